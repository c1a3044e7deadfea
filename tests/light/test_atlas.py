"""Atlases: kernels against plain loops; what a lookup reads, on however thin a face."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.arrays import Floats
from ptmtools.light.atlas import claim, cover, nearest, unwrap
from tests.light.shapes import (
    HOUSE,
    bilinear,
    indexed,
    ledges,
    loose,
    quad,
    samples,
    triangles_of,
)
from tests.systems.campus.models import level

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

SIZES = (512, 1024, 2048)


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


def test_an_atlas_gives_each_face_a_place_of_its_own() -> None:
    points, triangles = indexed(HOUSE)
    atlas = unwrap(points, triangles, SIZES)
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
    uv = unwrap(points, triangles, SIZES).uv
    lengths = np.linalg.norm(HOUSE - np.roll(HOUSE, 1, axis=1), axis=2)
    drawn = np.linalg.norm(uv - np.roll(uv, 1, axis=1), axis=2)
    ratio = drawn / lengths
    assert ratio.max() / ratio.min() < 1.1


@pytest.mark.parametrize("size", [512, 1024, 2048])
@pytest.mark.parametrize(
    "corner", [loose(3000), HOUSE, ledges(40)], ids=["loose", "house", "ledges"]
)
def test_every_face_reads_its_own_chart_alone(corner: Floats, size: int) -> None:
    """However thin it is."""
    atlas = unwrap(*indexed(corner), SIZES)
    assert atlas.side == 512
    owner = claim(atlas.uv, cover(atlas.uv, size)).ravel()
    face, _, at = samples(corner, atlas.uv, 20_000)
    _, read, weight = bilinear(np.zeros((size, size)), at)
    stranger = (owner[read] < 0) | (atlas.chart[owner[read]] != atlas.chart[face][:, None])
    assert ((weight * stranger).sum(axis=1) > 0.01).mean() < 0.005


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


def test_groups_share_no_chart_and_no_texel() -> None:
    """The two halves of a wall, which is one chart otherwise."""
    halves = [quad((0, y, 0), (6, y, 0), (6, y + 3, 0), (0, y + 3, 0)) for y in (0, 3)]
    points, triangles = indexed(np.concatenate(halves))
    group = np.array([0, 0, 7, 7])
    assert len(set(unwrap(points, triangles, (64,)).chart.tolist())) == 1
    atlas = unwrap(points, triangles, (64,), padding=1, group=group)
    assert (atlas.chart[:2] != atlas.chart[2:]).all()
    share = np.random.default_rng(1).dirichlet([0.2, 0.2, 0.2], 500)
    at = np.einsum("nk,tkx->tnx", share, atlas.uv)
    at[..., 1] = 1 - at[..., 1]
    read = []
    for half in (at[:2], at[2:]):
        _, index, weight = bilinear(np.zeros((64, 64)), half.reshape(-1, 2))
        read.append(set(index[weight > 0].tolist()))
    assert read[0].isdisjoint(read[1])


def test_too_many_charts_for_the_least_lightmap() -> None:
    """Thousands of loose faces, in small lightmaps."""
    assert unwrap(*indexed(loose(3000)), (64, 128)).side != 64


def test_a_long_object_is_packed_for_the_least_lightmap() -> None:
    quads = [level((5 * i, 0), (5 * i + 5, 3), 0) for i in range(40)]
    points, triangles = indexed(triangles_of(np.concatenate(quads)))
    assert unwrap(points, triangles, SIZES).side == 512
