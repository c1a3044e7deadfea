"""Triangles that continue each other: one plane, one look, one texture map.

Cutting such triangles makes corners on the edges between them that nothing but the cut accounts
for; where triangles are joined these go as well.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.merging import connected
from ptmtools.cells.vectors import areas, normals, ranges
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance

#: Texture coordinates that differ by less are the same: a tenth of a texel of 8,192.
_UV = 1.2e-5
#: An edge of more triangles than this is left alone.
_MOST = 8


def patches(scene: Scene, triangle: Ints, corner: Ints, may: Bools, tolerance: Tolerance) -> Ints:
    """(n,) for each of the scene's triangles, (n,) ``triangle``, the place of the largest one that
    it continues, directly or by way of others, its own if there is none.

    ``corner``: (n, 3) numbers of their corners; ``may``: (n,) which may be joined to others.

    An edge is left alone unless all triangles there continue each other in pairs: a wall that
    stands on a floor ends in its edges.
    """
    edge, one, other = _opposite(corner)
    corners, uv = scene.corners[triangle], scene.uv[triangle]
    if scene.colors is not None:  # they differ where they are a level of 255 apart
        uv = np.concatenate([uv, 2 * _UV * scene.colors[triangle].astype(np.float64)], axis=2)
    flat, same = _continues(corners, uv, one // 3, other // 3, tolerance)
    back = _continues(corners, uv, other // 3, one // 3, tolerance)
    flat, same = flat & back[0], same & back[1]
    paired = np.bincount(np.append(one[flat], other[flat]), minlength=corner.size) == 1
    alone = np.zeros(int(edge.max(initial=-1)) + 1, dtype=np.bool_)
    alone[edge[~paired]] = True
    joins = flat & same & ~alone[edge[one]]
    one, other = one[joins] // 3, other[joins] // 3
    for look in (scene.triangle_object, scene.triangle_material, scene.two_sided, may):
        each = look if look is may else look[triangle]
        alike = each[one] == each[other]
        one, other = one[alike], other[alike]
    one, other = one[may[one]], other[may[one]]
    group = connected(len(triangle), np.append(one, other), np.append(other, one))
    # Named by its largest triangle, of which all others must be continuations: many small steps
    # lead around a column.
    order = np.lexsort((np.arange(len(group)), -areas(corners), group))
    first = order[np.append(True, np.diff(group[order]) != 0)[: len(order)]]
    largest = np.empty(len(group), dtype=np.int64)
    largest[group[first]] = first
    largest = largest[group]
    own = np.arange(len(group))
    fits = np.logical_and(*_continues(corners, uv, largest, own, tolerance)) | (largest == own)
    stray = np.zeros(len(group), dtype=np.bool_)
    stray[group[~fits]] = True
    return np.where(stray[group], own, largest)


def _opposite(corner: Ints) -> tuple[Ints, Ints, Ints]:
    """The number of each edge of (n, 3) triangles, (3n,), the same for those with the same ends;
    and all pairs of edges, by row, that run between these in opposite directions."""
    start, end = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
    code = np.minimum(start, end) * (int(corner.max(initial=-1)) + 1) + np.maximum(start, end)
    _, edge, users = np.unique(code, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1)
    order = np.argsort(edge, kind="stable")
    users = users[edge[order]]
    place = np.arange(len(order))
    last = np.searchsorted(edge[order], edge[order], "right") - 1
    more = np.where(users <= _MOST, last - place, 0)
    one, other = np.repeat(order, more), order[ranges(place + 1, more)]
    opposite = start[one] == end[other]
    return edge, one[opposite], other[opposite]


def _continues(
    corners: Floats, uv: Floats, one: Ints, other: Ints, tolerance: Tolerance
) -> tuple[Bools, Bools]:
    """Whether triangles ``other`` lie in the planes of triangles ``one`` and face the same way, and
    whether they have the texture coordinates (and colours) that these would have there."""
    origin = corners[one, 0]
    a, b = corners[one, 1] - origin, corners[one, 2] - origin
    aa, ab, bb = (np.einsum("ij,ij->i", p, q) for p, q in ((a, a), (a, b), (b, b)))
    across = normals(corners)
    flat = np.einsum("ij,ij->i", across[one], across[other]) > 0
    same = np.ones(len(one), dtype=np.bool_)
    with np.errstate(divide="ignore", invalid="ignore"):  # one without area is continued by none
        scale = 1 / (aa * bb - ab**2)
        for k in range(3):
            to = corners[other, k] - origin
            to_a, to_b = (np.einsum("ij,ij->i", to, side) for side in (a, b))
            x = ((bb * to_a - ab * to_b) * scale)[:, None]
            y = ((aa * to_b - ab * to_a) * scale)[:, None]
            flat &= np.linalg.norm(to - x * a - y * b, axis=1) <= tolerance.file
            said = uv[one, 0] + x * (uv[one, 1] - uv[one, 0]) + y * (uv[one, 2] - uv[one, 0])
            same &= np.abs(said - uv[other, k]).max(axis=1) <= _UV
    return flat, same
