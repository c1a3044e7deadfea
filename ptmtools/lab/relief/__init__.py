"""Octree textures on a walk (`ptm build-scene --apo`): pictures that are lit, so that relief shows,
and octrees as what clients fetch beside textures.

An octree is one more texture to whom fetches: a file that refines what is on the screen, whose
columns (`Catalogue`) are its levels. So links, budgets, policies and measures need to know nothing
of normals. It comes behind the textures, and behind all of them comes one without levels: what the
simplified meshes themselves get wrong, which nothing that is fetched mends.
"""
