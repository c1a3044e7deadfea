"""The lit hall: lamps where paintings hang, smooth normals on turnings, sharp ones on walls."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from ptmtools_samples.lit_hall import MATERIALS, corner_normals, make_lit_hall
from ptmtools_samples.options import LitHallOptions

from ptmtools.glb import glb_chunks
from ptmtools.scene import ingest


@pytest.fixture(scope="module")
def data() -> bytes:
    ((_, load),) = make_lit_hall(LitHallOptions(scale=0.02))
    return load()


def test_spots_shine_on_paintings(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "hall.glb").write_bytes(data)
    scene = ingest(tmp_path / "hall.glb")
    spots = [lamp for lamp in scene.lights.lamps if lamp.kind == "spot"]
    paintings = [
        scene.corners[scene.triangle_material == k].reshape(-1, 3)
        for k, material in enumerate(scene.materials)
        if material.name.startswith("painting")
    ]
    assert len(spots) == len(paintings) == 6
    for corners in paintings:
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        way = middle - [spot.position for spot in spots]
        along = way / np.linalg.norm(way, axis=1, keepdims=True)
        aim = np.einsum("nx,nx->n", along, [spot.direction for spot in spots])
        assert aim.max() > 0.999
    (sun,) = [lamp for lamp in scene.lights.lamps if lamp.kind == "sun"]
    assert sun.direction[1] < -0.5
    assert scene.lights.glow.any(axis=1).sum() == 1


def test_materials_of_the_file(data: bytes) -> None:
    document = json.loads(glb_chunks(data)[0][2])
    looks = {entry["name"]: entry["pbrMetallicRoughness"] for entry in document["materials"]}
    assert looks["brass"]["metallicFactor"] == 1
    assert looks["stone"]["roughnessFactor"] == MATERIALS["stone"].roughness
    assert looks["painting_01"]["baseColorTexture"]["index"] == [
        image["name"] for image in document["images"]
    ].index("painting_01")


def test_normals_bend_within_the_crease() -> None:
    def fold(degrees: float) -> np.ndarray:
        a = np.radians(degrees)
        far = [np.cos(a), np.sin(a), 0]
        return np.array(
            [
                [[0, 0, 0], [0, 0, 1], [-1, 0, 0]],
                [[0, 0, 1], [0, 0, 0], far],
            ],
            float,
        )

    smooth, sharp = corner_normals(fold(30)), corner_normals(fold(60))
    assert np.allclose(smooth[0, 0], smooth[1, 1])
    assert np.allclose(np.linalg.norm(smooth, axis=2), 1)
    assert sharp[0, 0] @ sharp[1, 1] == pytest.approx(0.5, abs=1e-6)
