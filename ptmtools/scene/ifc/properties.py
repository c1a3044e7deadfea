"""Reads properties of an IFC file: roles by class, names, the unit, storeys, and materials.

A class in the tables includes its subclasses, in IFC2X3, IFC4 and IFC4X3; the first matching row
decides. The tables omit classes whose role follows from the shape: an opaque face of a column, a
beam, a plate of a curtain wall, a suspended ceiling or the ground divides the building if it is
large enough, and need not divide it otherwise. As structure, each of the 32 sides of a round column
would divide the hall around it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ptmtools.scene.model import Kind, Storey
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import SourceMaterial

#: Drawn although its superclass is not, because it contains the ground.
_GROUND = "IfcSite"
#: Invisible products: spaces, openings, drawings and analysis models.
_NOT_DRAWN = """
    IfcSpatialElement IfcSpatialStructureElement IfcFeatureElementSubtraction IfcVirtualElement
    IfcAnnotation IfcGrid IfcPositioningElement IfcLinearElement IfcPort IfcStructuralActivity
    IfcStructuralItem
"""
#: Roles by class. A building element part has the kind of its whole, such as the wall of a layer. A
#: window is detail because a pane without a style is opaque, but not meant to block sight.
_KINDS: tuple[tuple[Kind, str], ...] = (
    ("door", "IfcDoor"),
    ("structural", "IfcWall IfcSlab IfcRoof IfcStair IfcStairFlight IfcRamp IfcRampFlight"),
    ("", "IfcBuildingElementPart"),
    (
        "detail",
        """IfcWindow IfcRailing IfcFurnishingElement IfcDistributionElement IfcElectricalElement
        IfcEquipmentElement IfcElementComponent IfcReinforcingElement IfcShadingDevice
        IfcSurfaceFeature""",
    ),
)
_PART, _STOREY = "IfcBuildingElementPart", "IfcBuildingStorey"


def drawn(is_a: Callable[[str], bool]) -> bool:
    """Whether products of a class are drawn; ``is_a`` tests for a class or its subclasses."""
    return is_a(_GROUND) or not any(map(is_a, _NOT_DRAWN.split()))


def kind_of(is_a: Callable[[str], bool]) -> Kind:
    """The role of products of a class."""
    return next((kind for kind, classes in _KINDS if any(map(is_a, classes.split()))), "")


def is_part(is_a: Callable[[str], bool]) -> bool:
    """Whether products of a class have the role of their whole."""
    return is_a(_PART)


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


def length_unit(file: Any) -> tuple[str, float | None]:
    """The name of the file's unit of length and its length in metres; None without a unit."""
    from ifcopenshell.util import unit

    for context in file.by_type("IfcUnitAssignment"):
        for one in context.Units or ():
            if getattr(one, "UnitType", None) == "LENGTHUNIT":
                prefix = getattr(one, "Prefix", None) or ""
                name = f"{prefix}{name_of(one)}".lower()
                return name, float(unit.calculate_unit_scale(file))
    return "", None


def storeys(file: Any, metres: float) -> tuple[Storey, ...]:
    """The storeys with a name and a height, in metres along z."""
    every = ((s, name_of(s) or one_line(s.LongName or "")) for s in file.by_type(_STOREY))
    named = [(storey, name) for storey, name in every if name]
    placed = [_placement(storey) for storey, _ in named]
    stated = [_elevation(storey) for storey, _ in named]
    # Products are placed relative to the placement of their storey; the elevation is often that
    # above sea level. But some exporters place everything at 0, storeys included.
    if len(set(placed)) == 1 < len(set(stated)):
        placed = [None] * len(named)
    return tuple(
        Storey(name, height * metres)
        for (_, name), at, elevation in zip(named, placed, stated, strict=True)
        if (height := elevation if at is None else at) is not None and math.isfinite(height)
    )


def _placement(product: Any) -> float | None:
    """The height of a product's placement, in the file's unit; None without one."""
    from ifcopenshell.util import placement

    if product.ObjectPlacement is None:
        return None
    try:
        return float(placement.get_local_placement(product.ObjectPlacement)[2][3])
    except FAULTS:
        return None


def _elevation(storey: Any) -> float | None:
    """A storey's elevation, which is relative to its building, in the file's unit."""
    if storey.Elevation is None:
        return None
    building = next((whole for whole in _wholes(storey) if whole.is_a("IfcBuilding")), None)
    ground = 0.0 if building is None else _placement(building) or 0.0
    return ground + float(storey.Elevation)


def _wholes(product: Any) -> Iterator[Any]:
    """The product that this one is a part of, and so on."""
    seen = set()
    while product.id() not in seen:
        seen.add(product.id())
        for relation in product.Decomposes:
            product = relation.RelatingObject
            yield product
            break


#: The material of surfaces without a style.
UNSTYLED = SourceMaterial("default")
_DROPPED = (
    ("IfcSurfaceTexture", "textures dropped"),
    ("IfcIndexedColourMap", "colours of single faces dropped"),  # not in IFC2X3
)


def material_of(file: Any, style: Any) -> SourceMaterial:
    """The material of a style of the geometry kernel. Materials of equal name and appearance are
    equal, because programs write the same style thousands of times."""
    tint = [style.diffuse.r(), style.diffuse.g(), style.diffuse.b()]
    color = None
    if np.isfinite(tint).all():
        red, green, blue = np.clip(tint, 0, 1).tolist()
        color = red, green, blue
    opacity = 1.0
    if style.has_transparency() and np.isfinite(style.transparency):
        opacity = 1.0 - float(np.clip(style.transparency, 0, 1))
    number = style.instance_id()  # of the style, or of its material
    name = name_of(file.by_id(number)) if number else ""
    return SourceMaterial(name or _shade(color), color, opacity)


def note_dropped(file: Any, findings: Findings) -> None:
    """Notes the unsupported properties of surfaces."""
    for name, message in _DROPPED:
        try:
            count = len(file.by_type(name))
        except RuntimeError:  # not a class of this schema
            continue
        if count:
            findings.note("PTM-N215", message, "", count)


def _shade(color: tuple[float, float, float] | None) -> str:
    """The name of an unnamed style."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in color) if color else UNSTYLED.name
