"""The light of a build without `--light`: baked, within some bytes."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from PIL import Image

from ptmtools.coverage.options import AchOptions
from ptmtools.light import cells
from ptmtools.light.cells import (
    BYTES,
    LEAST,
    SHARE,
    TRIANGLE,
    affordable_density,
    expected_bytes,
)
from ptmtools.light.model import CellSurfaces
from ptmtools.light.options import LightOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import LIGHT, TEXTURES, scene
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
    pieces = [floor(150.0), floor(150.0)]
    assert expected_bytes(pieces, 10.0) > 2 * BYTES
    few = affordable_density(pieces, 10.0, BYTES)
    assert expected_bytes(pieces, few) == pytest.approx(BYTES)
    # Beside a model of one triangle, in pieces of two cells, without images there is less.
    least = affordable_density(pieces, 10.0, 0)
    assert expected_bytes(pieces, least) == pytest.approx(LEAST + TRIANGLE)
    # Beside images of up to ten times as many bytes it is the same.
    assert affordable_density(pieces, 10.0, int(BYTES / SHARE)) == pytest.approx(few)
    assert affordable_density(pieces, 10.0, int(1.5 * BYTES / SHARE)) == pytest.approx(
        few * 1.5**0.5
    )
    assert affordable_density(pieces, 10.0, 1 << 30) == 10.0
    assert affordable_density([floor(10.0)], 10.0, 0) == 10.0
    for side in (1e-5, 1e6):
        assert affordable_density([floor(side)], 10.0, 1 << 20) == 0
    assert (
        affordable_density([floor(10.0, glass=True), floor(10.0, dense=True)], 10.0, 1 << 30) == 0
    )


@pytest.mark.parametrize(
    ("images", "rounded"),
    [((), 0), ((1,), 1), ((1, 2), 2), ((1000, 23), 512), ((1000, 24), 1024), ((1500,), 1024)],
)
def test_bytes_are_rounded(
    images: tuple[int, ...], rounded: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scene, "image_rows", lambda _: [{"bytes": size} for size in images])
    assert scene.rounded_image_bytes(cast("Any", None)) == rounded


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


def test_the_bytes_of_images_bound_those_of_light(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = Path(shutil.copytree(TWO_ROOMS, tmp_path / "model")) / "two_rooms.obj"
    repaint(model, 4)
    first = light_of(model, tmp_path / "db", AUTO)
    assert (first["light"], first["lightmaps"]) == ("bake", 2)
    assert "reduced_density" not in first
    assert 0 < first["bytes"] < BYTES
    monkeypatch.setattr(cells, "BYTES", 1000)
    total = repaint(model, 48)
    lit = light_of(model, tmp_path / "db", AUTO)
    assert lit["ran"] >= {TEXTURES.name, LIGHT.name}
    assert lit["reduced_density"] < 10
    assert lit["texels"] < first["texels"]
    # Lightmaps of so few texels have more bytes a texel than expected.
    assert 0 < lit["bytes"] <= 1.5 * SHARE * total
    assert "texels per metre, to save bytes" in LIGHT.summarize(lit)
    # It is the same light as from the beginning.
    fresh = light_of(model, tmp_path / "fresh", AUTO)
    assert {k: fresh[k] for k in ("lightmaps", "texels", "bytes")} == {
        k: lit[k] for k in ("lightmaps", "texels", "bytes")
    }


@pytest.mark.parametrize("light", ["auto", "bake"])
def test_unlit_colours_contain_their_light(tmp_path: Path, light: Any) -> None:
    options = LightOptions(light, light_samples=4)
    own: dict[str, Any] = {"occlusionTexture": None, "extensions": {"KHR_materials_unlit": {}}}
    model = write_lit_room(tmp_path / "model", **own)
    assert light_of(model, tmp_path / "db", options)["lightmaps"] == 0
