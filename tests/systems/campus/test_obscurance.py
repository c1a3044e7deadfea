"""Light by rays, against what can be computed by hand."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.light.looks import planes
from ptmtools.light.occlusion import Occluders, hemisphere, normals, turns
from ptmtools_systems.campus.obscurance import RayLight, light, open_sides
from tests.light.shapes import prism, quad

UP = np.array([[0.0, 1, 0]])
#: So far away that it counts as infinite, metres.
FAR = 1e4


def around(*parts: Floats, ground: float = -1.0) -> Occluders:
    corner = np.concatenate(parts) if parts else np.zeros((0, 3, 3))
    triangles = np.arange(3 * len(corner), dtype=np.int32).reshape(-1, 3)
    return Occluders(corner.reshape(-1, 3), triangles, np.zeros(3), ground, 1e-4)


def seen(where: Occluders, point: object, normal: Floats = UP, reach: float = inf) -> float:
    at = np.array([point], float)
    return float(light(where, at, normal, np.zeros(1), 4096, reach)[0])


FLOOR = quad((-FAR, 0, -FAR), (-FAR, 0, FAR), (FAR, 0, FAR), (FAR, 0, -FAR))


def test_an_endless_plane_is_white() -> None:
    assert seen(around(FLOOR), (1, 0, 2)) == 1.0
    assert seen(around(), (1, 0, 2)) == 1.0


@pytest.mark.parametrize(("distance", "height"), [(1, 1), (3, 2), (0.5, 8), (2, FAR)])
def test_before_a_wall(distance: float, height: float) -> None:
    """The form factor of an endless wall: (1 − d / √(d² + h²)) / 2."""
    wall = quad((0, 0, -FAR), (0, height, -FAR), (0, height, FAR), (0, 0, FAR))
    actual = seen(around(FLOOR, wall), (distance, 0, 0))
    assert actual == pytest.approx((1 + distance / sqrt(distance**2 + height**2)) / 2, abs=0.005)


def test_a_wall_sees_the_ground_with_half_of_its_rays() -> None:
    out = np.array([[1.0, 0, 0]])
    assert seen(around(ground=0.0), (0, 5, 0), out) == pytest.approx(0.5, abs=0.005)
    # The ground is so far below that it does not count.
    assert seen(around(ground=-100.0), (0, 5, 0), out, reach=20) == pytest.approx(1, abs=0.001)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_under_a_ceiling(share: float) -> None:
    """Obscurance under an endless ceiling at r · reach: 2 r − r²."""
    reach = 10.0
    high = share * reach
    ceiling = quad((-FAR, high, -FAR), (FAR, high, -FAR), (FAR, high, FAR), (-FAR, high, FAR))
    actual = seen(around(FLOOR, ceiling), (0, 0, 0), reach=reach)
    assert actual == pytest.approx(2 * share - share**2, abs=0.005)
    assert seen(around(FLOOR, ceiling), (0, 0, 0)) == 0.0


def test_a_point_under_a_roof_is_darker() -> None:
    roof = quad((-2, 3, -2), (2, 3, -2), (2, 3, 2), (-2, 3, 2))
    where = around(FLOOR, roof)
    under, beside, away = (seen(where, (x, 0, 0), reach=20) for x in (0, 3, 30))
    assert under < beside < away
    assert away > 0.99


def test_the_lighter_side_counts() -> None:
    """A sheet just above a floor, wound so that its front looks down, and one of mixed winding."""
    sheet = quad((-1, 0.1, -1), (1, 0.1, -1), (1, 0.1, 1), (-1, 0.1, 1))
    assert (normals(sheet)[:, 1] < 0).all()
    where = around(FLOOR, sheet)
    assert open_sides(where, sheet, np.ones(2, bool), 20.0).tolist() == [-1, -1]
    assert open_sides(where, sheet, np.zeros(2, bool), 20.0).tolist() == [1, 1]
    mixed = np.stack([sheet[0, ::-1], sheet[1]])
    assert open_sides(where, mixed, np.ones(2, bool), 20.0).tolist() == [1, -1]
    face, point = np.array([0]), sheet[0].mean(axis=0)[None]
    for side, least, most in ((-1.0, 0.9, 1.0), (1.0, 0.0, 0.2)):
        actual = RayLight(where, sheet, 64, 20.0, side=side)(face, point, np.zeros(1))[0, 0]
        assert least <= actual <= most


def test_a_court_is_outside_however_light_the_halls_around_it_are() -> None:
    """Wings of 30 m around a shaft of 2 m, 20 m high, under a roof with a hole."""
    outer, inner = prism(-31, -31, 62, 62, 20), prism(-1, -1, 2, 2, 20)
    ring = [
        quad((x, 20, z), (x, 20, z + d), (x + w, 20, z + d), (x + w, 20, z))
        for x, z, w, d in ((-31, -31, 62, 30), (-31, 1, 62, 30), (-31, -1, 30, 2), (1, -1, 30, 2))
    ]
    walls = np.concatenate([outer, inner])
    floor = np.concatenate([FLOOR, *ring])
    where = around(floor, walls, ground=0.0)
    middle = inner.mean(axis=1)
    lights = [
        light(where, middle, way, np.zeros(8), 256, 20.0).mean()
        for way in (normals(inner), -normals(inner))
    ]
    assert lights[0] > lights[1], "the hall is lighter"
    actual = open_sides(where, walls, np.ones(16, bool), 20.0)
    assert actual.tolist() == [1] * 8 + [-1] * 8


def test_within_a_closed_house_the_lighter_side_counts() -> None:
    """A partition near a wall."""
    house = np.concatenate(
        [prism(0, 0, 20, 10, 3), quad((0, 3, 0), (0, 3, 10), (20, 3, 10), (20, 3, 0))]
    )
    partition = quad((0.2, 0, 0), (0.2, 0, 10), (0.2, 3, 10), (0.2, 3, 0))
    assert (normals(partition)[:, 0] < 0).all()
    where = around(FLOOR, house, partition, ground=0.0)
    assert open_sides(where, partition, np.ones(2, bool), 20.0).tolist() == [-1, -1]


def test_planes_are_connected_by_edges() -> None:
    """Two quads in a row, one turned away from them, and one apart; a face of one side is alone."""
    corner = np.concatenate(
        [
            quad((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)),
            quad((1, 0, 0), (2, 0, 0), (2, 0, 1), (1, 0, 1)),
            quad((2, 0, 0), (2, 0, 1), (2, 1, 1), (2, 1, 0)),
            quad((5, 0, 0), (6, 0, 0), (6, 0, 1), (5, 0, 1)),
        ]
    )
    every = planes(corner, normals(corner), np.ones(8, bool))
    assert every.tolist() == [0, 0, 0, 0, 4, 4, 6, 6]
    some = planes(corner, normals(corner), np.arange(8) != 2)
    assert some[2] == 2


def test_a_coarse_face_beneath_the_surface_has_its_light() -> None:
    """The faces of a coarse dome lie within the dome."""
    sheet = quad((-1, -0.2, -1), (-1, -0.2, 1), (1, -0.2, 1), (1, -0.2, -1))
    assert (normals(sheet)[:, 1] > 0).all()
    where = around(FLOOR)
    face, point = np.array([0]), sheet[0].mean(axis=0)[None]
    assert RayLight(where, sheet, 64, 20.0)(face, point, np.zeros(1))[0, 0] < 0.2
    assert RayLight(where, sheet, 64, 20.0, 0.3)(face, point, np.zeros(1))[0, 0] == 1.0


def test_sight_ends_at_what_is_before_it() -> None:
    wall = quad((0, 0, -1), (0, 2, -1), (0, 2, 1), (0, 0, 1))
    where = around(FLOOR, wall)
    eye = np.array([[5.0, 1, 0], [5, 1, 0], [5, 1, 0], [-5, 1, 0]])
    target = np.array([[0.0, 1, 0], [-0.05, 1, 0], [-3, 1, 5], [-3, 1, 0]])
    assert where.free(eye, target).tolist() == [True, False, True, True]


def test_directions_are_in_proportion_to_the_cosine() -> None:
    fan = hemisphere(1024).astype(float)
    assert np.allclose(np.linalg.norm(fan, axis=1), 1, atol=1e-6)
    assert (fan[:, 2] > 0).all()
    assert fan[:, 2].mean() == pytest.approx(2 / 3, abs=0.002)
    assert np.abs(fan[:, :2].mean(axis=0)).max() < 0.01
    assert len(np.unique(turns(100).round(3))) == 100


def test_far_from_the_origin_it_is_the_same() -> None:
    wall = quad((0, 0, -50), (0, 4, -50), (0, 4, 50), (0, 0, 50))
    floor = quad((-50, 0, -50), (-50, 0, 50), (50, 0, 50), (50, 0, -50))
    corner = np.concatenate([floor, wall])
    triangles = np.arange(12, dtype=np.int32).reshape(-1, 3)
    actual = []
    for shift in (0.0, 1e7):
        moved = corner.reshape(-1, 3) + shift
        where = Occluders(moved, triangles, np.full(3, shift), shift - 1, 1e-4)
        at = np.array([[1.0, 0, 0]]) + shift
        actual.append(float(light(where, at, UP, np.zeros(1), 1024, inf)[0]))
    assert actual[0] == pytest.approx(actual[1], abs=0.01)
