"""Octrees written and read by hand, straight from docs/formats/apo.md."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from ptmtools_systems.apo.model import Octree

#: A node: the bytes of its normal, and its children by number.
Node = tuple[tuple[int, int, int], dict[int, Any]]

colors = st.tuples(*[st.integers(0, 255)] * 3)


def nodes(depth: int) -> st.SearchStrategy[Node]:
    """Any tree of at most ``depth`` + 1 levels."""
    if depth == 0:
        return st.tuples(colors, st.just({}))
    return st.tuples(
        colors, st.dictionaries(st.integers(0, 7), nodes(depth - 1), max_size=8 if depth < 2 else 3)
    )


def octree_of(root: Node, low: tuple[float, ...] = (0, 0, 0), side: float = 1.0) -> Octree:
    """Breadth first, siblings side by side in the order of their numbers."""
    texels: list[list[int]] = []
    start = [0]
    level = [root]
    while level:
        end = len(texels) + sum(2 if below else 1 for _, below in level)
        following: list[Node] = []
        for color, below in level:
            if not below:
                texels.append([*color, 0])
                continue
            present = sum(1 << c for c in below)
            inner = sum(1 << c for c in below if below[c][1])
            texels.append([*color, present])
            texels.append([end & 255, end >> 8 & 255, end >> 16, inner])
            children = [below[c] for c in sorted(below)]
            end += sum(2 if node[1] else 1 for node in children)
            following += children
        start.append(len(texels))
        level = following
    return Octree(
        np.array(texels, dtype=np.uint8), np.array(start), np.array(low, dtype=np.float64), side
    )


def walk(octree: Octree, q: list[float], levels: int, stop: int) -> tuple[int, int]:
    """Address and depth, line by line as the page has it."""
    texel = octree.texels.tolist()
    address, depth = 0, 0
    while True:
        present = texel[address][3]
        if present == 0 or depth == levels - 1 or depth >= stop:
            return address, depth
        c = sum(1 << k for k in range(3) if q[k] >= 0.5)
        q = [2 * x % 1 for x in q]
        if not present & 1 << c:
            return address, depth
        r, g, b, inner = texel[address + 1]
        below = (1 << c) - 1
        first = r + 256 * g + 65536 * b
        address = first + (present & below).bit_count() + (inner & below).bit_count()
        depth = depth + 1


@cache
def ball(depth: int, low: tuple[float, ...] = (0, 0, 0), side: float = 1.0) -> Octree:
    """Of the sphere of radius 0.45 around the middle of the cube, with its normals."""
    middle, radius = np.full(3, 0.5), 0.45

    def node(corner: np.ndarray, size: float, left: int) -> Node:
        normal = corner + size / 2 - middle if size < 1 else np.array([0.0, 0, 1])
        unit = normal / np.linalg.norm(normal)
        color = tuple(np.rint((unit / 2 + 0.5) * 255).astype(int).tolist())
        below = {}
        for k in range(8 if left else 0):
            first = corner + size / 2 * np.array([k & 1, k >> 1 & 1, k >> 2 & 1])
            away = np.linalg.norm(first + size / 4 - middle)
            if abs(away - radius) < size * 3**0.5 / 4 + 0.01:
                below[k] = node(first, size / 2, left - 1)
        return color, below

    return octree_of(node(np.zeros(3), 1.0, depth), low, side)
