"""IFC: units, storeys, and buildings far from the origin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.scene import IngestOptions, ingest
from tests.scene.ifc.ifc_house import STOREY, THICK, Ifc, house
from tests.scene.ifc.reading import SCHEMAS, notes, read, size


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
