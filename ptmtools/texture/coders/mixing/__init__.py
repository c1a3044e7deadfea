"""The context mixing coder: the `small` profile's way with 8-bit levels."""
