"""Taking back what caps parted in vain.

A cap (`caps`) is worth a leaf where something behind it cannot be reached. Elsewhere, where both
its sides are reached some other way or neither is, it would only add leaves, mostly slivers of
some centimetres: the gallery would have half as many again (43 instead of 29), willowgarage an
eighth (852 instead of 753). So all caps are tried, and after the flood
those that cut nothing off are taken back. What is rejoined is reached as a whole or not at all,
and the flood need not be run again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.bsp import Tree
from ptmtools.cells.polyhedron import Polyhedron

_MIXED = -1


@dataclass(frozen=True)
class Rejoined:
    """A tree without caps that cut nothing off.

    Attributes
    ----------
    tree: what is left.
    leaf: (L,) for each leaf of the tree before, which it is or is part of; ascending but for parts.
    node: (N,) for each node of the tree before, which it is, or -1.
    """

    tree: Tree
    leaf: NDArray[np.int64]
    node: NDArray[np.int64]


def rejoined(tree: Tree, reached: NDArray[np.bool_]) -> Rejoined:
    """The tree less the caps that cut nothing off; ``reached``: (L,) what the flood met."""
    nodes = len(tree.planes)
    status = np.zeros(nodes, dtype=np.int64)
    first = np.zeros(nodes, dtype=np.int64)
    for node in range(nodes - 1, -1, -1):  # children come after their parents
        below = [
            (int(reached[-2 - c]), -2 - c) if c <= -2 else (int(status[c]), int(first[c]))
            for c in tree.children[node].tolist()
        ]
        status[node] = below[0][0] if below[0][0] == below[1][0] else _MIXED
        first[node] = min(leaf for _, leaf in below)
    gone = np.zeros(nodes, dtype=bool)
    target = np.arange(len(tree.leaves))
    bodies = dict(enumerate(tree.leaves))
    for node in range(nodes):
        if gone[node] or (node in tree.capped and status[node] != _MIXED):
            if not gone[node]:
                bodies[int(first[node])] = tree.capped[node]
            for child in tree.children[node].tolist():
                if child >= 0:
                    gone[child] = True
                    first[child] = first[node]
                else:
                    target[-2 - child] = first[node]
            gone[node] = True
    kept = np.unique(target)
    renumber = np.where(gone, -1, np.cumsum(~gone) - 1)
    index = np.searchsorted(kept, target)
    children = tree.children[~gone]
    below_node = children >= 0
    child = np.where(below_node, children, 0)
    leaf = np.where(below_node, first[child], -2 - children)
    inner = below_node & ~gone[child]
    return Rejoined(
        replace(
            tree,
            planes=tree.planes[~gone],
            walls=tuple(w for w, g in zip(tree.walls, gone, strict=True) if not g),
            children=np.where(inner, renumber[child], -2 - index[leaf]).astype(np.int32),
            leaves=tuple(_renamed(bodies[int(i)], renumber) for i in kept),
            capped={int(renumber[n]): b for n, b in tree.capped.items() if not gone[n]},
        ),
        index,
        renumber,
    )


def _renamed(body: Polyhedron, renumber: NDArray[np.int64]) -> Polyhedron:
    return replace(body, tags=tuple(int(renumber[t]) if t >= 0 else t for t in body.tags))
