"""The surfaces that occlude, rays of Embree among them, and points and directions spread evenly.

Directions over a point are denser by the cosine of their angle to the normal: a Hammersley set,
turned about the normal by an angle of each point's own, so that the error of few rays is a grain
and not bands.

Embree computes in float32. Its tree is built around the middle of the scene, and rays begin as far
above a surface as the scene's tolerance for planes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools import arrays
from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.embree import ray_tree
from ptmtools.jit import kernel
from ptmtools.scene.lights import Lights
from ptmtools.scene.model import Scene
from ptmtools.tolerance import DEPTH_SHARE

#: Glass that lets this share of each colour pass counts as clear; the faces of it on a ray that
#: count; and metres between the two sides of a pane at most.
CLEAR, _MOST_FACES, _THICK = 0.9, 16, 0.05
#: Rays that are cast together: their arrays stay within the processor's cache.
RAYS = 2**17
GOLDEN = 0.6180339887498949


@dataclass(frozen=True)
class Panes:
    """Coloured glass.

    Attributes
    ----------
    corner: (n, 3, 3) float32 of its faces, from the middle of the scene.
    passes: (n, 3) float32 the share of each colour that passes.
    lift: see `Occluders`.
    """

    corner: Singles
    passes: Singles
    lift: float

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name not in ("tree", "normal")}

    @cached_property
    def tree(self) -> Any:
        """Embree's tree."""
        return ray_tree(self.corner)

    @cached_property
    def normal(self) -> Singles:
        """(n, 3) unit normals."""
        return normals(self.corner.astype(np.float64)).astype(np.float32)

    def transmittance(self, origin: Singles, along: Singles, length: Singles) -> Singles:
        """(n, 3) the share of each colour that passes along rays of these lengths. Faces of one
        colour in one place are the sides of a pane, which counts once."""
        result = np.ones((len(origin), 3), np.float32)
        rows, start, rest = np.arange(len(origin)), origin, length
        # The face that a ray met before, and the way from there.
        before, way = np.full(len(origin), -1), np.zeros(len(origin), np.float32)
        for _ in range(_MOST_FACES):
            hit = self.tree.run(start, along[rows], dists=rest.copy(), output=True)
            met = hit["primID"] >= 0
            rows, face, reached = rows[met], hit["primID"][met], hit["tfar"][met]
            if not len(rows):
                break
            depth = np.abs(np.einsum("nx,nx->n", self.normal[face], along[rows]))
            depth *= way[rows] + reached
            last = before[rows]
            again = (last >= 0) & (depth <= _THICK)
            again &= (self.passes[face] == self.passes[last]).all(axis=1)
            result[rows[~again]] *= self.passes[face[~again]]
            before[rows] = np.where(again & (face != last), -1, face)
            beyond = reached + np.float32(self.lift)
            way[rows] = self.lift
            rest, start = rest[met] - beyond, start[met] + beyond[:, None] * along[rows]
        return result


@dataclass(frozen=True)
class Occluders:
    """The occluding surfaces.

    Attributes
    ----------
    points, triangles: (V, 3) metres and (T, 3), of the opaque faces.
    middle: (3,) subtracted before anything goes to float32.
    ground: height of the ground, metres.
    lift: height above its surface at which a ray begins, metres.
    panes: coloured glass, if there is any.
    """

    points: Floats
    triangles: NDArray[np.int32]
    middle: Floats
    ground: float
    lift: float
    panes: Panes | None = None

    @staticmethod
    def from_scene(
        scene: Scene, albedo: Floats | None = None, lights: Lights | None = None
    ) -> Occluders:
        """The opaque faces of a scene, and its glass that has a colour, with ``albedo``: (T, 3)
        mean reflectance of each face."""
        low, high = scene.points.min(axis=0), scene.points.max(axis=0)
        middle, lift = (low + high) / 2, scene.tolerance.plane
        panes = None
        if albedo is not None:
            passes = _passes(scene, albedo, lights)
            tinted = np.flatnonzero(passes.min(axis=1) < CLEAR)
            if len(tinted):
                corner = (scene.corners[tinted] - middle).astype(np.float32)
                panes = Panes(corner, passes[tinted], lift)
        triangles = scene.triangles[scene.opaque]
        return Occluders(scene.points, triangles, middle, float(low[1]), lift, panes)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "tree"}

    @property
    def size(self) -> float:
        """Metres beyond which nothing is, from any point of a surface."""
        across = self.points.max(axis=0) - self.points.min(axis=0)
        return float(2 * np.linalg.norm(across, axis=-1))

    @cached_property
    def tree(self) -> Any:
        """Embree's tree; None without faces."""
        if not len(self.triangles):
            return None
        return ray_tree(self.points - self.middle, self.triangles)

    def free(self, origin: Floats, target: Floats) -> Bools:
        """(n,) whether nothing is between (n, 3) points and their targets, (n, 3), on surfaces."""
        if self.tree is None:
            return np.ones(len(origin), np.bool_)
        start, along, short = self._rays_between(origin, target)
        return np.asarray(self.tree.run(start, along, dists=short, query="OCCLUDED") < 0)

    def transmittance(self, origin: Floats, target: Floats) -> Singles:
        """(n, 3) the share of each colour that passes from (n, 3) targets on surfaces to points,
        (n, 3); (n, 1) without coloured glass."""
        free = self.free(origin, target).astype(np.float32)[:, None]
        if self.panes is None:
            return free
        rows = np.flatnonzero(free)
        start, along, short = self._rays_between(origin[rows], target[rows])
        result = np.repeat(free, 3, axis=1)
        result[rows] = self.panes.transmittance(start, along, short)
        return result

    def _rays_between(self, origin: Floats, target: Floats) -> tuple[Singles, Singles, Singles]:
        """Origins, directions and lengths of rays that end before surfaces at (n, 3) targets."""
        way = target - origin
        distance = np.linalg.norm(way, axis=1)
        along = (way / np.maximum(distance, np.finfo(float).tiny)[:, None]).astype(np.float32)
        short = (distance * (1 - DEPTH_SHARE) - self.lift).astype(np.float32)
        return (origin - self.middle).astype(np.float32), along, short

    def upright(self, point: Floats, height: float, way: float) -> Floats:
        """(n,) the heights of the first surfaces above (``way`` 1) or below (-1) (n, 3) points, at
        most ``height`` away; the ground's where there is none."""
        result = np.full(len(point), self.ground)
        if self.tree is None:
            return result
        along = np.zeros((len(point), 3), np.float32)
        along[:, 1] = way
        limit = np.full(len(point), height + self.lift, np.float32)
        start = (point - self.middle).astype(np.float32)
        hit = self.tree.run(start, along, dists=limit.copy(), query="DISTANCE")
        blocked = hit < limit
        result[blocked] = (point[:, 1] + way * hit)[blocked]
        return result


def _passes(scene: Scene, albedo: Floats, lights: Lights | None) -> Singles:
    """(T, 3) the share of each colour that passes a face: as it shows what is white behind it, or
    with its own colour if it transmits light. Images with alpha are leaves and fences."""
    color = np.clip(albedo, 0, 1)
    share = np.array([
        m.opacity if m.opacity < 1 and (m.image < 0 or scene.images[m.image].plain) else 0.0
        for m in scene.materials
    ])  # fmt: skip
    if lights is not None:
        share = np.maximum(share, lights.transmits)
    return (1 - share[scene.triangle_material, None] * (1 - color)).astype(np.float32)


def hemisphere(samples: int) -> Singles:
    """(samples, 3) directions over z, with a density in proportion to the cosine."""
    number = np.arange(samples)
    inverse, digit, rest = np.zeros(samples), 0.5, number.copy()
    while rest.any():
        inverse += digit * (rest & 1)
        rest, digit = rest >> 1, digit / 2
    share, angle = (number + 0.5) / samples, 2 * math.pi * inverse
    out = np.sqrt(share)
    along = [out * np.cos(angle), out * np.sin(angle), np.sqrt(1 - share)]
    return np.stack(along, axis=1).astype(np.float32)


def normals(corner: Floats) -> Floats:
    """(T, 3) unit normals of (T, 3, 3) triangles; up for those without area."""
    across = arrays.normals(corner)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    return np.where(length > 0, across / np.where(length > 0, length, 1.0), [0.0, 1.0, 0.0])


def turns(count: int) -> Floats:
    """(count,) turns from 0 to 1, far apart in sequence."""
    return np.asarray(np.arange(count) * GOLDEN % 1.0)


@kernel
def rays_over(start: Floats, normal: Floats, turn: Floats, fan: Singles) -> tuple[Singles, Singles]:
    """(n * m, 3) origins and directions of rays: from each of (n, 3) points those of a (m, 3)
    ``fan`` over z, with z along (n, 3) unit normals, turned about them by (n,) turns."""
    origin = np.empty((len(start) * len(fan), 3), np.float32)
    along = np.empty_like(origin)
    frame = np.empty((3, 3), np.float32)
    for p in range(len(start)):
        # Duff et al. 2017, without a branch but for the sign.
        x, y, z = normal[p, 0], normal[p, 1], normal[p, 2]
        sign = -1.0 if z < 0 else 1.0
        a = -1.0 / (sign + z)
        b = x * y * a
        first = (1 + sign * x * x * a, sign * b, -sign * x)
        second = (b, sign + y * y * a, -y)
        c, s = np.cos(2 * np.pi * turn[p]), np.sin(2 * np.pi * turn[p])
        for axis in range(3):
            frame[0, axis] = c * first[axis] + s * second[axis]
            frame[1, axis] = c * second[axis] - s * first[axis]
            frame[2, axis] = normal[p, axis]
        for k in range(len(fan)):
            for axis in range(3):
                origin[p * len(fan) + k, axis] = start[p, axis]
                along[p * len(fan) + k, axis] = (
                    fan[k, 0] * frame[0, axis]
                    + fan[k, 1] * frame[1, axis]
                    + fan[k, 2] * frame[2, axis]
                )
    return origin, along


#: Multiples of these modulo 1 are far apart in both directions (Roberts' R2 sequence).
SPREAD = 0.7548776662466927, 0.5698402909980532


def points_on(corner: Floats, number: Ints) -> Floats:
    """(n, 3) a point in each of (n, 3, 3) triangles, by its (n,) number in a sequence whose points
    are far apart in one triangle."""
    along = np.sqrt(number * SPREAD[0] % 1.0)
    aside = number * SPREAD[1] % 1.0
    share = np.stack([1 - along, along * (1 - aside), along * aside], axis=1)
    return np.asarray(np.einsum("nk,nkx->nx", share, corner))


def spread_over(area: Floats, group: Ints, chosen: Ints, count: int) -> Ints:
    """(len(chosen), count) faces of each chosen group, each as often as its share of the group's
    area. ``area``, ``group``: (T,); chosen groups have some area."""
    order = np.argsort(group, kind="stable")
    total = np.concatenate([[0.0], np.cumsum(area[order])])
    first = np.searchsorted(group[order], chosen)
    last = np.searchsorted(group[order], chosen, side="right")
    share = (np.arange(count) + 0.5) / count
    place = total[first, None] + share * (total[last] - total[first])[:, None]
    index = np.searchsorted(total, place, side="right") - 1
    return np.asarray(order[np.clip(index, first[:, None], last[:, None] - 1)])
