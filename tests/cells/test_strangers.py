"""Made models of the kinds that people have keep what was expected of them, and miss nothing."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, structural_triangles, subdivide
from ptmtools.output.model import WriterOptions
from ptmtools.output.standpoints import FloorFinder
from ptmtools.output.storeys import storeys
from ptmtools.output.viewpoints import place_viewpoints
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.orientation.space import to_world
from ptmtools.visibility import check_conservative, compute_pvs
from tests.cells.buildings import Box, write
from tests.cells.strangers import STRANGERS

#: They take a minute each; `test_scans` and `test_worth` have smaller ones.
LARGE = {"tile", "scanned hall"}
NAMES = sorted(STRANGERS.keys() - LARGE)
#: Visitors see all of them, from all sides.
OPEN = {"bathroom", "square", "street", "facades"}


def divided(name: str) -> tuple[Scene, Cells]:
    with TemporaryDirectory() as folder:
        model = write(Path(folder, "model.obj"), STRANGERS[name].parts().items())
        scene = ingest(model, IngestOptions(unit="m", up="z"))
    return scene, subdivide(scene)


@pytest.mark.parametrize("name", NAMES)
def test_what_a_person_expects(name: str) -> None:
    """Each is divided once, which takes seconds."""
    scene, cells = divided(name)
    stranger = STRANGERS[name]
    least, most = stranger.cells
    assert least <= cells.standing.sum() <= most
    assert first_viewpoint_is_in(stranger.first, scene, cells)
    floors = to_world(np.array([(0.0, 0.0, z) for z in stranger.floors]), scene.space)
    assert storeys(scene, cells, 1.2) == pytest.approx(floors[:, 1].tolist())
    lost = [int(note.split()[0]) for note in cells.notes if "lie outside all cells" in note]
    assert sum(lost) <= stranger.left_out * len(scene.triangles)
    assert lost or name in OPEN
    if name == "plenums":  # no way leads to them
        assert [note for note in cells.notes if "left out as plenums" in note]
        assert not [note for note in cells.notes if "cannot be reached from the" in note]
    if name != "street":
        pvs = compute_pvs(cells)
        assert pvs.volume_at_hand[0] <= stranger.resident
        blocking = structural_triangles(scene, SubdivideOptions(), cells.opened)
        report = check_conservative(scene.corners[blocking], cells, pvs, 20_000)
        assert report.unoccluded > 1000
        assert report.missed == ()


def first_viewpoint_is_in(boxes: tuple[Box, ...], scene: Scene, cells: Cells) -> bool:
    """Whether the eye of the first viewpoint is where a person would begin, and above a floor."""
    (first, *_), _ = place_viewpoints(scene, cells, WriterOptions(viewpoint_count=1))
    eye = np.array([first.position])
    assert 1 < eye[0, 1] - FloorFinder(scene).floor_below(eye)[0] < 2.2
    ends = [to_world(np.array(box), scene.space) for box in boxes]
    return any(((box.min(axis=0) <= eye) & (eye <= box.max(axis=0))).all() for box in ends)
