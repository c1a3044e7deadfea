"""Detail recognised by its shape: furniture, statues, plants, which can neither split nor block.

What divides a building and what hides is flat: a polygon that lies in a plane with others, a jamb,
the edge of a slab. A sofa of 50,000 triangles has none of that, but each of its triangles would be
asked whether it does. So what is small, dense and round is taken for detail, as if `--detail` named
it: connected pieces first, then whole objects, for a plant is a thousand pieces.

To err is safe: what is taken for detail hides nothing, so the visible sets can only grow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.facets import Facets
from ptmtools.cells.vectors import summed
from ptmtools.cells.welding import Welded

#: Detail fits into a box of this side, metres: the longest sofas and shelves.
LARGEST = 3.0
#: It is dense: it has at least so many triangles,
DENSE = 256
#: and compact: neither a sheet nor a rod. Its box's shortest side over its longest.
COMPACT = 0.1
#: Flat regions smaller than this share of `SubdivideOptions.wall_area` neither split nor block.
FLAT_SHARE = 0.01
#: No flat region of it is larger than this share of `SubdivideOptions.wall_area`,
LARGEST_FLAT_SHARE = 0.25
#: and no more of its surface than this is flat.
FLAT = 2 / 3


@dataclass(frozen=True)
class Groups:
    """Triangles in groups, and what their shape is."""

    size: Ints  # (g,) triangles
    box: Floats  # (g, 3) sides of their bounding boxes, ascending, metres
    area: Floats  # (g,) m²
    flat: Floats  # (g,) m² in flat regions that could split or block
    flattest: Floats  # (g,) m² of the largest flat region

    @staticmethod
    def of(group: Ints, facets: Facets, wall_area: float) -> Groups:
        """``group``: (n,) of each triangle, from 0."""
        count = int(group.max(initial=-1)) + 1
        order = np.argsort(group, kind="stable")
        size = np.bincount(group, minlength=count)
        corners = facets.mesh.corners[order]
        begin = np.cumsum(size) - size
        low = np.minimum.reduceat(corners.min(axis=1), begin)
        high = np.maximum.reduceat(corners.max(axis=1), begin)
        large = np.where(facets.whole, facets.area, 0.0)[facets.region]
        area = facets.areas
        flat = np.where(large >= FLAT_SHARE * wall_area, area, 0.0)
        return Groups(
            size,
            np.sort(high - low, axis=1),
            summed(group, area, count),
            summed(group, flat, count),
            np.maximum.reduceat(large[order], begin),
        )

    def detail(self, wall_area: float) -> Bools:
        """(g,) which of them are detail."""
        dense = self.size >= DENSE
        small = (self.box[:, 2] <= LARGEST) & (self.box[:, 0] >= COMPACT * self.box[:, 2])
        curved = self.flat <= FLAT * self.area
        curved &= self.flattest <= LARGEST_FLAT_SHARE * wall_area
        found: Bools = dense & small & curved
        return found


def recognised(facets: Facets, object_of: NDArray[np.integer], wall_area: float) -> Bools:
    """(n,) which triangles of a mesh are detail by their shape; ``object_of``: (n,) the object of
    each."""
    if not len(object_of):
        return np.zeros(0, dtype=bool)
    found = np.zeros(len(object_of), dtype=bool)
    for group in (connected_pieces(facets.mesh), np.unique(object_of, return_inverse=True)[1]):
        found |= Groups.of(group, facets, wall_area).detail(wall_area)[group]
    return found


def connected_pieces(mesh: Welded) -> Ints:
    """(n,) the piece of each triangle: those that share corners, directly or over others."""
    from ptmtools.cells.facet_kernels import hang_together

    parent = np.arange(len(mesh.point))
    hang_together(mesh.triangle, parent)
    return np.unique(parent[mesh.triangle[:, 0]], return_inverse=True)[1].reshape(-1)
