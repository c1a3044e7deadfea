"""Cells as glTF in three.js: the client of docs/gltf.md shows what rays see."""

from __future__ import annotations

import io
import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "e2e"), str(ROOT / "benchmarks")]
from browsers import three_js  # noqa: E402
from likeness import likeness, outline  # noqa: E402
from render import Look, View, load, render  # noqa: E402

#: What MeshBasicMaterial shows before a background of nothing.
LOOK = Look("none", sky=(0, 0, 0), mipmaps=True)
#: dB, outside edges.
LIKE = 30.0


@pytest.fixture(scope="module")
def three(require: Callable[[str, str], None]) -> Any:
    if remedy := three_js.missing():
        require("three.js in Chromium", remedy)
    return three_js


def seen_from(hints: dict[str, Any], cell: int) -> tuple[list[Any], dict[str, float]]:
    """The cells that a cell sees; for each texture of these, by its URL from `gltf/`, how much of
    the view the cells cover that use it."""
    row = hints["cells"][cell]
    cells = [hints["cells"][other] for other in row["visible"]]
    share: dict[str, float] = {}
    for other, part in zip(cells, row["ach"], strict=True):
        for texture in other["textures"]:
            url = f"../{hints['textures'][texture]['file']}"
            share[url] = share.get(url, 0) + max(part, row["coverage"]["floor"])
    return cells, share


def test_three_js_shows_what_rays_see(three: Any, gltf_museum: Path) -> None:
    """With what can be seen from the viewpoint's cell, and nothing else."""
    www = gltf_museum / "www"
    hints, scene = json.loads((www / "hints.json").read_text()), load(gltf_museum)
    width, height = 320, 240
    mirrored = []
    for index, viewpoint in enumerate(hints["viewpoints"][:2]):
        walked = three.walk(www, viewpoint=index, width=width, height=height)
        assert walked.messages == ()
        assert walked.cell == viewpoint["cell"]
        cells, share = seen_from(hints, walked.cell)
        assert walked.files == {
            "gltf/hints.json",
            *(f"gltf/{cell['name']}.glb" for cell in cells),
            *(url.removeprefix("../").replace(".ptm", ".png") for url in share),
        }
        with Image.open(io.BytesIO(walked.png)) as image:
            shown = np.asarray(image.convert("RGB"))
        view = View.of_hint(viewpoint, width, height)
        own, edges = render(scene, view, LOOK, samples=2), outline(scene, view)
        found = likeness(shown, own, edges, LOOK)
        assert found.psnr > LIKE
        assert found.stray == 0
        mirrored.append(likeness(shown[:, ::-1], own, edges, LOOK).psnr)
    assert min(mirrored) < LIKE - 10


def test_three_js_shares_out_memory(three: Any, gltf_museum: Path) -> None:
    """What covers most of the view comes first; without memory, the coarsest level."""
    hints = json.loads((gltf_museum / "www/hints.json").read_text())
    levels = {f"../{row['file']}": row["levels"] for row in hints["textures"]}
    _, share = seen_from(hints, hints["viewpoints"][0]["cell"])
    half = sum(levels[url][-1]["gpuBytes"] for url in share) // 2
    walked = three.walk(gltf_museum / "www", width=64, height=64, gpu_bytes=half)
    assert sorted(url for url, _ in walked.levels) == sorted(share)
    parts = [share[url] for url, _ in walked.levels]
    assert parts == sorted(parts, reverse=True)
    assert parts[0] > parts[-1]
    used = sum(levels[url][level]["gpuBytes"] for url, level in walked.levels)
    assert sum(levels[url][0]["gpuBytes"] for url in share) < used <= half
    none = three.walk(gltf_museum / "www", width=64, height=64, gpu_bytes=0)
    assert {level for _, level in none.levels} == {0}


def test_three_js_complains(three: Any, gltf_museum: Path, tmp_path: Path) -> None:
    """Of a cell that is not there."""
    www = Path(shutil.copytree(gltf_museum / "www", tmp_path / "www"))
    hints = json.loads((www / "hints.json").read_text())
    (www / f"gltf/c{hints['viewpoints'][0]['cell']:04d}.glb").unlink()
    assert "404" in " ".join(three.walk(www, width=64, height=64).messages)
