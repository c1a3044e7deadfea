"""The light of a cell: dark corners, the side that counts, what is covered, light at vertices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.building import BuildingBaking
from ptmtools.light.cells import CellLight, LightBaking
from ptmtools.light.model import CellSurfaces, coded_light
from ptmtools.light.occlusion import turns
from ptmtools.light.options import LightOptions
from ptmtools.scene.lights import Lights
from ptmtools.scene.model import Material, Scene
from ptmtools.scene.orientation.main_axes import tolerance_of
from tests.light.shapes import bilinear, indexed, quad

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

SIDE, HEIGHT = 6.0, 3.0
OPTIONS = LightOptions("bake", light_samples=64)


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


def scene_of(corner: Floats) -> Scene:
    """Faces of one material."""
    points, triangles = indexed(corner)
    count = len(corner)
    return Scene(
        points,
        triangles,
        np.zeros((count, 3, 2)),
        np.zeros(count, np.int32),
        np.zeros(count, np.int32),
        np.zeros(count, np.bool_),
        ("building",),
        (Material("wall"),),
        tolerance_of(points, triangles, 0.0),
    )


def baking_of(
    corner: Floats, pieces: CellSurfaces, lights: Lights | None = None, albedo: float = 0.5
) -> LightBaking:
    """The light of all faces, of which a cell has some."""
    grey = np.full((len(corner), 3), albedo)
    others = replace(
        piece(corner[len(pieces.corner) :]), face=np.arange(len(pieces.corner), len(corner))
    )
    shown = [pieces, others] if len(others.corner) else [pieces]
    building = BuildingBaking(scene_of(corner), shown, lights, grey).light()
    return LightBaking(OPTIONS, building, None, grey[:, 0].astype(np.float32))


def baked(corner: Floats, *, side: int = 1, around: Floats | None = None) -> CellLight:
    """The light of faces, of one object, among others."""
    others = np.zeros((0, 3, 3)) if around is None else around
    shown = piece(corner, side)
    return baking_of(np.concatenate([corner, others]), shown).light(shown)


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
    """The green light at a point of a face, as a client looks it up."""
    assert result.texels is not None
    u, v = np.array(share) @ result.uv[face].astype(np.float64)
    code = bilinear(result.texels[..., 1].astype(float), np.array([[u, 1 - v]]))[0]
    return float(coded_light(code, result.white)[0])


MIDDLE = (0.5, 0.0, 0.5)  # of the longest side: of the quad


def test_corners_are_darker_and_floors_are_brighter_than_ceilings() -> None:
    """The ceiling glows, but does not show it."""
    result = baked(room())
    assert result.mapped.all()
    assert result.lit.all()
    assert (result.vertex == 255).all()
    floor, ceiling = at(result, 0, MIDDLE), at(result, 2, MIDDLE)
    assert at(result, 0, (0.98, 0.01, 0.01)) < 0.8 * floor
    assert floor > 1.3 * ceiling


def test_a_texel_has_the_light_of_its_place() -> None:
    """Against many rays, at points that no texel is centred on."""
    corner = room()
    shown = piece(corner)
    baking = baking_of(corner, shown)
    result = baking.light(shown)
    random = np.random.default_rng(1)
    face = random.integers(0, len(corner), 300)
    share = random.dirichlet([1, 1, 1], 300)
    point = np.einsum("nk,nkx->nx", share, corner[face])
    assert baking.building
    exact = baking.building.look(corner, np.ones(len(corner)), 4096, 0.0)
    expected = exact(face, point, turns(300))[:, 1]
    actual = [at(result, int(f), tuple(s)) for f, s in zip(face, share, strict=True)]
    assert np.abs(actual / expected - 1).mean() < 0.03


def test_the_front_the_back_or_the_brighter_side() -> None:
    """A panel that stands 5 cm before a wall, under the sky."""
    panel = quad((2, 1, 0.05), (4, 1, 0.05), (4, 2, 0.05), (2, 2, 0.05))
    wall = quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0))
    front, back, either = (baked(panel, side=k, around=wall) for k in (1, -1, 0))
    turned = baked(panel[:, ::-1], side=0, around=wall)
    assert at(front, 0, MIDDLE) > 4 * at(back, 0, MIDDLE)
    assert at(either, 0, MIDDLE) == pytest.approx(at(front, 0, MIDDLE), rel=0.1)
    assert at(turned, 0, MIDDLE) == pytest.approx(at(front, 0, MIDDLE), rel=0.1)


def test_a_picture_does_not_darken_the_wall_around_it() -> None:
    """What it covers has the light of what lies beside it: a texel is wider than the gap."""
    wall = quad((0, 0, 0), (6, 0, 0), (6, 6, 0), (0, 6, 0))
    picture = quad((2, 2, 0.004), (4, 2, 0.004), (4, 4, 0.004), (2, 4, 0.004))
    covered, beside, bare = (
        at(baked(wall, around=other), 0, share)
        for other, share in ((picture, MIDDLE), (picture, (0.1, 0.6, 0.3)), (None, MIDDLE))
    )
    assert beside == pytest.approx(bare, rel=0.1)
    assert covered == pytest.approx(bare, rel=0.15)


def test_a_gap_that_is_covered_everywhere_stays_dark() -> None:
    """The back of a board 1 cm off a wall, in a bright room."""
    wall = quad((1, 1, 0.0), (3, 1, 0.0), (3, 2, 0.0), (1, 2, 0.0))
    board = quad((1, 1, 0.01), (1, 2, 0.01), (3, 2, 0.01), (3, 1, 0.01))
    shown = np.concatenate([wall, board, room()[:2] + [0, 0, 0.5]])
    result = baked(shown, around=room()[2:])
    assert at(result, 4, MIDDLE) > 10 * at(result, 2, MIDDLE)


def test_dense_objects_have_light_at_vertices() -> None:
    side = 64
    x, y = np.meshgrid(np.arange(side) / 10, np.arange(side) / 10, indexing="ij")
    grid = np.stack([x, np.zeros_like(x), y], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    halves = [np.stack(k, axis=2).reshape(-1, 3, 3) for k in ((a, b, c), (a, c, d))]
    floor = np.concatenate(halves)
    box = quad((3, 0, 3), (3, 0, 6), (3, 3, 6), (3, 3, 3))
    shown = piece(floor, dense=True)
    result = baking_of(np.concatenate([floor, box]), shown).light(shown)
    assert result.texels is None
    assert not result.mapped.any()
    assert result.lit.all()
    near = np.abs(floor[..., 0] - 3.05) < 0.1
    beside = result.vertex[near & (floor[..., 2] > 3.5)].mean()
    assert beside < 0.95 * result.vertex[floor[..., 0] < 0.1].mean()


def test_a_cell_without_surfaces() -> None:
    corner = room()
    result = baking_of(corner, piece(corner)).light(piece(np.zeros((0, 3, 3))))
    assert result.texels is None
    assert not len(result.mapped)
    assert (result.exposure, result.area) == (0, 0)
    assert not result.balance.any()


def test_light_does_not_lead_over_edges_or_to_the_other_side() -> None:
    """A wall, the lower half of which shows its front, and the upper half its dark back."""
    low = quad((0, 0, 0), (6, 0, 0), (6, 2.96, 0), (0, 2.96, 0))
    high = quad((0, 2.96, 0), (6, 2.96, 0), (6, 6, 0), (0, 6, 0))
    behind = quad((-9, -9, -0.3), (15, -9, -0.3), (15, 15, -0.3), (-9, 15, -0.3))
    corner = np.concatenate([low, high])
    faces = replace(piece(corner), side=np.array([1, 1, -1, -1], np.int8))
    result = baking_of(np.concatenate([corner, behind]), faces).light(faces)
    light = at(result, 1, MIDDLE)
    assert at(result, 2, MIDDLE) < 0.4 * light
    for share in ((0, 0.5, 0.5), (0, 0.1, 0.9), (0.01, 0.495, 0.495)):  # at the edge between them
        assert at(result, 1, share) > 0.7 * light
