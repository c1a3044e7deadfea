"""What viewers around an object see of it: parallel rays from many directions, by Embree.

The rays are those of no option, so meshes of any setting are compared at the same places: the
distance of the surfaces along each ray, and the rays that meet only one of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.embree import ray_tree

#: Directions of view, and rays along each side of a view.
DIRECTIONS, SIDE = 24, 96
_GOLDEN = np.pi * (3 - np.sqrt(5))


@dataclass(frozen=True)
class Rays:
    """Parallel rays around a box, all within its sphere.

    Attributes
    ----------
    start, along: (n, 3) origins, and unit directions.
    middle: (3,) subtracted before anything goes to float32. far: length of the rays.
    """

    start: Floats
    along: Floats
    middle: Floats
    far: float

    @staticmethod
    def around(points: Floats) -> Rays:
        """Rays at the box of (n, 3) points from all sides."""
        low, high = points.min(axis=0), points.max(axis=0)
        middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
        k = np.arange(DIRECTIONS) + 0.5
        height, turn = 1 - 2 * k / DIRECTIONS, _GOLDEN * k
        flat = np.sqrt(1 - height**2)
        ahead = np.stack([flat * np.cos(turn), height, flat * np.sin(turn)], axis=1)
        right = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin(axis=1)])
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        up = np.cross(right, ahead)
        place = ((np.arange(SIDE) + 0.5) / SIDE * 2 - 1) * radius
        x, y = (each.ravel()[:, None] for each in np.meshgrid(place, place))
        inside = (x**2 + y**2 < radius**2).ravel()
        start = [
            (x * r + y * u - radius * a)[inside] for a, r, u in zip(ahead, right, up, strict=True)
        ]
        along = np.repeat(ahead, int(inside.sum()), axis=0)
        return Rays(middle + np.concatenate(start), along, middle, 2 * radius)


@dataclass(frozen=True)
class Seen:
    """What rays meet.

    Attributes
    ----------
    triangle: (n,) of the mesh, -1 for none. weight: (n, 3) of its corners.
    distance: (n,) along the rays.
    """

    triangle: Ints
    weight: Floats
    distance: Floats

    @cached_property
    def met(self) -> Bools:
        """(n,) whether a ray meets the mesh."""
        return self.triangle >= 0


def look(rays: Rays, points: Floats, triangles: NDArray[np.int32]) -> Seen:
    """The first hits of rays on (T, 3) triangles between (P, 3) points."""
    tree = ray_tree(points - rays.middle, triangles)
    origin = np.ascontiguousarray(rays.start - rays.middle, dtype=np.float32)
    hits = tree.run(origin, rays.along.astype(np.float32), output=True)
    u, v = hits["u"].astype(np.float64), hits["v"].astype(np.float64)
    return Seen(
        hits["primID"].astype(np.int64),
        np.stack([1 - u - v, u, v], axis=1),
        hits["tfar"].astype(np.float64),
    )


def outline(one: Seen, other: Seen) -> float:
    """The share of the rays that meet only one of two meshes, of those that meet any."""
    return float((one.met != other.met).sum() / max(int((one.met | other.met).sum()), 1))


def apart(one: Seen, other: Seen) -> Floats:
    """Distances of two meshes along the rays that meet both."""
    both = one.met & other.met
    return np.asarray(np.abs(one.distance - other.distance)[both])
