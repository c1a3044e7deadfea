"""Spaces of IFC files become volumes with names, and name the rooms of a database."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.cli.main import main
from ptmtools.scene import Scene, ingest, sandbox
from tests.scene.ifc.ifc_house import DEEP, HIGH, STOREY, THICK, WIDE, Ifc, house, office
from tests.scene.ifc.reading import SCHEMAS

LOW, TOP = (0, 0, 0), (4, 3, 2.5)


def walled(schema: str = "IFC4", unit: str = "MILLIMETERS", metres: float = 1e-3) -> Ifc:
    """A file with a wall, since a model of spaces only is none."""
    made = Ifc(schema, unit, metres)
    made.box("IfcWall", "Wall", (-1, -1, 0), (5, -0.8, 3))
    return made


def read(made: Ifc, folder: Path) -> Scene:
    return ingest(made.write(folder / "model.ifc"))


def spaces_left(scene: Scene) -> dict[str, int]:
    """Reasons why spaces are no rooms, and how many have each."""
    start = "IfcSpace: no room ("
    return {
        note.message.removeprefix(start)[:-1]: note.count
        for note in scene.notes
        if note.message.startswith(start)
    }


@pytest.mark.parametrize("schema", SCHEMAS)
@pytest.mark.parametrize(("unit", "metres"), [("MILLIMETERS", 1e-3), ("METERS", 1.0)])
def test_volumes_are_in_world_metres(tmp_path: Path, schema: str, unit: str, metres: float) -> None:
    """X is from the middle of the model, Y up from its lowest point, 0.2 m below the floor."""
    scene = read(house(Ifc(schema, unit, metres)), tmp_path)
    assert [room.name for room in scene.rooms] == ["West", "East", "West", "East"]
    half, deep = WIDE + THICK / 2, DEEP / 2
    for k, room in enumerate(scene.rooms):
        storey, east = divmod(k, 2)
        low = [THICK / 2 if east else -half, THICK + storey * STOREY, -deep]
        assert np.allclose(room.points.min(axis=0), low, rtol=0, atol=1e-9)
        high = np.add(low, [WIDE, HIGH, DEEP])
        assert np.allclose(room.points.max(axis=0), high, rtol=0, atol=1e-9)
    assert Scene.from_arrays(scene.to_arrays()).rooms == scene.rooms


def test_spaces_are_not_drawn(tmp_path: Path) -> None:
    made = walled()
    bare = read(made, tmp_path)
    made.space("1", "Kitchen", LOW, TOP)
    scene = read(made, tmp_path)
    assert scene.objects == bare.objects
    assert np.array_equal(scene.points, bare.points)
    assert not bare.rooms
    assert not any(name.startswith("room") for name in bare.to_arrays())


def test_names(tmp_path: Path) -> None:
    """The long name; with the name where it is not unique; the name without a long name."""
    made = walled()
    for name, long_name in (
        ("1.01", "Kitchen"),
        ("1.02", "Office"),
        ("1.03", "Office"),
        ("1.04", None),
        (None, "Hall"),
        (None, None),
        (None, "Office"),
        ("4", "Office 4\nwest"),
    ):
        made.space(name, long_name, LOW, TOP)
    names = [room.name for room in read(made, tmp_path).rooms]
    assert names == [
        "Kitchen",
        "Office 1.02",
        "Office 1.03",
        "1.04",
        "Hall",
        "",
        "Office",
        "Office 4 west",
    ]


def test_spaces_that_are_no_rooms(tmp_path: Path) -> None:
    made = walled()
    flat = made.space("A", "Flat", LOW, TOP, composition="COMPLEX")
    hall = made.space("B", "Hall", LOW, TOP, whole=flat)
    made.space("C", "Bay", LOW, TOP, whole=hall, composition="PARTIAL")
    made.space("D", "Storey", LOW, TOP, PredefinedType="GFA")
    outline = made.entity("IfcSpace", "E")
    outline.ObjectPlacement = made.building.ObjectPlacement
    line = made.file.create_entity("IfcPolyline", [made.point(0, 0, 0), made.point(1, 0, 0)])
    made.represent(outline, line, "Curve2D", "FootPrint")
    made.entity("IfcSpace", "F")
    scene = read(made, tmp_path)
    assert [room.name for room in scene.rooms] == ["Hall"]
    assert spaces_left(scene) == {
        "contains other spaces": 1,
        "part of another space": 1,
        "gross floor area": 1,
        "without a volume": 2,
    }


def test_a_volume_that_cannot_be_computed_is_no_miss(tmp_path: Path) -> None:
    """Nothing of the picture is missing, so there is no warning and no error under --strict."""
    made = walled()
    bad = made.space("1", "Bad", LOW, TOP)
    solid = bad.Representation.Representations[0].Items[0]
    solid.Depth = 0.0
    made.space("2", "Good", LOW, TOP)
    scene = read(made, tmp_path)
    assert [room.name for room in scene.rooms] == ["Good"]
    assert spaces_left(scene) == {"its volume cannot be computed": 1}
    assert not any(note.code == "PTM-N253" for note in scene.notes)


def test_the_kernel_crashes_on_spaces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """That costs the rooms only."""
    made = walled()
    made.space("1", "Kitchen", LOW, TOP)
    whole = read(made, tmp_path)
    crashing = """
import os
from ptmtools.scene.ifc import products
from ptmtools.scene.sandbox import serve
products._rooms = lambda *_: os.abort()
sys.argv = sys.argv[3:]
serve(products._read_in_child)
"""
    monkeypatch.setattr(sys, "executable", program(tmp_path, crashing))
    scene = read(made, tmp_path)
    assert np.array_equal(scene.points, whole.points)
    assert (len(whole.rooms), scene.rooms) == (1, ())
    assert spaces_left(scene) == {"IfcOpenShell fails on them": 1}


@pytest.mark.parametrize("end", ["time.sleep(600)", "sys.exit(1)", "print('{', flush=True)"])
def test_the_last_reply_of_a_child_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, end: str
) -> None:
    """Also if it crashes later, or exceeds its time."""
    replies = f"""
import time
from ptmtools.scene.sandbox import reply_so_far
reply_so_far(1)
reply_so_far([2])
{end}
"""
    monkeypatch.setattr(sys, "executable", program(tmp_path, replies))
    monkeypatch.setattr(sandbox, "_SECONDS", 3.0)
    assert sandbox.run_in_sandbox("module", "library", tmp_path / "python") == [2]


def program(folder: Path, source: str) -> str:
    """A program that runs instead of Python."""
    file = folder / "python"
    file.write_text(f"#!{sys.executable}\nimport sys\n{source}")
    file.chmod(0o755)
    return str(file)


def test_an_open_plan(tmp_path: Path) -> None:
    """One hall of two spaces: cells end where these touch."""
    made = Ifc()
    at = made.storey("Ground", 0)
    made.box("IfcSlab", "Floor", (-0.2, -0.2, -0.2), (8.2, 4.2, 0), at)
    made.box("IfcSlab", "Roof", (-0.2, -0.2, 2.8), (8.2, 4.2, 3), at)
    for low, high in (
        ((-0.2, -0.2, 0), (8.2, 0, 2.8)),
        ((-0.2, 4, 0), (8.2, 4.2, 2.8)),
        ((-0.2, 0, 0), (0, 4, 2.8)),
        ((8, 0, 0), (8.2, 4, 2.8)),
    ):
        made.box("IfcWall", "Wall", low, high, at)
    made.space("1", "Kitchen", (0, 0, 0), (3, 4, 2.5), at)
    made.space("2", "Living", (3, 0, 0), (8, 4, 2.5), at)
    scene = read(made, tmp_path)
    cells = subdivide(scene, SubdivideOptions(gain=1.0))
    named = {cells.room_name(c): v for c, v in enumerate(cells.cell_volumes().tolist())}
    assert named == pytest.approx({"Kitchen": 3 * 4 * 2.8, "Living": 5 * 4 * 2.8})
    assert subdivide(scene, SubdivideOptions(gain=1.0, spaces="none")).cell_count == 1


def test_an_office_has_a_cell_for_each_space(tmp_path: Path) -> None:
    """Without its spaces, the last two rooms in the north are one; with them there may be half as
    many cells again."""
    scene = read(office(Ifc()), tmp_path)
    names = ["Corridor", *(f"Office {k}" for k in range(1, 7))]
    assert [room.name for room in scene.rooms] == names
    plain = subdivide(scene, SubdivideOptions(spaces="none"))
    cells = subdivide(scene)
    assert (plain.cell_count, plain.rooms) == (len(names) - 1, ())
    assert sorted(cells.rooms) == sorted(names)
    assert len(names) <= cells.cell_count <= 1.5 * len(names)


def test_a_build_names_viewpoints_and_cells(tmp_path: Path) -> None:
    """A house of two rooms, behind a door, on each of two storeys."""
    file = house(Ifc()).write(tmp_path / "house.ifc")
    database = tmp_path / "house.db"
    quick = ["--samples", "8", "--light", "none"]
    assert main(["-q", "build-scene", str(file), "-o", str(database), *quick]) == 0
    hints = json.loads((database / "www/hints.json").read_text())
    assert sorted(v["description"] for v in hints["viewpoints"]) == [
        f"{storey}, {room}"
        for storey in ("Ground floor", "Upper floor")
        for room in ("East", "West")
    ]
    for viewpoint in hints["viewpoints"]:
        room = hints["cells"][viewpoint["cell"]]["room"]
        assert viewpoint["description"].endswith(f", {room}")
    root = (database / "www/root.wrl").read_text()
    assert '"Upper floor, East"' in root
