"""Whether a line can pass a sequence of portals, in exact arithmetic.

The flow rejects a sequence when a polygon ends within a few roundings of a plane. Whether it ends
before or behind it is then beyond floating point, and is decided here: the same clipping (see
`flow`), in integers. A point is (X, Y, Z, W) with W > 0, a plane (A, B, C, D), the side of a point
the sign of their product. Coordinates are those of the kernels, which as binary fractions are
integers over a power of two; portals are made truly plane by moving their vertices along one axis.

What is decided so is decided of these coordinates, and their last digits are noise: in a building
that is turned, the edges of doors that meet in a line no longer do, by 1e-16 of its extent. Portals
are therefore drawn in by `Tolerance.noise` first. A line that passes has so much room on all sides.

Numbers grow with every cut. A new vertex with more than `BITS` is rounded *along its edge* to the
outer side, so that polygons only ever grow: what is found empty is so for certain, what is found
open may be open by 2⁻⁹⁶ of the distance from a vertex to a plane.

This is slow; `decide` asks it what nothing else can tell.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import gcd
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.tolerance import ROUNDING_SHARE, Tolerance
from ptmtools.visibility.storage import Geometry

Point = tuple[int, int, int, int]
Plane = tuple[int, int, int, int]
Line = tuple[int, int, int, int, int, int]
Polygon = list[Point]

#: Vertices with longer numbers are rounded outwards, their distances to `SHARE` bits.
BITS, SHARE = 512, 96
#: A sequence that takes longer numbers than this counts as open: one of e1m1 took a minute.
LONGEST = 8192


class _LengthError(Exception):
    """Numbers of more than `LONGEST` bits."""


class _Left(NamedTuple):
    """What a sequence leaves of its first portal and, from the second on, of its last, and the
    planes that bound all lines through both, the first one's own plane at the head."""

    source: Polygon
    passed: Polygon
    bounds: list[Plane]


class ExactPortals:
    """Portals with integer coordinates. Not to be shared between threads."""

    def __init__(self, geometry: Geometry) -> None:
        self._geometry = geometry
        self._portal: dict[int, tuple[Polygon, Plane]] = {}
        #: By sequence, all from one source: those of one search begin alike.
        self._left: dict[tuple[int, ...], _Left | None] = {}
        #: Those of them that take too long numbers.
        self._endless: set[tuple[int, ...]] = set()

    def passes(self, sequence: tuple[int, ...]) -> bool:
        """Whether something is left when a sequence of directed portals is clipped as the flow does
        it; False proves that no line passes the interiors of all of them in turn."""
        if sequence[:1] not in self._left:
            portal, plane = self._directed(sequence[0])
            self._left.clear()
            self._endless.clear()
            self._left[sequence[:1]] = _Left(portal, [], [plane])
        left = self._left[sequence[:1]]
        for length in range(2, len(sequence) + 1):
            if left is None:
                break
            part = sequence[:length]
            if part in self._endless:
                return True
            if part not in self._left:
                try:
                    self._left[part] = _beyond(left, *self._directed(part[-1]))
                except _LengthError:
                    self._endless.add(part)
                    return True
            left = self._left[part]
        return left is not None

    def vertices(self, k: int) -> Polygon:
        """The vertices of a portal, drawn in by `Tolerance.noise`, exactly in its plane."""
        return self._directed(2 * k)[0]

    def _directed(self, q: int) -> tuple[Polygon, Plane]:
        """The polygon of a directed portal and its plane, positive beyond it."""
        if q >> 1 not in self._portal:
            self._portal[q >> 1] = self._exactly(q >> 1)
        polygon, plane = self._portal[q >> 1]
        return polygon, plane if q & 1 == 0 else _turned(plane)

    def _exactly(self, k: int) -> tuple[Polygon, Plane]:
        g = self._geometry
        points = [_binary(row) for row in self._drawn_in(k).tolist()]
        a, b, c, _ = _binary(g.normal[k].tolist())
        x, y, z, w = points[0]
        plane = (a * w, b * w, c * w, -(a * x + b * y + c * z))
        axis = max(range(3), key=lambda i: abs(plane[i]))
        moved = []
        for point in points:
            side = _side(plane, point)
            # point - side / plane[axis] along the axis lies in the plane.
            scale = abs(plane[axis])
            shift = side if plane[axis] > 0 else -side
            new = [n * scale for n in point]
            new[axis] -= shift
            moved.append(_reduced((new[0], new[1], new[2], new[3])))
        return moved, plane

    def _drawn_in(self, k: int) -> NDArray[np.float64]:
        """(n, 3) the vertices of a portal, moved towards its middle, and no further."""
        g = self._geometry
        points = g.point[g.start[k] : g.start[k + 1]]
        inward = g.ball[k, :3] - points
        way = np.linalg.norm(inward, axis=1, keepdims=True)
        noise = Tolerance.for_extent(g.slack / ROUNDING_SHARE).noise
        share = np.divide(noise, way, out=np.ones_like(way), where=way > 0)
        moved: NDArray[np.float64] = points + np.minimum(share, 1.0) * inward
        return moved


def _beyond(left: _Left, portal: Polygon, plane: Plane) -> _Left | None:
    """The same with one more portal, nothing if no line passes that too."""
    portal = _clipped(portal, left.bounds)
    source = _clipped(left.source, [_turned(plane)])
    if portal and source and left.passed:
        portal = _clipped(portal, _separators(source, left.passed))
        source = _clipped(source, _separators(portal, left.passed)) if portal else []
    if not portal or not source:
        return None
    return _Left(source, portal, [left.bounds[0], *_separators(source, portal)])


def _binary(row: Sequence[float]) -> Point:
    """(X, Y, Z, W) of three floats, exactly; W is a power of two."""
    ratios = [value.as_integer_ratio() for value in row]
    w = max(d for _, d in ratios)
    x, y, z = (n * (w // d) for n, d in ratios)
    return x, y, z, w


def _side(plane: Plane, point: Point) -> int:
    return plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] + plane[3] * point[3]


def _turned(plane: Plane) -> Plane:
    return -plane[0], -plane[1], -plane[2], -plane[3]


def _reduced(n: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    common = gcd(*n)
    return n if common <= 1 else (n[0] // common, n[1] // common, n[2] // common, n[3] // common)


def _clipped(polygon: Polygon, planes: Sequence[Plane]) -> Polygon:
    """What of a polygon lies on the positive sides; nothing if that has no area."""
    for plane in planes:
        sides = [_side(plane, point) for point in polygon]
        if max(sides) <= 0:
            return []
        if min(sides) >= 0:
            continue
        kept = []
        following = [*range(1, len(polygon)), 0]
        for i, j in enumerate(following):
            if sides[i] >= 0:
                kept.append(polygon[i])
            if sides[i] > 0 > sides[j]:
                kept.append(_between(polygon[i], polygon[j], sides[i], -sides[j]))
            elif sides[i] < 0 < sides[j]:
                kept.append(_between(polygon[j], polygon[i], sides[j], -sides[i]))
        polygon = kept
    return polygon


def _between(inner: Point, outer: Point, inward: int, outward: int) -> Point:
    """The point of an edge that lies in a plane, ``inward`` and ``outward`` from its ends."""
    if inward.bit_length() + max(map(int.bit_length, outer)) > BITS:
        # Each of them by itself: they are as long as the numbers of the ends that they belong to.
        up = max(inward.bit_length() - SHARE, 0)
        down = max(outward.bit_length() - SHARE, 0)
        least = min(up, down)
        inward = (inward >> up) + (up > 0) << up - least
        outward = outward >> down << down - least
    x, y, z, w = (inward * o + outward * i for i, o in zip(inner, outer, strict=True))
    found = _reduced((x, y, z, w))
    if found[3].bit_length() > LONGEST:
        raise _LengthError
    return found


def _separators(near: Polygon, far: Polygon) -> list[Plane]:
    """All planes through an edge of the one and a vertex of the other polygon that have ``near`` on
    their negative and ``far`` on their positive side, neither wholly in them."""
    return [*_beside(near, far), *(_turned(plane) for plane in _beside(far, near))]


def _beside(edged: Polygon, other: Polygon) -> Iterator[Plane]:
    """The planes through an edge of ``edged``, on their negative side, that touch ``other``, on
    their positive side: each turns about its edge until nothing of ``other`` is behind it."""
    for i, end in enumerate(edged):
        line = _line(edged[i - 1], end)
        found: Plane | None = None
        for corner in other:
            if found is not None and _side(found, corner) >= 0:
                continue
            plane = _through(line, corner)
            sides = [_side(plane, point) for point in edged]
            if max(sides) > 0:
                found = _turned(plane)
            elif min(sides) < 0:
                found = plane
        if found is not None:
            plane = _reduced(found)
            behind = [_side(plane, point) for point in edged]
            beyond = [_side(plane, point) for point in other]
            if min(behind) < 0 >= max(behind) and max(beyond) > 0 <= min(beyond):
                yield plane


def _line(p: Point, q: Point) -> Line:
    """The line through two points: the 2 × 2 minors xy, xz, xw, yz, yw, zw of their coordinates."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (
        px * qy - py * qx,
        px * qz - pz * qx,
        px * qw - pw * qx,
        py * qz - pz * qy,
        py * qw - pw * qy,
        pz * qw - pw * qz,
    )


def _through(line: Line, point: Point) -> Plane:
    """The plane through a line and a point: the 3 × 3 minors."""
    xy, xz, xw, yz, yw, zw = line
    x, y, z, w = point
    return (
        y * zw - z * yw + w * yz,
        z * xw - x * zw - w * xz,
        x * yw - y * xw + w * xy,
        y * xz - x * yz - z * xy,
    )
