"""Reads glTF 2.0 (.glb and .gltf) with its compression extensions.

`reader` contains the entry point `read_gltf`, and `document` the container, buffers and accessors.
"""
