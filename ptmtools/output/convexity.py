"""Hulls and portals that stay convex however a client reads their numbers.

The numbers are float32 in their shortest decimals. A VRML browser reads them back to the very
float32; JavaScript and NumPy read the decimals as float64, which differ from those by up to half a
unit of float32's last place. Both are near enough for points. They are not near enough for a plane
or a line through points that lie close together: it turns by the difference over their distance.

- A facet of a hull may be a sliver, a tenth of a millimetre high or less: a vertex near the edge of
  a large face. The convex hull is exact in float32, but read as float64 such a facet cut up to 5 m
  into its cell (two rooms whose corners are moved by 3 mm to 3 cm). The vertices of such a hull are
  written with the digits of float64, which are the float32 numbers in both readings. (Rejected:
  other triangles over the same vertices, or fewer vertices. The one is no longer the exact hull in
  either reading, the other does not hold its cell, and a cell with a bevel of 0.1 mm has no hull
  without slivers.)
- A portal may have a vertex in the middle of a side, with a short edge beside it: rounding bends
  the side inwards there, and the line through the short edge leaves corners outside. The vertex is
  dropped, as the convex hull of the rounded polygon would drop it. (Rejected: float64 digits.
  Hints hold float32 numbers, and a client may keep them as such.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, cross, normals
from ptmtools.cells.model import Cells
from ptmtools.output.numbers import coordinates, row_texts
from ptmtools.tolerance import Tolerance

#: How far a point may lie outside of a plane or a line as read, as a share of the on-plane distance
#: of the leaves' extent: clients and `ptm validate` allow the whole of it.
SLACK_SHARE = 0.5
_TINY = np.finfo(np.float64).tiny


def slack_of(cells: Cells) -> float:
    """How far a point of a hull or a portal may lie outside of it as read, metres."""
    return SLACK_SHARE * Tolerance.for_points(cells.leaf_point).plane


def hull_rows(
    points: NDArray[np.float32], triangles: NDArray[np.integer], slack: float
) -> list[str]:
    """The text of each vertex of a convex hull: the shortest decimals if the hull is convex in them
    within ``slack`` metres, else float64's, which are the float32 numbers themselves.

    Parameters
    ----------
    points: (h, 3) vertices.
    triangles: (f, 3) indices into them, counter-clockwise seen from outside.
    """
    rows, exact = row_texts(points), points.astype(np.float64)
    decimals = np.array([row.split() for row in rows], dtype=np.float64)
    # No point is in front of an exact facet, so turning it lifts none farther than `reach`.
    unit = _units(decimals[triangles])
    turn = np.linalg.norm(unit - _units(exact[triangles]), axis=1)
    reach = turn * np.linalg.norm(np.ptp(exact, axis=0))
    slivers = ~(reach <= slack)
    height = unit[slivers] @ decimals.T
    height -= np.einsum("ij,ij->i", unit[slivers], decimals[triangles[slivers, 0]])[:, None]
    return rows if (height <= slack).all() else row_texts(exact)


def portal_polygons(
    point: Floats, start: NDArray[np.integer], normal: Floats, slack: float
) -> list[list[list[float]]]:
    """The vertices of portals as the numbers to write: convex within ``slack`` metres, read as
    float32 or as float64.

    Parameters
    ----------
    point, start: (Q, 3) vertices of convex polygons; (K + 1,) CSR over polygons.
    normal: (K, 3) unit normals, counter-clockwise about which the vertices are.

    Raises DatabaseError: PTM-D601 a number is not finite in float32.
    """
    if len(start) < 2:
        return []
    points = coordinates(point, "portals")
    decimals = np.array(points, dtype=np.float64)
    readings = np.stack([decimals, decimals.astype(np.float32).astype(np.float64)])
    bent = _bent(readings, start, normal, slack)
    polygons = []
    for k, (first, last) in enumerate(zip(start[:-1].tolist(), start[1:].tolist(), strict=True)):
        polygon = points[first:last]
        if bent[k]:
            kept = _convex(readings[:, first:last], normal[k], slack)
            polygon = [polygon[corner] for corner in kept]
        polygons.append(polygon)
    return polygons


def _units(corners: Floats) -> Floats:
    """(f, 3) unit normals of (f, 3, 3) triangles; NaN for one without area."""
    normal = normals(corners)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit: Floats = normal / np.linalg.norm(normal, axis=1)[:, None]
    return unit


def _bent(
    readings: Floats, start: NDArray[np.integer], normal: Floats, slack: float
) -> NDArray[np.bool_]:
    """(K,) whether a polygon of the (r, Q, 3) points may have a corner more than ``slack`` outside
    of an edge: no corner turns inwards so far that all of them together could cause it."""
    size = np.diff(start)
    following = np.arange(1, start[-1] + 1)
    following[start[1:] - 1] = start[:-1]
    edge = readings[:, following] - readings
    length = np.linalg.norm(edge, axis=2)
    turn = np.einsum("rqi,qi->rq", cross(edge, edge[:, following]), np.repeat(normal, size, axis=0))
    with np.errstate(invalid="ignore", divide="ignore"):
        turn /= length * length[:, following]
    reach = size * np.add.reduceat(length, start[:-1], axis=1)
    straight = turn * np.repeat(reach, size, axis=1) >= -slack
    return ~np.logical_and.reduceat(straight.all(axis=0), start[:-1])


def _convex(readings: Floats, normal: Floats, slack: float) -> list[int]:
    """Which corners of the (r, n, 3) readings of a polygon to keep, ascending: all but those that
    reach the least beyond the line between their neighbours, until it is convex."""
    kept = list(range(readings.shape[1]))
    while len(kept) > 3 and _outside(points := readings[:, kept], normal) > slack:
        before = np.roll(points, 1, axis=1)
        chord = np.roll(points, -1, axis=1) - before
        height = cross(points - before, chord) @ normal
        height /= np.maximum(np.linalg.norm(chord, axis=2), _TINY)
        del kept[int(height.min(axis=0).argmin())]
    return kept


def _outside(readings: Floats, normal: Floats) -> float:
    """How far a corner of (r, n, 3) polygons lies outside of the line of an edge, metres."""
    edge = np.roll(readings, -1, axis=1) - readings
    inner = cross(normal, edge) / np.maximum(np.linalg.norm(edge, axis=2), _TINY)[..., None]
    inside = np.einsum("rik,rjk->rij", inner, readings)
    inside -= np.einsum("rik,rik->ri", inner, readings)[..., None]
    return float(-inside.min())
