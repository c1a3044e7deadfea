"""Atlases and lightmaps: kernels against plain loops, known scenes, what larger ones take over."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.arrays import Floats
from ptmtools.campus.atlas import claim, components, cover, nearest, unwrap
from ptmtools.campus.lightmap import AGREE, bake, fill
from ptmtools.campus.lights import LightImage, Painted, Rays
from ptmtools.campus.occlusion import Surroundings, normals
from ptmtools.campus.vertex_light import vertex_light
from ptmtools.scene.source import SourceWrap
from tests.campus.made import house, level

pytest.importorskip("xatlas", reason="pip install 'ptmtools[campus]'")


def triangles_of(rows: Floats) -> Floats:
    """(2 n, 3, 3) of the (4 n, 5) corners of quads."""
    quads = rows[:, :3].reshape(-1, 4, 3)
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)


HOUSE = triangles_of(np.concatenate(list(house(0, 0, 12, 8, 9, 2).values())))
GROUND = triangles_of(level((-30, -30), (40, 40), 0))


def indexed(corner: Floats) -> tuple[Floats, np.ndarray]:
    points, place = np.unique(corner.reshape(-1, 3), axis=0, return_inverse=True)
    return points, place.reshape(-1, 3).astype(np.int32)


def surroundings(*parts: Floats) -> Surroundings:
    points, triangles = indexed(np.concatenate(parts))
    return Surroundings(points, triangles, points.mean(axis=0), 0.0, 1e-4)


@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_cover_is_a_test_of_every_texel(seed: int, faces: int) -> None:
    uv = np.random.default_rng(seed).random((faces, 3, 2))
    size = 16
    wanted = np.full((size, size), -1)
    for row, column in np.ndindex(size, size):
        at = np.array([column + 0.5, size - row - 0.5]) / size
        for t in range(faces):
            sides = [
                np.linalg.det([b - a, at - a])
                for a, b in zip(uv[t], np.roll(uv[t], -1, 0), strict=True)
            ]
            if min(sides) > 1e-12 or max(sides) < -1e-12:
                wanted[row, column] = t
                break
    assert (cover(uv, size) == wanted).mean() > 0.99


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_components_are_those_of_a_flood(seed: int, faces: int) -> None:
    triangle = np.random.default_rng(seed).integers(0, 25, (faces, 3))
    label = np.arange(25)
    for _ in range(25):
        for t in triangle:
            label[t] = label[t].min()
    assert np.array_equal(components(triangle, 25), label)


def test_an_atlas_gives_each_face_a_place_of_its_own() -> None:
    points, triangles = indexed(HOUSE)
    atlas = unwrap(points, triangles)
    assert atlas.side == 512
    assert atlas.uv.shape == (len(triangles), 3, 2)
    assert ((atlas.uv >= 0) & (atlas.uv <= 1)).all()
    owner = cover(atlas.uv, 512)
    a, b, c = np.moveaxis(atlas.uv * 512, 1, 0)
    area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    held = np.bincount(owner[owner >= 0], minlength=len(triangles))
    assert np.allclose(held, area, rtol=0.1, atol=40), "faces lie over each other"
    assert (owner >= 0).mean() > 0.3


def test_texels_are_as_large_as_the_surface_everywhere() -> None:
    points, triangles = indexed(HOUSE)
    uv = unwrap(points, triangles).uv
    lengths = np.linalg.norm(HOUSE - np.roll(HOUSE, 1, axis=1), axis=2)
    drawn = np.linalg.norm(uv - np.roll(uv, 1, axis=1), axis=2)
    ratio = drawn / lengths
    assert ratio.max() / ratio.min() < 1.1


def loose(count: int) -> Floats:
    """(count, 3, 3) faces without neighbours, of all sizes."""
    random = np.random.default_rng(1)
    size = 10 ** random.uniform(-1, 1.5, (count, 1, 1))
    return random.random((count, 1, 3)) * 1000 + size * random.random((count, 3, 3))


def ledges(count: int) -> Floats:
    """A wall with shelves of 3 cm by 6 m, of which all faces are loose."""
    parts = [[[0, 0, 0], [6, 0, 0], [6, 8, 0], [0, 8, 0]]]
    for k in range(count):
        y = 0.5 + 0.1 * k
        for low, high, back in ((y, y, 0.0), (y + 0.03, y + 0.03, 0.0), (y, y + 0.03, 0.03)):
            quad = [[0, low, 0.03], [6, low, 0.03], [6, high, back], [0, high, back]]
            parts.append(quad if low != y or high != y else quad[::-1])
    quads = np.array(parts, float)
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)


def bilinear(texels: Floats, at: Floats) -> tuple[Floats, np.ndarray, Floats]:
    """(n,) as a client finds it; (n, 4) what is read, by row and column, and its weights."""
    size = len(texels)
    place = at * size - 0.5
    first = np.floor(place).astype(int)
    read, weights = [], []
    for right in (0, 1):
        for below in (0, 1):
            column, row = (first + [right, below]).T.clip(0, size - 1)
            weight = np.abs(1 - right - (place - first)[:, 0])
            weight = weight * np.abs(1 - below - (place - first)[:, 1])
            weights.append(weight)
            read.append(row * size + column)
    index, share = np.stack(read, axis=1), np.stack(weights, axis=1)
    return (share * texels.ravel()[index]).sum(axis=1), index, share


def samples(corner: Floats, uv: Floats, count: int) -> tuple[np.ndarray, Floats, Floats]:
    """Faces, points on them, and their coordinates from the upper left."""
    random = np.random.default_rng(5)
    face = random.integers(0, len(corner), count)
    share = random.dirichlet([1, 1, 1], count)
    point, at = (np.einsum("nk,nkx->nx", share, held[face]) for held in (corner, uv))
    return face, point, at * [1, -1] + [0, 1]


@pytest.mark.parametrize("size", [512, 1024, 2048])
@pytest.mark.parametrize(
    "corner", [loose(3000), HOUSE, ledges(40)], ids=["loose", "house", "ledges"]
)
def test_every_face_reads_its_own_chart_alone(corner: Floats, size: int) -> None:
    """However thin it is."""
    atlas = unwrap(*indexed(corner))
    assert atlas.side == 512
    owner = claim(atlas.uv, cover(atlas.uv, size)).ravel()
    face, _, at = samples(corner, atlas.uv, 20_000)
    _, read, weight = bilinear(np.zeros((size, size)), at)
    stranger = (owner[read] < 0) | (atlas.chart[owner[read]] != atlas.chart[face][:, None])
    assert ((weight * stranger).sum(axis=1) > 0.01).mean() < 0.005


def test_thin_faces_show_their_own_light() -> None:
    """The undersides of shelves are dark, their tops are light."""
    corner = ledges(40)
    atlas = unwrap(*indexed(corner))
    where = surroundings(corner, GROUND)
    face, point, at = samples(corner, atlas.uv, 4000)
    light = Rays.of(where, corner, 256, 0.2)
    wanted = light(face, point, np.zeros(len(face)))
    assert np.ptp(wanted) > 0.5
    for found, most in zip(bake(light, corner, atlas), (0.08, 0.04, 0.03), strict=True):
        assert (np.abs(bilinear(found.value, at)[0] - wanted) > 0.1)[face >= 2].mean() < most


@given(st.integers(0, 2**32 - 1), st.integers(1, 8))
def test_what_a_face_reads_is_claimed_by_the_nearest(seed: int, faces: int) -> None:
    random = np.random.default_rng(seed)
    uv = random.random((faces, 1, 2)) + 10 ** random.uniform(-4, 0, (faces, 1, 1)) * (
        random.random((faces, 3, 2)) - 0.5
    )
    uv, size = uv.clip(0, 1), 16
    centre = cover(uv, size)
    owner = claim(uv, centre)
    assert np.array_equal(owner[centre >= 0], centre[centre >= 0])
    face, _, at = samples(np.zeros((faces, 3, 3)), uv, 400)
    _, read, _ = bilinear(np.zeros((size, size)), at)
    assert (owner.ravel()[read] >= 0).all()
    # Of the faces that read a texel its own is the nearest.
    texel = np.stack([read % size, size - 1 - read // size], axis=2) + 0.5
    flat, reader = texel.reshape(-1, 2) / size, np.repeat(face, 4)
    ours, theirs = (
        np.linalg.norm(np.einsum("nk,nkx->nx", nearest(uv[f], flat), uv[f]) - flat, axis=1)
        for f in (owner.ravel()[read].ravel(), reader)
    )
    assert (ours <= theirs + 1e-9).all()


@given(st.integers(0, 2**32 - 1))
def test_the_nearest_point_of_a_triangle(seed: int) -> None:
    random = np.random.default_rng(seed)
    uv, at = random.random((1, 3, 2)), 3 * random.random((1, 2)) - 1
    share = nearest(uv, at)
    assert share.min() >= 0
    assert share.sum() == pytest.approx(1)
    others = random.dirichlet([0.5, 0.5, 0.5], 500)
    far = np.linalg.norm(share @ uv[0] - at)
    assert far <= np.linalg.norm(others @ uv[0] - at, axis=1).min() + 1e-9


def test_too_many_charts_for_the_least_lightmap(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousands of loose faces, in small lightmaps."""
    monkeypatch.setattr("ptmtools.campus.atlas.LIGHT_SIZES", (64, 128))
    assert unwrap(*indexed(loose(3000))).side != 64


def test_a_long_object_has_its_gaps_in_every_lightmap() -> None:
    quads = [level((5 * i, 0), (5 * i + 5, 3), 0) for i in range(40)]
    points, triangles = indexed(triangles_of(np.concatenate(quads)))
    assert unwrap(points, triangles).side == 512


def test_a_lightmap_of_a_house_on_the_ground() -> None:
    points, triangles = indexed(HOUSE)
    atlas = unwrap(points, triangles)
    where = surroundings(HOUSE, GROUND)
    look = Rays.of(where, HOUSE, 64, 20.0)
    maps = bake(look, HOUSE, atlas)
    assert [len(m.value) for m in maps] == [512, 1024, 2048]
    normal = normals(HOUSE)
    owner = cover(atlas.uv, 512)
    value = maps[0].value
    assert value.min() >= 0
    assert value.max() <= 1
    roof = np.flatnonzero(normal[:, 1] > 0.9)
    assert value[np.isin(owner, roof)].min() > 0.99, "the roof is in the open"
    low = np.flatnonzero((normal[:, 1] < 0.1) & (HOUSE[..., 1].max(axis=1) < 5))
    high = np.flatnonzero((normal[:, 1] < 0.1) & (HOUSE[..., 1].min(axis=1) > 4))
    assert value[np.isin(owner, low)].mean() < value[np.isin(owner, high)].mean() - 0.05


def test_larger_lightmaps_are_nearly_what_rays_say_everywhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    points, triangles = indexed(HOUSE)
    atlas = unwrap(points, triangles)
    where = surroundings(HOUSE, GROUND)
    look = Rays.of(where, HOUSE, 64, 20.0)
    (taken,) = bake(look, HOUSE, atlas, (512,))

    def nothing(
        value: object, chart: object, centred: object, larger: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(larger.shape, np.float32), np.zeros(larger.shape, np.bool_)

    monkeypatch.setattr("ptmtools.campus.lightmap._enlarged", nothing)
    (whole,) = bake(look, HOUSE, atlas, (512,))
    assert whole.computed == whole.covered
    assert taken.computed < 0.05 * whole.computed
    error = np.abs(taken.value - whole.value)[cover(atlas.uv, 512) >= 0]
    assert np.sqrt((error**2).mean()) < AGREE / 10
    assert error.max() < AGREE


def test_no_row_of_texels_lies_in_the_ground() -> None:
    """The lower edge of a wall that stands on it."""
    points, triangles = indexed(HOUSE)
    atlas = unwrap(points, triangles)
    where = surroundings(HOUSE, GROUND)
    look = Rays.of(where, HOUSE, 64, 20.0)
    (found,) = bake(look, HOUSE, atlas, (512,))
    assert found.value.min() > 0.4


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 40))
def test_gaps_take_what_is_near(seed: int, height: int, width: int) -> None:
    random = np.random.default_rng(seed)
    value = random.random((height, width)).astype(np.float32)
    known = random.random((height, width)) < 0.2
    found = fill(value, known)
    assert np.array_equal(found[known], value[known])
    if known.any():
        assert found.min() >= value[known].min() - 1e-6
        assert found.max() <= value[known].max() + 1e-6
    else:
        assert (found == 1).all()


def test_a_gap_has_the_value_of_its_own_side() -> None:
    value = np.zeros((32, 32), np.float32)
    known = np.zeros((32, 32), bool)
    known[:, :12] = known[:, 20:] = True
    value[:, 20:] = 1
    found = fill(value, known)
    assert (found[:, 12:14] == 0).all()
    assert (found[:, 18:20] == 1).all()


def test_vertices_carry_the_light_of_their_faces() -> None:
    """On a plane whose light is linear the fit is exact; noise is averaged."""
    corner = triangles_of(level((0, 0), (10, 10), 0))

    def look(face: object, point: Floats, turn: object) -> Floats:
        return np.asarray(point[:, 0] / 10, np.float32)

    found = vertex_light(look, corner, normals(corner))
    assert np.allclose(found, corner[..., 0] / 10, atol=0.06)


def test_a_corner_does_not_blacken_its_faces() -> None:
    where = surroundings(HOUSE, GROUND)
    look = Rays.of(where, HOUSE, 64, 20.0)
    found = vertex_light(look, HOUSE, normals(HOUSE))
    roof = normals(HOUSE)[:, 1] > 0.9
    assert found[roof].min() > 0.95
    assert found.min() > 0.2


def test_the_models_own_light_is_looked_up() -> None:
    corner = triangles_of(level((0, 0), (10, 10), 0))
    uv = np.stack([corner[..., 0] / 10, corner[..., 2] / 10], axis=2)
    image = LightImage(np.tile(np.linspace(0, 255, 64).astype(np.uint8), (64, 1)), CLAMPED)
    look = Painted(corner, uv, np.zeros(2, np.int32), (image,), np.arange(2))
    point = np.array([[2.0, 0, 3], [8, 0, 7]])
    face = np.array([1 if z > x else 0 for x, _, z in point])
    found = look(face, point, np.zeros(2))
    assert np.allclose(found, [0.2, 0.8], atol=0.02)
    white = Painted(corner, uv, np.full(2, -1, np.int32), (image,), np.arange(2))
    assert (white(face, point, np.zeros(2)) == 1).all()


CLAMPED: tuple[SourceWrap, SourceWrap] = ("clamp", "clamp")


@pytest.mark.parametrize(
    ("wrap", "wanted"),
    [("repeat", [0, 1, 0, 1]), ("clamp", [0, 1, 1, 1]), ("mirror", [0, 1, 1, 0])],
)
def test_the_models_own_light_goes_on_as_its_sampler_says(
    wrap: SourceWrap, wanted: list[float]
) -> None:
    """A half dark image, looked up in four halves, along either axis."""
    texels = np.zeros((8, 8), np.uint8)
    texels[:, 4:] = 255
    corner = triangles_of(level((0, 0), (10, 10), 0))
    point = np.array([[1.25, 0, 1.25], [3.75, 0, 1.25], [6.25, 0, 1.25], [8.75, 0, 1.25]])
    for axis, image in ((0, texels), (2, texels.T[::-1])):
        uv = corner[..., [0, 2]] / 5
        look = Painted(
            corner, uv, np.zeros(2, np.int32), (LightImage(image, (wrap, wrap)),), np.arange(2)
        )
        at = point if axis == 0 else point[:, ::-1]
        assert look(_face_of(corner, at), at, np.zeros(4)).tolist() == wanted


def _face_of(corner: Floats, point: Floats) -> np.ndarray:
    """Which of two triangles of a square a point is nearer to the middle of."""
    far = np.linalg.norm(point[:, None] - corner.mean(axis=1), axis=2)
    return np.asarray(far.argmin(axis=1))


def test_a_weaker_light_is_nearer_to_white() -> None:
    corner = triangles_of(level((0, 0), (10, 10), 0))
    image = LightImage(np.zeros((2, 2), np.uint8), strength=0.25)
    look = Painted(corner, np.zeros((2, 3, 2)), np.zeros(2, np.int32), (image,), np.arange(2))
    found = look(np.array([0]), corner[0].mean(axis=0)[None], np.zeros(1))
    assert found[0] == pytest.approx(0.75)
