"""Cutting of the geometry along the boundaries of leaves, and the owners of each piece.

Every triangle sinks through the BSP tree and is cut where it crosses a plane. A piece that *lies*
in a plane has two owners, so it sinks twice, siding with its front and with its back; true
positions decide, not the plane that a cluster was snapped to. A compiled loop takes whole triangles
to their leaves; the others are cut in numpy, all pieces at a node at once. Crossings are computed
from the end in front to the end behind, so two triangles that share an edge are cut in the same
point to the last bit. Pieces outside the root box belong to the leaf that the planes alone assign.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.cells.bsp import Tree
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance


@dataclass(frozen=True)
class Pieces:
    """Triangles cut to the leaves, in the order of the scene's triangles."""

    source: Ints  # (M,) index of the scene's triangle
    leaf: Ints  # (M, 2) leaf of the tree on the front and on the back
    cut: Ints  # (K,) the pieces that are not whole triangles, ascending
    corner: Floats  # (K, 3, 6) their positions, and barycentric coordinates in the source triangle


@dataclass(frozen=True)
class _Batch:
    """Pieces on their way down the tree."""

    corner: Floats  # as in `Pieces`
    source: Ints
    front: Ints  # (n,) the leaf on their front, once that is known
    lying: Bools  # (n,) whether they lay in some plane on the way
    at: Ints  # (n,) the current node, or leaf i as -2 - i

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
    at, lying = _settle(tree, corners, facing, tolerance)
    front = np.where(at < 0, -2 - at, -1)
    cut = _cut(tree, _batch(corners, at >= 0, front, lying, at), facing, tolerance)
    cut = replace(cut, front=-2 - cut.at)
    # Pieces in a plane sink again, siding with their backs.
    back = at.copy()
    twice = np.flatnonzero(lying & (at < 0))
    back[twice], _ = _settle(tree, corners[twice], -facing[twice], tolerance)
    again = cut.take(cut.lying)
    down, _ = _settle(tree, again.corner[..., :3], -facing[again.source], tolerance)
    boundary = _batch(corners, (at < 0) & (back >= 0), front, lying, back)
    boundary = _Batch.join([boundary, replace(again, at=down)])
    boundary = _cut(tree, boundary, -facing, tolerance)
    whole = np.flatnonzero((at < 0) & (back < 0))
    within = cut.take(~cut.lying)
    parts = _Batch.join([within, boundary])
    source = np.concatenate([whole, parts.source])
    order = np.argsort(source, kind="stable")
    sides = np.concatenate([-2 - back[whole], -2 - parts.at])
    is_cut = order >= len(whole)
    return Pieces(
        source[order],
        np.stack([np.append(front[whole], parts.front), sides], axis=1)[order],
        np.flatnonzero(is_cut),
        parts.corner[order[is_cut] - len(whole)],
    )


def _batch(corners: Floats, which: Bools, front: Ints, lying: Bools, at: Ints) -> _Batch:
    """The triangles that are to be cut."""
    rows = np.flatnonzero(which)
    shares = np.broadcast_to(np.eye(3), (len(rows), 3, 3))
    corner = np.concatenate([corners[rows], shares], axis=2)
    return _Batch(corner, rows, front[rows], lying[rows], at[rows])


def _settle(
    tree: Tree, corners: Floats, facing: Floats, tolerance: Tolerance
) -> tuple[Ints, Bools]:
    """(n,) the node that first cuts each of (n, 3, 3) triangles, or its leaf i as -2 - i, and (n,)
    whether it lies in the plane of a node on the way; it then goes to the side to which ``facing``,
    (n, 3), points."""
    from ptmtools.cells.kernels import sink

    at = np.full(len(corners), 0 if len(tree.planes) else -2)
    lying = np.zeros(len(corners), dtype=bool)
    # Contiguous: a view would be a type of its own, compiled again.
    corners = np.ascontiguousarray(corners)
    sink(tree.planes, tree.children, corners, facing, tolerance.plane, at, lying)
    return at, lying


def _cut(tree: Tree, batch: _Batch, facing: Floats, tolerance: Tolerance) -> _Batch:
    """Cuts pieces at their nodes, and on down to the leaves; pieces in a plane go to the side to
    which ``facing`` (one direction per scene triangle) points."""
    arrived = [batch.take(batch.at < 0)]
    order = np.argsort(batch.at, kind="stable")
    start = np.searchsorted(batch.at[order], np.arange(len(tree.planes) + 1))
    nothing = batch.take(np.zeros(0, dtype=np.int64))
    stack = [(0, nothing)] if len(tree.planes) else []
    while stack:
        node, present = stack.pop()
        if node < 0:
            arrived.append(replace(present, at=np.full(len(present.at), node)))
            continue
        waiting = order[start[node] : start[node + 1]]
        present = _Batch.join([present, batch.take(waiting)]) if len(waiting) else present
        sides = (
            _divide_batch(present, tree.planes[node], facing, tolerance)
            if len(present.at)
            else [present] * 2
        )
        stack += zip(tree.children[node].tolist(), sides, strict=True)
    return _Batch.join(arrived)


def _divide_batch(
    batch: _Batch, plane: Floats, facing: Floats, tolerance: Tolerance
) -> list[_Batch]:
    """The parts of pieces in front of a (4,) plane, and behind it."""
    x, y, z = (batch.corner[..., k] for k in range(3))
    distance = x * plane[0] + y * plane[1] + z * plane[2] + plane[3]  # the same bits as in `sink`
    ahead = distance > tolerance.plane
    behind = distance < -tolerance.plane
    some_ahead, some_behind = ahead.any(axis=1), behind.any(axis=1)
    lies = ~some_ahead & ~some_behind
    turned = facing[batch.source] @ plane[:3] > 0
    to_front = some_ahead & ~some_behind | lies & turned
    to_back = some_behind & ~some_ahead | lies & ~turned
    crossing = some_ahead & some_behind
    batch = replace(batch, lying=batch.lying | lies)
    sides = [[batch.take(to_front)], [batch.take(to_back)]]
    if crossing.any():
        sign = ahead[crossing].astype(np.int8) - behind[crossing]
        for side, parts in zip(
            sides, _split(batch.take(crossing), distance[crossing], sign), strict=True
        ):
            side.extend(parts)
    return [_Batch.join(side) for side in sides]


def _split(
    batch: _Batch, distance: Floats, sign: NDArray[np.int8]
) -> tuple[list[_Batch], list[_Batch]]:
    """Cuts pieces with corners strictly on both sides; returns the parts in front and behind."""
    front: list[_Batch] = []
    back: list[_Batch] = []
    touching = (sign == 0).any(axis=1)
    # One corner in the plane: cut from it to the opposite edge.
    rows = np.flatnonzero(touching)
    b, d, s = _turn(batch, distance, sign, rows, np.argmax(sign[rows] == 0, axis=1))
    middle = _crossing(b, d, 1, 2)
    first, second = _triangle(b, 0, 1, middle), _triangle(b, 0, middle, 2)
    upper = s[:, 1] > 0
    front += [first.take(upper), second.take(~upper)]
    back += [second.take(upper), first.take(~upper)]
    # One corner alone on its side: a triangle there, a quadrilateral on the other side.
    rows = np.flatnonzero(~touching)
    lone = np.argmax(sign[rows] == -np.sign(sign[rows].sum(axis=1))[:, None], axis=1)
    b, d, s = _turn(batch, distance, sign, rows, lone)
    p, q = _crossing(b, d, 0, 1), _crossing(b, d, 0, 2)
    tip, base, rest = _triangle(b, 0, p, q), _triangle(b, p, 1, 2), _triangle(b, p, 2, q)
    upper = s[:, 0] > 0
    front += [tip.take(upper), base.take(~upper), rest.take(~upper)]
    back += [base.take(upper), rest.take(upper), tip.take(~upper)]
    return front, back


def _turn(
    batch: _Batch, distance: Floats, sign: NDArray[np.int8], rows: Ints, first: Ints
) -> tuple[_Batch, Floats, NDArray[np.int8]]:
    """The given rows with their corners turned so that ``first`` comes first."""
    b = batch.take(rows)
    i = np.arange(len(rows))[:, None]
    j = (first[:, None] + np.arange(3)) % 3
    turned = replace(b, corner=b.corner[i, j])
    return turned, distance[rows][i, j], sign[rows][i, j]


def _crossing(batch: _Batch, distance: Floats, i: int, j: int) -> Floats:
    """(n, 6) the crossings of edges from corner i to corner j, computed from the front end."""
    swap = (distance[:, i] < distance[:, j])[:, None]
    d_front = np.maximum(distance[:, i], distance[:, j])
    d_back = np.minimum(distance[:, i], distance[:, j])
    ahead = np.where(swap, batch.corner[:, j], batch.corner[:, i])
    behind = np.where(swap, batch.corner[:, i], batch.corner[:, j])
    crossing: Floats = ahead + (d_front / (d_front - d_back))[:, None] * (behind - ahead)
    return crossing


def _triangle(batch: _Batch, *corners: int | Floats) -> _Batch:
    """The batch with its corners replaced: an old corner by index, or a new one."""
    columns = [batch.corner[:, c] if isinstance(c, int) else c for c in corners]
    return replace(batch, corner=np.stack(columns, axis=1))
