"""Shares of textures on their way from sample points to `hints.json`."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.required_levels import TextureSize, compute_need
from ptmtools.output import EmitExtras, TextureRecord, emit, validate_database
from ptmtools.output.content import Content
from ptmtools.output.hints import RecordWriter
from ptmtools.visibility.model import Pvs
from tests.output.agreement import disagreements


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


def test_how_fine_textures_are_needed(artifacts, tmp_path: Path, put_textures, seal) -> None:
    """Told by their place in the document's list; what no cell in view has is left out."""
    a, db = artifacts, tmp_path / "db"
    records = put_textures(db / "www")[::-1]
    sizes = {r.image: TextureSize(r.width, r.height, len(r.levels)) for r in records}
    need = compute_need(a.scene, a.cells, a.pvs, sizes, 4)
    extras = EmitExtras(need=need)
    emit(a.scene, a.cells, a.pvs, a.ach, records, db / "www", extras=extras)
    seal(db)
    assert validate_database(db).issues == ()
    assert disagreements(db / "www") == []
    for cell in range(3):
        record = json.loads((db / f"www/hints/c000{cell}.json").read_text())
        rows = {records[place].image: (first, shares) for place, first, *shares in record["need"]}
        entries = range(*need.start[cell : cell + 2].tolist())
        assert sorted(rows) == need.image[entries.start : entries.stop].tolist() == [0, 1]
        for entry in entries:
            first, shares = rows[int(need.image[entry])]
            wanted = need.share[slice(*need.share_start[entry : entry + 2].tolist())]
            assert first == need.first[entry]
            assert shares == pytest.approx(wanted, rel=5.1e-3)
            assert all(share == float(f"{share:.3g}") for share in shares)
    alone = Content(a.scene, a.cells, Pvs.from_matrix(np.eye(3, dtype=np.bool_)), a.ach, records)
    for cell in range(3):
        places = {place for place, *_ in RecordWriter(alone)._need(need, cell)}
        assert places == set(alone.cell_textures[cell].tolist())
