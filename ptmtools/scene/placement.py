"""Places the nodes of a scene whose parts are named several times (COLLADA, VRML, X3D).

A node may be below several others, and each of these too, so a small file can stand for more
instances than any machine can hold: 40 nodes that each have the next twice are a million million.
So the triangles of all instances are counted first, and the transformations of all instances of a
node are then multiplied at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.scene.options import too_many_triangles

T = TypeVar("T")


def place_nodes(
    roots: Sequence[T],
    children: Callable[[T], Sequence[T]],
    matrix: Callable[[T], Floats],
    weight: Callable[[T], int],
    limit: int,
    model: Path,
) -> Iterator[tuple[T, Floats]]:
    """Each node with its (k, 4, 4) local to world, one for each of its instances; parents first,
    then in the order of the file.

    Parameters
    ----------
    children: the nodes directly below a node, the same objects at each call.
    matrix: (4, 4) from a node to its parent.
    weight: the number of triangles of a node itself, called once for each node. Nodes without any
        at or below them are left out.

    Raises ValueError for a node below itself, and LimitError PTM-L203 for more triangles than
    ``limit``, before a transformation is multiplied.
    """
    below: dict[int, int] = {}
    order: list[T] = []
    total, stack = 0, [(root, False) for root in roots]
    while stack:
        node, complete = stack.pop()
        if complete:
            triangles = weight(node)
            total += triangles
            below[id(node)] = triangles + sum(below[id(child)] for child in children(node))
            if max(total, below[id(node)]) > limit:
                raise too_many_triangles(limit, model)
            order.append(node)
        elif id(node) not in below:
            below[id(node)] = -1
            stack += [(node, True), *((child, False) for child in children(node))]
        elif below[id(node)] < 0:
            raise ValueError("a node contains itself")
    if sum(below[id(root)] for root in roots) > limit:
        raise too_many_triangles(limit, model)
    frames: dict[int, list[Floats]] = {}
    for root in roots:
        frames.setdefault(id(root), []).append(np.eye(4)[None])
    for node in reversed(order):
        if not below[id(node)]:
            continue
        with np.errstate(all="ignore"):
            world = np.concatenate(frames.pop(id(node))) @ matrix(node)
        yield node, world
        for child in children(node):
            frames.setdefault(id(child), []).append(world)


def translation(offset: Floats) -> Floats:
    """(4, 4) of three numbers."""
    result = np.eye(4)
    result[:3, 3] = offset
    return result


def rotation(axis: Floats, angle: float) -> Floats:
    """(4, 4) about an axis of any length, in radians; the identity about one of length 0."""
    result, length = np.eye(4), float(np.linalg.norm(axis))
    if length > 0:
        x, y, z = axis / length
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        result[:3, :3] += np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return result
