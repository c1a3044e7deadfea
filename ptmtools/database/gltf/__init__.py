"""Artifacts → glTF 2.0: a GLB for every cell; and back: the strict reader of them.

docs/formats/gltf.md specifies them. The textures are those of the VRML files, referred to by URI;
no extension is used.
"""
