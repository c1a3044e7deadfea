"""A scene becomes convex cells, portals and cut geometry (paper §3)."""
