"""Which leaves somebody can stand in: those that meet the eye region (`eyes`).

Ceilings that hang lower than eyes may be are not asked for, so what is just above one counts as
well. It costs a little and hides nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ptmtools.arrays import Bools
from ptmtools.cells.clearance import PLAN, QUARTER, above, heights, shadows, tiled
from ptmtools.cells.options import Walker
from ptmtools.cells.places import Places
from ptmtools.cells.planar import intersection
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.tolerance import Tolerance

#: Eyes stay farther from what the body touches than rounding, but by no more of its radius.
_SLACK = 0.1
#: Pairs of leaf and floor that are compared at a time.
_AT_ONCE = 1 << 16


def eye_region(places: Places, walker: Walker, tolerance: Tolerance) -> Places:
    """What eyes can be above: the places as wide as the body, but not into what it touches."""
    inside = walker.radius * np.cos(np.pi / (4 * QUARTER))  # of a circle that is a polygon
    reach = inside - min(2 * tolerance.plane, _SLACK * walker.radius)
    box, plan, which = tiled(places.plan, walker.radius, tolerance.grid)
    eyes = intersection(shapely.buffer(plan, reach, quad_segs=QUARTER), box, tolerance.grid)
    some = ~shapely.is_empty(eyes)
    return Places(eyes[some], places.slope[which[some]])


def meets(
    eyes: Places, bodies: Sequence[Polyhedron], walker: Walker, tolerance: Tolerance
) -> Bools:
    """(L,) which of the leaves meet an eye region."""
    found = np.zeros(len(bodies), dtype=np.bool_)
    band = 2 * tolerance.plane, walker.reach
    low = np.array([body.points.min(axis=0) for body in bodies]).reshape(-1, 3)
    high = np.array([body.points.max(axis=0) for body in bodies]).reshape(-1, 3)
    boxes = shapely.box(*low[:, PLAN].T, *high[:, PLAN].T)
    leaf, floor = shapely.STRtree(eyes.plan).query(boxes, "intersects")
    least, most = heights(eyes.plan, eyes.slope)
    near = (high[leaf, 1] > least[floor] + band[0]) & (low[leaf, 1] < most[floor] + band[1])
    leaf, floor = leaf[near], floor[near]
    edges = [body.points[body.edges] for body in bodies]
    count = np.array([len(each) for each in edges], dtype=np.int64)
    for first in range(0, len(leaf), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        pair = np.repeat(np.arange(len(leaf[some])), count[leaf[some]])
        edge = np.concatenate([edges[i] for i in leaf[some].tolist()])
        height = above(edge, eyes.slope[floor[some]][pair])
        names, shadow = shadows(edge[:, :, PLAN], height, band, pair)
        touches = shapely.intersects(shadow, eyes.plan[floor[some]][names])
        found[leaf[some][names[touches]]] = True
    return found
