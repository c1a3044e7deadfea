"""Light of several bounces: what surfaces send to each other, and what reaches a point.

Light is in units of the radiance of a white diffuse surface: irradiance / π. In each pass a patch
gathers by a few rays what the patches that they meet reflect, in place, so that later patches of
the same pass see it; the light of lamps is exact but for its shadows (`lamps`). Noise of a pass
does not add up, since rays of the next meet other patches. A point has the light of its own rays,
once more into the patches: what is near it shows in full detail. White rooms keep light for many
passes; so before the last ones all gathered light grows by what it would still gain.

(Gathering into the texels of lightmaps themselves takes three times as many rays, and has to wait
for the atlases of all cells. Plain random walks from each texel take six times as long.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.jit import kernel
from ptmtools.light.occlusion import (
    RAYS,
    SPREAD,
    Occluders,
    hemisphere,
    normals,
    rays_over,
    turns,
)
from ptmtools.light.patches import LightPatches, are_small, patch_number

#: Passes, rays of a patch in each, and how many of the last passes count.
PASSES, PASS_RAYS, COUNTED = 12, 4, 4
#: A surface reflects at most this: a room of white surfaces would never be in balance.
MOST_REFLECTED = 0.95


@dataclass(frozen=True)
class Daylight:
    """The sky, (3,) radiance of each colour, and the light that the ground reflects."""

    sky: Floats
    ground: Floats


class Arrived(NamedTuple):
    """What reaches n points by rays.

    Attributes
    ----------
    light: (n, 3).
    blocked: (n,) the share of rays that meet something nearer than a distance, or the unlit side of
        a face: of a point that is covered, or within a wall.
    variance: (n,) of the mean of the colours, as if the rays were independent.
    """

    light: Singles
    blocked: Singles
    variance: Singles


@dataclass(frozen=True)
class LightField:
    """What the surfaces of a building send out.

    Attributes
    ----------
    around: the faces that rays meet, in the order of ``patches``.
    patches: their patches.
    radiance: (patches, 3) float32.
    daylight: what rays bring that leave the building.
    """

    around: Occluders
    patches: LightPatches
    radiance: Singles
    daylight: Daylight

    def gather(
        self,
        point: Floats,
        normal: Floats,
        turn: Floats,
        rays: int | Singles,
        near: float = 0.0,
    ) -> Arrived:
        """What reaches (n, 3) points with (n, 3) unit normals by a number of rays each,
        or those of a (rays, 3) fan over z.

        turn: (n,) rotation of the directions about the normals, in turns from 0 to 1.
        near: see `Arrived`, metres.
        """
        count = len(point)
        arrived = Arrived(*(np.empty((count, k), np.float32) for k in (3, 1, 1)))
        fan = hemisphere(rays) if isinstance(rays, int) else rays
        samples = len(fan)
        step = max(1, RAYS // samples)
        for at in range(0, len(point), step):
            part = slice(at, at + step)
            start = point[part] + self.around.lift * normal[part] - self.around.middle
            origin, along = rays_over(start, np.ascontiguousarray(normal[part]), turn[part], fan)
            for whole, some in zip(
                arrived, self._receive(origin, along, samples, near), strict=True
            ):
                whole[part] = some
        return Arrived(arrived.light, arrived.blocked[:, 0], arrived.variance[:, 0])

    def _receive(
        self, origin: Singles, along: Singles, samples: int, near: float
    ) -> tuple[Singles, Singles, Singles]:
        if self.around.tree is None:
            sky = np.where(along[:, 1:2] >= 0, self.daylight.sky, self.daylight.ground)
            mean = sky.reshape(-1, samples, 3).mean(axis=1)
            nothing = np.zeros((len(mean), 1), np.float32)
            return mean.astype(np.float32), nothing, nothing
        hit = self.around.tree.run(origin, along, output=True)
        panes, passed = self.around.panes, np.zeros((0, 3), np.float32)
        if panes is not None:
            passed = panes.transmittance(origin, along, hit["tfar"])
        return receive(
            hit["primID"], hit["u"], hit["v"], hit["tfar"], hit["Ng"], along,
            self.patches.split, self.patches.first, self.radiance,
            self.daylight.sky, self.daylight.ground, passed, samples, near,
        )  # fmt: skip


def transport(
    around: Occluders,
    patches: LightPatches,
    albedo: Floats,
    direct: Floats,
    daylight: Daylight,
    emission: Floats | float = 0.0,
    passes: int = PASSES,
    start: LightField | None = None,
) -> LightField:
    """The light of a building in balance. ``albedo``: (F, 3) of the faces of the patches;
    ``direct``: (patches, 3) the light of lamps; ``emission``: (patches, 3) what
    patches send that are no lamps; ``passes``: at least 1; ``start``: the same without emission."""
    face, side, number = patches.faces()
    normal = normals(patches.corner)[face] * np.where(side == 0, 1.0, -1.0)[:, None]
    reflected = np.minimum(albedo, MOST_REFLECTED)[face]
    before = reflected * direct if start is None else start.radiance
    radiance = (before + emission).astype(np.float32)
    emitted = np.broadcast_to(emission, radiance.shape)
    field = LightField(around, patches, radiance, daylight)
    spread, area, counted = turns(patches.count), patches.areas()[face], min(COUNTED, passes)
    small = are_small(area)
    groups = [np.flatnonzero(~small), np.flatnonzero(small)]
    sums: list[float] = []
    light, earlier, total = np.zeros((3, patches.count, 3))
    fan = hemisphere(PASS_RAYS)
    for turn in range(passes):
        # Passes that do not count, and those of small patches, share the rays of one fan.
        strides = 1 if turn >= passes - counted else 2, PASS_RAYS
        for group, stride in zip(groups, strides, strict=True):
            rays = np.ascontiguousarray(fan[turn % stride :: stride])
            step = max(1, RAYS // len(rays))
            for at in range(0, len(group), step):
                part = group[at : at + step]
                shift = spread[part] + turn * SPREAD[1]
                across, along = (shift * 7 + SPREAD[0] * turn) % 1.0, (shift * 3) % 1.0
                point = patches.points(face[part], number[part], across, along)
                light[part] = field.gather(point, normal[part], shift % 1.0, rays).light
                radiance[part] = reflected[part] * (direct[part] + light[part]) + emitted[part]
        if turn >= passes - counted:
            total += light
        sums.append(float((area * light.mean(axis=1)).sum()))  # a dot product follows the threads
        if turn == passes - counted - 1 and turn:
            # Two passes have all rays of the fan.
            factor = extrapolation([(a + b) / 2 for a, b in pairwise(sums)])
            radiance[:] = reflected * (direct + factor * (light + earlier) / 2) + emitted
        earlier[:] = light
    radiance[:] = reflected * (direct + total / counted) + emitted
    return field


def extrapolation(sums: Sequence[float]) -> float:
    """The factor from the last of some sums to their limit: two passes, which have other rays, add
    the same share of what the two before added. 1 for fewer than five sums."""
    if len(sums) < 5:
        return 1.0
    before, last = sums[-3] - sums[-5], sums[-1] - sums[-3]
    if not 0 < last < before:
        return 1.0
    share = min(last / before, MOST_REFLECTED**2)
    return 1 + last * share / (1 - share) / sums[-1]


@kernel
def receive(
    face: NDArray[np.int32],
    u: Singles,
    v: Singles,
    length: Singles,
    across: Singles,
    along: Singles,
    split: NDArray[np.int32],
    first: Ints,
    radiance: Singles,
    sky: Floats,
    ground: Floats,
    passed: Singles,
    samples: int,
    near: float,
) -> tuple[Singles, Singles, Singles]:
    """The fields of `Arrived`, the last two (n, 1), for ``samples`` rays of each point, which go
    ``along`` and meet faces with normals ``across``, of any length; a share of each colour, if
    ``passed`` is not empty, passes."""
    count = len(face) // samples
    light, blocked = np.zeros((count, 3), np.float32), np.zeros((count, 1), np.float32)
    variance = np.zeros((count, 1), np.float32)
    for p in range(count):
        red, green, blue, stopped = 0.0, 0.0, 0.0, 0
        total, squares = 0.0, 0.0
        for ray in range(p * samples, (p + 1) * samples):
            f = face[ray]
            r, g, b = 0.0, 0.0, 0.0
            if f < 0:
                if along[ray, 1] >= 0:
                    r, g, b = sky[0], sky[1], sky[2]
                else:
                    r, g, b = ground[0], ground[1], ground[2]
            else:
                facing = 0.0
                for axis in range(3):
                    facing += across[ray, axis] * along[ray, axis]
                start = first[f, 0 if facing < 0 else 1]
                if start < 0 or length[ray] < near:
                    stopped += 1
                if start >= 0:
                    k = start + patch_number(split[f], u[ray], v[ray])
                    r, g, b = radiance[k, 0], radiance[k, 1], radiance[k, 2]
            if len(passed):
                r, g, b = r * passed[ray, 0], g * passed[ray, 1], b * passed[ray, 2]
            red, green, blue = red + r, green + g, blue + b
            mean = (r + g + b) / 3
            total += mean
            squares += mean * mean
        light[p, 0], light[p, 1], light[p, 2] = red / samples, green / samples, blue / samples
        blocked[p, 0] = stopped / samples
        variance[p, 0] = max(squares / samples - (total / samples) ** 2, 0.0) / samples
    return light, blocked, variance
