"""Reads glTF 2.0 (.glb and .gltf) and the extensions by which files of it are made smaller.

`read_gltf` in `reader` is the way in; `document` is the container with its buffers and numbers.
"""
