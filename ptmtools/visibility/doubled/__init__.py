"""Sequences of portals decided in numbers of twice the length of a double, where that can tell."""
