"""Reads IFC through IfcOpenShell in a child process.

`reader` contains the entry point `read_ifc`; `products` makes triangles of the products of a file,
and `properties` reads classes, names, units, storeys and materials.
"""
