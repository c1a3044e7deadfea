"""IFC files. What is expected follows from the specification of IFC and was written before the
first run; the files are made by IfcOpenShell's API."""

from __future__ import annotations

import re
import sys
import zipfile
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.errors import InputError, LimitError, MissingComponentError
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.ifc import products as ifc_products, reader as ifc
from ptmtools.scene.model import Kind, Storey
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import MAX_VERTICES, Source
from tests.scene.conftest import Put
from tests.scene.ifc.ifc_house import DEEP, HIGH, STOREY, THICK, WIDE, Ifc, house

SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3")


@pytest.fixture(autouse=True)
def ifcopenshell(require: Callable[[str, str], None]) -> None:
    if find_spec("ifcopenshell") is None:
        require("ifcopenshell", "pip install 'ptmtools[ifc]'")


def read(file: Path, most: int = MAX_VERTICES) -> tuple[Source, Findings]:
    findings = Findings(file)
    return ifc.read_ifc(file, findings, most), findings


def notes(findings: Findings) -> list[tuple[str, str, int]]:
    return [(note.code, note.message, note.count) for note in findings.notes]


def corners(source: Source, name: str) -> Floats:
    """(T, 3, 3) of all objects of a name."""
    chosen = [i for i, called in enumerate(source.objects) if called == name]
    return source.points[source.triangles[np.isin(source.triangle_object, chosen)]]


def volume(triangles: Floats) -> float:
    """Of a solid, m³, faces seen from outside."""
    middle = triangles - triangles.reshape(-1, 3).mean(axis=0)
    return float(np.linalg.det(middle).sum() / 6)


def size(triangles: Floats) -> list[float]:
    return np.ptp(triangles.reshape(-1, 3), axis=0).round(9).tolist()


@pytest.mark.parametrize("schema", SCHEMAS)
def test_a_house(tmp_path: Path, schema: str) -> None:
    source, findings = read(house(Ifc(schema)).write(tmp_path / "house.ifc"))
    table = "IfcFurnishingElement" if schema == "IFC2X3" else "IfcFurniture"
    assert list(zip(source.objects, source.kinds, strict=True)) == [
        ("IfcSlab Slab 0", "structural"),
        ("IfcWall South", "structural"),
        ("IfcWall North", "structural"),
        ("IfcWall Outer", "structural"),
        ("IfcWall Outer", "structural"),
        ("IfcWall Inner", "structural"),
        ("IfcDoor D0", "door"),
        ("IfcWindow W1", "detail"),
        (f"{table} Table", "detail"),
        ("IfcSlab Slab 1", "structural"),
        ("IfcWall South", "structural"),
        ("IfcWall North", "structural"),
        ("IfcWall Outer", "structural"),
        ("IfcWall Outer", "structural"),
        ("IfcWall Inner", "structural"),
        ("IfcDoor D1", "door"),
        ("IfcSlab Flat roof", "structural"),
    ]
    assert source.storeys == (Storey("Ground floor", 0), Storey("Upper floor", STOREY))
    assert (source.metres, source.up) == (1.0, "z")
    low, high = source.points.min(axis=0), source.points.max(axis=0)
    assert np.allclose(low, [-THICK] * 3, rtol=0, atol=1e-9)
    assert np.allclose(high, [2 * WIDE + 2 * THICK, DEEP + THICK, 2 * STOREY], rtol=0, atol=1e-9)
    assert notes(findings) == [
        ("PTM-N201", "lengths in millimetre (0.001 m) converted to metres", 1),
        ("PTM-N215", "IfcOpeningElement: not drawn", 3),
        ("PTM-N215", "IfcSpace: not drawn", 4),
        ("PTM-N215", "IfcAnnotation: not drawn", 1),
    ]


def test_a_scene(tmp_path: Path) -> None:
    """World heights are above the lowest point, 0.2 m below the floor."""
    scene = ingest(house(Ifc()).write(tmp_path / "house.ifc"))
    assert [storey.name for storey in scene.storeys] == ["Ground floor", "Upper floor"]
    assert np.allclose([s.height for s in scene.storeys], [THICK, THICK + STOREY])
    assert (scene.space.up_guessed, scene.space.unit_guessed) == (False, False)
    assert np.allclose(np.ptp(scene.points, axis=0), [10.6, 6.2, 4.4])
    again = Scene.from_arrays(scene.to_arrays())
    assert (again.kinds, again.storeys) == (scene.kinds, scene.storeys)
    assert len(scene.kinds) == len(scene.objects)


CLASSES: list[tuple[str, Kind]] = [
    ("IfcWall", "structural"),
    ("IfcWallStandardCase", "structural"),
    ("IfcSlab", "structural"),
    ("IfcRoof", "structural"),
    ("IfcStair", "structural"),
    ("IfcStairFlight", "structural"),
    ("IfcRamp", "structural"),
    ("IfcRampFlight", "structural"),
    ("IfcColumn", ""),
    ("IfcBeam", ""),
    ("IfcMember", ""),
    ("IfcPlate", ""),
    ("IfcCurtainWall", ""),
    ("IfcCovering", ""),
    ("IfcFooting", ""),
    ("IfcBuildingElementProxy", ""),
    ("IfcTransportElement", ""),
    ("IfcSite", ""),
    ("IfcDoor", "door"),
    ("IfcWindow", "detail"),
    ("IfcRailing", "detail"),
    ("IfcFurnishingElement", "detail"),
    ("IfcFlowTerminal", "detail"),
    ("IfcFlowSegment", "detail"),
    ("IfcDistributionElement", "detail"),
    ("IfcDiscreteAccessory", "detail"),
    ("IfcReinforcingBar", "detail"),
]
LATER: list[tuple[str, Kind]] = [
    ("IfcWallElementedCase", "structural"),
    ("IfcSlabStandardCase", "structural"),
    ("IfcDoorStandardCase", "door"),
    ("IfcWindowStandardCase", "detail"),
    ("IfcFurniture", "detail"),
    ("IfcSystemFurnitureElement", "detail"),
    ("IfcSanitaryTerminal", "detail"),
    ("IfcLightFixture", "detail"),
    ("IfcShadingDevice", "detail"),
    ("IfcGeographicElement", ""),
    ("IfcChimney", ""),
]


@pytest.mark.parametrize(("schema", "classes"), [("IFC2X3", CLASSES), ("IFC4", CLASSES + LATER)])
def test_kinds_by_class(tmp_path: Path, schema: str, classes: list[tuple[str, Kind]]) -> None:
    made = Ifc(schema)
    for i, (name, _) in enumerate(classes):
        made.box(name, None, (i, 0, 0), (i + 1, 1, 1))
    source, _ = read(made.write(tmp_path / "classes.ifc"))
    classed = [name.split()[0] for name in source.objects]
    assert list(zip(classed, source.kinds, strict=True)) == classes


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
def test_light_fixtures_glow(tmp_path: Path, schema: str) -> None:
    from ifcopenshell.api import type as types

    made = Ifc(schema)
    made.box("IfcWall", "wall", (0, 0, 0), (1, 1, 1))
    made.box("IfcFlowTerminal", "tap", (2, 0, 0), (3, 1, 1))
    fixture = "IfcFlowTerminal" if schema == "IFC2X3" else "IfcLightFixture"
    made.box(fixture, "panel", (4, 0, 0), (5, 1, 1))
    (panel,) = (each for each in made.file.by_type(fixture) if each.Name == "panel")
    if schema == "IFC2X3":
        kind = made.entity("IfcLightFixtureType", "panel type")
        types.assign_type(made.file, related_objects=[panel], relating_type=kind)
    source, _ = read(made.write(tmp_path / "lamps.ifc"))
    glow = {
        name.split()[-1]: source.materials[
            source.triangle_material[source.triangle_object == number][0]
        ].glow
        for number, name in enumerate(source.objects)
    }
    assert glow == {"wall": 0, "tap": 0, "panel": ifc_products.GLOW}


def test_a_part_is_what_it_is_a_part_of(tmp_path: Path) -> None:
    made = Ifc()
    for i, whole in enumerate(("IfcWall", "IfcColumn", "IfcDoor")):
        entity = made.entity(whole, whole)
        made.box("IfcBuildingElementPart", whole, (i, 0, 0), (i + 1, 1, 1), whole=entity)
        made.box("IfcMember", whole, (i, 2, 0), (i + 1, 3, 1), whole=entity)
    source, _ = read(made.write(tmp_path / "parts.ifc"))
    assert source.kinds == ("structural", "", "", "", "door", "")


@pytest.mark.parametrize(
    "kind",
    ["IfcSpace", "IfcOpeningElement", "IfcVirtualElement", "IfcAnnotation", "IfcGrid", "IfcZone"],
)
def test_what_is_not_drawn(tmp_path: Path, kind: str) -> None:
    made = Ifc()
    made.box("IfcWall", "Wall", (0, 0, 0), (1, 1, 1))
    kind = "IfcSpatialZone" if kind == "IfcZone" else kind
    for _ in range(2):
        made.box(kind, "Nothing", (5, 0, 0), (6, 1, 1))
    source, findings = read(made.write(tmp_path / "file.ifc"))
    assert source.objects == ("IfcWall Wall",)
    assert ("PTM-N215", f"{kind}: not drawn", 2) in notes(findings)


@pytest.mark.parametrize(
    ("unit", "metres", "said"),
    [
        ("METERS", 1.0, []),
        ("MILLIMETERS", 1e-3, ["lengths in millimetre (0.001 m) converted to metres"]),
        ("CENTIMETERS", 1e-2, ["lengths in centimetre (0.01 m) converted to metres"]),
        ("FOOT", 0.3048, ["lengths in foot (0.3048 m) converted to metres"]),
    ],
)
@pytest.mark.parametrize("schema", SCHEMAS)
def test_units(tmp_path: Path, schema: str, unit: str, metres: float, said: list[str]) -> None:
    """The same house in any unit is the same in metres."""
    source, findings = read(house(Ifc(schema, unit, metres)).write(tmp_path / "house.ifc"))
    assert np.allclose(size(source.points), [10.6, 4.4, 6.2], rtol=0, atol=1e-6)
    assert np.allclose([storey.height for storey in source.storeys], [0, STOREY])
    assert source.metres == 1.0
    assert [text for code, text, _ in notes(findings) if code == "PTM-N201"] == said


def test_no_unit(tmp_path: Path) -> None:
    """Then it is guessed, as of other formats that say none."""
    file = house(Ifc("IFC4", None, 1.0)).write(tmp_path / "house.ifc")
    source, findings = read(file)
    assert source.metres is None
    assert ("PTM-N201", "the file defines no unit of length", 1) in notes(findings)
    assert np.allclose(size(source.points), [10.6, 4.4, 6.2])
    assert ingest(file).space.unit_guessed


def test_the_user_knows_better(tmp_path: Path) -> None:
    """A file that says millimetres and has metres: what was read is a thousandth."""
    file = house(Ifc("IFC4", "MILLIMETERS", 1.0)).write(tmp_path / "house.ifc")
    scene = ingest(file, IngestOptions(unit="1000"))
    assert np.allclose(np.ptp(scene.points, axis=0), [10.6, 6.2, 4.4])


def test_openings_are_cut_out(tmp_path: Path) -> None:
    source, _ = read(house(Ifc(), ["Ground"]).write(tmp_path / "house.ifc"))
    inner, north = corners(source, "IfcWall Inner"), corners(source, "IfcWall North")
    assert np.isclose(volume(inner), THICK * (DEEP * HIGH - 0.9 * 2.1))
    assert np.isclose(volume(north), THICK * ((2 * WIDE + 3 * THICK) * HIGH - 2 * 1))
    assert np.isclose(volume(corners(source, "IfcDoor D0")), 0.04 * 0.9 * 2.1)


class TestStoreys:
    def heights(self, made: Ifc, folder: Path) -> list[tuple[str, float]]:
        made.box("IfcWall", "Wall", (0, 0, 0), (1, 1, 1))
        source, _ = read(made.write(folder / "storeys.ifc"))
        return [(storey.name, round(storey.height, 9)) for storey in source.storeys]

    def test_above_the_sea(self, tmp_path: Path) -> None:
        """Elevations say 412 m, but the storey and what it contains are placed at 3."""
        made = Ifc()
        made.storey("EG", 0, 409)
        made.storey("OG", 3, 412)
        assert self.heights(made, tmp_path) == [("EG", 0), ("OG", 3)]

    def test_on_a_hill(self, tmp_path: Path) -> None:
        made = Ifc(origin=(0, 0, 409))
        made.site.RefElevation = made.long(409)
        made.storey("EG", 0)
        made.storey("OG", 3)
        assert self.heights(made, tmp_path) == [("EG", 409), ("OG", 412)]

    def test_not_placed(self, tmp_path: Path) -> None:
        """An elevation is above the zero of the building."""
        made = Ifc("IFC4", "FOOT", 0.3048, origin=(0, 0, 100))
        made.storey("EG", 0).ObjectPlacement = None
        made.storey("OG", 3).ObjectPlacement = None
        assert self.heights(made, tmp_path) == [("EG", 100), ("OG", 103)]

    def test_all_placed_at_zero(self, tmp_path: Path) -> None:
        made = Ifc()
        for name, height in (("EG", 0), ("OG", 3), ("DG", 6)):
            made.storey(name, 0, height)
        assert self.heights(made, tmp_path) == [("EG", 0), ("OG", 3), ("DG", 6)]

    def test_names(self, tmp_path: Path) -> None:
        made = Ifc()
        made.storey(None, 0)
        made.storey("", 3).LongName = "Bel étage \n II"
        assert self.heights(made, tmp_path) == [("Bel étage II", 3)]

    def test_no_height(self, tmp_path: Path) -> None:
        made = Ifc()
        storey = made.storey("EG", 0)
        storey.ObjectPlacement = storey.Elevation = None
        assert self.heights(made, tmp_path) == []


class TestFarAway:
    """Coordinates of a land register: 2,600 km east and 1,200 km north of its origin."""

    FAR = (2_600_123.456, 1_200_654.321, 409.25)

    @pytest.mark.parametrize("unit", [("MILLIMETERS", 1e-3), ("METERS", 1.0)])
    def test_the_site(self, tmp_path: Path, unit: tuple[str, float]) -> None:
        near, _ = read(house(Ifc("IFC4", *unit)).write(tmp_path / "near.ifc"))
        far, _ = read(house(Ifc("IFC4", *unit, origin=self.FAR)).write(tmp_path / "far.ifc"))
        assert np.array_equal(near.triangles, far.triangles)
        assert np.abs(far.points - self.FAR - near.points).max() < 1e-8
        scene = ingest(tmp_path / "far.ifc")
        assert np.allclose([s.height for s in scene.storeys], [THICK, THICK + STOREY])
        alike = ingest(tmp_path / "near.ifc").corners
        assert np.allclose(scene.corners, alike, rtol=0, atol=1e-8)

    def test_a_map(self, tmp_path: Path) -> None:
        """Where the file's own coordinates lie on a map makes no difference."""
        made = house(Ifc())
        context = made.file.by_type("IfcGeometricRepresentationContext", include_subtypes=False)[0]
        target = made.file.create_entity("IfcProjectedCRS", "EPSG:2056")
        east, north, up = self.FAR
        made.file.create_entity("IfcMapConversion", context, target, east, north, up, 0.6, 0.8)
        mapped, _ = read(made.write(tmp_path / "mapped.ifc"))
        assert np.allclose(mapped.points.min(axis=0), [-THICK] * 3)
        assert mapped.storeys[0].height == 0

    def test_the_points_themselves(self, tmp_path: Path) -> None:
        """A tetrahedron with an edge of a millimetre, its points far away."""
        made = Ifc("IFC4", "METERS", 1.0)
        points = np.array(self.FAR) + [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.001]]
        surface = made.file.create_entity(
            "IfcTriangulatedFaceSet",
            Coordinates=made.file.create_entity("IfcCartesianPointList3D", points.tolist()),
            CoordIndex=[[1, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]],
        )
        product = made.entity("IfcBuildingElementProxy", "Tip")
        product.ObjectPlacement = made.building.ObjectPlacement
        made.represent(product, surface, "Tessellation")
        source, _ = read(made.write(tmp_path / "tip.ifc"))
        actual = np.unique(source.points, axis=0)
        assert np.abs(actual - np.unique(points, axis=0)).max() < 1e-8
        assert len(source.triangles) == 4


class TestMaterials:
    def test_colours(self, tmp_path: Path) -> None:
        made = Ifc()
        looks: list[tuple[str | None, tuple[float, float, float], float | None]] = [
            ("Brick", (0.6, 0.2, 0.0), None),
            ("Brick", (0.6, 0.2, 0.0), 0.0),
            ("Brick", (0.2, 0.2, 0.2), None),
            ("Glass", (0.8, 1.0, 1.0), 0.75),
            (None, (1.0, 0.0, 0.2), None),
        ]
        for i, look in enumerate(looks):
            made.box("IfcWall", f"W{i}", (i, 0, 0), (i + 1, 1, 1), style=made.style(*look))
        made.box("IfcWall", "Plain", (9, 0, 0), (10, 1, 1))
        source, _ = read(made.write(tmp_path / "colours.ifc"))
        chosen = source.triangle_material[
            np.flatnonzero(np.diff(source.triangle_object, prepend=-1))
        ]
        actual = [source.materials[i] for i in chosen]
        assert [(m.name, m.color, m.opacity) for m in actual] == [
            ("Brick", (0.6, 0.2, 0.0), 1.0),
            ("Brick", (0.6, 0.2, 0.0), 1.0),
            ("Brick", (0.2, 0.2, 0.2), 1.0),
            ("Glass", (0.8, 1.0, 1.0), 0.25),
            ("#ff0033", (1.0, 0.0, 0.2), 1.0),
            ("default", None, 1.0),
        ]
        assert chosen[0] == chosen[1]
        scene = ingest(tmp_path / "colours.ifc")
        assert [m.name for m in scene.materials if m.transparent] == ["Glass"]

    @pytest.mark.parametrize("schema", SCHEMAS)
    def test_glass(self, tmp_path: Path, schema: str) -> None:
        scene = ingest(house(Ifc(schema), ["EG"]).write(tmp_path / "house.ifc"))
        pane = scene.triangle_object == scene.objects.index("IfcWindow W1")
        assert not scene.opaque[pane].any()
        assert scene.opaque[~pane].all()

    def test_textures_are_missed(self, tmp_path: Path) -> None:
        made = house(Ifc(), ["EG"])
        made.file.create_entity("IfcImageTexture", True, True, URLReference="brick.png")
        _, findings = read(made.write(tmp_path / "house.ifc"))
        assert ("PTM-N215", "textures dropped", 1) in notes(findings)


class TestNames:
    def test_twice_the_same(self, tmp_path: Path) -> None:
        """Each product is an object, whatever it is called."""
        made = Ifc()
        for x in (0, 3):
            made.box("IfcWall", "Wall", (x, 0, 0), (x + 1, 1, 1))
        source, _ = read(made.write(tmp_path / "walls.ifc"))
        assert source.objects == ("IfcWall Wall",) * 2
        assert np.bincount(source.triangle_object).tolist() == [12, 12]

    def test_none(self, tmp_path: Path) -> None:
        made = Ifc()
        wall = made.box("IfcWall", None, (0, 0, 0), (1, 1, 1))
        source, _ = read(made.write(tmp_path / "wall.ifc"))
        assert source.objects == (f"IfcWall {wall.GlobalId}",)

    @pytest.mark.parametrize(
        ("written", "name"),
        [
            (r"T\X2\00FC\X0\r", "Tür"),
            (r"a\X\0Ab", "a b"),
            (r"\X2\D800\X0\half", None),
            ("$x_{", "$x_{"),
            ("it''s", "it's"),
            ("T\xfcr", None),
        ],
    )
    def test_strange(self, tmp_path: Path, written: str, name: str | None) -> None:
        """What a name holds spoils no artifact and no line of output."""
        made = Ifc()
        made.box("IfcWall", "NAME", (0, 0, 0), (1, 1, 1))
        file = made.write(tmp_path / "wall.ifc")
        file.write_bytes(file.read_bytes().replace(b"'NAME'", f"'{written}'".encode("latin-1")))
        scene = ingest(file)
        assert Scene.from_arrays(scene.to_arrays()).objects == scene.objects
        if name:
            assert scene.objects == (f"IfcWall {name}",)


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
    assert all(re.search("^lengths|not drawn$", note.message) for note in findings.notes)


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
    (missed,) = [note for note in findings.notes if note.code == "PTM-N253"]
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
    plain = ifc_products.elements

    def backwards(file: Any, products: list[Any]) -> Iterator[Any]:
        for product in reversed(products):
            yield from plain(file, [product])

    monkeypatch.setattr(ifc_products, "elements", backwards)
    findings = Findings(path)
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
        assert all(re.search("^lengths|not drawn$", note.message) for note in findings.notes)

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


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = house(Ifc()).write(tmp_path / "house.ifc")
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    with pytest.raises(MissingComponentError, match=r"pip install 'ptmtools\[ifc\]'.*PTM-M100"):
        ingest(file)


class TestArchives:
    def test_one_file(self, tmp_path: Path) -> None:
        plain = house(Ifc()).write(tmp_path / "house.ifc")
        with zipfile.ZipFile(tmp_path / "a.ifczip", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(plain, "sub/house.IFC")
            archive.writestr("readme.txt", "a house")
        packed, _ = read(tmp_path / "a.ifczip")
        assert np.array_equal(packed.points, read(plain)[0].points)

    @pytest.mark.parametrize(("names", "what"), [((), "no"), (("a.ifc", "b.ifc"), "2")])
    def test_not_one_file(self, tmp_path: Path, names: tuple[str, ...], what: str) -> None:
        with zipfile.ZipFile(tmp_path / "a.ifczip", "w") as archive:
            archive.writestr("a.txt", "")
            for name in names:
                archive.writestr(name, "")
        with pytest.raises(InputError, match=f"contains {what} IFC files instead of one.*PTM-I266"):
            read(tmp_path / "a.ifczip")

    def test_none(self, put: Put) -> None:
        with pytest.raises(InputError, match="PTM-I266"):
            read(put("a.ifczip", b"PK\x03\x04" + bytes(100)))

    def test_too_large(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        with zipfile.ZipFile(tmp_path / "a.ifczip", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("a.ifc", bytes(5 << 20))
        monkeypatch.setattr(ifc, "_LARGEST", 0)
        with pytest.raises(LimitError, match="PTM-L204"):
            read(tmp_path / "a.ifczip")


@pytest.fixture
def whole(tmp_path: Path) -> bytes:
    return house(Ifc(), ["EG"]).write(tmp_path / "whole.ifc").read_bytes()


class TestDamage:
    @pytest.mark.parametrize(
        ("content", "code"),
        [
            (b"", "PTM-I243"),
            (b"hello", "PTM-I266"),
            (bytes(5000), "PTM-I266"),
            (b"ISO-10303-21;", "PTM-I266"),
            (b"ISO-10303-21;\nEND-ISO-10303-21;", "PTM-I254"),
        ],
    )
    def test_no_ifc(self, put: Put, content: bytes, code: str) -> None:
        with pytest.raises(InputError, match=code):
            ingest(put("a.ifc", content))

    @pytest.mark.parametrize("schema", [b"IFC5", b"AUTOMOTIVE_DESIGN"])
    def test_other_schemas(self, put: Put, whole: bytes, schema: bytes) -> None:
        file = put("a.ifc", whole.replace(b"'IFC4'", b"'" + schema + b"'"))
        with pytest.raises(InputError, match=rf"{schema.decode()}.*IFC4X3_ADD2.*PTM-I243"):
            ingest(file)

    def test_no_products(self, tmp_path: Path) -> None:
        made = Ifc()
        made.storey("EG", 0)
        with pytest.raises(InputError, match=r"no drawable product.*PTM-I247"):
            ingest(made.write(tmp_path / "empty.ifc"))

    def test_only_spaces(self, tmp_path: Path) -> None:
        made = Ifc()
        made.box("IfcSpace", "Room", (0, 0, 0), (1, 1, 1))
        with pytest.raises(InputError, match=r"no drawable product.*PTM-I247"):
            ingest(made.write(tmp_path / "space.ifc"))

    def test_cut_off(self, put: Put, whole: bytes) -> None:
        for length in np.linspace(1, len(whole) - 3, 40).astype(int).tolist():
            with pytest.raises(InputError, match="PTM-I266"):
                ingest(put("cut.ifc", whole[:length]))

    @pytest.mark.parametrize("share", [0.05, 0.2, 0.4, 0.6, 0.8, 0.95])
    def test_a_part_is_missing(self, put: Put, whole: bytes, share: float) -> None:
        """Begun and ended as it should be."""
        cut = whole[: int(share * len(whole))] + b"\nENDSEC;\nEND-ISO-10303-21;\n"
        self.harmless(put("cut.ifc", cut))

    @pytest.mark.parametrize("seed", range(16))
    def test_flipped_bytes(self, put: Put, whole: bytes, seed: int) -> None:
        random = np.random.default_rng(seed)
        damaged = np.frombuffer(whole, np.uint8).copy()
        places = random.integers(300, len(whole) - 100, random.integers(1, 40))
        damaged[places] = random.integers(0, 256, len(places))
        self.harmless(put("flipped.ifc", damaged.tobytes()))

    def harmless(self, file: Path) -> None:
        """Read as far as it goes, or one line that says why not."""
        try:
            scene = ingest(file)
        except InputError as error:
            printed = str(error)
        else:
            printed = str(file)
            Scene.from_arrays(scene.to_arrays())
        assert str(file) in printed
        assert "\n" not in printed

    def test_a_product_that_is_damaged(self, tmp_path: Path) -> None:
        """All others are drawn, and storeys with no sound placement have their elevations."""
        made = house(Ifc(), ["EG", "OG"])
        made.file.by_type("IfcBuildingStorey")[1].ObjectPlacement = None
        text = made.file.to_string()
        door = made.file.by_type("IfcDoor")[0]
        text = text.replace(f"#{door.Representation.id()},$", "1.5,$")
        assert "1.5," in text
        file = tmp_path / "damaged.ifc"
        file.write_text(text)
        scene = ingest(file)
        assert "IfcDoor D0" not in scene.objects
        assert "IfcWall Inner" in scene.objects
        assert [storey.name for storey in scene.storeys] == ["EG", "OG"]
        assert [note.code for note in scene.notes if "geometry" in note.message] == ["PTM-N253"]

    def test_wrong_statements_are_missed(self, put: Put, whole: bytes) -> None:
        spoilt = whole.replace(b"IFCFURNITURE(", b"IFCFURNICHER(")
        scene = ingest(put("a.ifc", spoilt))
        (note,) = [note for note in scene.notes if note.code == "PTM-N244"]
        assert "IFCFURNICHER" in note.message
        assert not [name for name in scene.objects if "Table" in name]
