"""The light that a build has without `--light`: baked within a tenth of the bytes of the images."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.coverage.options import AchOptions
from ptmtools.light.cells import LEAST, SHARE, affordable_density, round_bytes
from ptmtools.light.model import CellSurfaces
from ptmtools.light.options import LightOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import LIGHT, TEXTURES
from tests.light.glowing import write_lit_room
from tests.systems.apo.statues import TWO_ROOMS

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

QUICK = AchOptions(samples=1, backend="embree")
AUTO = LightOptions(light_samples=4)


def floor(side: float, **kind: bool) -> CellSurfaces:
    """A square, `side` metres long."""
    corner = np.array([[[0, 0, 0], [0, 0, 1], [1, 0, 1]], [[0, 0, 0], [1, 0, 1], [1, 0, 0]]])
    none, zero = np.zeros(2, np.bool_), np.zeros(2, np.int64)
    flags = {name: ~none if kind.get(name) else none for name in ("glass", "dense")}
    return CellSurfaces(
        (side * corner).astype(np.float32), zero, zero, **flags, side=np.ones(2, np.int8), face=zero
    )


def test_lightmaps_fit_the_images() -> None:
    pieces = [floor(10.0), floor(10.0)]
    whole = next(
        n for n in (1 << k for k in range(30)) if affordable_density(pieces, 10.0, n) == 10.0
    )
    fewer = affordable_density(pieces, 10.0, whole // 2)
    assert 10 * LEAST <= fewer < 10
    # A quarter of the bytes has a quarter of the texels.
    assert fewer == pytest.approx(10 * (whole / 2 / _enough(pieces)) ** 0.5, rel=1e-6)
    assert affordable_density(pieces, 10.0, whole // 16) == 0
    assert affordable_density(pieces, 10.0, 0) == 0
    assert affordable_density([floor(1e-5)], 10.0, 1 << 20) == 0
    assert (
        affordable_density([floor(10.0, glass=True), floor(10.0, dense=True)], 10.0, 1 << 30) == 0
    )


def _enough(pieces: list[CellSurfaces]) -> float:
    """The bytes of images beside which lightmaps have all texels, by bisection."""
    low, high = 1, 1 << 40
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (
            (low, middle) if affordable_density(pieces, 10.0, middle) == 10.0 else (middle, high)
        )
    return high


def test_bytes_are_rounded() -> None:
    assert [round_bytes(n) for n in (0, 1, 2, 3, 1023, 1024, 1500)] == [0, 1, 2, 2, 512, 1024, 1024]


def repaint(model: Path, side: int) -> int:
    """Paints noise into the images of the model; returns their bytes."""
    files = sorted(model.parent.glob("*.png"))
    for k, file in enumerate(files):
        texels = np.random.default_rng(k).integers(0, 256, (side, side, 3), dtype=np.uint8)
        Image.fromarray(texels).save(file)
    return sum(file.stat().st_size for file in files)


def light_of(model: Path, db: Path, *options: Any) -> dict[str, Any]:
    """The counts of the light, and the names of the stages that ran."""
    report = build_scene(model, db, QUICK, *options, workers=1)
    ran = {stage.stage for stage in report.stages if stage.ran}
    rows = json.loads((db / "manifest.json").read_text())["stages"]
    return {**rows[LIGHT.name]["counts"], "ran": ran}


def test_small_images_have_no_light_and_large_ones_have_it(tmp_path: Path) -> None:
    model = Path(shutil.copytree(TWO_ROOMS, tmp_path / "model")) / "two_rooms.obj"
    repaint(model, 4)
    first = light_of(model, tmp_path / "db", AUTO)
    assert (first["light"], first["lightmaps"]) == ("none", 0)
    # The omission is reported, with the remedy, although the stage wrote nothing.
    assert first["too_many_bytes"] > 0
    assert LIGHT.name in first["ran"]
    assert "--light bake" in LIGHT.summarize(first)
    total = repaint(model, 96)
    lit = light_of(model, tmp_path / "db", AUTO)
    assert (lit["light"], lit["lightmaps"]) == ("bake", 2)
    # Lightmaps of so few texels, with the noise of few rays, have more bytes a texel than expected.
    assert 0 < lit["ptm_bytes"] <= 1.2 * SHARE * total
    assert "reduced to 9.1 texels per metre, to save bytes" in LIGHT.summarize(lit)
    assert lit["ran"] >= {TEXTURES.name, LIGHT.name}
    # As many bytes as before, but for the noise.
    texels = np.random.default_rng(99).integers(0, 256, (96, 96, 3), dtype=np.uint8)
    Image.fromarray(texels).save(sorted(model.parent.glob("*.png"))[0])
    again = light_of(model, tmp_path / "db", AUTO)
    assert TEXTURES.name in again["ran"]
    assert LIGHT.name not in again["ran"]
    # It is the same light as from the beginning.
    fresh = light_of(model, tmp_path / "fresh", AUTO)
    assert {k: fresh[k] for k in ("lightmaps", "texels", "ptm_bytes")} == {
        k: lit[k] for k in ("lightmaps", "texels", "ptm_bytes")
    }


@pytest.mark.parametrize("light", ["auto", "bake"])
def test_unlit_colours_contain_their_light(tmp_path: Path, light: Any) -> None:
    options = LightOptions(light, light_samples=4)
    own: dict[str, Any] = {"occlusionTexture": None, "extensions": {"KHR_materials_unlit": {}}}
    model = write_lit_room(tmp_path / "model", **own)
    assert light_of(model, tmp_path / "db", options)["lightmaps"] == 0
