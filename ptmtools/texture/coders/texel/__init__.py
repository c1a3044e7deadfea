"""Samples of 16 bits, floats, and errors that are allowed. `coder` says how."""
