"""Names and representations of the entities of an IFC file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

#: Exceptions for an attribute of the wrong type, which the kernel may not require.
FAULTS = (AttributeError, LookupError, RuntimeError, TypeError, ValueError)


def one_line(text: object) -> str:
    """Text of a file for a message: on one line, in valid UTF-8."""
    return " ".join(str(text).encode("utf-8", "replace").decode().split())


def name_of(thing: Any) -> str:
    """The name of an entity, "" without one."""
    return one_line(getattr(thing, "Name", None) or "")


def title_of(product: Any) -> str:
    """A product's class and name, or its class and GlobalId without a name."""
    return f"{product.is_a()} {name_of(product) or one_line(product.GlobalId)}"


#: Largest depth of mapped representations, which are circular in a damaged file.
_DEEPEST = 16
#: Representations that are not drawn.
_NO_BODY = frozenset(
    ["Annotation", "Axis", "Box", "Clearance", "CoG", "FootPrint", "Plan", "Profile", "Reference"]
)
#: Items without a surface.
_LINES = ("IfcCurve", "IfcPoint", "IfcGeometricCurveSet", "IfcTextLiteral", "IfcAnnotationFillArea")


def items(representation: Any, deep: int = _DEEPEST) -> Iterator[Any]:
    """The items of a representation, with mapped ones replaced by their sources."""
    for item in representation.Items or ():
        if item.is_a("IfcMappedItem") and deep:
            yield from items(item.MappingSource.MappedRepresentation, deep - 1)
        else:
            yield item


def has_body(product: Any) -> bool:
    """Whether a product has a representation with a surface."""
    try:
        every = product.Representation.Representations or ()
        bodies = (one for one in every if one.RepresentationIdentifier not in _NO_BODY)
        return any(not any(map(item.is_a, _LINES)) for one in bodies for item in items(one))
    except FAULTS:
        return True  # becomes a miss if the kernel fails
