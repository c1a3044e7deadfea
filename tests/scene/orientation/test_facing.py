"""Detection of models that are inside out. With one-sided faces, less than 1 % of the
bounds of rooms faces away in the real scenes, and 83 % or more when these are turned over."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.cli.main import main
from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.orientation.facing import TURNED_AWAY, share_turned_away
from tests.scene.buildings import (
    box,
    castle,
    corridor,
    furnished,
    gabled,
    house,
    inside_out,
    meadow,
    mezzanine,
    sheets,
    site_plan,
    welded,
    y_up,
)
from tests.scene.conftest import GltfModel, Put

#: Solids that face outwards, which is towards the rooms between them.
SOUND = {
    "house": house(),
    "walls only": house(floor=False, roof=False),
    "furnished": furnished(house()),
    "no ceiling": house(roof=False),
    "gable": gabled(house(roof=False), 0),
    "tower": house(8, 8, 2.7, storeys=10),
    "mezzanine": mezzanine(),
    "corridor": corridor(40, 2, 3, rooms=True),
    "on a meadow": meadow(house()),
    "on a meadow of 3 km": meadow(house(), 3000),
    "walls 1.8 m thick": castle(),
    "walls 1.8 m thick and nothing else": castle(4, slabs=False),
    "a house in millimetres, taken for metres": house() * 1000,
    "a room, seen from inside": inside_out(box((0, 0, 0), (5, 4, 3))),
}


def share(triangles: Floats, backed: bool = False) -> float:
    points, faces = welded(triangles)
    return share_turned_away(points, faces, np.full(len(faces), backed))


@pytest.mark.parametrize("name", SOUND)
def test_made_models(name: str) -> None:
    assert share(SOUND[name]) < 0.8 * TURNED_AWAY
    assert share(inside_out(SOUND[name])) > TURNED_AWAY
    assert share(inside_out(SOUND[name]), backed=True) == 0


def test_a_shell_that_is_seen_from_outside() -> None:
    assert share(sheets()[:8]) == 1
    assert share(inside_out(sheets()[:8])) == 0


def test_walls_of_two_sheets_in_one_place() -> None:
    """Each shows on its own side, however it is cut into triangles."""
    a, b, c, d = (4, 0, 0), (4, 8, 0), (4, 8, 3), (4, 0, 3)
    one = np.array([[a, b, c], [a, c, d]], dtype=np.float64)
    other = np.array([[b, a, d], [b, d, c]], dtype=np.float64)
    room = inside_out(box((0, 0, 0), (8, 8, 3)))
    assert share(np.concatenate([room, one, other])) == 0
    assert 0 < share(np.concatenate([room, one])) < 0.3


def test_where_there_are_no_rooms_nothing_is_said() -> None:
    assert share(site_plan()) == 0
    assert share(inside_out(site_plan())) == 0


def glb(triangles: Floats) -> bytes:
    """A glTF file of these Z-up triangles, Y up as it should be, whose faces have no backs."""
    points, faces = welded(y_up(triangles))
    document = GltfModel()
    position = document.add(points.astype(np.float32))
    indices = document.add(faces.reshape(-1).astype(np.uint16))
    document.place({"attributes": {"POSITION": position}, "indices": indices})
    return document.glb()


def test_it_is_noted_with_the_remedy(put: Put) -> None:
    path = put("house.glb", glb(inside_out(house())))
    scene = ingest(path)
    assert not scene.two_sided.any()
    (note,) = scene.notes
    assert note.code == "PTM-N235"
    assert note.message.startswith("the model seems to be inside out: ")
    assert "use --two-sided" in note.message
    scene = ingest(path, IngestOptions(two_sided=True))
    assert scene.two_sided.all()
    assert scene.notes == ()
    assert ingest(put("sound.glb", glb(house()))).notes == ()


def test_it_is_not_said_of_what_is_looked_at_from_outside(
    put: Put, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Turned normals would be wrong there."""
    path = str(put("house.glb", glb(inside_out(house()))))
    for command in (["apo", path], ["campus", path, "--lightmaps", "none"]):
        assert main([*command, "-o", str(tmp_path / command[0]), "-j", "1"]) == 0
        assert "N235" not in capsys.readouterr().err
    assert main(["info", path]) == 0
    assert "N235" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["hospital", "gallery", "office"])
def test_real_models(shared: Path, name: str) -> None:
    """As if their faces had no backs. (The fourth has two faces for nearly all of its walls.)"""
    scene = ingest(shared / "scenes" / name / f"{name}.obj")
    none = np.zeros(len(scene.triangles), dtype=bool)
    assert share_turned_away(scene.points, scene.triangles, none) < 0.1
    assert share_turned_away(scene.points, scene.triangles[:, ::-1], none) > 0.8
