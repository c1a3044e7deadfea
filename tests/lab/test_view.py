"""The picture on the screen, against slow references: rays, samples, levels of detail."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, given, settings
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.output.locating import Locator
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.kernels import GREY, level_of_detail
from ptmtools.rendering.rays import LINES, Frustum, RayCamera
from ptmtools.rendering.records import Pyramids
from ptmtools.scene.colors import gradients
from ptmtools_lab.tables import look
from tests.lab.worlds import SEEDS, leaf

CAMERA = RayCamera(16, 10, 1.0, 1.6)
#: Rays that pass so near to an edge, in its triangle's own coordinates, could meet either side.
EDGE = 1e-4
#: Panels of two opposite faces in one plane.
PAIRS = 3


@dataclass(frozen=True)
class Room:
    """A room with pictures, and all levels of its textures."""

    surfaces: Surfaces
    levels: list[list[NDArray[np.uint8]]]

    @property
    def pyramids(self) -> Pyramids:
        deepest = max(map(len, self.levels))
        start = np.zeros((len(self.levels), deepest), np.int64)
        size = np.zeros((*start.shape, 2), np.int64)
        parts, at = [], 0
        for t, levels in enumerate(self.levels):
            for n, level in enumerate(levels):
                start[t, n], size[t, n] = at, level.shape[1::-1]
                parts.append(level.ravel())
                at += level.size
        return Pyramids(
            np.concatenate(parts), start, size, np.array([len(rows) for rows in self.levels]),
            np.array([rows[0].reshape(-1, 3).mean(axis=0) for rows in self.levels]),
            np.zeros(start.shape),
        )  # fmt: skip


def room(random: np.random.Generator) -> Room:
    """Walls of 6 × 3 × 4 m, and panels within, of two cells; one-sided ones and glass as well. The
    last panels have a one-sided face for each side."""
    levels = []
    for shape in ((16, 8), (5, 7), (32, 32)):
        rows = [random.integers(0, 256, (*shape, 3), dtype=np.uint8)]
        while min(rows[0].shape[:2]) > 1:
            height, width = (max(1, side // 2) for side in rows[0].shape[:2])
            rows.insert(0, random.integers(0, 256, (height, width, 3), dtype=np.uint8))
        levels.append(rows)
    corner = []
    low, high = np.array([0.0, 0, 0]), np.array([6.0, 3, 4])
    for axis in range(3):
        for end in (low, high):
            other = [k for k in range(3) if k != axis]
            quad = np.tile(end, (4, 1))
            quad[:, other[0]] = np.array([low, high, high, low])[:, other[0]]
            quad[:, other[1]] = np.array([low, low, high, high])[:, other[1]]
            corner += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    for _ in range(6):
        middle = random.uniform(low + 0.5, high - 0.5)
        corner.append(middle + random.normal(0, 1.0, (3, 3)))
    corner += [each[::-1] for each in corner[-PAIRS:]]
    count = len(corner)
    two_sided = random.random(count) < 0.7
    two_sided[-2 * PAIRS :] = False
    # Up to so fine that a pixel covers many texels.
    uv = random.uniform(-1, 1, (count, 3, 2)) * 10 ** random.uniform(0, 2.5, (count, 1, 1))
    texture = random.integers(-1, 3, count).astype(np.int32)
    return Room(
        Surfaces(
            corner=np.array(corner),
            uv=uv,
            cell=np.sort(random.integers(0, 2, count)).astype(np.int32),
            shape=np.arange(count, dtype=np.int32),
            texture=texture,
            color=random.uniform(0.3, 1, (count, 3)),
            two_sided=two_sided,
            glass=(random.random(count) < 0.3) & (texture < 0),
            clamped=random.random((count, 2)) < 0.5,
            seen=np.repeat(np.arange(count)[:, None], 2, axis=1),
        ),
        levels,
    )


def first_surface(surfaces: Surfaces, eye: Floats, ray: Floats) -> tuple[int, Floats]:
    """The triangle and the point that a ray meets first (Möller and Trumbore); assumes that it
    passes no edge too near."""
    a, b, c = (surfaces.corner[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    facing = normal @ ray
    far = np.einsum("ij,ij->i", normal, a - eye) / np.where(facing == 0, np.nan, facing)
    point = eye + far[:, None] * ray
    sides = [
        np.einsum("ij,ij->i", np.cross(q - p, point - p), normal) / (normal**2).sum(axis=1)
        for p, q in ((a, b), (b, c), (c, a))
    ]
    inner = np.min(sides, axis=0)
    assume(not ((abs(inner) < EDGE) & (far > -EDGE)).any())
    assume(not (abs(far) < EDGE).any())
    met = (inner > 0) & (far > 0) & ~surfaces.glass & (surfaces.two_sided | (facing < 0))
    nearest = int(np.where(met, far, np.inf).argmin())
    assume(not ((abs(far - far[nearest]) < EDGE) & met & (np.arange(len(far)) != nearest)).any())
    return (nearest, point[nearest]) if met[nearest] else (-1, point[nearest])


def at_point(surfaces: Surfaces, f: int, point: Floats) -> Floats:
    """Texture coordinates by barycentric ones of the triangle's plane."""
    a, b, c = surfaces.corner[f]
    share = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), point - a, rcond=None)[0]
    ua, ub, uc = surfaces.uv[f]
    actual: Floats = ua + share[0] * (ub - ua) + share[1] * (uc - ua)
    return actual


def bilinear(level: NDArray[np.uint8], at: Floats, clamped: Bools) -> Floats:
    """The four texels around, repeated or clamped."""
    height, width = level.shape[:2]
    x, y = at[0] * width - 0.5, at[1] * height - 0.5
    total = np.zeros(3)
    for i in (int(np.floor(x)), int(np.floor(x)) + 1):
        for j in (int(np.floor(y)), int(np.floor(y)) + 1):
            column = min(max(i, 0), width - 1) if clamped[0] else i % width
            row = min(max(j, 0), height - 1) if clamped[1] else j % height
            total += (1 - abs(x - i)) * (1 - abs(y - j)) * level[row, column].astype(np.float64)
    return total


def detail_at(
    surfaces: Surfaces, f: int, eye: Floats, ray: Floats, axes: Floats, size: Ints
) -> float:
    """log2 of texels a pixel: where rays a thousandth of a pixel beside meet the plane."""
    pixel = 2 * np.tan(CAMERA.field_of_view / 2) / LINES
    normal = np.cross(*(surfaces.corner[f, 1:] - surfaces.corner[f, 0]))

    def texels(along: Floats) -> Floats:
        far = normal @ (surfaces.corner[f, 0] - eye) / (normal @ along)
        actual: Floats = at_point(surfaces, f, eye + far * along) * size
        return actual

    h = 1e-3 * pixel
    moved = [texels(ray + h * axis) - texels(ray - h * axis) for axis in axes]
    return float(np.log2(max(np.linalg.norm(move) for move in moved) * pixel / (2 * h)))


@settings(max_examples=10)
@given(SEEDS)
def test_tables_against_slow_ones(seed: int) -> None:
    random = np.random.default_rng(seed)
    made = room(random)
    surfaces = made.surfaces
    eye = random.uniform([1, 0.5, 1], [5, 2.5, 3])
    direction = random.normal(size=3) * [1, 0.3, 1]
    direction /= np.linalg.norm(direction)
    rays, axes = CAMERA.rays(direction[None])
    flat = rays.reshape(-1, 3)
    deepest = max(map(len, made.levels))
    tables: dict[tuple[int, int], list[Floats]] = {}
    owner, depth = np.full(len(flat), -1), np.full(len(flat), np.inf)
    for i, ray in enumerate(flat):
        f, point = first_surface(surfaces, eye, ray)
        if f < 0:
            continue
        owner[i], depth[i] = surfaces.cell[f], (point - eye) @ direction
        wide = (deepest + 2, deepest + 2, deepest, deepest)
        key = int(surfaces.cell[f]), int(surfaces.texture[f])
        error, square, need, sight = tables.setdefault(key, [np.zeros(n) for n in wide])
        each = _errors(made, f, eye, ray, axes[0], point)
        error[: len(each)] += each / len(flat)
        square[: len(each)] += each**2 / len(flat)
        wants = _wants(made, f, eye, ray, axes[0])
        need += np.pad(wants, (0, deepest - len(wants))) / len(flat)
        if CAMERA.sparse[i]:
            sight += np.pad(wants, (0, deepest - len(wants))) / CAMERA.sparse.sum()
    (views,) = look(surfaces, made.pyramids, CAMERA, eye[None], direction[None])
    assert set(zip(views.cell.tolist(), views.texture.tolist(), strict=True)) == set(tables)
    for r, key in enumerate(zip(views.cell.tolist(), views.texture.tolist(), strict=True)):
        actual = (views.error[r], views.square[r], views.need[r], views.sight[r])
        for mine, theirs in zip(tables[key], actual, strict=True):
            assert theirs == pytest.approx(mine, rel=1e-3, abs=2e-3)
    assert views.owner[0].tolist() == owner[CAMERA.sparse].tolist()
    assert views.depth[0] == pytest.approx(depth[CAMERA.sparse], rel=1e-4)
    assert views.need[:, 0].sum() <= 1 + 1e-6
    assert views.sight[:, 0].sum() <= 1 + 1e-6
    for t, error in zip(views.texture.tolist(), views.error, strict=True):
        assert t < 0 or error[len(made.levels[t]) + 1] == 0


def _detail(made: Room, f: int, eye: Floats, ray: Floats, axes: Floats) -> float:
    levels = made.levels[made.surfaces.texture[f]]
    size = np.array(levels[-1].shape[1::-1])
    return min(max(detail_at(made.surfaces, f, eye, ray, axes, size), 0.0), len(levels) - 1.0)


def _errors(made: Room, f: int, eye: Floats, ray: Floats, axes: Floats, point: Floats) -> Floats:
    """What a pixel is wrong by with nothing, the mean colour, level 0, level 1, …"""
    surfaces, t = made.surfaces, made.surfaces.texture[f]
    tint = surfaces.color[f]
    if t < 0:
        return np.array([np.sqrt(((GREY - 255 * tint) ** 2).mean())])
    levels = made.levels[t]
    detail = _detail(made, f, eye, ray, axes)
    at = at_point(surfaces, f, point)
    samples = [bilinear(level, at, surfaces.clamped[f]) for level in levels]
    sharp = len(levels) - 1 - int(detail)
    part = detail - int(detail)
    exact = (1 - part) * samples[sharp] + part * samples[max(sharp - 1, 0)]
    lit = [levels[0].reshape(-1, 3).mean(axis=0), *samples[:sharp]]
    shown = [np.full(3, GREY), *(color * tint for color in lit)]
    wrong = [np.sqrt(((color - exact * tint) ** 2).mean()) for color in shown]
    return np.array([*wrong, *[0.0] * (len(levels) - sharp)])


def _wants(made: Room, f: int, eye: Floats, ray: Floats, axes: Floats) -> Floats:
    """How much a pixel wants each level."""
    t = made.surfaces.texture[f]
    if t < 0:
        return np.ones(1)
    detail = _detail(made, f, eye, ray, axes)
    coarser = len(made.levels[t]) - 1 - np.arange(len(made.levels[t]))
    return np.clip(coarser + 1 - detail, 0.0, 1.0)


@given(SEEDS)
def test_levels_of_detail_against_differences(seed: int) -> None:
    random = np.random.default_rng(seed)
    surfaces = room(random).surfaces
    eye = random.uniform([1, 0.5, 1], [5, 2.5, 3])
    rays, axes = CAMERA.rays(_unit(random)[None])
    ray = rays.reshape(-1, 3)[random.integers(CAMERA.width * CAMERA.height)]
    corner, size = surfaces.corner, np.array([64, 32])
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    slopes = gradients(corner, surfaces.uv) * size[:, None]
    pixel = 2 * np.tan(CAMERA.field_of_view / 2) / LINES
    for f in range(len(corner)):
        if abs(normal[f] @ ray) < 0.05 * np.linalg.norm(normal[f]):
            continue
        actual = level_of_detail(ray, axes[0], normal[f], corner[f, 0] - eye, slopes[f], pixel)
        expected = detail_at(surfaces, f, eye, ray, axes[0], size)
        assert actual == pytest.approx(expected, abs=1e-3)


def _unit(random: np.random.Generator) -> Floats:
    actual = random.normal(size=3)
    return actual / np.linalg.norm(actual)


@given(SEEDS)
def test_what_reaches_into_the_frustum(seed: int) -> None:
    """Box by box: out is what lies wholly beyond one side, by coordinates of the screen."""
    random = np.random.default_rng(seed)
    eye, ahead = random.uniform(-2, 2, 3), _unit(random)
    angle, aspect = float(random.uniform(0.3, 2)), float(random.uniform(0.5, 2))
    frustum = Frustum(eye, ahead, angle, aspect)
    low = random.uniform(-6, 6, (30, 3))
    high = low + random.uniform(0, 4, (30, 3))
    right = np.cross(ahead, [0, 1, 0])
    right /= np.linalg.norm(right)
    up, tall = np.cross(right, ahead), np.tan(angle / 2)
    meets = frustum.meets_boxes(low, high)
    covered, distance = frustum.covered_shares(low, high), frustum.distance(low, high)
    for k in range(len(low)):
        corner = np.array(leaf(low[k], high[k])["points"]) - eye
        depth = corner @ ahead
        x, y = corner @ right / (tall * aspect), corner @ up / tall
        beyond = [x > depth, x < -depth, y > depth, y < -depth, depth < 0]
        assert meets[k] == (not any(side.all() for side in beyond))
        assert frustum.meets_hull(corner + eye) == meets[k]
        inside = random.uniform(low[k], high[k], (200, 3)) - eye
        far = inside @ ahead
        assert distance[k] <= np.linalg.norm(inside, axis=1).min() + 1e-9
        assert distance[k] >= np.linalg.norm(inside, axis=1).min() - np.linalg.norm(
            high[k] - low[k]
        )
        on_screen = (
            (far > 0)
            & (abs(inside @ right) < far * tall * aspect)
            & (abs(inside @ up) < far * tall)
        )
        assert meets[k] or not on_screen.any()
        if (depth > 0.1).all():
            ends = [np.clip(side / depth, -1, 1) for side in (x, y)]
            assert covered[k] == pytest.approx(np.prod([np.ptp(end) / 2 for end in ends]))
        elif (depth < 0.05).any():
            assert covered[k] == 1.0


@given(SEEDS)
def test_the_cell_of_each_eye(seed: int) -> None:
    """Cells of turned boxes in a row, of one or two leaves: an eye is in the one whose box it is
    in, measured along the box's own edges; and stays with the cell before where two touch."""
    random = np.random.default_rng(seed)
    axes = np.linalg.qr(random.normal(size=(3, 3)))[0]
    if np.linalg.det(axes) < 0:
        axes[0] *= -1
    bounds = np.cumsum(random.uniform(1, 3, 5))
    records = []
    for a, b in itertools.pairwise(bounds):
        middle = (a + b) / 2
        parts = [(a, b)] if random.random() < 0.5 else [(a, middle), (middle, b)]
        leaves = [leaf(np.array([p, 0, 0]), np.array([q, 2, 3])) for p, q in parts]
        for one in leaves:
            one["points"] = (np.array(one["points"]) @ axes).tolist()
        records.append({"leaves": leaves})
    local = random.uniform([bounds[0] - 1, -0.5, -0.5], [bounds[-1] + 1, 2.5, 3.5], (60, 3))
    clear = (abs(local[:, :1] - bounds) > 0.01).all(axis=1)
    local = local[clear & (abs(local[:, 1:, None] - [0, 2, 3]) > 0.01).all(axis=(1, 2))]
    inside = ((local[:, 1:] > 0) & (local[:, 1:] < [2, 3])).all(axis=1)
    inside &= (local[:, 0] > bounds[0]) & (local[:, 0] < bounds[-1])
    expected = np.where(inside, np.searchsorted(bounds, local[:, 0]) - 1, -1)
    locator = Locator(records)
    assert locator.cells_along(local @ axes).tolist() == expected.tolist()
    for start in (0, 1):
        first = np.array([bounds[start : start + 2].mean(), 1, 1])
        wall = np.array([bounds[1], 1, 1])
        assert locator.cells_along(np.array([first, wall]) @ axes).tolist() == [start, start]
