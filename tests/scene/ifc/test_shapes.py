"""IFC: openings, representations, triangles and their order."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.errors import InputError, LimitError
from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.ifc import products as ifc_products
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import MAX_VERTICES
from tests.scene.ifc.ifc_house import DEEP, HIGH, THICK, WIDE, Ifc, house
from tests.scene.ifc.reading import corners, notes, read, size, volume


def test_openings_are_cut_out(tmp_path: Path) -> None:
    source, _ = read(house(Ifc(), ["Ground"]).write(tmp_path / "house.ifc"))
    inner, north = corners(source, "IfcWall Inner"), corners(source, "IfcWall North")
    assert np.isclose(volume(inner), THICK * (DEEP * HIGH - 0.9 * 2.1))
    assert np.isclose(volume(north), THICK * ((2 * WIDE + 3 * THICK) * HIGH - 2 * 1))
    assert np.isclose(volume(corners(source, "IfcDoor D0")), 0.04 * 0.9 * 2.1)


def test_one_representation_of_several(tmp_path: Path) -> None:
    """An axis, a box and two bodies: the first body is drawn."""
    made = Ifc()
    wall = made.box("IfcWall", "Wall", (0, 0, 0), (4, 1, 3))
    body = wall.Representation.Representations[0]
    line = made.file.create_entity("IfcPolyline", [made.point(0, 0), made.point(4, 0)])
    axis = made.file.create_entity("IfcShapeRepresentation", made.body, "Axis", "Curve2D", [line])
    least = made.box("IfcWall", "Small", (0, 0, 0), (1, 1, 1)).Representation.Representations[0]
    least.RepresentationIdentifier = "Body-FallBack"
    wall.Representation.Representations = [axis, least, body]
    source, findings = read(made.write(tmp_path / "wall.ifc"))
    assert size(corners(source, "IfcWall Wall")) == [4, 1, 3]
    assert len(corners(source, "IfcWall Wall")) == 12
    assert all(re.search("^lengths|not drawn$", note.message) for note in findings.entries)


def test_only_lines(tmp_path: Path) -> None:
    made = Ifc()
    made.box("IfcWall", "Wall", (0, 0, 0), (4, 1, 3))
    line = made.file.create_entity("IfcPolyline", [made.point(0, 0, 0), made.point(4, 0, 0)])
    for name in ("Axis", "Body"):
        wall = made.entity("IfcWall", name)
        wall.ObjectPlacement = made.building.ObjectPlacement
        made.represent(wall, line, "Curve3D", name)
    source, findings = read(made.write(tmp_path / "wall.ifc"))
    assert source.objects == ("IfcWall Wall",)
    assert ("PTM-N215", "IfcWall: lines without a surface", 2) in notes(findings)


def test_what_cannot_be_made_is_missed(tmp_path: Path) -> None:
    made = Ifc()
    made.box("IfcWall", "Good", (0, 0, 0), (1, 1, 1))
    bad = made.box("IfcWall", "Bad", (0, 0, 0), (1, 1, 1))
    bad.Representation.Representations[0].Items[0].SweptArea.XDim = -1.0
    file = made.write(tmp_path / "wall.ifc")
    source, findings = read(file)
    assert source.objects == ("IfcWall Good",)
    (missed,) = [note for note in findings.entries if note.code == "PTM-N253"]
    assert missed.message.startswith("IfcWall Bad: geometry cannot be computed")
    assert missed.place == f"GlobalId {bad.GlobalId}"
    with pytest.raises(InputError, match=r"IfcWall Bad.*PTM-I253"):
        ingest(file, IngestOptions(strict=True))


def test_twice_the_same_arrays(tmp_path: Path) -> None:
    path = house(Ifc()).write(tmp_path / "house.ifc")
    first, second = read(path)[0], read(path)[0]
    for name, value in vars(first).items():
        assert np.array_equal(value, getattr(second, name)), name


def test_the_order_is_that_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In whatever order the kernel makes the shapes."""
    import ifcopenshell as library

    path = house(Ifc()).write(tmp_path / "house.ifc")
    plain = ifc_products.compute_elements

    def backwards(file: Any, products: list[Any]) -> Iterator[Any]:
        for product in reversed(products):
            yield from plain(file, [product])

    monkeypatch.setattr(ifc_products, "compute_elements", backwards)
    findings = IngestNotes(path)
    turned = ifc_products.read_products(library.open(str(path)), findings, MAX_VERTICES)
    for name, value in vars(read(path)[0]).items():
        assert np.array_equal(value, getattr(turned, name)), name


class TestTriangles:
    """The parallelepiped of 1, 2 and 3 m, as the formats of IFC have it, moved by 5 m along x."""

    CORNERS = [(x, y, z) for x in (0, 1) for y in (0, 2) for z in (0, 3)]  # noqa: RUF012
    QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]  # noqa: RUF012
    HALVES = [half for a, b, c, d in QUADS for half in ([a, b, c], [a, c, d])]  # noqa: RUF012

    def face_set(self, made: Ifc, faces: list[list[int]]) -> Any:
        points = [[made.long(c) for c in corner] for corner in self.CORNERS]
        listed = made.file.create_entity("IfcCartesianPointList3D", points)
        index = [[i + 1 for i in face] for face in faces]
        if len(faces) == 12:
            return made.file.create_entity(
                "IfcTriangulatedFaceSet", Coordinates=listed, CoordIndex=index
            )
        polygons = [made.file.create_entity("IfcIndexedPolygonalFace", face) for face in index]
        return made.file.create_entity(
            "IfcPolygonalFaceSet", Coordinates=listed, Closed=True, Faces=polygons
        )

    def brep(self, made: Ifc, faces: list[list[int]]) -> Any:
        points = [made.point(*corner) for corner in self.CORNERS]
        create = made.file.create_entity
        loops = [create("IfcPolyLoop", [points[i] for i in face]) for face in faces]
        bounds = [create("IfcFaceOuterBound", loop, True) for loop in loops]
        shell = create("IfcClosedShell", [create("IfcFace", [bound]) for bound in bounds])
        return create("IfcFacetedBrep", shell)

    @pytest.mark.parametrize("mapped", [False, True])
    @pytest.mark.parametrize("item", ["face_set", "brep"])
    @pytest.mark.parametrize("cut", [False, True])
    @pytest.mark.parametrize("halves", [False, True])
    def test_solids(self, tmp_path: Path, item: str, halves: bool, cut: bool, mapped: bool) -> None:
        made = Ifc()
        wall = made.entity("IfcWall", "Wall")
        wall.ObjectPlacement = made.placement(made.building.ObjectPlacement, (5, 0, 0))
        solid = getattr(self, item)(made, self.HALVES if halves else self.QUADS)
        style = made.style("Blue", (0, 0, 1))
        made.file.create_entity("IfcStyledItem", solid, [style])
        made.represent(wall, solid, "Brep")
        if mapped:
            body = wall.Representation.Representations[0]
            axes = made.file.create_entity("IfcAxis2Placement3D", made.point(0, 0, 0))
            source = made.file.create_entity("IfcRepresentationMap", axes, body)
            move = made.file.create_entity(
                "IfcCartesianTransformationOperator3D",
                LocalOrigin=made.point(0, 1, 0),
                Scale=1.0,
            )
            again = made.file.create_entity("IfcMappedItem", source, move)
            made.represent(wall, again, "MappedRepresentation")
        if cut:
            made.opening(wall, (4, 0, 0), (7, 4, 1))
        source, findings = read(made.write(tmp_path / "solid.ifc"))
        actual = corners(source, "IfcWall Wall")
        low = [5, mapped, cut]
        assert np.allclose(actual.reshape(-1, 3).min(axis=0), low, rtol=0, atol=1e-9)
        assert size(actual) == [1, 2, 3 - cut]
        assert np.isclose(volume(actual), 6 - 2 * cut)
        assert [source.materials[i].name for i in np.unique(source.triangle_material)] == ["Blue"]
        assert all(re.search("^lengths|not drawn$", note.message) for note in findings.entries)

    def test_a_concave_polygon(self, tmp_path: Path) -> None:
        """No fan: an area of 4 m², not of 12."""
        made = Ifc()
        points = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (3, 1, 0)]
        listed = [[made.long(c) for c in point] for point in points]
        surface = made.file.create_entity(
            "IfcPolygonalFaceSet",
            Coordinates=made.file.create_entity("IfcCartesianPointList3D", listed),
            Faces=[made.file.create_entity("IfcIndexedPolygonalFace", [1, 2, 3, 4])],
        )
        slab = made.entity("IfcSlab", "Slab")
        slab.ObjectPlacement = made.building.ObjectPlacement
        made.represent(slab, surface, "Tessellation")
        source, _ = read(made.write(tmp_path / "slab.ifc"))
        a, b, c = np.moveaxis(corners(source, "IfcSlab Slab"), 1, 0)
        assert np.isclose(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2, 4)


def test_triangles_are_counted(tmp_path: Path) -> None:
    made = Ifc()
    for x in (0, 3):
        made.box("IfcWall", "Wall", (x, 0, 0), (x + 1, 1, 1))
    file = made.write(tmp_path / "walls.ifc")
    assert len(read(file, 24)[0].triangles) == 24
    with pytest.raises(LimitError, match=r"more than 23 triangles.*PTM-L203"):
        read(file, 23)
