"""How much of a PVS is too much? Its pairs of cells over those that rays show to see each other.

    python benchmarks/tightness.py DB... [--rays 100000000] [--lines 1000] [--aimed 20000]

Two answers, both upper bounds, since what no ray showed may be visible all the same. *Portals*:
random straight lines through the portals, then lines aimed at each pair that they left open; this
is about the flow alone. *Geometry*: segments between random points of the two cells of each pair
that is still open, against the structural triangles in Embree, until the rays are spent or a
hundred rounds in turn have shown nothing; half of the ends lie just inside a portal of their cell,
where the view is widest. This is about everything between: portals are convex hulls of their
openings, and what is too small to split a cell hides things without anybody taking note. The exit
status is 1 if a line shows a pair that is not in the PVS.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from prt import arriving

from ptmtools.cells.model import Cells
from ptmtools.cells.seen import portals_of
from ptmtools.cells.vectors import volumes
from ptmtools.pipeline.validation import structure_of
from ptmtools.visibility.pvs import lifted
from ptmtools.visibility.sampled import sampled_leaves
from ptmtools.visibility.segments import Blockers

#: Segments shot at once, and at each open pair in a round.
BATCH, EACH = 1 << 18, 64
#: Rounds that show nothing, one after the other, before it is enough.
SATURATED = 100
#: How far ends at portals are moved into the leaf, as a share of the way to its middle.
INWARD = 1e-3


@dataclass(frozen=True)
class Ends:
    """Random points of cells: simplices ordered by cell, and their weights summed up."""

    corners: NDArray[np.float64]  # (n, 3 or 4, 3)
    summed: NDArray[np.float64]  # (n + 1,)
    first: NDArray[np.int64]  # (C + 1,)

    @staticmethod
    def inside(cells: Cells) -> Ends:
        """Uniform in the volume of the cell."""
        corners, leaf = cells.tetrahedra()
        return Ends._ordered(cells, corners, volumes(corners), cells.leaf_cell[leaf])

    @staticmethod
    def at_portals(cells: Cells) -> Ends:
        """On a portal of the cell, each as likely as any, just inside the leaf."""
        corners, cell, weight = [np.zeros((0, 3, 3))], [np.zeros(0, np.int32)], [np.zeros(0)]
        for k in range(cells.portal_count):
            polygon = cells.portal(k)
            for leaf in cells.portal_leaf[k]:
                middle = cells.leaf_points(leaf).mean(axis=0)
                inward = polygon + INWARD * (middle - polygon)
                fan = np.stack(
                    [np.broadcast_to(inward[0], (len(polygon) - 2, 3)), inward[1:-1], inward[2:]],
                    axis=1,
                )
                area = np.linalg.norm(
                    np.cross(fan[:, 1] - fan[:, 0], fan[:, 2] - fan[:, 0]), axis=1
                )
                corners.append(fan)
                cell.append(np.full(len(fan), cells.leaf_cell[leaf]))
                weight.append(area / area.sum())
        return Ends._ordered(
            cells, np.concatenate(corners), np.concatenate(weight), np.concatenate(cell)
        )

    @staticmethod
    def _ordered(
        cells: Cells,
        corners: NDArray[np.float64],
        weight: NDArray[np.float64],
        cell: NDArray[np.int32],
    ) -> Ends:
        order = np.argsort(cell, kind="stable")
        first = np.searchsorted(cell[order], np.arange(cells.cell_count + 1))
        return Ends(corners[order], np.concatenate([[0.0], np.cumsum(weight[order])]), first)

    def points(self, rng: np.random.Generator, cell: NDArray[np.int64]) -> NDArray[np.float64]:
        """(n, 3), one in each of the cells (n,)."""
        low, high = self.summed[self.first[cell]], self.summed[self.first[cell + 1]]
        at = np.searchsorted(self.summed, low + rng.random(len(cell)) * (high - low), side="right")
        at = np.clip(at - 1, self.first[cell], self.first[cell + 1] - 1)
        weight = rng.exponential(size=(len(cell), self.corners.shape[1], 1))
        mixed: NDArray[np.float64] = (self.corners[at] * weight).sum(axis=1) / weight.sum(axis=1)
        return mixed


def by_portals(cells: Cells, visible: NDArray[np.bool_], lines: int, aimed: int) -> tuple[int, int]:
    """(pairs of cells that lines show, pairs that they show outside the PVS)."""
    portals = portals_of(cells)
    leaves = sampled_leaves(portals, lines)
    seen = lifted(cells, leaves)
    outside = int(np.count_nonzero(np.triu(seen & ~visible, 1)))
    # Open is what no pair of leaves of the two cells showed; any of them may.
    one, other = np.nonzero(np.triu(~leaves, 1))
    a, b = cells.leaf_cell[one], cells.leaf_cell[other]
    stands = cells.leaf_standing[one] | cells.leaf_standing[other]
    open_ = (a >= 0) & (b >= 0) & stands & visible[a, b] & ~seen[a, b]
    pairs = np.stack([one[open_], other[open_]], axis=1).astype(np.int32)
    shown = pairs[arriving(portals, pairs, aimed) > 0]
    seen[cells.leaf_cell[shown[:, 0]], cells.leaf_cell[shown[:, 1]]] = True
    seen |= seen.T
    return int(np.count_nonzero(np.triu(seen & visible, 1))), outside


def by_geometry(
    cells: Cells, visible: NDArray[np.bool_], structural: NDArray[np.float64], rays: int
) -> tuple[int, int]:
    """(pairs of cells that segments show, rays shot)."""
    inside, at_portals = Ends.inside(cells), Ends.at_portals(cells)
    blockers = Blockers(structural, cells.root_box)
    rng = np.random.default_rng(0)
    open_ = np.argwhere(np.triu(visible, 1))
    shown = shot = vain = 0
    while len(open_) and shot < rays and vain < SATURATED:
        clear = np.zeros(len(open_), dtype=np.bool_)
        step = max(1, BATCH // EACH)
        for first in range(0, len(open_), step):
            pairs = np.repeat(open_[first : first + step], EACH, axis=0)
            start, end = np.empty((len(pairs), 3)), np.empty((len(pairs), 3))
            # Inside to inside, portal to portal, and the two mixtures.
            for kind in range(4):
                for side, place, ends in ((0, start, kind & 1), (1, end, kind >> 1)):
                    source = at_portals if ends else inside
                    place[kind::4] = source.points(rng, pairs[kind::4, side])
            stands = [cells.leaf_standing[cells.locate_leaf(points)] for points in (start, end)]
            free = (stands[0] | stands[1]) & ~blockers.between(start, end)
            clear[first : first + step] = free.reshape(-1, EACH).any(axis=1)
            shot += len(pairs)
        shown += int(clear.sum())
        vain = 0 if clear.any() else vain + 1
        open_ = open_[~clear]
    return shown, shot


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("database", type=Path, nargs="+")
    parser.add_argument("--rays", type=int, default=100_000_000)
    parser.add_argument("--lines", type=int, default=1000, help="through each portal")
    parser.add_argument("--aimed", type=int, default=20_000, help="at each pair left open")
    given = parser.parse_args(arguments)
    print(
        f"{'database':24} {'pairs':>9} {'by lines':>9} {'ratio':>6} {'by rays':>9} {'ratio':>6}",
        end="",
    )
    print(f" {'rays':>12} {'s':>6}")
    wrong = False
    for path in given.database:
        begun = time.perf_counter()
        structural, cells, pvs = structure_of(path)
        visible = pvs.to_matrix()
        pairs = int(np.count_nonzero(np.triu(visible, 1)))
        lines, outside = by_portals(cells, visible, given.lines, given.aimed)
        seen, shot = by_geometry(cells, visible, structural, given.rays)
        print(
            f"{path.name:24} {pairs:9,} {lines:9,} {pairs / max(lines, 1):6.3f} {seen:9,} "
            f"{pairs / max(seen, 1):6.3f} {shot:12,} {time.perf_counter() - begun:6.1f}",
            flush=True,
        )
        if outside:
            print(f"    {outside} pairs of cells on one line are not in the PVS")
        wrong |= outside > 0
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
