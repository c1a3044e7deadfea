"""Camera rays: the first surface along each, by Embree, and frustum tests of boxes and hulls.

A ray passes through one-sided surfaces from behind, and through glass always. Pictures show glass
and textures with alpha as layers before the surfaces (`ptmtools.rendering.layers`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.embree import ray_tree
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.records import Sight
from ptmtools.tolerance import RAY_STEP_SHARE

#: Lines of the target screen.
LINES = 1080
#: Rays per call of Embree.
_BATCH = 1 << 18
#: Maximum number of surfaces along a ray.
_MAX_HITS = 16


@dataclass(frozen=True)
class RayCamera:
    """A pinhole camera with Y up.

    Attributes
    ----------
    width, height: pixels. field_of_view: vertical, radians. aspect: width over height of the view,
        independent of the number of pixels. lines: lines of the target screen.
    """

    width: int
    height: int
    field_of_view: float
    aspect: float
    lines: int = LINES

    @property
    def sparse(self) -> Bools:
        """(height * width,) pixels of a client's item buffer: every second pixel along each axis,
        from the second on."""
        odd = [np.arange(side) % 2 == 1 for side in (self.height, self.width)]
        result: Bools = np.outer(*odd).ravel()
        return result

    @property
    def pixel(self) -> float:
        """Side of a pixel of the target screen at depth 1, independent of the camera's own
        pixels."""
        return float(2 * np.tan(self.field_of_view / 2) / self.lines)

    def rays(self, direction: Floats) -> tuple[Floats, Floats]:
        """(F, height, width, 3) rays with component 1 along the view, from the top left, and
        (F, 2, 3) right and up vectors, for (F, 3) unit view directions."""
        right, up = axes(direction)
        tall = np.tan(self.field_of_view / 2)
        across = ((np.arange(self.width) + 0.5) / self.width * 2 - 1) * tall * self.aspect
        down = (1 - (np.arange(self.height) + 0.5) / self.height * 2) * tall
        rays = (
            direction[:, None, None]
            + across[None, None, :, None] * right[:, None, None]
            + down[None, :, None, None] * up[:, None, None]
        )
        return rays, np.stack([right, up], axis=1)


def axes(direction: Floats) -> tuple[Floats, Floats]:
    """(F, 3) right and up vectors of (F, 3) unit view directions; right is x for vertical views."""
    right = np.stack([-direction[:, 2], np.zeros(len(direction)), direction[:, 0]], axis=1)
    length = np.linalg.norm(right, axis=1, keepdims=True)
    right = np.where(length > 1e-9, right / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])
    return right, np.cross(right, direction)


class Caster:
    """Ray caster over the surfaces of a scene."""

    def __init__(self, surfaces: Surfaces, passed: Bools | None = None) -> None:
        """``passed``: (T,) surfaces that all rays pass through, glass by default."""
        corner = surfaces.corner
        self._which = np.flatnonzero(~(surfaces.glass if passed is None else passed))
        self._corner = corner
        self._normal = normals(corner)
        self._one_sided, self._seen = ~surfaces.two_sided, surfaces.seen
        low, high = corner.min(axis=(0, 1), initial=0), corner.max(axis=(0, 1), initial=0)
        self._middle = (low + high) / 2
        #: Offset of a ray's new origin behind a surface that it passed through, metres.
        self._step = RAY_STEP_SHARE * max(1.0, float((high - low).max()))
        self._tree: Any = None
        if len(self._which):
            self._tree = ray_tree(corner[self._which] - self._middle)
        self._fronts = Fronts(surfaces, self._which, self._middle)

    def look(self, camera: RayCamera, eye: Floats, direction: Floats) -> Sight:
        """Casts all rays of a camera from an eye (3,) in a direction (3,)."""
        rays, axes = camera.rays(direction[None])
        ray = rays.reshape(-1, 3)
        parts = np.array_split(ray, -(-len(ray) // _BATCH))
        triangle = np.concatenate([self.first(eye, part) for part in parts])
        return Sight(triangle, ray, axes[0], eye, camera.pixel)

    def first(self, eye: Floats, along: Floats) -> Ints:
        """(n,) first visible triangle along each of (n, 3) rays from a point (3,), -1 for none."""
        result = np.full(len(along), -1, np.int64)
        if self._tree is None:
            return result
        waiting = np.arange(len(along))
        start = np.repeat((eye - self._middle)[None], len(along), axis=0)
        for _ in range(_MAX_HITS):
            origin = start[waiting].astype(np.float32)
            hit = self._tree.run(origin, along[waiting].astype(np.float32), query="INTERSECT")
            met = hit >= 0
            waiting, triangle = waiting[met], self._which[hit[met]]
            turn = np.einsum("ij,ij->i", self._normal[triangle], along[waiting])
            passed = self._one_sided[triangle] & (turn > 0)
            behind = turn[~passed] > 0
            result[waiting[~passed]] = self._seen[triangle[~passed], behind.astype(np.int64)]
            waiting, triangle, turn = waiting[passed], triangle[passed], turn[passed]
            if not len(waiting):
                break
            to = self._corner[triangle, 0] - self._middle - start[waiting]
            distance = np.maximum(np.einsum("ij,ij->i", to, self._normal[triangle]) / turn, 0)
            step = self._step / np.linalg.norm(along[waiting], axis=1)
            start[waiting] += along[waiting] * (distance - step)[:, None]
            met = self._fronts.first_hit(start[waiting], along[waiting], 2 * step, triangle)
            result[waiting] = met
            start[waiting] += along[waiting] * (2 * step)[:, None]
            waiting = waiting[met < 0]
        return result


class Fronts:
    """The front in the place of a face that a ray passes through from behind: a wall may consist
    of two one-sided faces in one plane, of which Embree returns either."""

    def __init__(self, surfaces: Surfaces, which: Ints, middle: Floats) -> None:
        """``which``: the surfaces that may be fronts. ``middle``: (3,) origin of the rays."""
        self._which, self._middle = which, middle
        self._corner, self._seen = surfaces.corner, surfaces.seen
        self._normal, self._one_sided = normals(surfaces.corner), ~surfaces.two_sided
        #: (T,) 0 for faces with two sides; of two opposite faces one has 1 and the other -1.
        self._way = np.where(self._one_sided, _ways(self._normal), 0)
        #: Trees of the faces that may coincide with the back of one of a `_way`.
        self._others: dict[int, tuple[Any, Ints]] = {}

    def first_hit(self, start: Floats, along: Floats, length: Floats, back: Ints) -> Ints:
        """(n,) the visible triangle in the place of each of ``back``, -1 for none.

        start, along: (n, 3) of the rays, from the middle; length: (n,) of them.
        """
        result, ways = np.full(len(start), -1, np.int64), self._way[back]
        for way in np.unique(ways).tolist():
            rows = np.flatnonzero(ways == way)
            if way not in self._others:
                which = self._which[self._way[self._which] != way]
                tree = ray_tree(self._corner[which] - self._middle) if len(which) else None
                self._others[way] = tree, which
            tree, which = self._others[way]
            if tree is None:
                continue
            ray = start[rows].astype(np.float32), along[rows].astype(np.float32)
            hit = tree.run(*ray, dists=length[rows].astype(np.float32), query="INTERSECT")
            rows, triangle = rows[hit >= 0], which[hit[hit >= 0]]
            turn = np.einsum("ij,ij->i", self._normal[triangle], along[rows])
            faced = ~self._one_sided[triangle] | (turn <= 0)
            behind = turn[faced] > 0
            result[rows[faced]] = self._seen[triangle[faced], behind.astype(np.int64)]
        return result


def _ways(normal: Floats) -> Ints:
    """(T,) 1 or -1, opposite for opposite (T, 3) normals."""
    place = np.abs(normal).argmax(axis=1)
    return np.where(normal[np.arange(len(normal)), place] > 0, 1, -1)


#: Distance of the near plane, metres.
NEAR = 0.05
_CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64)


class Frustum:
    """View frustum at ``eye`` (3,) along ``direction`` (3,); ``angle`` is vertical, radians."""

    def __init__(self, eye: Floats, direction: Floats, angle: float, aspect: float) -> None:
        self.eye, self.direction = eye, direction
        self._tall, self._wide = np.tan(angle / 2), np.tan(angle / 2) * aspect

    @cached_property
    def _axes(self) -> tuple[Floats, Floats]:
        right, up = axes(self.direction[None])
        return right[0], up[0]

    @cached_property
    def _planes(self) -> Floats:
        """(5, 3) inward normals of the four sides, and the view direction."""
        right, up = self._axes
        ahead = self.direction
        wide, tall = ahead * self._wide, ahead * self._tall
        return np.array([wide + right, wide - right, tall + up, tall - up, ahead])

    def meets_boxes(self, low: Floats, high: Floats) -> Bools:
        """(n,) whether each box may meet the frustum; conservative near its corners."""
        normal = self._planes
        # Corner of each box farthest along each normal.
        farthest = np.where(normal[:, None] > 0, high[None], low[None]) - self.eye
        inside: Bools = (np.einsum("pij,pj->pi", farthest, normal) > 0).all(axis=0)
        return inside

    def meets_hull(self, points: Floats) -> bool:
        """Whether the convex hull of (n, 3) points may meet the frustum; conservative near its
        corners."""
        return bool(((points - self.eye) @ self._planes.T).max(axis=0).min() > 0)

    def distance(self, low: Floats, high: Floats) -> Floats:
        """(n,) distance from the eye to the nearest point of each box, metres."""
        outside = np.maximum(np.maximum(low - self.eye, self.eye - high), 0)
        return np.asarray(np.linalg.norm(outside, axis=1))

    def covered_shares(self, low: Floats, high: Floats) -> Floats:
        """(n,) share of the screen covered by the bounding rectangle of each projected box; 1 if
        the box reaches behind the camera."""
        right, up = self._axes
        corner = low[:, None] + (high - low)[:, None] * _CORNERS - self.eye
        depth = corner @ self.direction
        ahead = np.maximum(depth, NEAR)
        x = np.clip(corner @ right / ahead / self._wide, -1, 1)
        y = np.clip(corner @ up / ahead / self._tall, -1, 1)
        share = np.ptp(x, axis=1) * np.ptp(y, axis=1) / 4
        return np.where((depth > NEAR).all(axis=1), share, 1.0)
