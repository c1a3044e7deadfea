"""Shares of textures on their way from sample points to `hints.json`."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.options import AchOptions
from ptmtools.database import TextureRecord, emit


def test_textures_of_visible_cells(artifacts, tmp_path: Path) -> None:
    """Told by their place in the document's list, which here is not the scene's order."""
    options = AchOptions(samples=32, face=4, backend="embree", per_texture=True)
    ach = compute_ach(artifacts.scene, artifacts.cells, artifacts.pvs, options)
    assert set(np.unique(ach.texture)) == {-1, 0, 1}
    records = tuple(
        TextureRecord(i, f"textures/{i}.ptm", f"textures/{i}.png", 1, 1, 3, (), "0" * 64)
        for i in (1, 0)
    )
    emit(artifacts.scene, artifacts.cells, artifacts.pvs, ach, records, tmp_path)
    document = json.loads((tmp_path / "hints.json").read_text())
    records_of_cells = [
        json.loads((tmp_path / f"hints/{cell['name']}.json").read_text())
        for cell in document["cells"]
    ]
    place = {1: "textures/1.ptm", 0: "textures/0.ptm"}
    listed = [texture["file"] for texture in document["textures"]]
    for i, cell in enumerate(records_of_cells):
        shares = cell["textureShares"]
        assert len(shares) == len(cell["ach"])
        for k, (entry, share) in enumerate(zip(shares, cell["ach"], strict=True)):
            assert math.fsum(s for _, s in entry) == pytest.approx(share, rel=1e-3)
            at = int(ach.start[i]) + k
            part = slice(int(ach.texture_start[at]), int(ach.texture_start[at + 1]))
            expected = {
                place.get(int(image)): pytest.approx(value, rel=1e-3)
                for image, value in zip(ach.texture[part], ach.texture_value[part], strict=True)
            }
            assert {None if t is None else listed[t]: s for t, s in entry} == expected
