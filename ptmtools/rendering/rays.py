"""Camera rays: the first surface along each, by Embree, and the boxes and hulls in the frustum.

One-sided surfaces are passed through from behind, and glass always: it shows what is behind it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.embree import ray_tree
from ptmtools.output.served import Surfaces
from ptmtools.rendering.records import Sight

#: Lines of the screen that pictures are made for.
LINES = 1080
#: Rays that are cast at a time.
_RAYS = 1 << 18
#: Surfaces that a ray passes through before it is given up.
_LAYERS = 16


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with Y up.

    Attributes
    ----------
    width, height: pixels. field_of_view: vertical, radians. aspect: width over height of the view,
        whatever its pixels are. lines: of the screen that the picture is made for.
    """

    width: int
    height: int
    field_of_view: float
    aspect: float
    lines: int = LINES

    @property
    def sparse(self) -> Bools:
        """(height * width,) which pixels a client's own item buffer has: every other one each way,
        from the second on."""
        odd = [np.arange(side) % 2 == 1 for side in (self.height, self.width)]
        result: Bools = np.outer(*odd).ravel()
        return result

    @property
    def pixel(self) -> float:
        """Side of a pixel of the screen at depth 1, whatever the pixels of the camera are."""
        return float(2 * np.tan(self.field_of_view / 2) / self.lines)

    def rays(self, direction: Floats) -> tuple[Floats, Floats]:
        """(F, height, width, 3) rays of which the component along the view is 1, from the top left,
        and (F, 2, 3) right and up, for (F, 3) unit directions of view."""
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
    """(F, 3) right and up of (F, 3) unit directions of view; who looks straight up or down has x to
    the right."""
    right = np.stack([-direction[:, 2], np.zeros(len(direction)), direction[:, 0]], axis=1)
    length = np.linalg.norm(right, axis=1, keepdims=True)
    right = np.where(length > 1e-9, right / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])
    return right, np.cross(right, direction)


class Caster:
    """Casts rays at surfaces."""

    def __init__(self, surfaces: Surfaces) -> None:
        corner = surfaces.corner
        self._which = np.flatnonzero(~surfaces.glass)
        self._corner = corner
        self._normal = normals(corner)
        self._one_sided, self._seen = ~surfaces.two_sided, surfaces.seen
        low, high = corner.min(axis=(0, 1), initial=0), corner.max(axis=(0, 1), initial=0)
        self._middle = (low + high) / 2
        #: Metres by which a ray goes on behind what it passed through.
        self._step = 1e-6 * max(1.0, float((high - low).max()))
        self._tree: Any = None
        if len(self._which):
            self._tree = ray_tree(corner[self._which] - self._middle)

    def look(self, camera: Camera, eye: Floats, direction: Floats) -> Sight:
        """What is seen from an eye (3,) in a direction (3,)."""
        rays, axes = camera.rays(direction[None])
        ray = rays.reshape(-1, 3)
        parts = np.array_split(ray, -(-len(ray) // _RAYS))
        triangle = np.concatenate([self.first(eye, part) for part in parts])
        return Sight(triangle, ray, axes[0], eye, camera.pixel)

    def first(self, eye: Floats, along: Floats) -> Ints:
        """(n,) the triangle that each of (n, 3) rays from a point (3,) shows, or -1."""
        result = np.full(len(along), -1, np.int64)
        if self._tree is None:
            return result
        waiting = np.arange(len(along))
        start = np.repeat((eye - self._middle)[None], len(along), axis=0)
        for _ in range(_LAYERS):
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
            far = np.einsum("ij,ij->i", to, self._normal[triangle]) / turn
            length = np.linalg.norm(along[waiting], axis=1)
            start[waiting] += along[waiting] * (np.maximum(far, 0) + self._step / length)[:, None]
        return result


#: Nothing nearer than this is in front of the camera, metres.
NEAR = 0.05
_CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64)


class Frustum:
    """Of a camera at ``eye`` (3,) along ``direction`` (3,); ``angle`` is vertical, radians."""

    def __init__(self, eye: Floats, direction: Floats, angle: float, aspect: float) -> None:
        self.eye, self.direction = eye, direction
        self._tall, self._wide = np.tan(angle / 2), np.tan(angle / 2) * aspect

    @cached_property
    def _axes(self) -> tuple[Floats, Floats]:
        right, up = axes(self.direction[None])
        return right[0], up[0]

    @cached_property
    def _planes(self) -> Floats:
        """(5, 3) inward normals of the sides, and the view itself."""
        right, up = self._axes
        ahead = self.direction
        wide, tall = ahead * self._wide, ahead * self._tall
        return np.array([wide + right, wide - right, tall + up, tall - up, ahead])

    def meets_boxes(self, low: Floats, high: Floats) -> Bools:
        """(n,) which boxes reach into it; some that just pass by a corner count, too."""
        normal = self._planes
        # The corner of each box that is farthest along a normal.
        far = np.where(normal[:, None] > 0, high[None], low[None]) - self.eye
        inside: Bools = (np.einsum("pij,pj->pi", far, normal) > 0).all(axis=0)
        return inside

    def meets_hull(self, points: Floats) -> bool:
        """Whether the convex hull of (n, 3) points reaches into it, or passes by a corner."""
        return bool(((points - self.eye) @ self._planes.T).max(axis=0).min() > 0)

    def distance(self, low: Floats, high: Floats) -> Floats:
        """(n,) metres from the eye to the nearest point of each box."""
        outside = np.maximum(np.maximum(low - self.eye, self.eye - high), 0)
        return np.asarray(np.linalg.norm(outside, axis=1))

    def covered(self, low: Floats, high: Floats) -> Floats:
        """(n,) the share of the screen that the projected box around each box covers; all of it if
        the box reaches behind the camera."""
        right, up = self._axes
        corner = low[:, None] + (high - low)[:, None] * _CORNERS - self.eye
        depth = corner @ self.direction
        ahead = np.maximum(depth, NEAR)
        x = np.clip(corner @ right / ahead / self._wide, -1, 1)
        y = np.clip(corner @ up / ahead / self._tall, -1, 1)
        share = np.ptp(x, axis=1) * np.ptp(y, axis=1) / 4
        return np.where((depth > NEAR).all(axis=1), share, 1.0)
