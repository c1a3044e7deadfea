"""Reads USD through usd-core in a child process.

`reader` contains the entry point `read_usd`; `layers` opens a stage, `source` traverses it, `mesh`
cuts meshes into triangles, and `material` reads materials and colours.
"""
