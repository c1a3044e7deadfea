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

from ptmtools.arrays import Ints
from ptmtools.cells.bsp import Tree
from ptmtools.cells.polyhedron import Polyhedron


@dataclass(frozen=True)
class Rejoined:
    """A tree without caps that cut nothing off, and what became of the leaves and nodes before."""

    tree: Tree
    leaf: Ints  # (L,) which leaf each is or is part of; ascending but for parts
    node: Ints  # (N,) which node each is, or -1


def rejoined(tree: Tree, group: Ints) -> Rejoined:
    """The tree less the caps that cut nothing off; ``group``: (L,) for leaves that are kept any of
    those that hang together, -1 for others."""
    bodies, children = list(tree.leaves), tree.children.copy()
    part_of = np.arange(len(bodies))
    kept = np.ones(len(children), dtype=bool)
    for node in sorted(tree.capped, reverse=True):  # parts before wholes
        first, second = sorted(-2 - children[node])
        if first >= 0 and group[first] == group[second]:
            bodies[first] = tree.capped[node]
            part_of[part_of == second] = first
            children[children == node] = -2 - first
            kept[node] = False
    wholes, leaf = np.unique(part_of, return_inverse=True)
    renumber = np.where(kept, np.cumsum(kept) - 1, -1)
    children = children[kept]
    inner, outer = np.maximum(children, 0), -2 - np.minimum(children, -2)
    return Rejoined(
        replace(
            tree,
            walls=tuple(wall for wall, keeps in zip(tree.walls, kept, strict=True) if keeps),
            children=np.where(children >= 0, renumber[inner], -2 - leaf[outer]).astype(np.int32),
            leaves=tuple(_renamed(bodies[whole], renumber) for whole in wholes),
            capped={int(renumber[n]): body for n, body in tree.capped.items() if kept[n]},
        ),
        leaf,
        renumber,
    )


def _renamed(body: Polyhedron, renumber: Ints) -> Polyhedron:
    return replace(body, tags=tuple(int(renumber[t]) if t >= 0 else t for t in body.tags))
