"""Made models of the kinds that people have keep what was expected of them, and miss nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from ptmtools.cells import SubdivideOptions, structural_triangles, subdivide
from ptmtools.scene import IngestOptions, ingest
from ptmtools.visibility import check_conservative, compute_pvs
from tests.cells.buildings import write
from tests.cells.strangers import STRANGERS

#: They take ten seconds each; `test_scans` and `test_worth` have smaller ones.
LARGE = {"tile", "street", "scanned hall"}


@pytest.mark.parametrize("name", sorted(STRANGERS.keys() - LARGE))
def test_resident_share_and_cells(name: str, tmp_path: Path) -> None:
    stranger = STRANGERS[name]
    model = write(tmp_path / "model.obj", stranger.parts().items())
    scene = ingest(model, IngestOptions(unit="m", up="z"))
    cells = subdivide(scene)
    pvs = compute_pvs(cells)
    assert pvs.volume_at_hand[0] <= stranger.resident
    least, most = stranger.cells
    assert least <= cells.standing.sum() <= most
    blocking = structural_triangles(scene, SubdivideOptions(), cells.opened)
    report = check_conservative(scene.corners[blocking], cells, pvs, 20_000)
    assert report.unoccluded > 1000
    assert report.missed == ()
