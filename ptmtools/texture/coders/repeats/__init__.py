"""What repeats: flat areas, patterns, few colours. `coder` says how."""
