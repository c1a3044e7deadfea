"""Where a cell is looked from: points spread uniformly over its volume, best first.

The paper takes "samples per cell whose COPs are uniformly distributed inside the cell" (§5).
Position matters far more than resolution, so the points are stratified: the volume is filled with
a low-discrepancy cloud, the cloud is halved again and again along its longest axis into as many
parts of equal volume as there are samples, and each part is looked at from the point nearest to
its centroid. Where that turns out to be unusable, another point of the same part takes its place,
and the rest of the cell keeps its share of the samples. Rejected: independent random points, and
a random point of each part; both are noisier (docs/coverage.md).

A cell is a union of disjoint convex leaves; a leaf is cut into tetrahedra around its centroid.
The cloud is a Kronecker sequence in integer arithmetic (Roberts' generalised golden ratio in
four dimensions: one picks the tetrahedron, three the point in it), so it is the same on every
machine and for every version of every library, and depends on nothing but the leaves and the seed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells

#: Points of the cloud for each sample asked for: enough that parts of equal count are parts of
#: equal volume within a few percent.
CLOUD = 256
#: Points that a part of the cell offers, evenly picked from its share of the cloud.
TRIES = 32
#: Fractional parts of 1/g, 1/g², 1/g³, 1/g⁴ in units of 2⁻⁶⁴, where g⁵ = g + 1.
STEPS = np.array(
    [15802862336838869349, 13537915256980136287, 11597591980405560693, 9935365762805847689],
    dtype=np.uint64,
)


def tetrahedra(cells: Cells, cell: int) -> NDArray[np.float64]:
    """(n, 4, 3) disjoint tetrahedra that fill a cell, metres; flat ones are left out."""
    found: list[NDArray[np.float64]] = []
    for leaf in cells.cell_leaves(cell):
        centroid = cells.leaf_points(int(leaf)).mean(axis=0)
        for loop in cells.leaf_faces(int(leaf)):
            face = cells.leaf_point[loop]
            fan = np.empty((max(len(face) - 2, 0), 4, 3))
            fan[:, 0] = centroid
            fan[:, 1] = face[0]
            fan[:, 2] = face[1:-1]
            fan[:, 3] = face[2:]
            found.append(fan)
    every = np.concatenate(found) if found else np.zeros((0, 4, 3))
    return every[volumes(every) > 0]


def volumes(tetra: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) volumes of (n, 4, 3) tetrahedra, m³."""
    a, b, c = (tetra[:, 1:] - tetra[:, :1]).transpose(1, 0, 2)
    return np.asarray(np.abs(np.einsum("ij,ij->i", a, np.cross(b, c))) / 6, dtype=np.float64)


def kronecker(count: int, seed: int) -> NDArray[np.float64]:
    """(count, 4) points of the unit cube, evenly spread; ``seed`` picks the stretch of the
    sequence."""
    first = (1 + seed * count) % 2**64
    index = np.arange(count, dtype=np.uint64) + np.uint64(first)
    fixed = index[:, None] * STEPS  # whole turns drop out: wraps modulo 2⁶⁴ on purpose
    return np.asarray((fixed >> np.uint64(11)).astype(np.float64) * 2.0**-53)


def cloud(tetra: NDArray[np.float64], count: int, seed: int) -> NDArray[np.float64]:
    """(count, 3) points uniform in the union of (n, 4, 3) tetrahedra, metres."""
    share = np.cumsum(volumes(tetra))
    at = kronecker(count, seed)
    which = np.minimum(np.searchsorted(share / share[-1], at[:, 0], "right"), len(tetra) - 1)
    # The gaps between three sorted numbers and the ends of [0, 1] are uniform barycentric
    # coordinates.
    cut = np.sort(at[:, 1:], axis=1)
    weight = np.diff(cut, axis=1, prepend=0.0, append=1.0)
    base = tetra[which, 0]
    offset = np.einsum("ij,ijk->ik", weight[:, 1:], tetra[which, 1:] - base[:, None])
    return np.asarray(base + offset, dtype=np.float64)


def strata(points: NDArray[np.float64], parts: int) -> list[NDArray[np.int64]]:
    """Indices of the (n, 3) points in ``parts`` groups of equal size, compact in space.

    Each group is halved across its longest axis; an odd number of parts is divided as evenly as
    it goes. Within a group the points are in order of their distance from its centroid.
    """
    pending = [(np.arange(len(points), dtype=np.int64), parts)]
    done: list[NDArray[np.int64]] = []
    while pending:
        group, share = pending.pop()
        here = points[group]
        if share == 1:
            away = np.sum((here - here.mean(axis=0)) ** 2, axis=1)
            done.append(group[np.argsort(away, kind="stable")])
            continue
        axis = int(np.argmax(np.ptp(here, axis=0)))
        order = group[np.argsort(here[:, axis], kind="stable")]
        low = share // 2
        middle = len(order) * low // share
        pending.append((order[middle:], share - low))
        pending.append((order[:middle], low))
    return done


def candidates(cells: Cells, cell: int, samples: int, seed: int) -> list[NDArray[np.float64]]:
    """For each of ``samples`` equal parts of a cell (TRIES, 3) points, from its centroid outwards;
    empty if the cell has no volume."""
    tetra = tetrahedra(cells, cell)
    if len(tetra) == 0:
        return []
    points = cloud(tetra, CLOUD * samples, seed)
    return [points[group[:: CLOUD // TRIES]] for group in strata(points, samples)]
