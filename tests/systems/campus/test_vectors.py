"""A frozen campus of each schema must be readable for ever."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.pipeline.validation import validate
from ptmtools_systems.campus import read_campus
from ptmtools_systems.campus.meshes import read_mesh

V1 = Path(__file__).parent / "vectors" / "v1"


def test_it_is_small() -> None:
    assert sum(file.stat().st_size for file in V1.rglob("*.*")) < 100_000


def test_it_is_valid() -> None:
    assert validate(V1).issues == ()


def test_it_says_what_it_said() -> None:
    campus = read_campus(V1)
    (gate,) = campus.objects
    assert (gate.name, gate.label, gate.lightmap) == ("Garden_gate", "Garden gate", "Garden_gate")
    assert gate.box == (-4, 0, -3, 4, 3, 3)
    assert [mesh.faces for mesh in gate.meshes] == [5, 10]
    assert [m.name for m in campus.materials] == ["fence", "floor"]
    assert [m.channels for m in campus.materials] == [("d", "a"), ()]
    assert campus.materials[1].color == pytest.approx((0.2, 0.4, 0.6))
    assert [(t.base, t.size, t.channel) for t in campus.textures] == [
        *(("fence", size, channel) for size in (128, 256, 512) for channel in "da"),
        *(("Garden_gate", size, "l") for size in (512, 1024, 2048)),
    ]
    assert campus.presets[3].bytes == campus.presets[4].bytes > campus.presets[0].bytes


def test_its_files_are_what_they_were() -> None:
    coarse, fine = (
        read_mesh((V1 / f"meshes/Garden_gate_{lod}.glb").read_bytes()) for lod in (0, 1)
    )
    assert sum(len(p.triangle) for p in fine) == 10
    fence, floor = fine
    assert fence.uv is not None
    assert floor.uv is None
    # Up the wall by 3 m of the 4 that an image covers, from the upper left.
    assert np.ptp(fence.uv[:, 1]) == pytest.approx(0.75)
    assert all(p.color is not None and p.light is None for p in coarse)
    with Image.open(V1 / "textures/fence_128_a.jpg") as image:
        alpha = np.asarray(image, float)
    assert alpha[64, 20] > 240
    assert alpha[64, 100] < 15
    with Image.open(V1 / "textures/Garden_gate_512_l.jpg") as image:
        light = np.asarray(image, float) / 255
    assert fence.light is not None
    assert floor.light is not None
    # The fence is not opaque, so it takes no light from the floor; the ground does from the fence.
    for part, least, most in ((floor, 0.97, 1.0), (fence, 0.7, 0.95)):
        middle = part.light.mean(axis=0)
        assert least <= light[int(middle[1] * 512), int(middle[0] * 512)] <= most
