"""Compiled loops over frequency tables."""
