"""Glass in pictures: what is blended, in which order, and with which light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.glass import Glass
from ptmtools.rendering.rays import Camera, Caster

#: Metres before the eye, sides seen (2: both, 1: the nearer, -1: the farther), colour, opacity.
PANES = (
    (2.0, 1, (1.0, 0.0, 0.0), 0.25),
    (3.0, 2, (0.0, 1.0, 0.0), 0.5),
    (4.0, -1, (0.0, 0.0, 1.0), 0.5),
    (5.0, 2, (1.0, 1.0, 1.0), 1.0),
    (6.0, 2, (0.0, 0.0, 0.0), 0.5),
)


def panes(count: int) -> Surfaces:
    """The last of ``count`` is opaque, or all are glass."""
    corner = []
    for far, sides, *_ in PANES[:count]:
        triangle = np.array([[-40, -40, -far], [40, -40, -far], [0, 60, -far]])
        corner.append(triangle if sides > 0 else triangle[::-1])
    _, sides, color, opacity = zip(*PANES[:count], strict=True)
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


@pytest.mark.parametrize("count", [len(PANES), 3])
def test_panes_blend_the_farthest_first(count: int) -> None:
    """With a wall, panes behind it are not seen; nor are those that face away."""
    surfaces, ahead = panes(count), np.array([0.0, 0.0, -1.0])
    eye = np.array([0.1, 0.2, 0.0])
    sight = Caster(surfaces).look(Camera(6, 4, 1.2, 1.5), eye, ahead)
    assert set(sight.triangle.tolist()) == ({3} if count > 3 else {-1})
    shown = np.full((24, 3), 200.0)
    Glass(surfaces).blend(sight, shown)
    behind_red = 0.5 * np.array([200, 200, 200]) + 0.5 * np.array([0, 255, 0])
    expected = 0.75 * behind_red + 0.25 * np.array([255, 0, 0])
    np.testing.assert_allclose(shown, np.repeat(expected[None], 24, axis=0))


def test_a_pane_counts_once_for_rays_that_graze_it() -> None:
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    floor = np.array([[-1000, 0, 1000], [1000, 0, 1000], [0, 0, -3000]]) @ turn.T
    surfaces = replace(panes(1), corner=floor[None], two_sided=np.array([True]))
    eye, ahead = turn @ [0, 0.2, 600], turn @ [0, 0, -1]
    sight = Caster(surfaces).look(Camera(320, 180, 1.2, 1.78), eye, ahead)
    shown = np.full((len(sight.ray), 3), 255.0)
    Glass(surfaces).blend(sight, shown)
    assert {*shown[:, 1].tolist()} == {255.0, 0.75 * 255}


def test_light_falls_with_the_angle() -> None:
    surfaces = panes(1)
    sight = Caster(surfaces).look(Camera(5, 5, 1.2, 1.0), np.zeros(3), np.array([0.0, 0.0, -1.0]))
    shown = np.zeros((25, 3))
    Glass(surfaces, 0.25).blend(sight, shown)
    cosine = 1 / np.linalg.norm(sight.ray, axis=1)
    np.testing.assert_allclose(shown[:, 0], 255 * 0.25 * (0.25 + 0.75 * cosine))
