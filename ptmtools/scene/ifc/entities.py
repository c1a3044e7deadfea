"""Reads the entities of an IFC file that have no geometry: names, roles by class, unit, storeys,
materials, and which spaces are rooms.

A space (IfcSpace) is never drawn. Spaces that contain other spaces, gross floor areas and spaces
without a volume are no rooms; `ptmtools.cells.named_rooms` tests the meshes of the others. A room
has the long name of its space ("Kitchen"); if other rooms have the same one, or if there is none,
the name, which most programs fill with a number, is added ("Office 1.07").
"""

from __future__ import annotations

import math
from collections import ChainMap, Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.model import Kind, RoomVolume, Storey
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import SourceMaterial

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
        shapes = product.Representation.Representations or ()
        bodies = (shape for shape in shapes if shape.RepresentationIdentifier not in _NO_BODY)
        return any(not any(map(item.is_a, _LINES)) for body in bodies for item in items(body))
    except FAULTS:
        return True  # becomes a miss if the kernel fails


# Roles by class, names, the unit, storeys and materials. A class in the tables includes its
# subclasses, in IFC2X3, IFC4 and IFC4X3; the first matching row decides. The tables omit classes
# whose role follows from the shape: an opaque face of a column, a beam, a plate of a curtain wall,
# a suspended ceiling or the ground divides the building if it is large enough, and need not divide
# it otherwise. As structure, each of the 32 sides of a round column would divide the hall.

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
#: Their surfaces glow, housings included: files seldom tell these apart.
_LAMPS = "IfcLightFixture", "IfcLamp"
#: Lumens of a watt, of LEDs, and watts of a lamp whose file states neither.
_LUMENS_OF_WATT, _WATTS = 100.0, 30.0
#: Properties with the lumens and with the watts of a lamp.
_LUMENS, _POWERS = ("ContributedLuminousFlux",), ("TotalWattage", "NominalPower", "Power")
_PART, _STOREY = "IfcBuildingElementPart", "IfcBuildingStorey"


def is_drawn(product: Any) -> bool:
    """Whether products of this class are drawn."""
    return product.is_a(_GROUND) or not any(map(product.is_a, _NOT_DRAWN.split()))


def is_provision(product: Any) -> bool:
    """Whether a product reserves the place of an opening, by its type: in IFC2X3 by a name."""
    from ifcopenshell.util import element

    if not product.is_a("IfcBuildingElementProxy"):
        return False
    with suppress(*FAULTS):
        types = [product, element.get_type(product)]
        names = (getattr(t, name, None) for t in types for name in ("PredefinedType", "ObjectType"))
        return any(str(name).upper() == "PROVISIONFORVOID" for name in names)
    return False


def kind_of(product: Any) -> Kind:
    """The role of a product by its class, or that of the product that it is a part of."""
    whole = product
    if product.is_a(_PART):
        whole = next((relation.RelatingObject for relation in product.Decomposes), product)
    return next((kind for kind, names in _KINDS if any(map(whole.is_a, names.split()))), "")


def shines(product: Any) -> bool:
    """Whether a product is a lamp or a light fixture, by its class or, in IFC2X3, by its type."""
    if any(map(product.is_a, _LAMPS)):
        return True
    with suppress(*FAULTS):
        for relation in product.IsDefinedBy:
            if relation.is_a("IfcRelDefinesByType"):
                return any(relation.RelatingType.is_a(f"{name}Type") for name in _LAMPS)
    return False


def luminous_flux(file: Any, product: Any) -> float:
    """Lumens of a lamp, by its properties or those of its type."""
    from ifcopenshell.util import element, unit

    properties, watts = dict[str, Any](), 1.0
    with suppress(*FAULTS):
        properties = dict(ChainMap(*reversed(element.get_psets(product).values())))
        watts = float(unit.calculate_unit_scale(file, "POWERUNIT"))
    for names, factor in ((_LUMENS, 1.0), (_POWERS, watts * _LUMENS_OF_WATT)):
        for name in names:
            value = properties.get(name)
            if isinstance(value, float | int) and 0 < value < math.inf:
                return float(value) * factor
    return _LUMENS_OF_WATT * _WATTS


def length_unit(file: Any) -> tuple[str, float | None]:
    """The name of the file's unit of length and its length in metres; None without a unit."""
    from ifcopenshell.util import unit

    for context in file.by_type("IfcUnitAssignment"):
        for entry in context.Units or ():
            if getattr(entry, "UnitType", None) == "LENGTHUNIT":
                prefix = getattr(entry, "Prefix", None) or ""
                name = f"{prefix}{name_of(entry)}".lower()
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
    entity = file.by_id(number) if number else None
    metallic, roughness = _matter(entity)
    name = name_of(entity) or _shade(color)
    return SourceMaterial(name, color, opacity, metallic=metallic, roughness=roughness)


#: Metallic and roughness by the method of reflectance; 0 and 1 by others.
_REFLECTANCES = {
    "METAL": (1.0, 0.3),
    "MIRROR": (1.0, 0.0),
    "GLASS": (0.0, 0.0),
    "PLASTIC": (0.0, 0.4),
}


def _matter(style: Any) -> tuple[float, float]:
    """Metallic and roughness of a surface style."""
    metallic, roughness = 0.0, 1.0
    with suppress(*FAULTS):
        for part in getattr(style, "Styles", None) or ():
            if part.is_a("IfcSurfaceStyleRendering"):
                metallic, roughness = _REFLECTANCES.get(part.ReflectanceMethod, (0.0, 1.0))
                highlight = part.SpecularHighlight
                if highlight is not None and highlight.is_a("IfcSpecularRoughness"):
                    roughness = float(highlight.wrappedValue)
    return metallic, roughness


def note_dropped(file: Any, notes: IngestNotes) -> None:
    """Notes the unsupported properties of surfaces."""
    for name, message in _DROPPED:
        try:
            count = len(file.by_type(name))
        except RuntimeError:  # not a class of this schema
            continue
        if count:
            notes.note("PTM-N215", message, "", count)


def _shade(color: tuple[float, float, float] | None) -> str:
    """The name of an unnamed style."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in color) if color else UNSTYLED.name


_SPACE = "IfcSpace"
#: A space of this composition contains others, one of the next is a part of another.
_WHOLE, _PARTIAL = "COMPLEX", "PARTIAL"
#: Types of spaces that are no rooms: gross floor areas.
_AREAS = ("GFA",)
_NO_MESH: tuple[Floats, Ints] = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
#: Triangles of a space; a room with a curved wall has hundreds.
_MOST_TRIANGLES = 20_000


def rooms_of(file: Any, notes: IngestNotes) -> list[Any]:
    """The spaces that may be rooms, in the order of their numbers; notes the others."""
    result, faults = [], Counter[str]()
    for space in sorted(file.by_type(_SPACE), key=lambda space: int(space.id())):
        try:
            fault = _fault(space)
        except FAULTS:
            fault = "an attribute has a wrong type"
        if not fault:
            result.append(space)
        faults[fault] += 1
    for fault, count in faults.items():
        if fault:
            notes.note("PTM-N215", f"{_SPACE}: no room ({fault})", "", count)
    return result


def _fault(space: Any) -> str:
    """The reason why a space is no room, "" if it may be one."""
    if space.Representation is None or not has_body(space):
        return "without a volume"
    if space.CompositionType == _WHOLE or any(
        part.is_a(_SPACE) and part.CompositionType != _PARTIAL for part in _parts(space)
    ):
        return "contains other spaces"
    if space.CompositionType == _PARTIAL and any(
        whole.is_a(_SPACE) and whole.Representation and whole.CompositionType != _WHOLE
        for relation in space.Decomposes
        for whole in [relation.RelatingObject]
    ):
        return "part of another space"
    if getattr(space, "PredefinedType", None) in _AREAS:
        return "gross floor area"
    return ""


def _parts(space: Any) -> list[Any]:
    return [part for relation in space.IsDecomposedBy for part in relation.RelatedObjects]


def make_rooms(
    spaces: Sequence[Any], meshes: Mapping[int, tuple[Floats, Ints]], notes: IngestNotes
) -> tuple[RoomVolume, ...]:
    """The rooms of spaces; ``meshes`` are their points and triangles by number. Notes the spaces
    without a mesh."""
    long_names = Counter(_long_name(space) for space in spaces)
    rooms = []
    for space in spaces:
        points, triangles = meshes.get(space.id(), _NO_MESH)
        name, number = _long_name(space), name_of(space)
        if not len(triangles) or not np.isfinite(points).all():
            notes.note("PTM-N215", f"{_SPACE}: no room (its volume cannot be computed)")
        elif len(triangles) > _MOST_TRIANGLES:
            notes.note("PTM-N215", f"{_SPACE}: no room (more than {_MOST_TRIANGLES} triangles)")
        else:
            if (long_names[name] > 1 and number not in name) or not name:
                name = one_line(f"{name} {number}")
            rooms.append(RoomVolume(name, points, triangles.astype(np.int32)))
    return tuple(rooms)


def _long_name(space: Any) -> str:
    return one_line(space.LongName or "")
