"""A visitor stands on the ground and sees what he was brought to, by rays in plain numpy."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.occlusion import Occluders
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools_systems.campus.objects import parts_of
from ptmtools_systems.campus.viewpoints import EYE, STEP, viewpoint
from tests.light.shapes import prism, surroundings, triangles_of
from tests.systems.campus.models import level

METRES = IngestOptions(unit="m", up="y")


def hits(corner: Floats, eye: Floats, way: Floats) -> Floats:
    """The shares of a way, ascending, at which it meets triangles (Möller and Trumbore)."""
    a, one, two = corner[:, 0], corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.cross(way, two)
    scale = np.einsum("tx,tx->t", one, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("tx,tx->t", eye - a, across) / scale
        turned = np.cross(eye - a, one)
        v = turned @ way / scale
        far = np.einsum("tx,tx->t", two, turned) / scale
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0)
    return np.sort(far[inside])


def share_seen(corner: Floats, object_corner: Floats, eye: Floats) -> float:
    """Of points spread over an object by area, those between which and an eye nothing lies."""
    random = np.random.default_rng(3)
    area = np.linalg.norm(
        np.cross(
            object_corner[:, 1] - object_corner[:, 0], object_corner[:, 2] - object_corner[:, 0]
        ),
        axis=1,
    )
    face = random.choice(len(area), 40, p=area / area.sum())
    point = np.einsum("nk,nkx->nx", random.dirichlet([1, 1, 1], 40), object_corner[face])
    actual = [hits(corner, eye, target - eye) for target in point]
    return float(np.mean([not len(far) or far[0] > 1 - 1e-4 for far in actual]))


def over_ground(corner: Floats, eye: Floats, ground: float) -> tuple[float, bool]:
    """How high an eye is over what lies lowest, and whether it is under the open sky."""
    down = hits(corner, eye, np.array([0.0, -1, 0]))
    lowest = eye[1] - down[-1] if len(down) else ground
    return float(eye[1] - lowest), not len(hits(corner, eye, np.array([0.0, 1, 0])))


def check(scene: Scene) -> None:
    around = Occluders.from_scene(scene)
    opaque = scene.corners[scene.opaque]
    for part in parts_of(scene, 10.0):
        corner = scene.corners[part.triangles]
        points = corner.reshape(-1, 3)
        box = np.concatenate([points.min(axis=0), points.max(axis=0)])
        eye = np.array(viewpoint(around, corner, box)[0])
        assert (eye[[0, 2]] < box[[0, 2]]).any() or (eye[[0, 2]] > box[[3, 5]]).any()
        assert share_seen(opaque, corner, eye) >= 0.1, part.label
        height, sky = over_ground(opaque, eye, around.ground)
        assert EYE - 1e-3 <= height <= EYE + STEP + 1e-3, part.label
        assert sky, part.label


def test_on_a_small_campus(model: Path) -> None:
    check(ingest(model, METRES))


def test_on_the_made_campus(tmp_path: Path) -> None:
    words = ["-o", str(tmp_path / "few"), "--buildings", "3", "--length", "100", "--texture", "32"]
    subprocess.run(
        [sys.executable, "-m", "ptmtools", "sample", "campus", *words],
        check=True,
        capture_output=True,
    )
    check(ingest(tmp_path / "few" / "campus.obj", METRES))


def solid(x: float, z: float, wide: float, deep: float, high: float) -> Floats:
    """A box with a roof."""
    return np.concatenate(
        [prism(x, z, wide, deep, high), triangles_of(level((x, z), (x + wide, z + deep), high))]
    )


GROUND = triangles_of(level((-300, -300), (300, 300), 0))


def looked_at(part: Floats, *others: Floats) -> tuple[Floats, float, Floats]:
    """The eye for a part of a scene; how much of it is seen; all faces."""
    around = surroundings(part, *others)
    points = part.reshape(-1, 3)
    box = np.concatenate([points.min(axis=0), points.max(axis=0)])
    eye = np.array(viewpoint(around, part, box)[0])
    every = np.concatenate([part, *others])
    return eye, share_seen(every, part, eye), every


@pytest.mark.parametrize("open_side", range(4))
def test_among_large_neighbours(open_side: int) -> None:
    """They stand on three sides, 2 m away, where its own size would put the visitor."""
    around = [(0, 14), (14, 0), (0, -62), (-62, 0)]
    rows = [
        solid(x, z, 60 if x else 12, 60 if z else 12, 25)
        for k, (x, z) in enumerate(around)
        if k != open_side
    ]
    eye, seen, every = looked_at(solid(0, 0, 12, 12, 9), *rows, GROUND)
    assert seen >= 0.1
    height, sky = over_ground(every, eye, 0.0)
    assert height == pytest.approx(EYE, abs=1e-4)
    assert sky


def test_what_stands_in_a_house_is_seen_within_it() -> None:
    eye, seen, every = looked_at(solid(9, 9, 1, 1, 2), solid(0, 0, 20, 20, 4), GROUND)
    assert seen >= 0.1
    height, sky = over_ground(every, eye, 0.0)
    assert height == pytest.approx(EYE, abs=1e-4)
    assert not sky


def test_what_nobody_can_see_has_a_viewpoint_on_the_ground() -> None:
    """A box in a box, without room between them."""
    eye, seen, every = looked_at(solid(0, 0, 10, 10, 5), solid(-1, -1, 12, 12, 6), GROUND)
    assert seen == 0
    assert over_ground(every, eye, 0.0) == (pytest.approx(EYE, abs=1e-4), True)
