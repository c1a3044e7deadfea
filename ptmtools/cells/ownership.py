"""Cutting the geometry along the cell boundaries, and who owns each piece.

Every triangle sinks through the BSP tree and is cut where it crosses a plane, so that each piece
belongs to one leaf; texture coordinates at the cuts follow from barycentric coordinates of the
source triangle. A piece that *lies* in a plane has two owners: the leaf that its front faces and
the one behind it. It therefore sinks twice, once siding with its front and once with its back
(design, "Ownership": true positions decide, not the plane that a cluster was snapped to).

A whole tree node is treated at once in numpy, pieces as arrays; crossing points are computed from
the endpoint in front to the endpoint behind, so that two triangles sharing an edge are cut in the
same point to the last bit. Pieces outside the root box belong to the leaf that the planes alone
assign: nothing of the model is lost to a clipped box.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.bsp import Tree
from ptmtools.cells.vectors import normals
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance


@dataclass(frozen=True)
class Pieces:
    """Triangles cut to the leaves."""

    corner: Floats  # (M, 3, 6) positions, and barycentric coordinates in the source triangle
    source: Ints  # (M,) index of the scene's triangle
    leaf: Ints  # (M, 2) leaf of the tree on the front and on the back


@dataclass(frozen=True)
class _Batch:
    """Pieces on their way down."""

    corner: Floats  # as in `Pieces`
    source: Ints
    front: Ints  # (n,) the leaf on their front, once that is known
    lying: Bools  # (n,) whether they lay in some plane on the way

    def take(self, rows: Ints | Bools) -> _Batch:
        return _Batch(*(array[rows] for array in vars(self).values()))

    @staticmethod
    def join(parts: list[_Batch]) -> _Batch:
        columns = zip(*(vars(part).values() for part in parts), strict=True)
        return _Batch(*(np.concatenate(column) for column in columns))


def cut_to_leaves(scene: Scene, tree: Tree, tolerance: Tolerance) -> Pieces:
    """Cut all triangles of a scene along the planes of a tree."""
    corners = scene.corners
    facing = normals(corners)
    count = len(corners)
    whole = _Batch(
        corner=np.concatenate([corners, np.tile(np.eye(3), (count, 1, 1))], axis=2),
        source=np.arange(count),
        front=np.full(count, -1),
        lying=np.zeros(count, dtype=bool),
    )
    batch, front = _sink(tree, whole, facing, tolerance)
    boundary = replace(batch, front=front).take(batch.lying)
    boundary, back = _sink(tree, boundary, -facing, tolerance)
    within = ~batch.lying
    pieces = _Batch.join([batch.take(within), boundary])
    leaf = np.stack(
        [np.append(front[within], boundary.front), np.append(front[within], back)], axis=1
    )
    order = np.argsort(pieces.source, kind="stable")
    return Pieces(pieces.corner[order], pieces.source[order], leaf[order])


def _sink(tree: Tree, batch: _Batch, facing: Floats, tolerance: Tolerance) -> tuple[_Batch, Ints]:
    """Let pieces sink to leaves; what lies in a plane goes to the side that ``facing`` (one
    direction per scene triangle) points to. Returns the cut pieces and the leaf of each."""
    arrived: list[_Batch] = []
    leaves: list[Ints] = []
    stack = [(0 if len(tree.planes) else -2, batch)]
    while stack:
        node, here = stack.pop()
        if node < 0:
            arrived.append(here)
            leaves.append(np.full(len(here.source), -2 - node))
            continue
        plane = tree.planes[node]
        distance = here.corner[..., :3] @ plane[:3] + plane[3]
        ahead = distance > tolerance.plane
        behind = distance < -tolerance.plane
        some_ahead, some_behind = ahead.any(axis=1), behind.any(axis=1)
        lies = ~some_ahead & ~some_behind
        turned = facing[here.source] @ plane[:3] > 0
        to_front = some_ahead & ~some_behind | lies & turned
        to_back = some_behind & ~some_ahead | lies & ~turned
        crossing = some_ahead & some_behind
        here = replace(here, lying=here.lying | lies)
        sides = [[here.take(to_front)], [here.take(to_back)]]
        if crossing.any():
            sign = ahead[crossing].astype(np.int8) - behind[crossing]
            for side, parts in enumerate(_split(here.take(crossing), distance[crossing], sign)):
                sides[side].extend(parts)
        for side in (0, 1):
            joined = _Batch.join(sides[side])
            if len(joined.source):
                stack.append((int(tree.children[node, side]), joined))
    if not arrived:
        return batch, np.zeros(0, dtype=np.int64)
    return _Batch.join(arrived), np.concatenate(leaves)


def _split(
    batch: _Batch, distance: Floats, sign: NDArray[np.int8]
) -> tuple[list[_Batch], list[_Batch]]:
    """Cut pieces with corners strictly on both sides; returns what is in front and behind."""
    front: list[_Batch] = []
    back: list[_Batch] = []
    touching = (sign == 0).any(axis=1)
    # One corner in the plane: cut from it to the opposite edge.
    rows = np.flatnonzero(touching)
    b, d, s = _turned(batch, distance, sign, rows, np.argmax(sign[rows] == 0, axis=1))
    middle = _crossing(b, d, 1, 2)
    first, second = _triangle(b, 0, 1, middle), _triangle(b, 0, middle, 2)
    upper = s[:, 1] > 0
    front += [first.take(upper), second.take(~upper)]
    back += [second.take(upper), first.take(~upper)]
    # One corner alone on its side: a triangle there, a quadrilateral on the other side.
    rows = np.flatnonzero(~touching)
    lone = np.argmax(sign[rows] == -np.sign(sign[rows].sum(axis=1))[:, None], axis=1)
    b, d, s = _turned(batch, distance, sign, rows, lone)
    p, q = _crossing(b, d, 0, 1), _crossing(b, d, 0, 2)
    tip, base, rest = _triangle(b, 0, p, q), _triangle(b, p, 1, 2), _triangle(b, p, 2, q)
    upper = s[:, 0] > 0
    front += [tip.take(upper), base.take(~upper), rest.take(~upper)]
    back += [base.take(upper), rest.take(upper), tip.take(~upper)]
    return front, back


def _turned(
    batch: _Batch, distance: Floats, sign: NDArray[np.int8], rows: Ints, first: Ints
) -> tuple[_Batch, Floats, NDArray[np.int8]]:
    """The given rows with their corners turned so that ``first`` comes first."""
    b = batch.take(rows)
    i = np.arange(len(rows))[:, None]
    j = (first[:, None] + np.arange(3)) % 3
    turned = replace(b, corner=b.corner[i, j])
    return turned, distance[rows][i, j], sign[rows][i, j]


def _crossing(batch: _Batch, distance: Floats, i: int, j: int) -> Floats:
    """(n, 6) where edges from corner i to corner j cross, always reckoned from the front end."""
    swap = (distance[:, i] < distance[:, j])[:, None]
    d_front, d_back = (
        np.maximum(distance[:, i], distance[:, j]),
        np.minimum(distance[:, i], distance[:, j]),
    )
    ahead = np.where(swap, batch.corner[:, j], batch.corner[:, i])
    behind = np.where(swap, batch.corner[:, i], batch.corner[:, j])
    crossing: Floats = ahead + (d_front / (d_front - d_back))[:, None] * (behind - ahead)
    return crossing


def _triangle(batch: _Batch, *corners: int | Floats) -> _Batch:
    """The batch with its corners replaced: an old corner by index, or a new one."""
    each = [batch.corner[:, c] if isinstance(c, int) else c for c in corners]
    return replace(batch, corner=np.stack(each, axis=1))
