"""Reads USD through usd-core in a child process; the entry point is `reader.read_usd`."""
