"""Layout of the campus: the line of the street, the plots beside it, and frames for objects.

The street bends slightly every 250 m. s runs along it, t across it, positive to the right in the
direction of travel. Cosines and sines of its headings are rational, so results do not depend on the
last bit of a library.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from ptmtools.errors import InputError
from ptmtools_samples.campus.solids import Flat
from ptmtools_samples.mesh import Face, Point

HEADINGS: list[Flat] = [(60 / 61, -11 / 61), (1.0, 0.0), (40 / 41, 9 / 41), (1.0, 0.0)]
#: Metres: extension of the street at either end; then distances from its centre line: kerb, end of
#: the pavement, end of the front gardens, end of the campus, fronts of the buildings.
BEYOND, KERB, PAVEMENT, GARDEN, EDGE, FRONT = 30.0, 5.0, 8.5, 24.0, 66.0, 15.0
CURB_HEIGHT = 0.12
#: Minimum frontage of a plot, m: the widest building, and a margin at the bends.
LEAST_PLOT = 46.0


@dataclass(frozen=True)
class PlotFrame:
    """A local frame: x runs along ``right``, z along ``out``, y up from ``origin``."""

    origin: Point
    right: Flat
    out: Flat

    def point(self, p: Point) -> Point:
        (x, y, z), (rx, rz), (ox, oz) = self.origin, self.right, self.out
        return x + rx * p[0] + ox * p[2], y + p[1], z + rz * p[0] + oz * p[2]

    def place(self, faces: list[Face]) -> list[Face]:
        return [Face(f.material, tuple(self.point(p) for p in f.points), f.uv) for f in faces]


@dataclass(frozen=True)
class Plot:
    """The plot of a building: its interval of a street segment, on the right (1) or left (-1)."""

    number: int
    segment: int
    slot: int
    side: int
    low: float
    high: float


class Street:
    """The line of the street, its segments and plots."""

    def __init__(self, buildings: int, length: float) -> None:
        count = max(1, round(length / 250))
        slots = -(-buildings // 2)
        count = min(count, slots)
        self.segment_length = length / count
        shares = [slots * (k + 1) // count - slots * k // count for k in range(count)]
        if self.segment_length / max(shares) < LEAST_PLOT:
            least = round(LEAST_PLOT * max(shares) * count)
            raise InputError(
                "PTM-I111",
                f"{buildings} buildings do not fit on {length:g} m",
                remedy=f"use --length {least}",
            )
        self.headings = [HEADINGS[k % len(HEADINGS)] for k in range(count)]
        self.nodes: list[Flat] = [(0.0, 0.0)]
        for hx, hz in self.headings:
            x, z = self.nodes[-1]
            self.nodes.append((x + hx * self.segment_length, z + hz * self.segment_length))
        self.shares = shares
        self.plots: list[Plot] = []
        slot = 0
        for segment, share in enumerate(shares):
            for k in range(share):
                for side in (1, -1):
                    if len(self.plots) < buildings:
                        low, high = k / share, (k + 1) / share
                        self.plots.append(Plot(len(self.plots), segment, slot, side, low, high))
                slot += 1

    def mitre(self, node: int) -> Flat:
        """Displacement of the cross-section at a node per metre of t: the mitre of two segments."""
        a = self.headings[max(node - 1, 0)]
        b = self.headings[min(node, len(self.headings) - 1)]
        (ax, az), (bx, bz) = (-a[1], a[0]), (-b[1], b[0])
        share = 1 + ax * bx + az * bz
        return (ax + bx) / share, (az + bz) / share

    def mitre_point(self, segment: int, f: float, t: float) -> Flat:
        """The point at a share f of a segment, between its mitred ends."""
        (x, z), (X, Z) = self.nodes[segment : segment + 2]
        (p, q), (P, Q) = self.mitre(segment), self.mitre(segment + 1)
        a, b = (x + p * t, z + q * t), (X + P * t, Z + Q * t)
        return a[0] + (b[0] - a[0]) * f, a[1] + (b[1] - a[1]) * f

    def frame(self, segment: int, s: float, t: float, y: float, side: int) -> PlotFrame:
        """The frame at s metres along a segment and t across it, facing the street from a side."""
        (x, z), (hx, hz) = self.nodes[segment], self.headings[segment]
        out = (hz * side, -hx * side)
        return PlotFrame((x + hx * s - hz * t, y, z + hz * s + hx * t), (out[1], -out[0]), out)

    def line(self) -> list[Flat]:
        """The centre line of the street from end to end, including the parts beyond the plots."""
        (hx, hz), (kx, kz) = self.headings[0], self.headings[-1]
        (x, z), (X, Z) = self.nodes[0], self.nodes[-1]
        first, last = (x - hx * BEYOND, z - hz * BEYOND), (X + kx * BEYOND, Z + kz * BEYOND)
        return [first, *self.nodes, last]


def point_along(line: list[Flat], s: float) -> Flat:
    """The point of a polyline at s metres from its start."""
    for (x, z), (X, Z) in pairwise(line):
        length = ((X - x) * (X - x) + (Z - z) * (Z - z)) ** 0.5
        if s <= length:
            return x + (X - x) * s / length, z + (Z - z) * s / length
        s -= length
    return line[-1]
