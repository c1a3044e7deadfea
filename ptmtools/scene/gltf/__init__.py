"""Reads glTF 2.0 with its compression extensions; the entry point is `reader.read_gltf`."""
