"""Layers before surfaces in pictures: which a ray meets, in which order, and what they cover."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from ptmtools.arrays import Floats
from ptmtools.output.surfaces import LEAST_ALPHA, Surfaces
from ptmtools.progress import silent
from ptmtools.rendering.footprints import show_colors
from ptmtools.rendering.layers import MOST, Layers, blend, transparent_of
from ptmtools.rendering.painting import SurfacePainter
from ptmtools.rendering.rays import Caster, RayCamera
from ptmtools.rendering.records import Sight, triangles_of
from ptmtools.rendering.tone import GLOW
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
        opacity=share,
    )


def shown(
    surfaces: Surfaces,
    camera: RayCamera,
    eye: Floats,
    ahead: Floats,
    texels: Floats | None = None,
) -> Floats:
    """(n, 3) colours of the pixels of a view before 200; ``texels`` (T, 2): alpha and level of
    detail of the texture of each."""

    def colors(sight: Sight) -> Floats:
        return np.where((sight.triangle < 0)[:, None], 200, 255 * surfaces.color[sight.triangle])

    sight = Caster(surfaces, transparent_of(surfaces)).look(camera, eye, ahead)
    sight, layers = Layers(surfaces).split(
        sight, lambda at: (0, 0) if texels is None else tuple(texels[at.triangle].T)
    )
    result = colors(sight)
    blend(layers, sight, lambda at, share: (colors(at) * share, share), result)
    return result


@pytest.mark.parametrize("count", [len(PANES), 3])
def test_panes_blend_the_farthest_first(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a wall, panes behind it are not seen; nor are those that face away."""
    monkeypatch.setattr("ptmtools.rendering.layers._BATCH", 7)
    actual = shown(
        panes(PANES[:count]), RayCamera(6, 4, 1.2, 1.5), np.array([0.1, 0.2, 0.0]), AHEAD
    )
    behind = 0.5 * (255 if count > 3 else 200)
    expected = 0.75 * np.array([behind, behind + 127.5, behind]) + 0.25 * np.array([255, 0, 0])
    np.testing.assert_allclose(actual, np.repeat(expected[None], 24, axis=0))


@pytest.mark.parametrize("faces", [1, 2])
def test_a_pane_counts_once_for_rays_that_graze_it(faces: int) -> None:
    """It has two sides, or two faces of one side each; that behind it counts, too."""
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    floor = np.array([[-1000, 0, 1000], [1000, 0, 1000], [0, 0, -3000]])
    corner = np.array([floor, floor - [0, 0.2, 0]])
    corner = np.concatenate([corner, corner[:, ::-1]])[: 2 * faces] @ turn.T
    surfaces = panes(PANES[:1] * len(corner))
    surfaces = replace(surfaces, corner=corner, two_sided=np.full(len(corner), faces == 1))
    eye, ahead = turn @ [0, 0.2, 600], turn @ [0, 0, -1]
    actual = shown(surfaces, RayCamera(320, 180, 1.2, 1.78), eye, ahead)
    times = np.log(actual[:, 1] / 200) / np.log(0.75)
    counts = np.unique_counts(times.round(6) + 0.0)
    assert {*counts.values.tolist()} == {0, 1, 2}
    # Some pixels see the lower one alone, beside the edges of the upper one.
    assert counts.counts[1] < 10


@pytest.mark.parametrize("span", [5.0, 1000.0])
def test_leaves_in_a_large_building_have_no_holes(span: float) -> None:
    """They have a face for each side, and grow in a corner of it."""
    random = np.random.default_rng(1)
    leaf = np.array([[-0.2, -0.2, 0], [0.2, -0.2, 0], [0, 0.2, 0]])
    turns = np.linalg.qr(random.normal(size=(40, 3, 3)))[0]
    leaves = leaf @ turns + random.uniform(-0.4, 0.4, (40, 1, 3)) + [0, 0, -2]
    room = np.array([[[0, -5, 0], [span, -5, 0], [0, -5, span]]])
    surfaces = panes(tuple((1.0, 1, (0.0, 0.0, 0.0), 1.0) for _ in range(81)))
    surfaces = replace(
        surfaces,
        corner=np.concatenate([leaves, leaves[:, ::-1], room]),
        transparent=np.arange(81) < 80,
    )
    one = replace(surfaces, two_sided=np.ones(81, np.bool_))
    camera = RayCamera(160, 120, 0.8, 4 / 3)
    pairs, both = (shown(each, camera, np.zeros(3), AHEAD) for each in (surfaces, one))
    assert (both == 0).all(axis=1).sum() > 3000
    np.testing.assert_array_equal(pairs, both)


@pytest.mark.parametrize("moved", [0.0, 3e5])
def test_insulating_glass_is_met_wherever_others_are(moved: float) -> None:
    rows = tuple((far, 2, (0.0, 0.0, 0.0), 0.5) for far in (2, 2.004, 2.02, 2.024, 10_000))
    surfaces = panes((*rows, (3.0, 2, (1.0, 1.0, 1.0), 1.0)))
    eye = np.array([moved, 0, -moved])
    surfaces = replace(surfaces, corner=surfaces.corner + eye)
    actual = shown(surfaces, RayCamera(6, 4, 1.2, 1.5), eye, AHEAD)
    np.testing.assert_allclose(actual, 255 / 16)


def test_pairs_of_faces_that_almost_touch_are_two() -> None:
    """The front of the first is not taken for that of the second."""
    colors = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    rows = [(2 + 0.0003 * k, side, colors[k], 0.5) for k in (0, 1) for side in (-1, 1)]
    actual = shown(panes(tuple(rows)), RayCamera(6, 4, 1.2, 1.5), np.zeros(3), AHEAD)
    np.testing.assert_allclose(actual, np.tile([50 + 127.5, 50 + 63.75, 50], (24, 1)))


def test_panes_in_the_plane_of_a_wall_and_of_no_alpha_are_left_out() -> None:
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    faint = (2.0, 2, (0.0, 0.0, 0.0), 0.9 * LEAST_ALPHA)
    wall = (3.0, 2, (1.0, 1.0, 1.0), 1.0)
    surfaces = panes((faint, (3.0, 2, (0.0, 0.0, 0.0), 0.5), wall))
    # Other corners in the same plane, of other rounding.
    corner = surfaces.corner * [[[1, 1, 1]], [[0.9, 0.7, 1]], [[1, 1, 1]]]
    surfaces = replace(surfaces, corner=corner @ turn.T)
    actual = shown(surfaces, RayCamera(60, 40, 1.2, 1.5), np.zeros(3), turn @ AHEAD)
    np.testing.assert_array_equal(actual, 255)


def test_layers_are_painted_one_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """And take 12 bytes for each ray, since those of a whole picture are in memory."""
    monkeypatch.setattr("ptmtools.rendering.layers._BATCH", 7)
    surfaces, sizes = panes(PANES), list[int]()

    def paint(sight: Sight, share: Floats) -> tuple[Floats, Floats]:
        sizes.append(len(sight.ray))
        return surfaces.color[sight.triangle] * share, share

    camera = RayCamera(6, 4, 1.2, 1.5)
    sight = Caster(surfaces, transparent_of(surfaces)).look(camera, np.zeros(3), AHEAD)
    sight, layers = Layers(surfaces).split(
        sight, lambda at: (np.ones(len(at.ray)), np.zeros(len(at.ray)))
    )
    blend(layers, sight, paint, np.zeros((24, 3)))
    assert sizes == [3, 3, 7, 7, 7, 7, 7, 7]
    assert sum(array.nbytes for layer in layers for array in layer) == 12 * 2 * 24


def test_light_falls_with_the_angle() -> None:
    """On layers without texture, as on surfaces."""
    surfaces = panes(PANES[:1])
    served: Any = SimpleNamespace(surfaces=surfaces, cell_count=1, index={"textures": []})
    painter = SurfacePainter(served, None, max_side=0, lit=False, progress=silent)
    sight = Caster(surfaces).look(RayCamera(5, 5, 1.2, 1.0), np.zeros(3), AHEAD)
    sight, layers = Layers(surfaces).split(sight, painter.alpha)
    painter.load(sight.triangle, *(layer.triangle for layer in layers))
    actual = np.zeros((25, 3))
    blend(layers, sight, painter.layer, actual)
    cosine = 1 / np.linalg.norm(sight.ray, axis=1)
    expected = 255 * 0.25 * (GLOW + (1 - GLOW) * cosine)
    np.testing.assert_allclose(actual[:, 0], expected, rtol=1e-6)


def test_a_triangle_without_area_has_the_color_of_a_corner() -> None:
    """Rays may meet it, at its edge."""
    surfaces = panes(PANES[1:3])
    surfaces.corner[1, 2] = surfaces.corner[1, 1]
    sight = Sight(np.array([1, -1]), np.tile(AHEAD, (2, 1)), np.eye(3)[:2], np.zeros(3), 0.01)
    colors, actual = np.tile(np.eye(3), (2, 1, 1)), np.full((2, 3), 50.0)
    show_colors(sight, triangles_of(surfaces), colors, actual)
    np.testing.assert_allclose(actual, [[150, 0, 0], [50, 50, 50]])


@given(SEEDS)
def test_textures_with_alpha_against_a_loop(seed: int) -> None:
    """Up to as many layers as a ray meets; some blend, others are drawn or not by a cutoff, or
    drawn in part at coarser levels; of some leaves each side is a face of its own."""
    random = np.random.default_rng(seed)
    count = int(random.integers(1, MOST + 1))
    rows, cutoff, texels = [], [], []
    for k in range(count):
        sides = int(random.integers(-1, 3)) or 3
        opacity = float(random.choice([1.0, random.random()]))
        for side in (1, -1) if sides == 3 else (sides,):
            rows.append((1 + 0.01 * k, side, tuple(random.random(3)), opacity))
            cutoff.append(random.choice([0, LEAST_ALPHA, random.random()]))
            alpha = random.choice([0, 1, random.random()], p=[0.4, 0.1, 0.5])
            texels.append((alpha, random.choice([0, random.random(), 3])))
    surfaces = panes((*rows, (9.0, 2, (0.5, 0.5, 0.5), 1.0)))
    own = np.arange(len(rows) + 1) < len(rows)
    surfaces = replace(
        surfaces,
        texture=np.where(own & (random.random(len(own)) < 0.9), 0, -1).astype(np.int32),
        glass=np.zeros(len(own), np.bool_),
        transparent=own,
        cutoff=np.array([*cutoff, 0]),
    )
    actual = shown(
        surfaces, RayCamera(3, 2, 1.0, 1.5), np.zeros(3), AHEAD, np.array([*texels, (1, 0)])
    )
    expected = np.full(3, 127.5)
    for k in reversed(range(len(rows))):
        _, side, color, share = rows[k]
        if side < 0:
            continue
        alpha, detail = texels[k] if surfaces.texture[k] >= 0 else (1, 0)
        share *= alpha
        if cutoff[k]:
            part = min(detail, 1)
            share = part * share + (1 - part) * (share >= cutoff[k])
        if share < LEAST_ALPHA:
            continue
        expected = (1 - share) * expected + share * 255 * np.array(color)
    np.testing.assert_allclose(actual, np.repeat(expected[None], 6, axis=0), atol=1e-3)


def test_what_follows_too_many_layers_is_left_out() -> None:
    rows = tuple((1 + 0.01 * k, 2, (0.0, 0.0, 0.0), 0.004) for k in range(MOST + 20))
    actual = shown(panes(rows), RayCamera(1, 1, 1.0, 1.0), np.zeros(3), AHEAD)
    np.testing.assert_allclose(actual, 200 * (1 - 0.004) ** MOST, atol=1e-3)
