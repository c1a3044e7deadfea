"""Light of several bounces: energy is kept, walls hold it, colours go along."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.arrays import Bools, Floats
from ptmtools.light.occlusion import Occluders, normals, turns
from ptmtools.light.patches import LightPatches
from ptmtools.light.transport import Daylight, LightField, transport

DARK = Daylight(np.zeros(3), np.zeros(3))
OVERCAST = Daylight(np.ones(3), np.ones(3))


def box(low: float, high: float, *, inwards: bool) -> Floats:
    """(12, 3, 3) the faces of a cube, two for each side: -x, +x, -y, +y, -z, +z."""
    faces = []
    for axis in range(3):
        for end in (low, high):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = np.full((4, 3), end)
            corners[:, u] = low, high, high, low
            corners[:, v] = low, low, high, high
            if (end == high) == inwards:
                corners = corners[::-1]
            faces += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
    return np.array(faces)


def occluders(corner: Floats, ground: float = -1e3) -> Occluders:
    points = corner.reshape(-1, 3)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    triangles = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    size = float(np.ptp(points, axis=0).max())
    return Occluders(points, triangles, middle, ground, 1e-6 * size)


def field_of(
    corner: Floats, albedo: Floats | float, direct: float, daylight: Daylight, size: float
) -> LightField:
    lit: Bools = np.ones((len(corner), 2), np.bool_)
    patches = LightPatches.of_faces(corner, lit, size)
    colors = np.broadcast_to(albedo, (len(corner), 3)).astype(float)
    light = np.full((patches.count, 3), direct)
    return transport(occluders(corner), patches, colors, light, daylight)


def light_on(field: LightField, face: int, samples: int = 256) -> Floats:
    """The mean light on the front of a face, (3,)."""
    share = np.random.default_rng(1).dirichlet((1, 1, 1), 200)
    point = share @ field.patches.corner[face]
    normal = np.repeat(normals(field.patches.corner[[face]]), len(point), axis=0)
    light, _, _ = field.gather(point, normal, turns(len(point)), samples, 0.0)
    return np.asarray(light.mean(axis=0, dtype=np.float64))


@pytest.mark.parametrize("albedo", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_furnace_is_in_balance(albedo: float, scale: float) -> None:
    corner = scale * box(-1, 1, inwards=True)
    field = field_of(corner, albedo, 1.0, DARK, 0.4 * scale)
    assert light_on(field, 0) == pytest.approx(albedo / (1 - albedo), rel=0.02)


def test_the_sky_lights_a_convex_body_evenly() -> None:
    field = field_of(box(-1, 1, inwards=False), 0.5, 0.0, OVERCAST, 0.5)
    assert light_on(field, 6) == pytest.approx(1.0, rel=1e-6)


def test_walls_of_five_centimetres_keep_the_sky_out() -> None:
    inside, outside = box(-1, 1, inwards=True), box(-1.05, 1.05, inwards=False)
    field = field_of(np.concatenate([inside, outside]), 0.9, 0.0, OVERCAST, 0.2)
    assert light_on(field, 4).max() == 0


def test_a_red_wall_reddens_the_floor() -> None:
    corner, albedo = box(-1, 1, inwards=True), np.full((12, 3), 0.5)
    albedo[:2] = 0.5, 0.1, 0.1
    red, green, blue = light_on(field_of(corner, albedo, 1.0, DARK, 0.2), 4)
    white = light_on(field_of(corner, 0.5, 1.0, DARK, 0.2), 4)[0]
    # The wall fills a fifth of what the floor sees, and its missing light comes back less often.
    assert red == pytest.approx(white, rel=0.02)
    assert 0.6 * white < green < 0.9 * white
    assert green == pytest.approx(blue, rel=1e-6)


def test_white_surfaces_do_not_keep_all_light() -> None:
    field = field_of(box(-1, 1, inwards=True), 1.0, 1.0, DARK, 0.5)
    assert np.isfinite(field.radiance).all()
    assert light_on(field, 0).max() < 25


def test_nothing_but_the_sky() -> None:
    field = field_of(box(-1, 1, inwards=False), 0.5, 0.0, OVERCAST, 1.0)
    around = Occluders(field.around.points, field.around.triangles[:0], np.zeros(3), 0.0, 1e-6)
    empty = LightField(around, field.patches, field.radiance, Daylight(np.ones(3), np.zeros(3)))
    point, up = np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]])
    assert empty.gather(point, up, np.zeros(1), 16, 0.0)[0].tolist() == [[1.0, 1.0, 1.0]]
    assert empty.gather(point, -up, np.zeros(1), 16, 0.0)[0].tolist() == [[0.0, 0.0, 0.0]]


def test_points_that_are_covered_are_noticed() -> None:
    sheet = np.array([[[-1, 0.01, -1], [-1, 0.01, 1], [1, 0.01, 1]]], float)
    corner = np.concatenate([box(-1, 1, inwards=False) - [0, 1, 0], sheet])
    field = field_of(corner, 0.5, 0.0, OVERCAST, 0.5)
    under, beside = np.array([[-0.5, 0.0, 0.5]]), np.array([[0.5, 0.0, -0.5]])
    up = np.array([[0.0, 1.0, 0.0]])
    shares = [field.gather(point, up, np.zeros(1), 64, 0.05)[1][0] for point in (under, beside)]
    assert shares[0] > 0.8
    assert shares[1] < 0.3


def test_patches_find_their_points_again() -> None:
    rng = np.random.default_rng(2)
    corner = rng.normal(size=(20, 3, 3)) * rng.uniform(0.1, 5, (20, 1, 1))
    patches = LightPatches.of_faces(corner, rng.random((20, 2)) < 0.7, 0.3)
    face, side, number = patches.faces()
    point = patches.points(face, number, rng.random(len(face)), rng.random(len(face)))
    normal = normals(corner)[face] * np.where(side == 0, 1.0, -1.0)[:, None]
    field = LightField(
        occluders(corner), patches, np.arange(3.0 * len(face), dtype=np.float32).reshape(-1, 3),
        DARK,
    )  # fmt: skip
    # A ray from just before a point meets its patch.
    along = np.asarray(-normal, np.float32)
    start = (point + 1e-4 * normal - field.around.middle).astype(np.float32)
    hit = field.around.tree.run(start, along, output=True)
    met = (hit["primID"] == face) & (hit["tfar"] < 2e-4)
    assert met.mean() > 0.9
    light, _, _ = field._receive(start, along, 1, 0.0)
    assert (light[met] == field.radiance[met]).all(axis=1).mean() > 0.995
