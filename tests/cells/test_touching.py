"""Polygons that meet, by the kernel, against distances of all corners to all edges."""

from __future__ import annotations

import numpy as np
from hypothesis import given, strategies as st

from ptmtools.arrays import Floats
from ptmtools.cells.kernels import outlines_meet


def distance(points: Floats, polygon: Floats) -> float:
    """Metres between the nearest of (n, 3) points and the outline of an (m, 3) polygon."""
    along = np.roll(polygon, -1, axis=0) - polygon
    square = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
    to = points[:, None] - polygon
    share = np.clip((to * along).sum(axis=2) / square, 0.0, 1.0)
    return float(np.linalg.norm(to - share[..., None] * along, axis=2).min())


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_polygons_meet_as_their_distances_say(seed: int, degenerate: bool) -> None:
    rng = np.random.default_rng(seed)
    polygons = [rng.uniform(0, 2, (rng.integers(3, 9), 3)) for _ in range(8)]
    if degenerate:  # a corner twice, and a polygon that is a point
        polygons[0][1] = polygons[0][0]
        polygons[1][:] = polygons[1][0]
    start = np.cumsum([0, *map(len, polygons)])
    pairs = np.array([(i, j) for j in range(8) for i in range(j)])
    meets = np.zeros(len(pairs), dtype=np.bool_)
    outlines_meet(np.concatenate(polygons), start, pairs, 0.4, meets)
    expected = [
        min(distance(polygons[i], polygons[j]), distance(polygons[j], polygons[i])) <= 0.4
        for i, j in pairs
    ]
    assert meets.tolist() == expected
