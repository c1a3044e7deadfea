"""A museum whose statues are replaced, as a user builds, checks, walks and publishes it."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.output.gltf_reader import read_glb
from ptmtools_systems.apo.files import inflate_texels
from ptmtools_systems.apo.model import Octree
from ptmtools_systems.apo.octree import fault_of
from ptmtools_systems.apo.traversal import look_up
from tests.e2e.conftest import Ptm, make_museum
from tests.output.agreement import disagreements
from tests.systems.apo.statues import STATUES, write_rooms

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "benchmarks")]
from kills import Trial  # noqa: E402

APO = ("--apo", "statue_*", "--apo-faces", 300, "--apo-error", 0.1)


@pytest.fixture(scope="module")
def museum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small museum as modelled, ``plain``, and with light statues, ``light``."""
    folder = tmp_path_factory.mktemp("apo")
    model = make_museum(folder / "model", rooms=2)
    for name, options in (("plain", ()), ("light", APO)):
        words = ["-o", folder / name, "--samples", 16, "--backend", "embree", "--light", "none"]
        assert main(["-q", "build-scene", str(model), *map(str, [*words, *options])]) == 0
    return folder


def counts(db: Path, stage: str) -> dict[str, Any]:
    actual: dict[str, Any] = json.loads((db / "manifest.json").read_text())["stages"][stage]
    return dict(actual["counts"])


def test_the_building_is_the_same(museum: Path, ptm: Ptm) -> None:
    db = museum / "light"
    checked = ptm("validate", db, "--strict", "--segments", 5000)
    assert checked.status == 0, checked.out
    assert disagreements(db / "www") == []
    assert "0 errors, 0 warnings" in checked.out
    for name in ("cells", "leaves", "portals", "closed"):
        assert counts(db, "cells")[name] == counts(museum / "plain", "cells")[name], name
    assert counts(db, "pvs") == counts(museum / "plain", "pvs")
    made = counts(db, "apo")
    assert made["octrees"] >= 2
    assert made["faces"] <= 300 * made["octrees"] < made["source"]
    light, plain = (counts(museum / name, "emit")["triangles"] for name in ("light", "plain"))
    assert light <= plain - (made["source"] - made["faces"])
    index = json.loads((db / "www/hints.json").read_text())
    for cell in index["cells"]:
        record = json.loads((db / f"www/hints/{cell['name']}.json").read_text())
        assert sum(record["ach"]) == pytest.approx(1, abs=1e-9)


def test_commands(museum: Path, tmp_path: Path, ptm: Ptm) -> None:
    db = museum / "light"
    described = ptm("info", db)
    assert f"{counts(db, 'apo')['octrees']} objects of " in described.out
    assert "--apo 'statue_*' --apo-faces 300 --apo-error 0.1" in described.out
    status = ptm("status", db)
    assert "not finished" not in status.out
    walk = tmp_path / "walk.json"
    for words in (
        ("plot", db, "-o", tmp_path / "plan.png", "--cell", 0),
        ("path", db, "-o", walk, "--duration", 20),
        ("simulate", db, "--walk", walk, "--policy", "best", "--bandwidth", "4M"),
        ("publish", db, "-o", tmp_path / "site", "--no-pictures"),
    ):
        done = ptm(*words)
        assert done.status == 0, done.err
    (index,) = (tmp_path / "site" / "data").glob("index-*.json")
    files = {row["file"] for row in json.loads(index.read_text())["octrees"]}
    assert files == {file.name for file in index.parent.glob("statue_*.bin")}
    assert len(files) >= len(STATUES)


def test_statues_can_be_lit_by_what_is_served(tmp_path: Path, ptm: Ptm) -> None:
    """As a client does it: of hints, GLBs and octrees alone."""
    model, db = write_rooms(tmp_path / "model", 4), tmp_path / "db"
    options = ("--samples", 4, "--apo", "statue*", "--apo-faces", 600, "--apo-density", 30)
    assert ptm("build-scene", model, "-o", db, *options).status == 0
    www = db / "www"
    index = json.loads((www / "hints.json").read_text())
    rows = {row["object"]: row for row in index["octrees"]}
    assert list(rows) == list(STATUES)
    seen = 0
    for cell in index["cells"]:
        for name, corner in shapes(www / f"gltf/{cell['name']}.glb"):
            if name not in rows:
                continue
            row = rows[name]
            data = (www / row["file"]).read_bytes()
            start = np.concatenate([[0], np.cumsum(row["levels"])])
            texels = inflate_texels(data, start, row)
            low, side = np.array(row["cube"]["low"]), row["cube"]["side"]
            octree = Octree(texels, start, low, side)
            assert fault_of(octree) is None
            flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
            flat /= np.linalg.norm(flat, axis=1, keepdims=True)
            actual = look_up(octree, (corner.mean(axis=1) - low) / side).normals
            off = np.degrees(np.arccos(np.clip((actual * flat).sum(axis=1), -1, 1)))
            assert np.median(off) < 12  # the relief, not the triangle
            assert off.mean() > 1
            seen += len(corner)
    assert seen == counts(db, "apo")["faces"]


def shapes(file: Path) -> list[tuple[str, np.ndarray]]:
    """The name of each node of a GLB, and its (m, 3, 3) triangles."""
    primitives = read_glb(file.read_bytes()).primitives
    return [(p.object, p.point[p.triangle].astype(np.float64)) for p in primitives]


def test_killed_builds_end_as_undisturbed_ones(tmp_path: Path) -> None:
    model = write_rooms(tmp_path / "model", 2)
    options = ["--samples", "4", "-j", "1", "--apo", "statue*", "--apo-faces", "99"]
    trial = Trial(model, tmp_path, options, update=False)
    assert {"www/apo/statue_01.bin", "stages/octrees.json"} <= trial.wanted.keys()
    for n in (10, 25, 40):
        assert trial.at_name(n) == ""
