"""The direct light of lamps: surfaces that glow, and lamps without a surface.

Glowing surfaces are divided into patches. The light of a patch at a point is that of a small disc,
E = L A cos cos' / (r² + A/π), which is finite everywhere and exact far away and on the axis of a
disc. Where there are too many lamps without a surface, those near each other join. The light that
all lamps would send without anything between is summed, and shadow rays go to lamps that are chosen
in proportion to their parts of it (systematic sampling): the share that is free counts for all of
them. So light is without grain where no lamp is half hidden.

Lamps are chosen by luminance; what of their light is free counts for each colour by itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas, sum_by_group
from ptmtools.jit import inlined_kernel, kernel
from ptmtools.light.looks import SMALLEST
from ptmtools.light.occlusion import RAYS, Occluders, normals, points_on, spread_over
from ptmtools.scene.colors import luminance
from ptmtools.scene.lights import KINDS, Lights
from ptmtools.scene.model import Scene

#: Metres of the side of a patch, and most patches of a scene, which are larger where necessary. So
#: are the cubes in which lamps without a surface join.
PATCH, MOST_PATCHES = 0.2, 4096
#: Lamps that join differ by at most this in each component of their ways and cones, in cubes of the
#: least size, and by twice as much in those of twice the size.
_APART = 0.1
#: A point of a lamp is no nearer than this, metres: within a bulb light would be infinite.
_NEAREST = 0.1
#: Least difference of the cosines of the two cones of a spot.
_SHARPEST = 1e-6
#: Least luminance of a material that is a lamp; less is a shine to bring out colours. If more than
#: this share of all surfaces glows, the light of the building is part of its colours.
LEAST, _SHARE = 0.1, 0.25
#: Lamps that together have less light than this share of the usual one are left out of a cell.
_FEW = 0.03
#: Kinds of a row of `Lamps`: those of `KINDS`, then patches with one and with two sides.
_POINT, _SPOT, _SUN = range(len(KINDS))
_PATCH_KIND, _BOTH = len(KINDS), len(KINDS) + 1


@dataclass(frozen=True)
class Lamps:
    """Lamps and patches of glowing surfaces.

    Attributes
    ----------
    kind: (n,) see `_POINT` and so on.
    place, way: (n, 3) metres, and unit vectors along which they shine.
    power: (n,) luminance of patches, luminous intensity, or illuminance of a sun.
    area: (n,) m² of patches.
    cone: (n, 2) see `Lamp`.
    color: (n, 3) linear colours of luminance 1.
    """

    kind: NDArray[np.uint8]
    place: Floats
    way: Floats
    power: Floats
    area: Floats
    cone: Floats
    color: Floats

    def __len__(self) -> int:
        return len(self.kind)

    def only(self, chosen: Bools | Ints) -> Lamps:
        """Some of them."""
        return Lamps(*(values[chosen] for values in vars(self).values()))

    def arrival(self, point: Floats, size: float) -> tuple[Floats, Floats, Floats]:
        """(n, 3) directions in which (3,) a point sees lamps without a surface, (n,) the light from
        each, square to its direction, and (n, 3) where it comes from, of suns this far away."""
        sun = self.kind == _SUN
        to = np.where(sun[:, None], -size * self.way, self.place - point)
        distance = np.linalg.norm(to, axis=1)
        to = to / np.maximum(distance, SMALLEST)[:, None]
        edge = -np.einsum("nx,nx->n", to, self.way) - self.cone[:, 1]
        edge = np.clip(edge / np.maximum(self.cone[:, 0] - self.cone[:, 1], _SHARPEST), 0, 1)
        spread = (
            np.where(self.kind == _SPOT, edge * edge, 1.0) / np.maximum(distance, _NEAREST) ** 2
        )
        return to, self.power * np.where(sun, 1.0, spread), point + to * distance[:, None]

    def groups(self) -> tuple[Bools, Bools, Bools]:
        """(n,) which are points and spots, suns, and surfaces."""
        return self.kind < _SUN, self.kind == _SUN, self.kind > _SUN


def lamps_of(
    scene: Scene, lights: Lights | None, size: float = PATCH, limit: int = MOST_PATCHES
) -> Lamps:
    """The lamps of a scene; none if it has none. ``size``: metres of a patch of a surface, of which
    there are at most ``limit``."""
    if lights is None:
        lights = Lights.none(len(scene.materials))
    patches = _patches(scene, lamp_radiance(scene, lights), size, limit)
    single = Lamps(
        np.array([KINDS.index(lamp.kind) for lamp in lights.lamps], np.uint8),
        np.array([lamp.position for lamp in lights.lamps]).reshape(-1, 3),
        np.array([lamp.direction for lamp in lights.lamps]).reshape(-1, 3),
        np.array([lamp.intensity for lamp in lights.lamps]),
        np.zeros(len(lights.lamps)),
        np.array([lamp.cone for lamp in lights.lamps]).reshape(-1, 2),
        np.array([lamp.color for lamp in lights.lamps]).reshape(-1, 3),
    )
    pairs = zip(vars(_merge(single, limit)).values(), vars(patches).values(), strict=True)
    return Lamps(*(np.concatenate(pair) for pair in pairs))


def _merge(lamps: Lamps, limit: int) -> Lamps:
    """Lamps without a surface, at most that number: those of a kind in a cube with ways and cones
    alike become one, with the sum of their powers and the means, weighted by these, of all else."""
    lamps, size = lamps.only(lamps.power > 0), 1.0
    while len(lamps) > limit:
        turned, placed = lamps.kind != _POINT, lamps.kind != _SUN
        cube = np.where(placed[:, None], lamps.place, 0) // (size * PATCH)
        shape = np.concatenate([lamps.way, lamps.cone], axis=1)
        alike = np.where(turned[:, None], shape, 0) // (size * _APART)
        _, first, group = np.unique(
            np.concatenate([lamps.kind[:, None], cube, alike], axis=1),
            axis=0,
            return_index=True,
            return_inverse=True,
        )
        lamps = _merge_groups(lamps, group.ravel(), lamps.kind[first])
        size *= 2
    return lamps


def _merge_groups(lamps: Lamps, group: Ints, kind: NDArray[np.uint8]) -> Lamps:
    """One lamp of each (G,) kind for the lamps of each group."""
    power = np.bincount(group, lamps.power).astype(np.float64)
    share = lamps.power / power[group]
    place, way, cone, color = (
        np.stack([np.bincount(group, share * part) for part in value.T], axis=1).astype(np.float64)
        for value in (lamps.place, lamps.way, lamps.cone, lamps.color)
    )
    long = np.linalg.norm(way, axis=1, keepdims=True)
    way = np.where(long > 0, way / np.where(long > 0, long, 1), [0.0, -1.0, 0.0])
    return Lamps(kind, place, way, power, np.zeros(len(power)), cone, color)


def lamp_radiance(scene: Scene, lights: Lights) -> Floats:
    """(M, 3) what each material that is a lamp emits, 0 of the others."""
    bright = luminance(lights.glow.astype(np.float64)) >= LEAST
    glow = np.where(bright[:, None], lights.glow, 0.0).astype(np.float64)
    area = areas(scene.corners)
    if area[bright[scene.triangle_material]].sum() > _SHARE * area.sum():
        return np.zeros((len(bright), 3))
    return glow


def _patches(scene: Scene, glow: Floats, size: float, limit: int) -> Lamps:
    faces = np.flatnonzero(glow[scene.triangle_material].any(axis=1))
    corner = scene.corners[faces]
    area = areas(corner)
    total = float(area.sum())
    count = min(limit, max(len(faces), math.ceil(total / size**2))) if total else 0
    chosen = np.zeros(0, np.int64)
    if count:
        chosen = spread_over(area, np.zeros(len(faces), np.int64), np.array([0]), count)[0]
    both = scene.two_sided[faces[chosen]]
    radiance = glow[scene.triangle_material[faces[chosen]]]
    power, color = shades(radiance)
    return Lamps(
        np.where(both, _BOTH, _PATCH_KIND).astype(np.uint8),
        _patch_centres(corner, chosen),
        normals(corner[chosen]),
        power,
        np.full(count, total / max(count, 1)),
        np.ones((count, 2)),
        color,
    )


def shades(light: Floats) -> tuple[Floats, Floats]:
    """(n,) the luminance of (n, 3) light, and (n, 3) its colours, of luminance 1."""
    power = luminance(light)
    return power, light / np.where(power > 0, power, 1)[:, None]


def _patch_centres(corner: Floats, chosen: Ints) -> Floats:
    """(n, 3) points on the (n,) chosen ones of (T, 3, 3) faces; those of a face have its centre."""
    points = points_on(corner[chosen], np.arange(len(chosen)))
    times = np.maximum(np.bincount(chosen, minlength=len(corner)), 1)[:, None]
    mean = np.stack([np.bincount(chosen, part, len(corner)) for part in points.T], axis=1) / times
    return np.asarray(points + (corner.mean(axis=1) - mean)[chosen])


def lamps_near(lamps: Lamps, corner: Floats, usual: float) -> Lamps:
    """Those lamps that can matter to (T, 3, 3) faces, where all light is ``usual``."""
    low, high = corner.min(axis=(0, 1)), corner.max(axis=(0, 1))
    distance = np.linalg.norm(lamps.place - np.clip(lamps.place, low, high), axis=1)
    patch = lamps.kind >= _PATCH_KIND
    size = np.where(patch, lamps.area, 1.0)
    largest = lamps.power * size / (distance**2 + np.where(patch, size / math.pi, _NEAREST**2))
    largest = np.where(lamps.kind == _SUN, lamps.power, largest) / math.pi
    order = np.argsort(largest, kind="stable")
    kept = np.cumsum(largest[order]) > _FEW * usual
    return lamps.only(np.sort(order[kept]))


def direct_light(
    around: Occluders, lamps: Lamps, point: Floats, normal: Floats, turn: Floats, rays: int
) -> Floats:
    """(n, 3) the light of lamps, irradiance / pi, at (n, 3) points with (n, 3) normals, by at most
    ``rays`` shadow rays for each point. ``turn``: (n,) shares of the way between two lamps at which
    choosing begins."""
    sun = lamps.groups()[1]
    # The light of a sun would be nearly all that could arrive, and nearly everywhere indoors none.
    parts = [
        (lamps.only(~sun), rays),
        *((lamps.only(np.array([k])), 1) for k in np.flatnonzero(sun)),
    ]
    result = np.zeros((len(point), 3))
    for part, count in parts:
        if len(part):
            result += _light_with_shadows(around, part, point, normal, turn, count)
    return result


def _light_with_shadows(
    around: Occluders, lamps: Lamps, point: Floats, normal: Floats, turn: Floats, rays: int
) -> Floats:
    """See `direct_light`."""
    result = np.zeros((len(point), 3))
    step = max(1, RAYS // rays)
    for at in range(0, len(point), step):
        part = slice(at, at + step)
        origin = point[part] + around.lift * normal[part]
        total, chosen, times = _choose_lamps(
            origin, np.ascontiguousarray(normal[part]), turn[part], rays, *vars(lamps).values()
        )
        row, column = np.nonzero(times)
        lamp = chosen[row, column]
        target = lamps.place[lamp]
        sun = lamps.kind[lamp] == _SUN
        target[sun] = origin[row[sun]] - around.size * lamps.way[lamp[sun]]
        passed = around.transmittance(origin[row], target)
        # Of each colour the part that is free: without shadows the light is exact.
        sent = times[row, column, None] * lamps.color[lamp]
        every, arrived = (
            np.stack([sum_by_group(row, part, len(origin)) for part in weight.T], axis=1)
            for weight in (sent, sent * passed)
        )
        share = np.divide(arrived, every, out=np.zeros_like(arrived), where=every > 0)
        result[part] = total * share / math.pi
    return result


@kernel
def _choose_lamps(
    point: Floats,
    normal: Floats,
    turn: Floats,
    rays: int,
    kind: NDArray[np.uint8],
    place: Floats,
    way: Floats,
    power: Floats,
    area: Floats,
    cone: Floats,
    color: Floats,
) -> tuple[Floats, Ints, Ints]:
    """(n, 3) the light of all lamps without shadows; (n, rays) the lamps that rays go to, and how
    many of the ``rays`` each of these stands for, 0 beyond the last."""
    total = np.zeros((len(point), 3))
    chosen = np.zeros((len(point), rays), np.int64)
    times = np.zeros((len(point), rays), np.int64)
    light = np.zeros(len(kind))
    for p in range(len(point)):
        sum_light = 0.0
        for k in range(len(kind)):
            light[k] = _lamp_light(point, normal, p, k, kind, place, way, power, area, cone)
            if light[k] > 0:
                sum_light += light[k]
                for c in range(3):
                    total[p, c] += light[k] * color[k, c]
        if sum_light <= 0:
            continue
        step = sum_light / rays
        ahead, reached, used, sent = turn[p] * step, 0.0, 0, 0
        for k in range(len(kind)):
            reached += light[k]
            while ahead < reached and sent < rays:
                if used == 0 or chosen[p, used - 1] != k:
                    chosen[p, used] = k
                    used += 1
                times[p, used - 1] += 1
                sent += 1
                ahead += step
        # Rounding may leave the last ray over.
        times[p, used - 1] += rays - sent
    return total, chosen, times


@inlined_kernel
def _lamp_light(
    point: Floats,
    normal: Floats,
    p: int,
    k: int,
    kind: NDArray[np.uint8],
    place: Floats,
    way: Floats,
    power: Floats,
    area: Floats,
    cone: Floats,
) -> float:
    """The light of lamp ``k`` at point ``p``, with nothing between."""
    nx, ny, nz = normal[p, 0], normal[p, 1], normal[p, 2]
    if kind[k] == _SUN:
        facing = -(nx * way[k, 0] + ny * way[k, 1] + nz * way[k, 2])
        return float(power[k] * max(facing, 0.0))
    x, y, z = place[k, 0] - point[p, 0], place[k, 1] - point[p, 1], place[k, 2] - point[p, 2]
    facing = nx * x + ny * y + nz * z
    if facing <= 0:
        return 0.0
    square = x * x + y * y + z * z
    distance = np.sqrt(square)
    along = -(way[k, 0] * x + way[k, 1] * y + way[k, 2] * z) / distance
    if kind[k] == _BOTH:
        along = abs(along)
    if kind[k] >= _PATCH_KIND:
        spread = area[k] * max(along, 0.0) / (square + area[k] / np.pi)
    else:
        spread = 1 / max(square, _NEAREST * _NEAREST)
        if kind[k] == _SPOT:
            edge = (along - cone[k, 1]) / max(cone[k, 0] - cone[k, 1], _SHARPEST)
            edge = min(max(edge, 0.0), 1.0)
            spread *= edge * edge
    return float(power[k] * spread * facing / distance)
