"""Reads IFC through IfcOpenShell, in a process of its own.

`read_ifc` in `reader` is the way in; `products` goes through what a file holds, and `classes` says
what each product is to the building.
"""
