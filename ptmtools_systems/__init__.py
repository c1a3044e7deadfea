"""Neighbouring systems: octree textures, interlaced images, campus levels of detail."""
