"""Compares the portal flow on a Quake map with ericw-tools' ``vis``, leaf by leaf.

    python benchmarks/prt.py MAP.prt -o OUT.npz [--reference MAP.visible.npz] [--exact]

Reads PRT2 (N A B then N points in brackets per portal, then one line of leafs per cluster), runs
`ptmtools.portal_flow.flow.portal_flow` over the clusters, lifts the result to leafs and writes
``shape`` and ``visible`` (rows of big-endian bits). The reference is its AND with its transpose,
which is still conservative. Two tests check leaf pairs that only the reference contains:
``--lines`` random lines from a portal of one leaf to a portal of the other pass through the
portals; and double-double arithmetic clips every sequence of portals between them. A line that
arrives proves that the flow misses a pair (exit status 1); if every sequence is clipped to nothing,
no such line exists. CPU time is that of the process, after one warm-up that loads or compiles the
kernels, including those that decide near ties.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.parallel import open_executor
from ptmtools.portal_flow.double_double import SequenceTest
from ptmtools.portal_flow.flow import PortalFlow, Portals, geometry, leaf_matrix, portal_flow
from ptmtools.tolerance import Tolerance
from ptmtools.visibility.options import PvsOptions


def read_prt(path: Path) -> tuple[Portals, NDArray[np.int64]]:
    """The portals between clusters, and the (leafs,) cluster of each leaf."""
    lines = path.read_text().split("\n")
    if lines[0].strip() != "PRT2":
        raise SystemExit(f"{path}: not a PRT2 file")
    leafs, clusters, count = (int(line) for line in lines[1:4])
    ends = np.zeros((count, 2), np.int32)
    normal = np.zeros((count, 3))
    polygons = []
    for k, line in enumerate(lines[4 : 4 + count]):
        words = line.replace("(", " ").replace(")", " ").split()
        ends[k] = int(words[1]), int(words[2])
        points = np.array(words[3:], dtype=np.float64).reshape(int(words[0]), 3)
        arm = points - points[0]
        area = np.cross(arm[1:-1], arm[2:]).sum(axis=0)
        normal[k] = area / np.linalg.norm(area)  # counter-clockwise seen from the second cluster
        polygons.append(points)
    cluster = np.full(leafs, -1, np.int64)
    for c, line in enumerate(lines[4 + count : 4 + count + clusters]):
        cluster[[int(word) for word in line.split()[:-1]]] = c
    start = np.cumsum([0, *(len(p) for p in polygons)])
    return Portals(clusters, ends, normal, np.concatenate(polygons), start), cluster


def visible_leafs(portals: Portals, flow: PortalFlow, cluster: NDArray[np.int64]) -> NDArray:
    """(leafs, leafs) bool from the flow over clusters; a leaf outside all clusters sees nothing."""
    seen = leaf_matrix(portals, flow)
    inside = cluster >= 0
    return seen[cluster][:, cluster] & inside[:, None] & inside


def arriving(
    portals: Portals, pairs: NDArray[np.int64], lines: int, seed: int = 0
) -> NDArray[np.int64]:
    """(n,) how many of ``lines`` random lines lead from leaf to leaf, for (n, 2) pairs of leaves.

    A line starts at a random point of a portal out of the first leaf, aims at a random point of
    a portal into the second, and is walked from leaf to leaf by point-in-polygon tests alone. One
    that runs in a portal's plane does not cross it.
    """
    sizes = np.diff(portals.start)
    widest = int(sizes.max())
    corner = np.minimum(np.arange(widest), sizes[:, None] - 1)
    polygon = portals.point[portals.start[:-1, None] + corner]  # last vertex repeated
    leaves, enters = portals.leaf.reshape(-1), portals.leaf[:, ::-1].reshape(-1)
    out = np.argsort(leaves, kind="stable")
    out_start = np.searchsorted(leaves[out], np.arange(portals.leaf_count + 1))
    rng = np.random.default_rng(seed)
    rounding = Tolerance.for_points(portals.point).rounding

    def towards(p: NDArray[np.int64]) -> NDArray[np.float64]:
        return portals.normal[p >> 1] * np.where(p & 1, -1.0, 1.0)[:, None]

    def points(p: NDArray[np.int64]) -> NDArray[np.float64]:
        weight = rng.exponential(size=(len(p), widest)) * (np.arange(widest) < sizes[p >> 1, None])
        return np.einsum("ij,ijk->ik", weight / weight.sum(axis=1, keepdims=True), polygon[p >> 1])

    actual = np.zeros(len(pairs), np.int64)
    for row, (a, b) in enumerate(pairs):
        first = rng.choice(np.flatnonzero(leaves == a), lines)
        origin = points(first)
        along = points(rng.choice(np.flatnonzero(enters == b), lines)) - origin
        crossing = np.einsum("ij,ij->i", towards(first), along) > rounding
        origin, along, at = origin[crossing], along[crossing], enters[first[crossing]]
        for _ in range(portals.leaf_count):
            if len(at) == 0:
                break
            actual[row] += int((at == b).sum())
            on = at != b
            origin, along, at = origin[on], along[on], at[on]
            degree = out_start[at + 1] - out_start[at]
            line = np.repeat(np.arange(len(at)), degree)
            nth = np.arange(len(line)) - np.repeat(np.cumsum(degree) - degree, degree)
            p = out[out_start[at][line] + nth]
            n = towards(p)
            shape = polygon[p >> 1]
            speed = np.einsum("ij,ij->i", n, along[line])
            ahead = np.flatnonzero(speed > rounding)
            line, p, n, shape = line[ahead], p[ahead], n[ahead], shape[ahead]
            reach = np.einsum("ij,ij->i", n, shape[:, 0] - origin[line]) / speed[ahead]
            place = origin[line] + reach[:, None] * along[line]
            edge = np.roll(shape, -1, axis=1) - shape
            side = np.cross(edge, place[:, None] - shape) @ portals.normal[p >> 1][..., None]
            inside = np.all(side[..., 0] >= 0, axis=1)
            line, first_hit = np.unique(line[inside], return_index=True)
            at = enters[p[inside][first_hit]]
            origin, along = origin[line], along[line]
    return actual


class Sequences:
    """All sequences of portals from leaf to leaf, in double-double arithmetic."""

    def __init__(self, portals: Portals, may: NDArray[np.bool_]) -> None:
        """``may`` (L, L): only leaves are passed that may see both ends; a line that passes others
        has come to its end."""
        self._test = SequenceTest(geometry(portals))
        self._leaves = portals.leaf.reshape(-1).tolist()
        self._enters = portals.leaf[:, ::-1].reshape(-1).tolist()
        self._out: list[list[int]] = [[] for _ in range(portals.leaf_count)]
        for q, leaf in enumerate(self._leaves):
            self._out[leaf].append(q)
        self._may = may
        self.clipped = 0

    def refuted(self, a: int, b: int) -> bool:
        """Whether of each sequence from a to b, or of a part of it, or of the way back, nothing is
        left. As the flow does, every portal into b is clipped by the planes of the sequence so far.
        """
        passable = self._may[a] & self._may[b]
        into = [q ^ 1 for q in self._out[b]]
        stack = [(q,) for q in self._out[a] if passable[self._enters[q]]]
        while stack:
            sequence = stack.pop()
            if not self._test.passes(sequence):
                self.clipped += 1
                continue
            leaf = self._enters[sequence[-1]]
            if leaf == b:
                if self._passes_in_parts(sequence):
                    return False
                self.clipped += 1
                continue
            if not any(q not in sequence and self._test.passes((*sequence, q)) for q in into):
                self.clipped += 1
                continue
            passed = {self._leaves[q] for q in sequence}
            onward = [q for q in self._out[leaf] if self._enters[q] not in passed]
            stack += [(*sequence, q) for q in onward if passable[self._enters[q]]]
        return True

    def _passes_in_parts(self, sequence: tuple[int, ...]) -> bool:
        """Whether each part passes, both ways, and each later portal together with its beginning:
        of a sequence only the first and last portal narrow, and the last planes bound it."""
        back = tuple(q ^ 1 for q in reversed(sequence))
        return all(
            self._test.passes(way[first:]) and self._passes_ahead(way[first:])
            for way in (back, sequence)
            for first in range(len(way) - 1)
        )

    def _passes_ahead(self, part: tuple[int, ...]) -> bool:
        return all(
            self._test.passes((*part[:length], q))
            for length in range(1, len(part))
            for q in part[length:]
        )


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("map", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--reference", type=Path)
    parser.add_argument("--budget", type=int, default=PvsOptions().budget)
    parser.add_argument("--lines", type=int, default=2000)
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args(arguments)

    portals, cluster = read_prt(given.map)
    small = portals.start[1]
    portal_flow(
        Portals(
            portals.leaf_count,
            portals.leaf[:1],
            portals.normal[:1],
            portals.point[:small],
            portals.start[:2],
        ),
        1,
    )
    SequenceTest(geometry(portals)).passes((0, 2))
    cpu, wall = time.process_time(), time.perf_counter()
    with open_executor(given.workers) as executor:
        flow = portal_flow(portals, given.budget, executor=executor)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    ours = visible_leafs(portals, flow, cluster)
    np.savez_compressed(given.output, shape=np.array(ours.shape), visible=np.packbits(ours, axis=1))
    print(
        f"{given.map.name}: {len(ours)} leafs, {len(portals.leaf)} portals, "
        f"average visible {ours.sum() / len(ours):.2f}, CPU {cpu:.2f} s, wall {wall:.2f} s, "
        f"{flow.operations / 1e6:.2f} M operations ({flow.operations / 1e6 / cpu:.2f} M/s), "
        f"cut short {int(flow.cut.sum())}; {int(flow.ties.sum()):,} near ties, "
        f"{int(flow.decided.sum()):,} decided in double-double, {int(flow.opened.sum()):,} open"
    )
    if given.reference:
        with np.load(given.reference) as stored:
            shape = tuple(stored["shape"])
            bits = np.unpackbits(stored["visible"], axis=1, count=shape[1])
        theirs = bits.astype(bool)
        both = theirs & theirs.T
        print(
            f"reference: average {theirs.sum() / len(theirs):.2f}, symmetric "
            f"{both.sum() / len(both):.2f}; equal {np.mean(ours == both):.4%}, "
            f"ours only {int((ours & ~both).sum())}, theirs only {int((both & ~ours).sum())}"
        )
        lost = np.argwhere(np.triu(both & ~ours))
        lost = np.unique(np.sort(cluster[lost], axis=1), axis=0)
        arrived = arriving(portals, lost, given.lines)
        print(
            f"theirs only: {len(lost)} pairs of clusters, {given.lines} lines each, "
            f"{int((arrived > 0).sum())} pairs really see each other"
        )
        seen = leaf_matrix(portals, flow)
        for one, other in np.argwhere(both):
            seen[cluster[one], cluster[other]] = True
        sequences = Sequences(portals, seen)
        hidden = [sequences.refuted(*pair) for pair in lost.tolist()]
        print(
            f"in double-double {sum(hidden)} of {len(hidden)} pairs cannot see each other "
            f"({sequences.clipped:,} sequences of portals clipped to nothing)"
        )
        return int(arrived.any())
    return 0


if __name__ == "__main__":
    sys.exit(main())
