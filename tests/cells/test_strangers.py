"""Made models of the kinds that people have keep what was expected of them, and miss nothing."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, structural_triangles, subdivide
from ptmtools.output.model import WriterOptions
from ptmtools.output.standpoints import FloorFinder
from ptmtools.output.viewpoints import place_viewpoints
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.orientation.space import to_world
from ptmtools.visibility import check_conservative, compute_pvs
from tests.cells.buildings import write
from tests.cells.strangers import STRANGERS

#: They take a minute each; `test_scans` and `test_worth` have smaller ones.
LARGE = {"tile", "scanned hall"}
NAMES = sorted(STRANGERS.keys() - LARGE)


@cache
def divided(name: str) -> tuple[Scene, Cells]:
    with TemporaryDirectory() as folder:
        model = write(Path(folder, "model.obj"), STRANGERS[name].parts().items())
        scene = ingest(model, IngestOptions(unit="m", up="z"))
    return scene, subdivide(scene)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "street"])
def test_resident_share_and_cells(name: str) -> None:
    stranger, (scene, cells) = STRANGERS[name], divided(name)
    pvs = compute_pvs(cells)
    assert pvs.volume_at_hand[0] <= stranger.resident
    least, most = stranger.cells
    assert least <= cells.standing.sum() <= most
    blocking = structural_triangles(scene, SubdivideOptions(), cells.opened)
    report = check_conservative(scene.corners[blocking], cells, pvs, 20_000)
    assert report.unoccluded > 1000
    assert report.missed == ()


@pytest.mark.parametrize("name", NAMES)
def test_first_viewpoint(name: str) -> None:
    """The eye of the first viewpoint is where a person would begin, and above a floor."""
    scene, cells = divided(name)
    (first, *_), _ = place_viewpoints(scene, cells, WriterOptions(viewpoint_count=1))
    eye = np.array([first.position])
    boxes = [to_world(np.array(ends), scene.space) for ends in STRANGERS[name].first]
    assert any(((box.min(axis=0) <= eye) & (eye <= box.max(axis=0))).all() for box in boxes)
    assert 1 < eye[0, 1] - FloorFinder(scene).floor_below(eye)[0] < 2.2


@pytest.mark.parametrize("name", NAMES)
def test_triangles_left_out(name: str) -> None:
    """Those that no cell has, by the note of the subdivision, which joins the rest."""
    scene, cells = divided(name)
    notes = [note for note in cells.notes if "lie outside all cells" in note]
    left_out = sum(int(note.split()[0]) for note in notes)
    assert left_out <= STRANGERS[name].left_out * len(scene.triangles)


def test_plenums_are_no_rooms() -> None:
    """No way leads to them, so they are neither kept nor reported as rooms beyond."""
    assert not [
        note for note in divided("plenums")[1].notes if "cannot be reached from the" in note
    ]
