"""Convex polygons in space: what is left of one behind planes, and the planes between two."""
