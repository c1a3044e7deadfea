"""Compiled coding of one symbol."""
