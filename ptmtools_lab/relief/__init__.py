"""Octree textures on a walk (`ptm build-scene --apo`): lit pictures, which show relief, and octrees
as files of clients beside textures.

To a client an octree is one more texture: a file that refines the screen, whose columns
(`Catalogue`) are its levels. So links, budgets, policies and measures need no knowledge of normals.
Octrees come after the textures, and after all of them comes one texture without levels: the errors
of the simplified meshes themselves, which no download reduces.
"""
