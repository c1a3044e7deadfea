"""Reads VRML97 and X3D; the entry point is `reader.read_x3d`."""
