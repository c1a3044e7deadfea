"""Artifacts become VRML97 and hints, and are checked (paper §6)."""
