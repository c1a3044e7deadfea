"""Visibility by lines: never more than the flow's, and all of it where it is easy to see."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.cells.sight import portals_of
from ptmtools.parallel import Local
from ptmtools.portal_flow.flow import Portals, leaf_matrix, portal_flow
from ptmtools.visibility.pvs import sampled_leaves
from tests.visibility.test_pvs import ROW, ZIGZAG


@pytest.fixture(scope="module")
def maze(build_rooms) -> Portals:
    """Five by five rooms, a door of a place and a size of its own in every wall."""
    rng = np.random.default_rng(3)
    cuts = np.arange(6) * 4.0
    doors = {}
    for i in range(5):
        for k in range(5):
            for axis in (0, 2):
                low = 4.0 * (k if axis == 0 else i) + rng.uniform(0, 2.5)
                span = (low, low + rng.uniform(0.2, 1.2))
                # The axes that follow: y, z for doors along x; x, y for doors along z.
                doors[i, 0, k, axis] = [(0.0, 2.0, *span) if axis == 0 else (*span, 0.0, 2.0)]
    return portals_of(build_rooms(cuts, [0.0, 3.0], cuts, doors).cells)


def test_lines_see_what_there_is_to_see(build_rooms):
    hidden = portals_of(build_rooms(*ROW, ZIGZAG).cells)
    seen = sampled_leaves(hidden, 2000)
    assert not seen[0, 3]
    assert not seen[3, 0]
    assert seen.sum() == 14


def test_lines_never_see_more_than_the_flow(maze):
    flow = leaf_matrix(maze, portal_flow(maze, 200_000))
    seen = sampled_leaves(maze, 3000)
    assert np.array_equal(seen, seen.T)
    assert not np.any(seen & ~flow)
    assert seen.sum() > 0.9 * flow.sum()
    assert sampled_leaves(maze, 10).sum() < seen.sum()


def test_who_shoots_changes_nothing(maze):
    one = sampled_leaves(maze, 50)
    assert not np.array_equal(one, sampled_leaves(maze, 50, seed=1))
    with Local(3) as local:
        assert np.array_equal(one, sampled_leaves(maze, 50, local))


def test_rooms_without_doors(build_rooms):
    alone = portals_of(build_rooms(*ROW, {}).cells)
    assert np.array_equal(sampled_leaves(alone, 10), np.eye(4, dtype=bool))
