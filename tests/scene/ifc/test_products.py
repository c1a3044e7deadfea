"""IFC: the products of a building, their kinds, materials and names."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from ptmtools.scene import Scene, ingest
from ptmtools.scene.model import Kind, Storey
from tests.scene.ifc.ifc_house import DEEP, STOREY, THICK, WIDE, Ifc, house
from tests.scene.ifc.reading import SCHEMAS, notes, read


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


@pytest.mark.parametrize(
    ("schema", "properties", "lumens"),
    [
        ("IFC2X3", {}, 3000),
        ("IFC4", {}, 3000),
        ("IFC4", {"TotalWattage": 18.0}, 1800),
        ("IFC4", {"TotalWattage": 18.0, "ContributedLuminousFlux": 2200.0}, 2200),
        ("IFC4", {"TotalWattage": -1.0}, 3000),
    ],
)
def test_light_fixtures_glow(
    tmp_path: Path, schema: str, properties: dict[str, float], lumens: float
) -> None:
    from ifcopenshell.api import pset, type as types

    made = Ifc(schema)
    made.box("IfcWall", "wall", (0, 0, 0), (1, 1, 1))
    made.box("IfcFlowTerminal", "tap", (2, 0, 0), (3, 1, 1))
    fixture = "IfcFlowTerminal" if schema == "IFC2X3" else "IfcLightFixture"
    made.box(fixture, "panel", (4, 0, 0), (5, 1, 1))
    (panel,) = (each for each in made.file.by_type(fixture) if each.Name == "panel")
    if schema == "IFC2X3":
        kind = made.entity("IfcLightFixtureType", "panel type")
        types.assign_type(made.file, related_objects=[panel], relating_type=kind)
    if properties:
        group = pset.add_pset(made.file, product=panel, name="Pset_Lamp")
        pset.edit_pset(made.file, pset=group, properties=properties)
    source, _ = read(made.write(tmp_path / "lamps.ifc"))
    glow = {
        name.split()[-1]: source.materials[
            source.triangle_material[source.triangle_object == number][0]
        ].glow
        for number, name in enumerate(source.objects)
    }
    assert glow["wall"] == glow["tap"] == (0,) * 3
    assert glow["panel"] == pytest.approx([lumens / (6 * math.pi)] * 3)


@pytest.mark.parametrize(
    ("method", "highlight", "matter"),
    [
        ("NOTDEFINED", None, (0, 1)),
        ("MATT", None, (0, 1)),
        ("PHONG", ("IfcSpecularExponent", 128.0), (0, 1)),
        ("METAL", None, (1, 0.3)),
        ("MIRROR", None, (1, 0)),
        ("GLASS", None, (0, 0)),
        ("PLASTIC", None, (0, 0.4)),
        ("METAL", ("IfcSpecularRoughness", 0.75), (1, 0.75)),
        ("PHONG", ("IfcSpecularRoughness", 0.5), (0, 0.5)),
    ],
)
def test_reflectance(
    tmp_path: Path, method: str, highlight: tuple[str, float] | None, matter: tuple[float, float]
) -> None:
    made = Ifc()
    specular = highlight and made.file.create_entity(*highlight)
    style = made.style("Paint", (1, 1, 1), ReflectanceMethod=method, SpecularHighlight=specular)
    made.box("IfcWall", "wall", (0, 0, 0), (1, 1, 1), style=style)
    source, _ = read(made.write(tmp_path / "matter.ifc"))
    material = source.materials[source.triangle_material[0]]
    assert (material.metallic, material.roughness) == matter


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
    ("schema", "attribute", "value"),
    [
        ("IFC4", "PredefinedType", "PROVISIONFORVOID"),
        ("IFC4", "ObjectType", "ProvisionForVoid"),
        ("IFC2X3", "ObjectType", "ProvisionForVoid"),
    ],
)
def test_a_provision_for_void_is_an_opening(
    schema: str, attribute: str, value: str, tmp_path: Path
) -> None:
    made = Ifc(schema)
    made.box("IfcBuildingElementProxy", "Kiosk", (0, 0, 0), (1, 1, 1))
    provision = made.box("IfcBuildingElementProxy", "Provision", (5, 0, 0), (6, 1, 1))
    setattr(provision, attribute, value)
    source, findings = read(made.write(tmp_path / "file.ifc"))
    assert source.objects == ("IfcBuildingElementProxy Kiosk",)
    note = "IfcBuildingElementProxy, a provision for void: not drawn"
    assert ("PTM-N215", note, 1) in notes(findings)


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
