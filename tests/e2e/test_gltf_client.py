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


def read(www: Path, name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((www / name).read_text())
    return found


def record_of(www: Path, cell: int) -> dict[str, Any]:
    return read(www, f"hints/c{cell:04d}.json")


def seen_from(www: Path, cell: int) -> tuple[list[int], dict[str, float]]:
    """The cells that a cell sees; for each texture of these, by its URL, how much of the view the
    cells cover that use it."""
    row, textures = record_of(www, cell), read(www, "hints.json")["textures"]
    share: dict[str, float] = {}
    for other, part in zip(row["visible"], row["ach"], strict=True):
        for texture in record_of(www, other)["textures"][0]:
            url = textures[texture]["file"]
            share[url] = share.get(url, 0) + max(part, row["floor"])
    return row["visible"], share


def test_three_js_shows_what_rays_see(three: Any, gltf_museum: Path) -> None:
    """With what can be seen from the viewpoint's cell, and nothing else."""
    www = gltf_museum / "www"
    index, scene = read(www, "hints.json"), load(gltf_museum)
    width, height = 320, 240
    mirrored = []
    for place, viewpoint in enumerate(index["viewpoints"][:2]):
        walked = three.walk(www, viewpoint=place, width=width, height=height)
        assert walked.messages == ()
        assert walked.cell == viewpoint["cell"]
        cells, share = seen_from(www, walked.cell)
        records = {file for file in walked.files if file.startswith("hints/")}
        assert f"hints/c{walked.cell:04d}.json" in records
        assert len(records) <= 3, "those whose boxes hold the eye"
        assert walked.files - records == {
            "hints.json",
            *(f"gltf/c{cell:04d}.glb" for cell in cells),
            *(url.replace(".ptm", ".png") for url in share),
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


def gpu_bytes(texture: dict[str, Any], level: int) -> int:
    """Texture memory of the pyramid up to a level."""
    last = len(texture["ends"]) - 1
    halved = range(last - level, last + 1)
    texels = sum((texture["width"] >> k) * (texture["height"] >> k) for k in halved)
    return int(texels * texture["texelBytes"])


def test_three_js_shares_out_memory(three: Any, gltf_museum: Path) -> None:
    """What covers most of the view comes first; without memory, the coarsest level."""
    www = gltf_museum / "www"
    index = read(www, "hints.json")
    textures = {row["file"]: row for row in index["textures"]}
    _, share = seen_from(www, index["viewpoints"][0]["cell"])
    half = sum(gpu_bytes(textures[url], len(textures[url]["ends"]) - 1) for url in share) // 2
    walked = three.walk(www, width=64, height=64, gpu_bytes=half)
    assert sorted(url for url, _ in walked.levels) == sorted(share)
    parts = [share[url] for url, _ in walked.levels]
    assert parts == sorted(parts, reverse=True)
    assert parts[0] > parts[-1]
    used = sum(gpu_bytes(textures[url], level) for url, level in walked.levels)
    assert sum(gpu_bytes(textures[url], 0) for url in share) < used <= half
    for url, level in walked.levels:
        part = half * share[url] / sum(share.values())
        finer = min(level + 1, len(textures[url]["ends"]) - 1)
        assert level == finer or gpu_bytes(textures[url], finer) > part * (1 - 1e-9)
    none = three.walk(www, width=64, height=64, gpu_bytes=0)
    assert {level for _, level in none.levels} == {0}


def test_three_js_refuses_another_schema(three: Any, gltf_museum: Path, tmp_path: Path) -> None:
    www = Path(shutil.copytree(gltf_museum / "www", tmp_path / "www"))
    (www / "hints.json").write_text(json.dumps(read(www, "hints.json") | {"schema": 3}))
    assert "hints of schema 3, not 2" in " ".join(three.walk(www, width=64, height=64).messages)


def test_three_js_complains(three: Any, gltf_museum: Path, tmp_path: Path) -> None:
    """Of a cell that is not there."""
    www = Path(shutil.copytree(gltf_museum / "www", tmp_path / "www"))
    cell = read(www, "hints.json")["viewpoints"][0]["cell"]
    (www / f"gltf/c{cell:04d}.glb").unlink()
    assert "404" in " ".join(three.walk(www, width=64, height=64).messages)
