"""The light at a point: ambient occlusion by rays of Embree, and points spread over surfaces.

Rays go out into the hemisphere over a point, denser by the cosine of their angle to the normal, and
the light is the share of them that escape. The directions are a Hammersley set, turned about the
normal by an angle of each point's own, so that the error of few rays is a grain and not bands. All
opaque faces and a level ground under the scene occlude. A ray with a hit at distance d counts
d / reach, and 1 beyond (ambient obscurance, Zhukov, Iones and Kronin 1998): with plain occlusion,
``reach`` inf, rooms are black.

Embree computes in float32. Its tree is built around the middle of the scene, and rays begin as far
above a surface as the scene's tolerance for planes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools import arrays
from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.embree import ray_tree
from ptmtools.scene.model import Scene
from ptmtools.tolerance import DEPTH_SHARE

#: Rays that are cast together: their arrays stay within the processor's cache.
RAYS = 2**17
_GOLDEN = 0.6180339887498949


@dataclass(frozen=True)
class Occluders:
    """The occluding surfaces.

    Attributes
    ----------
    points, triangles: (V, 3) metres and (T, 3), of the opaque faces.
    middle: (3,) subtracted before anything goes to float32.
    ground: height of the ground, metres.
    lift: height above its surface at which a ray begins, metres.
    """

    points: Floats
    triangles: NDArray[np.int32]
    middle: Floats
    ground: float
    lift: float

    @staticmethod
    def from_scene(scene: Scene) -> Occluders:
        """The opaque faces of a scene."""
        low, high = scene.points.min(axis=0), scene.points.max(axis=0)
        return Occluders(
            scene.points,
            scene.triangles[scene.opaque],
            (low + high) / 2,
            float(low[1]),
            scene.tolerance.plane,
        )

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "tree"}

    @cached_property
    def tree(self) -> Any:
        """Embree's tree; None without faces."""
        if not len(self.triangles):
            return None
        return ray_tree(self.points - self.middle, self.triangles)

    def free(self, origin: Floats, target: Floats) -> Bools:
        """(n,) whether nothing is between (n, 3) points and their targets, (n, 3), on surfaces."""
        way = target - origin
        distance = np.linalg.norm(way, axis=1)
        if self.tree is None:
            return np.ones(len(distance), np.bool_)
        along = (way / np.maximum(distance, np.finfo(float).tiny)[:, None]).astype(np.float32)
        start = (origin - self.middle).astype(np.float32)
        short = (distance * (1 - DEPTH_SHARE) - self.lift).astype(np.float32)
        # A copy: Embree writes into its arguments.
        hit = self.tree.run(start, along, dists=short.copy(), query="DISTANCE")
        return np.asarray(hit >= short)

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


def move_outwards(around: Occluders, point: Floats, normal: Floats, within: float) -> Floats:
    """(n, 3) points moved to the outermost surface within ``within`` metres along their normals,
    before or behind them; unchanged without one.

    The model's own faces would shade those of a coarse mesh beneath them.
    """
    if around.tree is None or within <= around.lift:
        return point
    start = (point + within * normal - around.middle).astype(np.float32)
    limit = np.full(len(point), 2 * within, np.float32)
    back = (-normal).astype(np.float32)
    distance = around.tree.run(start, back, dists=limit.copy(), query="DISTANCE")
    moved = np.where(distance < limit, within - distance.astype(np.float64), 0.0)
    return np.asarray(point + moved[:, None] * normal)


def light(
    around: Occluders,
    point: Floats,
    normal: Floats,
    turn: Floats,
    samples: int,
    reach: float,
    above: float = 0.0,
) -> Singles:
    """(n,) light from 0 to 1 at (n, 3) points with (n, 3) unit normals.

    Parameters
    ----------
    turn: (n,) rotation of the directions about the normals, in turns from 0 to 1.
    samples, reach: number of rays for each point; metres, beyond which surfaces do not occlude.
    above: by how much less light comes from straight below than from straight above, in [0, 1]. Of
        a level surface in the open, the light stays 1.
    """
    return light_and_sky(around, point, normal, turn, samples, reach, above, sky=False)[0]


def light_and_sky(
    around: Occluders,
    point: Floats,
    normal: Floats,
    turn: Floats,
    samples: int,
    reach: float,
    above: float = 0.0,
    *,
    sky: bool = True,
) -> tuple[Singles, Singles]:
    """(n,) light as of `light`, and (n,) the share of the same rays that reach the sky: they meet
    nothing opaque at any distance, nor the ground. Without ``sky``, 0: rays end at ``reach``."""
    result, open_share = np.empty(len(point), np.float32), np.zeros(len(point), np.float32)
    for part, origin, along in _fans(around, point, normal, turn, samples):
        start = origin.astype(np.float32)
        share, unmet = _ray_light(around, start, along, reach, math.inf if sky else reach)
        if above:
            share *= (1 - above * (1 - along[:, 1]) / 2) / (1 - above / 6)
        result[part] = share.reshape(-1, samples).mean(axis=1)
        if sky:
            open_share[part] = unmet.reshape(-1, samples).mean(axis=1)
    return result, open_share


def _fans(
    around: Occluders, point: Floats, normal: Floats, turn: Floats, samples: int
) -> Iterator[tuple[slice, Floats, Singles]]:
    """Runs of points, with the (k, 3) origins of the rays from these, relative to the middle of the
    scene, and their (k, 3) directions; see `light`."""
    fan, step = hemisphere(samples), max(1, RAYS // samples)
    for at in range(0, len(point), step):
        part = slice(at, at + step)
        along = (fan @ tangent_frames(normal[part], turn[part])).reshape(-1, 3)
        lifted = point[part] + around.lift * normal[part] - around.middle
        yield part, np.repeat(lifted, samples, axis=0), along


def count_escapes(
    around: Occluders,
    point: Floats,
    normal: Floats,
    turn: Floats,
    samples: int,
    bounces: int,
) -> Ints:
    """(n,) the number of ``samples`` walks from (n, 3) points into the hemispheres over (n, 3)
    normals that reach the sky, each reflected by surfaces at most ``bounces`` times. ``turn`` as of
    `light`."""
    fan = hemisphere(samples)
    count = np.zeros(len(point), np.int64)
    for part, origin, along in _fans(around, point, normal, turn, samples):
        walk = np.arange(len(origin))
        for bounce in range(bounces + 1):
            length, against = _first_hits(around, origin, along)
            out = np.isinf(length)
            count[part] += np.bincount(walk[out] // samples, minlength=len(count[part]))
            if bounce == bounces or out.all():
                break
            kept = ~out
            origin, walk, back = origin[kept], walk[kept], against[kept]
            origin = origin + length[kept, None] * along[kept] + around.lift * back
            ways = fan[(walk * 5 + 3 * bounce + 1) % samples]
            turned = np.asarray((walk + bounce + 1) * _GOLDEN % 1.0, np.float64)
            frames = tangent_frames(back, turned)
            along = np.einsum("nk,nkx->nx", ways, frames)
    return count


def _first_hits(around: Occluders, origin: Floats, along: Singles) -> tuple[Floats, Floats]:
    """(n,) lengths of rays whose origins are relative to the middle of the scene, inf to the sky;
    (n, 3) the normals of the surfaces that they meet, against them."""
    with np.errstate(divide="ignore", invalid="ignore"):
        down = (around.ground - around.middle[1] - origin[:, 1]) / along[:, 1]
    length = np.where(along[:, 1] < 0, np.maximum(down, 0), np.inf)
    against = np.zeros((len(length), 3))
    against[:, 1] = 1.0
    if around.tree is not None:
        hit = around.tree.run(origin.astype(np.float32), along.astype(np.float32), output=True)
        nearer = (hit["primID"] >= 0) & (hit["tfar"] < length)
        length[nearer] = hit["tfar"][nearer]
        face = around.points[around.triangles[hit["primID"][nearer]]]
        way = normals(face)
        facing = np.einsum("nx,nx->n", way, along[nearer]) < 0
        against[nearer] = np.where(facing[:, None], way, -way)
    return length, against


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
    return np.asarray(np.arange(count) * _GOLDEN % 1.0)


def tangent_frames(normal: Floats, turn: Floats) -> Singles:
    """(n, 3, 3) rows: two tangents, turned, and the normal."""
    # Duff et al. 2017, without a branch but for the sign.
    x, y, z = normal.T
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    second = np.stack([b, sign + y * y * a, -y], axis=1)
    angle = 2 * math.pi * turn
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([c * first + s * second, c * second - s * first, normal], axis=1).astype(
        np.float32
    )


def _ray_light(
    around: Occluders, origin: Singles, along: Singles, reach: float, longest: float
) -> tuple[Singles, Bools]:
    """(n,) the light of each ray, and (n,) whether it meets nothing within ``longest``, which is
    ``reach`` at least."""
    limit = np.full(len(origin), min(longest, np.finfo(np.float32).max), np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        down = (np.float32(around.ground - around.middle[1]) - origin[:, 1]) / along[:, 1]
    stop = np.where((along[:, 1] < 0) & (down < limit), np.maximum(down, 0), limit)
    if around.tree is not None:
        # A copy: Embree writes into its arguments.
        stop = around.tree.run(origin, along, dists=stop.astype(np.float32), query="DISTANCE")
    unmet = stop >= limit
    if math.isinf(reach):
        return unmet.astype(np.float32), unmet
    return np.minimum(stop / np.float32(reach), np.float32(1)), unmet


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
