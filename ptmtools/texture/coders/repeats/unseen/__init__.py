"""Compiled loops for what was not seen before."""
