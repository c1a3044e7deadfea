"""IFC files of small buildings, written with IfcOpenShell's API. Lengths are in metres; the file
has them in its unit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

Point = tuple[float, float, float]


class Ifc:
    """A project with a site, a building and storeys.

    ``unit`` is the word for the file's length unit in IfcOpenShell, ``metres`` its length; with
    ``unit=None`` the file says none. ``origin`` is where the site is placed.
    """

    def __init__(
        self,
        schema: str = "IFC4",
        unit: str | None = "MILLIMETERS",
        metres: float = 1e-3,
        origin: Point = (0, 0, 0),
    ) -> None:
        from ifcopenshell.api import aggregate, context, project, unit as units

        self.metres = metres
        self.file: Any = project.create_file(version=schema)
        if schema == "IFC2X3":
            self._owner()
        top = self.entity("IfcProject", "Museum")
        if unit == "FOOT":
            foot = units.add_conversion_based_unit(self.file, name="foot")
            units.assign_unit(self.file, units=[foot])
        elif unit:
            units.assign_unit(self.file, length={"is_metric": True, "raw": unit})
        model = context.add_context(self.file, context_type="Model")
        self.body = context.add_context(
            self.file,
            context_type="Model",
            context_identifier="Body",
            target_view="MODEL_VIEW",
            parent=model,
        )
        self.site = self.entity("IfcSite", "Site")
        self.building = self.entity("IfcBuilding", "House")
        aggregate.assign_object(self.file, products=[self.site], relating_object=top)
        aggregate.assign_object(self.file, products=[self.building], relating_object=self.site)
        self.site.ObjectPlacement = self.placement(None, origin)
        self.building.ObjectPlacement = self.placement(self.site.ObjectPlacement, (0, 0, 0))

    def entity(self, kind: str, name: str | None = None) -> Any:
        from ifcopenshell.api import root

        return root.create_entity(self.file, ifc_class=kind, name=name)

    def storey(self, name: str | None, height: float, elevation: float | None = None) -> Any:
        """A storey placed at a height in its building, with that elevation or another."""
        from ifcopenshell.api import aggregate

        storey = self.entity("IfcBuildingStorey", name)
        storey.ObjectPlacement = self.placement(self.building.ObjectPlacement, (0, 0, height))
        storey.Elevation = self.long(height if elevation is None else elevation)
        aggregate.assign_object(self.file, products=[storey], relating_object=self.building)
        return storey

    def box(
        self,
        kind: str,
        name: str | None,
        low: Point,
        high: Point,
        storey: Any = None,
        style: Any = None,
        whole: Any = None,
    ) -> Any:
        """A product that fills a box, in the coordinates of its storey; part of a ``whole``."""
        from ifcopenshell.api import aggregate, spatial

        product = self.entity(kind, name)
        below = storey.ObjectPlacement if storey else self.building.ObjectPlacement
        product.ObjectPlacement = self.placement(below, low)
        size = np.subtract(high, low).tolist()
        solid = self._extruded(size)
        if style:
            self.file.create_entity("IfcStyledItem", Item=solid, Styles=self._presented(style))
        self.represent(product, solid, "SweptSolid")
        if whole:
            aggregate.assign_object(self.file, products=[product], relating_object=whole)
        elif storey and product.is_a("IfcElement") and not product.is_a("IfcFeatureElement"):
            spatial.assign_container(self.file, products=[product], relating_structure=storey)
        return product

    def space(
        self,
        name: str | None,
        long_name: str | None,
        low: Point,
        high: Point,
        storey: Any = None,
        whole: Any = None,
        composition: str = "ELEMENT",
        **attributes: Any,
    ) -> Any:
        """A space that fills a box, part of a storey or of a ``whole``."""
        from ifcopenshell.api import aggregate

        space = self.box("IfcSpace", name, low, high, storey)
        space.LongName, space.CompositionType = long_name, composition
        for attribute, value in attributes.items():
            setattr(space, attribute, value)
        if whole or storey:
            aggregate.assign_object(self.file, products=[space], relating_object=whole or storey)
        return space

    def represent(self, product: Any, item: Any, kind: str, identifier: str = "Body") -> None:
        """Gives a product one representation of one item."""
        shape = self.file.create_entity(
            "IfcShapeRepresentation", self.body, identifier, kind, [item]
        )
        product.Representation = self.file.create_entity(
            "IfcProductDefinitionShape", Representations=[shape]
        )

    def opening(self, wall: Any, low: Point, high: Point, storey: Any = None) -> Any:
        """Cuts a box, in the coordinates of the storey, out of a wall."""
        opening = self.box("IfcOpeningElement", None, low, high, storey)
        self.file.create_entity(
            "IfcRelVoidsElement",
            GlobalId=self.guid(),
            OwnerHistory=wall.OwnerHistory,
            RelatingBuildingElement=wall,
            RelatedOpeningElement=opening,
        )
        return opening

    def style(
        self,
        name: str | None,
        color: Sequence[float],
        transparency: float | None = None,
        **rendering: Any,
    ) -> Any:
        tint = self.file.create_entity("IfcColourRgb", None, *color)
        shading = self.file.create_entity(
            "IfcSurfaceStyleRendering",
            tint,
            transparency,
            **{"ReflectanceMethod": "NOTDEFINED", **rendering},
        )
        return self.file.create_entity("IfcSurfaceStyle", name, "BOTH", [shading])

    def _owner(self) -> None:
        """Whoever makes things in IFC2X3 must be named."""
        from ifcopenshell.api import owner

        person = owner.add_person(self.file)
        firm = owner.add_organisation(self.file)
        owner.add_person_and_organisation(self.file, person=person, organisation=firm)
        owner.add_application(self.file, application_developer=firm)

    def guid(self) -> str:
        import ifcopenshell

        return str(ifcopenshell.guid.new())

    def long(self, length: float) -> float:
        """Metres in the file's unit."""
        return float(length) / self.metres

    def point(self, *place: float) -> Any:
        return self.file.create_entity("IfcCartesianPoint", [self.long(c) for c in place])

    def write(self, path: Path) -> Path:
        self.file.write(str(path))
        return path

    def placement(self, parent: Any, place: Sequence[float]) -> Any:
        axes = self.file.create_entity("IfcAxis2Placement3D", self.point(*place))
        return self.file.create_entity("IfcLocalPlacement", parent, axes)

    def _extruded(self, size: Sequence[float]) -> Any:
        width, depth, height = size
        middle = self.file.create_entity("IfcAxis2Placement2D", self.point(width / 2, depth / 2))
        profile = self.file.create_entity(
            "IfcRectangleProfileDef", "AREA", None, middle, self.long(width), self.long(depth)
        )
        return self.file.create_entity(
            "IfcExtrudedAreaSolid",
            profile,
            self.file.create_entity("IfcAxis2Placement3D", self.point(0, 0, 0)),
            self.file.create_entity("IfcDirection", (0.0, 0.0, 1.0)),
            self.long(height),
        )

    def _presented(self, style: Any) -> list[Any]:
        if self.file.schema != "IFC2X3":
            return [style]
        return [self.file.create_entity("IfcPresentationStyleAssignment", [style])]


#: Of the house: inner width, depth and height of a room, and the thickness of all walls and slabs.
WIDE, DEEP, HIGH, THICK = 5.0, 4.0, 2.8, 0.2
#: From floor to floor.
STOREY = HIGH + THICK


def house(ifc: Ifc, storeys: Sequence[str] = ("Ground floor", "Upper floor")) -> Ifc:
    """Storeys of two rooms each, one west and one east of a wall with a door in it, and, on the
    lowest, a window to the north and a table in the east. Rooms begin at the site's origin."""
    glass = ifc.style("Glass", (0.6, 0.8, 0.9), 0.7)
    brick = ifc.style("Brick", (0.6, 0.3, 0.2))
    span, t = 2 * WIDE + THICK, THICK
    for number, name in enumerate(storeys):
        at = ifc.storey(name, number * STOREY)
        ifc.box("IfcSlab", f"Slab {number}", (-t, -t, -t), (span + t, DEEP + t, 0), at)
        ifc.box("IfcWall", "South", (-t, -t, 0), (span + t, 0, HIGH), at, brick)
        north = ifc.box("IfcWall", "North", (-t, DEEP, 0), (span + t, DEEP + t, HIGH), at, brick)
        ifc.box("IfcWall", "Outer", (-t, 0, 0), (0, DEEP, HIGH), at, brick)
        ifc.box("IfcWall", "Outer", (span, 0, 0), (span + t, DEEP, HIGH), at, brick)
        inner = ifc.box("IfcWall", "Inner", (WIDE, 0, 0), (WIDE + t, DEEP, HIGH), at)
        ifc.opening(inner, (WIDE - t, 1.5, 0), (WIDE + 2 * t, 2.4, 2.1), at)
        ifc.box("IfcDoor", f"D{number}", (WIDE + 0.08, 1.5, 0), (WIDE + 0.12, 2.4, 2.1), at)
        for room, west in (("West", 0.0), ("East", WIDE + t)):
            ifc.box("IfcSpace", room, (west, 0, 0), (west + WIDE, DEEP, HIGH), at)
        if number == 0:
            ifc.opening(north, (1, DEEP - t, 1), (3, DEEP + 2 * t, 2), at)
            ifc.box("IfcWindow", "W1", (1, DEEP + 0.08, 1), (3, DEEP + 0.12, 2), at, glass)
            table = "IfcFurnishingElement" if ifc.file.schema == "IFC2X3" else "IfcFurniture"
            ifc.box(table, "Table", (8, 2, 0), (9, 3, 0.7), at)
    top = len(storeys) * STOREY
    roof = ifc.box("IfcSlab", "Flat roof", (-t, -t, top - t), (span + t, DEEP + t, top))
    ifc.entity("IfcAnnotation", "no geometry")
    note = ifc.entity("IfcAnnotation", "Dimension")
    note.ObjectPlacement = roof.ObjectPlacement
    line = ifc.file.create_entity("IfcPolyline", [ifc.point(0, 0, 0), ifc.point(1, 0, 0)])
    ifc.represent(note, line, "Curve3D", "Annotation")
    return ifc


#: Of the office: from one room to the next along the corridor, and the height of the ceilings.
BAY, CEILING = 4.2, 2.6


def office(ifc: Ifc, columns: int = 3) -> Ifc:
    """A corridor with rooms on both sides behind doors, under suspended ceilings. Spaces end in the
    middle of walls; between the last two in the north there is none."""
    long, t, top = BAY * columns - THICK, THICK, HIGH + 0.3
    at = ifc.storey("Level 1", 0)
    for name, low in (("Slab", -t), ("Roof", top)):
        ifc.box("IfcSlab", name, (-t, -5.4, low), (long + t, 7.4, low + t), at)
    for y in (-5.4, 7.2):
        ifc.box("IfcWall", "Long", (-t, y, 0), (long + t, y + t, top), at)
    for x in (-t, long):
        ifc.box("IfcWall", "End", (x, -5.2, 0), (x + t, 7.2, top), at)
    for y in (-t, 2.0):
        wall = ifc.box("IfcWall", "Corridor", (0, y, 0), (long, y + t, top), at)
        for x in (BAY * k + 1 for k in range(columns)):
            ifc.opening(wall, (x, y - 0.1, 0), (x + 0.9, y + t + 0.1, 2.1), at)
            ifc.box("IfcDoor", "Leaf", (x, y + 0.08, 0), (x + 0.9, y + 0.13, 2.1), at)
    ifc.box("IfcCovering", "Ceiling", (0, 0, CEILING), (long, 2, CEILING + 0.03), at)
    half = t / 2
    ifc.space("0", "Corridor", (-half, -half, 0), (long + half, 2 + half, CEILING), at)
    for number in range(2 * columns):
        k, north = divmod(number, 2)
        x, y = BAY * k, 2.2 if north else -5.2
        if k and not (north and k == columns - 1):
            ifc.box("IfcWall", "Party", (x - t, y, 0), (x, y + 5, top), at)
        gap = BAY - 4 if north and k == columns - 2 else 0.0
        ifc.box("IfcCovering", "Ceiling", (x, y, CEILING), (x + 4 + gap, y + 5, CEILING + 0.03), at)
        low, high = (x - half, y - half, 0), (x + 4 + half, y + 5 + half, CEILING)
        ifc.space(str(number + 1), "Office", low, high, at)
    return ifc
