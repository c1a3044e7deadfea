"""The light of a cell: dark corners, the side that counts, what is covered, light at vertices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.cells import ABOVE, CellLight, LightBaking, encode, expose
from ptmtools.light.lightmap import vertex_light
from ptmtools.light.looks import RayLight
from ptmtools.light.model import CellSurfaces
from ptmtools.light.occlusion import light, normals, turns
from ptmtools.light.options import LightOptions
from tests.light.shapes import bilinear, quad, surroundings

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

SIDE, HEIGHT = 6.0, 3.0


def room() -> Floats:
    """The floor, the ceiling and the walls of a room, wound inwards: pairs of triangles."""
    s, h = SIDE, HEIGHT
    corner = [(0, 0), (s, 0), (s, s), (0, s)]
    walls = []
    for (a, b), (c, d) in zip(corner, corner[1:] + corner[:1], strict=True):
        walls.append(quad((a, 0, b), (c, 0, d), (c, h, d), (a, h, b)))
    floor = quad((0, 0, 0), (0, 0, s), (s, 0, s), (s, 0, 0))
    ceiling = quad((0, h, 0), (s, h, 0), (s, h, s), (0, h, s))
    return np.concatenate([floor, ceiling, *walls])


def baked(corner: Floats, *, side: int = 1, around: Floats | None = None) -> CellLight:
    """The light of faces, of one object, among others."""
    others = np.zeros((0, 3, 3)) if around is None else around
    baking = LightBaking(surroundings(corner, others), LightOptions("bake", light_samples=256))
    return baking.light(piece(corner, side))


def piece(corner: Floats, side: int = 1, *, dense: bool = False) -> CellSurfaces:
    count = len(corner)
    zeros = np.zeros(count, np.int64)
    return CellSurfaces(
        corner.astype(np.float32),
        zeros,
        zeros,
        np.zeros(count, np.bool_),
        np.full(count, dense),
        np.full(count, side, np.int8),
        np.arange(count),
    )


def at(result: CellLight, face: int, share: tuple[float, float, float]) -> float:
    """The light at a point of a face, as a client looks it up."""
    assert result.texels is not None
    u, v = np.array(share) @ result.uv[face].astype(np.float64)
    return float(bilinear(result.texels / 255, np.array([[u, 1 - v]]))[0][0])


MIDDLE = (0.5, 0.0, 0.5)  # of the longest side: of the quad


def test_corners_are_dark_and_floors_are_brighter_than_ceilings() -> None:
    result = baked(room())
    assert result.mapped.all()
    assert (result.vertex == 255).all()
    floor, ceiling = at(result, 0, MIDDLE), at(result, 2, MIDDLE)
    assert at(result, 0, (0.98, 0.01, 0.01)) < 0.75 * floor
    assert floor > ceiling + 0.1


def test_a_texel_has_the_light_of_its_place() -> None:
    """Against many rays, at points that no texel is centred on."""
    corner = room()
    result = baked(corner)
    random = np.random.default_rng(1)
    face = random.integers(0, len(corner), 300)
    share = random.dirichlet([1, 1, 1], 300)
    point = np.einsum("nk,nkx->nx", share, corner[face])
    around = surroundings(corner)
    expected = light(around, point, normals(corner)[face], turns(300), 4096, 3.0, ABOVE)
    actual = [at(result, int(f), tuple(s)) for f, s in zip(face, share, strict=True)]
    assert np.abs(expose(expected) - actual).mean() < 0.02


def test_the_front_the_back_or_the_more_open_side() -> None:
    """A panel that stands 5 cm before a wall."""
    panel = quad((2, 1, 0.05), (4, 1, 0.05), (4, 2, 0.05), (2, 2, 0.05))
    wall = quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0))
    front, back, either = (baked(panel, side=k, around=wall) for k in (1, -1, 0))
    turned = baked(panel[:, ::-1], side=0, around=wall)
    assert at(front, 0, MIDDLE) > 4 * at(back, 0, MIDDLE)
    assert at(either, 0, MIDDLE) == pytest.approx(at(front, 0, MIDDLE), abs=0.03)
    assert at(turned, 0, MIDDLE) == pytest.approx(at(front, 0, MIDDLE), abs=0.03)


def test_a_picture_does_not_darken_the_wall_around_it() -> None:
    """What it covers has the light of what lies beside it: a texel is wider than the gap."""
    wall = quad((0, 0, 0), (6, 0, 0), (6, 6, 0), (0, 6, 0))
    picture = quad((2, 2, 0.004), (4, 2, 0.004), (4, 4, 0.004), (2, 4, 0.004))
    covered, beside, bare = (
        at(baked(wall, around=other), 0, share)
        for other, share in ((picture, MIDDLE), (picture, (0.1, 0.6, 0.3)), (None, MIDDLE))
    )
    assert beside == pytest.approx(bare, abs=0.05)
    assert covered == pytest.approx(bare, abs=0.08)


def test_dense_objects_have_light_at_vertices() -> None:
    side = 64
    x, y = np.meshgrid(np.arange(side) / 10, np.arange(side) / 10, indexing="ij")
    grid = np.stack([x, np.zeros_like(x), y], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    halves = [np.stack(k, axis=2).reshape(-1, 3, 3) for k in ((a, b, c), (a, c, d))]
    floor = np.concatenate(halves)
    box = quad((3, 0, 3), (3, 0, 6), (3, 3, 6), (3, 3, 3))
    around, options = surroundings(floor, box), LightOptions("bake")
    result = LightBaking(around, options).light(piece(floor, dense=True))
    assert result.texels is None
    assert not result.mapped.any()
    near = np.abs(floor[..., 0] - 3.05) < 0.1
    assert result.vertex[near & (floor[..., 2] > 3.5)].mean() < 200
    assert result.vertex[floor[..., 0] < 0.1].mean() > 230
    half = RayLight(around, floor, options.light_samples // 2, options.light_reach, above=ABOVE)
    assert (result.vertex == encode(vertex_light(half, floor, normals(floor)))).all()


def test_a_cell_without_surfaces() -> None:
    result = LightBaking(surroundings(room()), LightOptions("bake")).light(
        piece(np.zeros((0, 3, 3)))
    )
    assert result.texels is None
    assert not len(result.mapped)


def test_light_does_not_lead_over_edges_or_to_the_other_side() -> None:
    """A wall, the lower half of which shows its front, and the upper half its dark back."""
    low = quad((0, 0, 0), (6, 0, 0), (6, 2.96, 0), (0, 2.96, 0))
    high = quad((0, 2.96, 0), (6, 2.96, 0), (6, 6, 0), (0, 6, 0))
    behind = quad((-9, -9, -0.3), (15, -9, -0.3), (15, 15, -0.3), (-9, 15, -0.3))
    corner = np.concatenate([low, high])
    faces = replace(piece(corner), side=np.array([1, 1, -1, -1], np.int8))
    baking = LightBaking(surroundings(corner, behind), LightOptions("bake", light_samples=256))
    result = baking.light(faces)
    assert at(result, 2, MIDDLE) < 0.4
    for share in ((0, 0.5, 0.5), (0, 0.1, 0.9), (0.01, 0.495, 0.495)):  # at the edge between them
        assert at(result, 1, share) > 0.7
