"""Compiled loops between texels and differences."""
