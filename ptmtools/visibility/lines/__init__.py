"""Compiled loops that walk straight lines through the portals."""
