"""Blocks that could be anything with the right mean."""
