"""Compiled loops for what was seen before."""
