"""Faces that are kept, at every size and place."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.faces import keep_faces

from .conftest import read_source

POINTS = np.array(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0, 0], [1, 0, 0], [np.nan, 0, 0], [9, 9, 9]],
    dtype=float,
)


def kept(triangles: list[list[int]], points: np.ndarray = POINTS):
    return keep_faces(points, np.array(triangles, dtype=np.int64))


def test_duplicates_of_either_winding() -> None:
    result = kept([[0, 1, 2], [2, 0, 1], [2, 1, 0], [0, 1, 3], [5, 2, 0], [1, 0, 2]])
    assert result.source.tolist() == [0, 2, 3]
    assert result.paired.tolist() == [True, True, False]
    assert result.keeper.tolist() == [0, 0, 2, 3, 0, 2]
    assert len(result.points) == 4


def test_degenerate_and_not_finite() -> None:
    result = kept([[0, 4, 1], [0, 0, 2], [1, 5, 2], [0, 6, 2], [0, 1, 2]])
    assert (result.degenerate, result.not_finite) == (3, 1)
    assert result.keeper.tolist() == [-1, -1, -1, -1, 4]


ROOM = np.random.default_rng(2).uniform(-4, 4, (60, 3)).round(3)
STRAYS = [[100, 0, 0], [0, 101, 0], [0, 0, 102]]


@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
@pytest.mark.parametrize("distance", [1e5, 1e7, 1e300, 1e308])
def test_strays_change_nothing(distance: float, scale: float) -> None:
    """A face out there, and one that a corner of the room spans with a corner out there."""
    clean = np.arange(60).reshape(-1, 3)
    far = np.sign(STRAYS) * min(distance, 1e308 / scale) + STRAYS
    faces = np.concatenate([clean[:9], [[60, 61, 62], [0, 1, 60]], clean[9:]])
    result = keep_faces(np.concatenate([ROOM, far]) * scale, faces)
    assert result.strays.tolist() == [9, 10]
    assert np.array_equal(result.points, keep_faces(ROOM * scale, clean).points)
    assert (result.keeper == -1).nonzero()[0].tolist() == [9, 10]


def test_what_is_no_stray() -> None:
    """A model of few large faces around many small ones, and one of two equal halves."""
    clean = np.arange(60).reshape(-1, 3)
    ground = np.array([[-3e3, 0, -3e3], [3e3, 0, -3e3], [0, 0, 5e3]])
    assert not len(keep_faces(np.concatenate([ROOM, ground]), np.arange(63).reshape(-1, 3)).strays)
    halves = np.concatenate([ROOM, ROOM + 1e6, ROOM - 1e6])
    assert not len(keep_faces(halves, np.arange(180).reshape(-1, 3)).strays)
    assert not len(keep_faces(ROOM * 0, clean).strays)


def test_points_are_those_in_use_in_the_order_of_their_use() -> None:
    result = kept([[3, 2, 5], [1, 2, 0]])
    assert result.points.tolist() == POINTS[[3, 2, 1, 0]].tolist()
    assert result.triangles.tolist() == [[0, 1, 2], [2, 1, 3]]


def test_minus_zero_is_zero() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, 0]])
    assert kept([[0, 1, 2], [3, 1, 2]], points).source.tolist() == [0]


def test_nothing_is_left() -> None:
    assert len(kept([[0, 0, 0]]).triangles) == 0
    assert len(kept([[6, 6, 6]]).triangles) == 0


@pytest.mark.parametrize("scale", [1e-200, 1e-3, 1.0, 1e6, 1e200])
@pytest.mark.parametrize("offset", [0.0, 1e6, -3e9])
def test_the_same_answer_at_every_size_and_place(scale: float, offset: float) -> None:
    """A grid with a row of collinear faces: exactly those go. Numbers as a file would hold them,
    so that points on a line are so only within rounding."""
    rng = np.random.default_rng(1)
    points = np.round(rng.uniform(0, 10, (30, 3)), 3)
    line = np.linspace(points[0], points[1], 10)
    everything = (np.concatenate([points, line]) + offset) * scale
    faces = [[i, i + 1, i + 2] for i in range(28)] + [[30, 30 + i, 39] for i in range(1, 9)]
    result = keep_faces(everything, np.array(faces))
    assert (result.degenerate, len(result.source)) == (8, 28)


@given(
    st.lists(st.tuples(*[st.integers(0, 5)] * 3), min_size=1, max_size=30),
    st.randoms(use_true_random=False),
)
def test_counts_do_not_depend_on_order(faces: list[tuple[int, int, int]], order) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 2], [3, 1, 1]], float)
    # Reference: sets of rotations.
    seen = set()
    for a, b, c in faces:
        if len({a, b, c}) == 3:
            seen.add(min((a, b, c), (b, c, a), (c, a, b)))
    result = keep_faces(points, np.array(faces, dtype=np.int64))
    assert len(result.source) == len(seen)
    mirrored = {min((a, c, b), (c, b, a), (b, a, c)) for a, b, c in seen}
    assert result.paired.sum() == len(seen & mirrored)
    shuffled = list(faces)
    order.shuffle(shuffled)
    again = keep_faces(points, np.array(shuffled, dtype=np.int64))
    assert (len(again.source), again.paired.sum()) == (len(seen), result.paired.sum())


def test_two_sided_walls_of_the_case(shared: Path) -> None:
    """Four walls of two quads: whatever the order of the corners, each side has its own."""
    path = shared / "cases/twosided-obj/m.obj"
    source = read_source(path)
    wall = np.array([name in "nswe" for name in source.objects])[source.triangle_object]
    result = keep_faces(source.points, source.triangles)
    assert result.paired.tolist() == wall[result.source].tolist()
    scene = ingest(path, IngestOptions(unit="m", up="y"))
    assert (~scene.two_sided).tolist() == wall.tolist()
    (note,) = [n for n in scene.notes if "opposite winding" in n.message]
    assert note.count == 8


def fan(corners: list[int], first: int) -> list[list[int]]:
    turned = corners[first:] + corners[:first]
    return [[turned[0], a, b] for a, b in pairwise(turned[1:])]


OUTLINE = np.array([[0, 0, 0], [3, 0, 0], [5, 2, 0], [4, 5, 0], [1, 5, 0], [-1, 2, 0]], float)
#: Neighbours in the plane, and a wall that meets it in one of its edges.
BESIDE = np.array([[3, 0, 9], [0, 0, 9], [9, -1, 0], [9, 9, 0]], float)


@pytest.mark.parametrize("angle", [0, 0.3, 2])
@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("second", range(6))
def test_polygons_are_paired_however_they_are_cut(first: int, second: int, angle: float) -> None:
    """Their neighbours, of which one side has more, change nothing."""
    ring = list(range(6))
    front, back = fan(ring, first), fan(ring[::-1], second)
    more = [[1, 0, 6], [1, 6, 7], [1, 8, 2], [2, 8, 9]]
    c, s = np.cos(angle), np.sin(angle)
    points = np.concatenate([OUTLINE, BESIDE]) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    result = kept(front + back + more, points)
    assert result.paired.tolist() == [True] * 8 + [False] * 4


def test_what_is_no_opposite_polygon() -> None:
    """The same winding, another outline, a bent quad, and a lid over a bowl of the same rim."""
    ring = list(range(6))
    assert not kept(fan(ring, 0) + fan(ring, 1), OUTLINE).paired.any()
    assert not kept(fan(ring, 0) + fan(ring[:0:-1], 1), OUTLINE).paired.any()
    bent = OUTLINE[:4] + np.array([[0, 0, 0], [0, 0, 0.1], [0, 0, 0], [0, 0, 0]])
    assert not kept(fan(ring[:4], 0) + fan(ring[3::-1], 0), bent).paired.any()
    bowl = np.concatenate([OUTLINE, [[2, 2, -1]]])
    sides = [[6, (k + 1) % 6, k] for k in ring]
    assert not kept(fan(ring, 0) + sides, bowl).paired.any()
    flat = np.concatenate([OUTLINE, [[2, 2, 0]]])
    assert kept(fan(ring, 0) + sides, flat).paired.all()


def test_a_floor_of_many_tiles_is_paired() -> None:
    """Each tile with the one below it, cut along the other diagonal."""
    n = 40
    x, y = np.divmod(np.arange((n + 1) ** 2), n + 1)
    points = np.stack([x, y, 0 * x], axis=1).astype(float)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    above = np.concatenate([first + [0, n + 1, n + 2], first + [0, n + 2, 1]])
    below = np.concatenate([first + [0, 1, n + 1], first + [1, n + 2, n + 1]])
    faces = np.concatenate([above, below[:-1]])
    result = keep_faces(points, faces)
    assert result.paired.sum() == len(faces) - 3
