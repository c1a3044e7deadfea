"""What the classes of IFC say of a product: whether it is drawn, and what it is to the structure.

Classes stand for their subclasses, in IFC2X3, IFC4 and IFC4X3; the first row that fits decides.
Tables are kept short by what shape tells as well: an opaque face of a column, a beam, a plate of a
curtain wall, a suspended ceiling or the ground divides the building if it is large enough, and need
not if it is not. As structural, each of the 32 sides of a round column would divide the hall that
it stands in.

What things are called in an IFC file, and what is raised where it is wrong about them.

The unit of length of an IFC file, and its storeys.

Materials of the surface styles of an IFC file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ptmtools.scene.model import Kind, Storey
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import SourceMaterial

#: Drawn though its superclass is not: it bears the ground.
_GROUND = "IfcSite"
#: Space, what is cut away, drawings and models of something else: not there to be seen.
_NOT_DRAWN = (
    "IfcSpatialElement",
    "IfcSpatialStructureElement",  # IFC2X3
    "IfcFeatureElementSubtraction",
    "IfcVirtualElement",
    "IfcAnnotation",
    "IfcGrid",
    "IfcPositioningElement",
    "IfcLinearElement",
    "IfcPort",
    "IfcStructuralActivity",
    "IfcStructuralItem",
)
_KINDS: tuple[tuple[Kind, tuple[str, ...]], ...] = (
    ("door", ("IfcDoor",)),
    (
        "structural",
        (
            "IfcWall",
            "IfcSlab",
            "IfcRoof",
            "IfcStair",
            "IfcStairFlight",
            "IfcRamp",
            "IfcRampFlight",
        ),
    ),
    # Takes the kind of what it is a part of: a layer of a wall.
    ("", ("IfcBuildingElementPart",)),
    (
        "detail",
        (
            # Its pane may be opaque for want of a style; nobody means a window to hide the street.
            "IfcWindow",
            "IfcRailing",
            "IfcFurnishingElement",
            "IfcDistributionElement",
            "IfcElectricalElement",  # IFC2X3
            "IfcEquipmentElement",  # IFC2X3
            "IfcElementComponent",
            "IfcReinforcingElement",  # in IFC2X3 no component
            "IfcShadingDevice",
            "IfcSurfaceFeature",
        ),
    ),
)
_PART = "IfcBuildingElementPart"


def drawn(is_a: Callable[[str], bool]) -> bool:
    """Whether products of a class are drawn; ``is_a`` says whether it is one or a subclass."""
    return is_a(_GROUND) or not any(map(is_a, _NOT_DRAWN))


def kind_of(is_a: Callable[[str], bool]) -> Kind:
    """What products of a class are."""
    return next((kind for kind, classes in _KINDS if any(map(is_a, classes))), "")


def is_part(is_a: Callable[[str], bool]) -> bool:
    """Whether products of a class are what the product is that they are parts of."""
    return is_a(_PART)


#: What is raised over an attribute that is not of its type: the kernel may do without it.
FAULTS = (AttributeError, LookupError, RuntimeError, TypeError, ValueError)


def one_line(text: object) -> str:
    """Text of a file as it may stand in a message: on one line, and nothing that UTF-8 lacks."""
    return " ".join(str(text).encode("utf-8", "replace").decode().split())


def name_of(thing: Any) -> str:
    """Its name; "" if it has none."""
    return one_line(getattr(thing, "Name", None) or "")


def called(product: Any) -> str:
    """A product's class and name, or, in want of a name, what tells it from all others."""
    return f"{product.is_a()} {name_of(product) or one_line(product.GlobalId)}"


def length_unit(file: Any) -> tuple[str, float | None]:
    """The name of the file's unit of length, and its metres; None if it says none."""
    from ifcopenshell.util import unit

    for context in file.by_type("IfcUnitAssignment"):
        for one in context.Units or ():
            if getattr(one, "UnitType", None) == "LENGTHUNIT":
                prefix = getattr(one, "Prefix", None) or ""
                name = f"{prefix}{name_of(one)}".lower()
                return name, float(unit.calculate_unit_scale(file))
    return "", None


def storeys(file: Any, metres: float) -> tuple[Storey, ...]:
    """The storeys that have a name and a height, at their heights in metres along z."""
    found = [(one, name) for one in file.by_type("IfcBuildingStorey") if (name := _name(one))]
    placed = [_placed(one) for one, _ in found]
    stated = [_stated(one) for one, _ in found]
    # What stands in a storey stands on its placement, whatever the elevation says of it, which is
    # often that above sea level. But some exporters place everything at 0, storeys included.
    if len(set(placed)) == 1 < len(set(stated)):
        placed = [None] * len(found)
    return tuple(
        Storey(name, height * metres)
        for (_, name), at, said in zip(found, placed, stated, strict=True)
        if (height := said if at is None else at) is not None and math.isfinite(height)
    )


def _name(storey: Any) -> str:
    return name_of(storey) or one_line(storey.LongName or "")


def _placed(product: Any) -> float | None:
    """How high a product is placed, in the file's unit; None if nothing says it."""
    from ifcopenshell.util import placement

    if product.ObjectPlacement is None:
        return None
    try:
        return float(placement.get_local_placement(product.ObjectPlacement)[2][3])
    except FAULTS:
        return None


def _stated(storey: Any) -> float | None:
    """A storey's elevation, which is above the zero of its building."""
    if storey.Elevation is None:
        return None
    building = next((one for one in _above(storey) if one.is_a("IfcBuilding")), None)
    ground = 0.0 if building is None else _placed(building) or 0.0
    return ground + float(storey.Elevation)


def _above(product: Any) -> Iterator[Any]:
    """What it is a part of, and what that is a part of."""
    seen = set()
    while product.id() not in seen:
        seen.add(product.id())
        for relation in product.Decomposes:
            product = relation.RelatingObject
            yield product
            break


#: Of surfaces without a style.
UNSTYLED = SourceMaterial("default")
_LOST = (
    ("IfcSurfaceTexture", "textures are not carried over"),
    ("IfcIndexedColourMap", "colours of single faces are not carried over"),  # not in IFC2X3
)


def material_of(file: Any, style: Any) -> SourceMaterial:
    """The material of a style as the geometry kernel has it. Styles of one name and look are one:
    programs write the same thousands of times."""
    tint = [style.diffuse.r(), style.diffuse.g(), style.diffuse.b()]
    color = None
    if np.isfinite(tint).all():
        red, green, blue = np.clip(tint, 0, 1).tolist()
        color = red, green, blue
    opacity = 1.0
    if style.has_transparency() and np.isfinite(style.transparency):
        opacity = 1.0 - float(np.clip(style.transparency, 0, 1))
    number = style.instance_id()  # of the style, or of the material that has it
    name = name_of(file.by_id(number)) if number else ""
    return SourceMaterial(name or _shade(color), color, opacity)


def note_lost(file: Any, findings: Findings) -> None:
    """Notes on what surfaces have and is not shown."""
    for name, what in _LOST:
        try:
            count = len(file.by_type(name))
        except RuntimeError:  # no class of this schema
            continue
        if count:
            findings.note("PTM-N215", what, "", count)


def _shade(color: tuple[float, float, float] | None) -> str:
    """The name of a style without one."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in color) if color else UNSTYLED.name
