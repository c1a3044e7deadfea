"""The light of campus objects by ambient obscurance, and the lit side of a face with two.

Rays go out into the hemisphere over a point, denser by the cosine of their angle to the normal, and
the light is the share of them that escape. All opaque faces and a level ground under the scene
occlude. A ray with a hit at distance d counts d / reach, and 1 beyond (Zhukov, Iones and Kronin
1998): with plain occlusion, ``reach`` inf, rooms are black.

Of a face with two sides, that side counts on which viewers can be. Walks by random rays begin on
both sides and turn at surfaces; the side from which more of them reach the sky counts, or the
lighter one if they are alike, as of a fence or within a building. Faces of one plane that share an
edge are decided together, by points spread over all of them, and more points where the two sides
are close. (The lighter side of each face by itself, by 16 rays from its middle, takes a hall of
20 m for lighter than a court of 3 m.)
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas
from ptmtools.light.looks import planes
from ptmtools.light.occlusion import (
    GOLDEN,
    RAYS,
    Occluders,
    hemisphere,
    normals,
    points_on,
    spread_over,
    turns,
)

#: The grain of n rays is within this, divided by the root of n.
_GRAIN = 0.8
#: Points of a plane from which walks begin on either side, at first and if the sides are close;
#: walks from each, and most turns of one: from the underside of a sill to the ground, to a wall, to
#: the sky.
_POINTS, _MORE, _WALKS, _BOUNCES = 8, 32, 16, 3
#: Two sides differ if their counts of rays do by more standard deviations.
_SURE = 3.0


@dataclass(frozen=True)
class RayLight:
    """The light by rays of (T, 3, 3) faces, on their (T,) sides: 1 for the front, -1 for the back;
    see `light`.

    Faces up to ``error`` metres off the model's surface have its light.
    """

    around: Occluders
    corner: Floats
    samples: int
    reach: float
    error: float = 0.0
    side: Floats | float = 1.0

    @cached_property
    def normal(self) -> Floats:
        """(T, 3) of the lit sides."""
        side = np.broadcast_to(self.side, len(self.corner))
        return np.asarray(normals(self.corner) * side[:, None])

    @property
    def grain(self) -> float:
        """Largest difference between samples of the same light."""
        return _GRAIN / math.sqrt(self.samples)

    def __call__(self, face: Ints, point: Floats, turn: Floats) -> Singles:
        normal = self.normal[face]
        place = move_outwards(self.around, point, normal, self.error)
        return light(self.around, place, normal, turn, self.samples, self.reach)[:, None]


def light(
    around: Occluders, point: Floats, normal: Floats, turn: Floats, samples: int, reach: float
) -> Singles:
    """(n,) light from 0 to 1 at (n, 3) points with (n, 3) unit normals.

    Parameters
    ----------
    turn: (n,) rotation of the directions about the normals, in turns from 0 to 1.
    samples, reach: number of rays for each point; metres, beyond which surfaces do not occlude.
    """
    result = np.empty(len(point), np.float32)
    for part, origin, along in _fans(around, point, normal, turn, samples):
        share = _ray_light(around, origin.astype(np.float32), along, reach)
        result[part] = share.reshape(-1, samples).mean(axis=1)
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


def _ray_light(around: Occluders, origin: Singles, along: Singles, reach: float) -> Singles:
    """(n,) the light of each ray."""
    limit = np.full(len(origin), min(reach, np.finfo(np.float32).max), np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        down = (np.float32(around.ground - around.middle[1]) - origin[:, 1]) / along[:, 1]
    stop = np.where((along[:, 1] < 0) & (down < limit), np.maximum(down, 0), limit)
    if around.tree is not None:
        # A copy: Embree writes into its arguments.
        stop = around.tree.run(origin, along, dists=stop.astype(np.float32), query="DISTANCE")
    if math.isinf(reach):
        return (stop >= limit).astype(np.float32)
    return np.minimum(stop / np.float32(reach), np.float32(1))


def open_sides(around: Occluders, corner: Floats, both: Bools, reach: float) -> Floats:
    """(T,) -1 for faces of which the back counts, and 1 for all others.

    ``corner``: (T, 3, 3); ``both``: (T,) which have two sides; ``reach``: as of `light`.
    """
    normal = normals(corner)
    area = areas(corner)
    wanted = both & (area > 0)
    if not wanted.any():
        return np.ones(len(corner))
    plane = planes(corner, normal, wanted)
    # Relative to the first face of the plane.
    sign = np.where(np.einsum("tx,tx->t", normal, normal[plane]) < 0, -1.0, 1.0)
    front, back = np.zeros(len(corner)), np.zeros(len(corner))

    def look(chosen: Ints, points: int, *, sky: bool) -> None:
        """Set `front` and `back` of planes, by the numbers of their first faces."""
        face = spread_over(area, np.where(wanted, plane, -1), chosen, points).ravel()
        point, turn = (
            points_on(corner[face], np.tile(np.arange(points), len(chosen))),
            turns(len(face)),
        )
        for counts, side in ((front, 1.0), (back, -1.0)):
            way = side * sign[face, None] * normal[face]
            rays = around, point, way, turn, _WALKS
            seen = count_escapes(*rays, _BOUNCES) if sky else light(*rays, reach)
            counts[chosen] = seen.reshape(len(chosen), points).sum(axis=1)

    chosen = np.unique(plane[wanted])
    rounds = ((_POINTS, True), (_MORE, True), (_MORE, False))
    for points, sky in rounds:
        look(chosen, points, sky=sky)
        close = np.abs(front - back) <= _SURE * np.sqrt(front + back)
        chosen = chosen[close[chosen]]
    return np.where(wanted, np.where((back > front)[plane], -sign, sign), 1.0)


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
            turned = np.asarray((walk + bounce + 1) * GOLDEN % 1.0, np.float64)
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
