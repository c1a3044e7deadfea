"""Layers before surfaces in pictures: which a ray meets, in which order, and what they cover."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from ptmtools.arrays import Floats
from ptmtools.output.surfaces import LEAST_ALPHA, Surfaces
from ptmtools.rendering.layers import MOST, Layers, blend, seen_of, sheer_of
from ptmtools.rendering.rays import Camera, Caster
from ptmtools.rendering.records import Sight
from tests.lab.worlds import SEEDS

AHEAD = np.array([0.0, 0.0, -1.0])
#: Metres before the eye, sides seen (2: both, 1: the nearer, -1: the farther), colour, opacity.
PANES = (
    (2.0, 1, (1.0, 0.0, 0.0), 0.25),
    (3.0, 2, (0.0, 1.0, 0.0), 0.5),
    (4.0, -1, (0.0, 0.0, 1.0), 0.5),
    (5.0, 2, (1.0, 1.0, 1.0), 1.0),
    (6.0, 2, (0.0, 0.0, 0.0), 0.5),
)


def panes(rows: tuple[tuple[float, int, tuple[float, ...], float], ...]) -> Surfaces:
    """Triangles across the view, as `PANES`, without texture."""
    count, corner = len(rows), []
    for far, sides, *_ in rows:
        triangle = np.array([[-40, -40, -far], [40, -40, -far], [0, 60, -far]])
        corner.append(triangle if sides > 0 else triangle[::-1])
    _, sides, color, opacity = zip(*rows, strict=True)
    share = np.array(opacity)
    return Surfaces(
        corner=np.array(corner, np.float64),
        uv=np.zeros((count, 3, 2)),
        cell=np.zeros(count, np.int32),
        shape=np.arange(count, dtype=np.int32),
        texture=np.full(count, -1, np.int32),
        color=np.array(color),
        two_sided=np.array(sides) == 2,
        glass=share < 1,
        clamped=np.zeros((count, 2), np.bool_),
        seen=np.repeat(np.arange(count)[:, None], 2, axis=1),
        octree=np.full(count, -1, np.int32),
        opacity=share,
    )


def shown(
    surfaces: Surfaces, camera: Camera, eye: Floats, ahead: Floats, alpha: Floats | None = None
) -> Floats:
    """(n, 3) colours of the pixels of a view, of textures with ``alpha`` (T,), before 200."""

    def colors(sight: Sight) -> Floats:
        return np.where((sight.triangle < 0)[:, None], 200, 255 * surfaces.color[sight.triangle])

    sight = Caster(surfaces, sheer_of(surfaces)).look(camera, eye, ahead)
    sight, layers = Layers(surfaces).before(
        sight, lambda at: np.ones(0) if alpha is None else alpha[at.triangle]
    )
    result = colors(sight)
    blend(layers, colors(seen_of(layers, sight)), result)
    return result


@pytest.mark.parametrize("count", [len(PANES), 3])
def test_panes_blend_the_farthest_first(count: int) -> None:
    """With a wall, panes behind it are not seen; nor are those that face away."""
    actual = shown(panes(PANES[:count]), Camera(6, 4, 1.2, 1.5), np.array([0.1, 0.2, 0.0]), AHEAD)
    behind = 0.5 * (255 if count > 3 else 200)
    expected = 0.75 * np.array([behind, behind + 127.5, behind]) + 0.25 * np.array([255, 0, 0])
    np.testing.assert_allclose(actual, np.repeat(expected[None], 24, axis=0))


def test_a_pane_counts_once_for_rays_that_graze_it() -> None:
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    floor = np.array([[-1000, 0, 1000], [1000, 0, 1000], [0, 0, -3000]]) @ turn.T
    surfaces = replace(panes(PANES[:1]), corner=floor[None], two_sided=np.array([True]))
    eye, ahead = turn @ [0, 0.2, 600], turn @ [0, 0, -1]
    actual = shown(surfaces, Camera(320, 180, 1.2, 1.78), eye, ahead)
    assert {*actual[:, 1].tolist()} == {200.0, 0.75 * 200}


@given(SEEDS)
def test_textures_with_alpha_against_a_loop(seed: int) -> None:
    """Up to as many layers as a ray meets; some blend, others are drawn or not by a cutoff; of some
    leaves each side is a face of its own."""
    random = np.random.default_rng(seed)
    count = int(random.integers(1, MOST + 1))
    rows, cutoff, alpha = [], [], []
    for k in range(count):
        sides = int(random.integers(-1, 3)) or 3
        opacity = float(random.choice([1.0, random.random()]))
        for side in (1, -1) if sides == 3 else (sides,):
            rows.append((1 + 0.01 * k, side, tuple(random.random(3)), opacity))
            cutoff.append(random.choice([0, LEAST_ALPHA, random.random()]))
            alpha.append(random.choice([0, 1, random.random()], p=[0.4, 0.1, 0.5]))
    surfaces = panes((*rows, (9.0, 2, (0.5, 0.5, 0.5), 1.0)))
    own = np.arange(len(rows) + 1) < len(rows)
    surfaces = replace(
        surfaces,
        texture=np.where(own & (random.random(len(own)) < 0.9), 0, -1).astype(np.int32),
        glass=np.zeros(len(own), np.bool_),
        sheer=own,
        cutoff=np.array([*cutoff, 0]),
    )
    actual = shown(surfaces, Camera(3, 2, 1.0, 1.5), np.zeros(3), AHEAD, np.array([*alpha, 1]))
    expected = np.full(3, 127.5)
    for k in reversed(range(len(rows))):
        _, side, color, share = rows[k]
        if side < 0:
            continue
        share *= alpha[k] if surfaces.texture[k] >= 0 else 1
        if share < max(cutoff[k], LEAST_ALPHA):
            continue
        share = 1 if cutoff[k] else share
        expected = (1 - share) * expected + share * 255 * np.array(color)
    np.testing.assert_allclose(actual, np.repeat(expected[None], 6, axis=0))


def test_what_follows_too_many_layers_is_left_out() -> None:
    rows = tuple((1 + 0.01 * k, 2, (0.0, 0.0, 0.0), 0.004) for k in range(MOST + 20))
    actual = shown(panes(rows), Camera(1, 1, 1.0, 1.0), np.zeros(3), AHEAD)
    np.testing.assert_allclose(actual, 200 * (1 - 0.004) ** MOST)
