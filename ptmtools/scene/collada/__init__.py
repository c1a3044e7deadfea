"""Reads COLLADA 1.4 and 1.5; the entry point is `reader.read_collada`."""
