"""The shapes that IfcOpenShell's geometry kernels make of products.

Open CASCADE makes them all, but of what is triangles already some 5,000 a second: each becomes a
face with edges, is sewn to its neighbours, and taken apart again. So products of nothing but
triangles go through the kernel `passthrough` where there is one (IfcOpenShell 0.9): an office of
2,450 products and 1.4 million triangles, most of them of chairs, is read in 18 s instead of 319.
Other polygons do not: it cuts concave ones as fans. (Tried: two threads, which took more time than
one.)
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ptmtools.scene.ifc.names import FAULTS

_PLAIN, _DIRECT = "opencascade", "passthrough"
_THREADS = 1
_TRIANGLE = 3
#: Without subclasses, which have holes.
_FACE, _BREP = "IfcIndexedPolygonalFace", "IfcFacetedBrep"
#: Representations repeat others, which repeat others; a damaged file has them in a circle.
_DEEPEST = 16


def elements(file: Any, products: list[Any]) -> Iterator[Any]:
    """What the kernels make of products: one, none or several of each, in any order."""
    from ifcopenshell import geom

    direct = []
    if hasattr(geom, "has_geometry_library") and geom.has_geometry_library(_DIRECT):
        direct = [product for product in products if _of_triangles(product)]
    there = {product.id() for product in direct}
    rest = [product for product in products if product.id() not in there]
    settings = geom.settings()
    settings.set("apply-default-materials", False)
    # The second is for what the first cannot make after all, such as triangles with openings.
    for chosen, kernel in ((direct, f"hybrid-{_DIRECT}-{_PLAIN}"), (rest, _PLAIN)):
        if chosen:
            yield from geom.iterator(
                settings, file, _THREADS, include=chosen, geometry_library=kernel
            )


def items(representation: Any, deep: int = _DEEPEST) -> Iterator[Any]:
    """The items of a representation, in place of repeated ones those that they repeat."""
    for item in representation.Items or ():
        if item.is_a("IfcMappedItem") and deep:
            yield from items(item.MappingSource.MappedRepresentation, deep - 1)
        else:
            yield item


def _of_triangles(product: Any) -> bool:
    """Whether nothing of a product is anything but triangles."""
    try:
        every = product.Representation.Representations or ()
        return all(_is_triangles(item) for one in every for item in items(one))
    except FAULTS:
        return False


def _is_triangles(item: Any) -> bool:
    if item.is_a("IfcTriangulatedFaceSet"):
        return True
    if item.is_a("IfcPolygonalFaceSet"):
        return all(len(f.CoordIndex) == _TRIANGLE and f.is_a() == _FACE for f in item.Faces)
    if item.is_a() == _BREP:
        bounds = (face.Bounds for face in item.Outer.CfsFaces)
        return all(len(b) == 1 and len(b[0].Bound.Polygon) == _TRIANGLE for b in bounds)
    return False
