"""The gallery of photographs: all images hang on its walls, apart from each other, upright."""

from __future__ import annotations

import itertools
from collections import defaultdict

import numpy as np
import pytest
from ptmtools_samples.options import PhotoGalleryOptions
from ptmtools_samples.photo_gallery import (
    HEIGHT,
    WALL_DISTANCE,
    WIDTH_RATIO,
    hung,
    make_photo_gallery,
    photos,
)


@pytest.mark.parametrize("count", [1, 2, 24, 60])
def test_images_hang_apart_on_the_walls(count: int) -> None:
    length, things = hung(photos(count))
    deep = round(length * WIDTH_RATIO, 3)
    assert len(things) == count
    walls = defaultdict(list)
    for thing in things:
        (face,) = thing.faces
        point = np.array(face.points)
        low, high = point.min(axis=0), point.max(axis=0)
        assert (low >= 0).all()
        assert (high <= [length, HEIGHT, deep]).all()
        across = 0 if low[2] == high[2] else 2
        right = face.points[1][across] - face.points[0][across]
        # Seen from inside the first corner is at the left, and above the second edge is up.
        normal = np.cross(point[1] - point[0], point[3] - point[0])
        inward = np.array([length / 2, 0, deep / 2]) - point.mean(axis=0)
        assert normal @ inward > 0
        assert face.uv == ((0, 0), (1, 0), (1, 1), (0, 1))
        wall = (across, bool(right > 0))
        assert min(
            low[2 - across], (deep, length)[across // 2] - high[2 - across]
        ) == pytest.approx(WALL_DISTANCE)
        walls[wall].append((low[across], high[across]))
    for spans in walls.values():
        spans.sort()
        assert all(a[1] < b[0] for a, b in itertools.pairwise(spans))


def test_the_same_again_and_another_seed() -> None:
    """Of the smallest image; painting all of them takes minutes."""
    files = {seed: dict(make_photo_gallery(PhotoGalleryOptions(2, seed))) for seed in (1, 2)}
    again = dict(make_photo_gallery(PhotoGalleryOptions(2, 1)))
    small = "textures/photo_02.png"
    assert list(again) == [
        "textures/photo_01.png",
        small,
        *(f"photo_gallery.{s}" for s in ("mtl", "obj")),
    ]
    assert files[1][small]() == again[small]() != files[2][small]()
    assert again["photo_gallery.obj"]().startswith(b"# ptmtools sample")
