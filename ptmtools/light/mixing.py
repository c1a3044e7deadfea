"""The light of a building from its parts: ambient light, the sky, and lamps.

Ambient light is what surfaces nearby leave (`occlusion`). The share of rays that reach the sky, by
windows and other openings, adds to it, and so does the direct light of lamps. Both saturate: of the
usual light a surface shows a half, of twice as much two thirds. Of the sum, what is above a knee
counts less, so that its bright end shows as white: rooms without windows and lamps stay about as
bright as by ambient light alone, and little is cut off. (With all of the sum scaled, such rooms
became dark; with the mean kept, all floors were cut off at 1.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ptmtools.arrays import Floats, Ints, Singles, areas
from ptmtools.light.lamps import Lamps, direct_light, lamps_near, measure_lamps
from ptmtools.light.looks import RayLight
from ptmtools.light.occlusion import (
    Occluders,
    light_and_sky,
    normals,
    points_on,
    spread_over,
    turns,
)

if TYPE_CHECKING:
    from ptmtools.light.model import CellSurfaces
    from ptmtools.light.options import LightOptions

#: The usual share of rays that reach the sky beside a window.
SKY = 0.1
#: Where less of the sky is seen, this many times as many rays look for it: few of them meet it.
_FINER = 4
#: The share of all surfaces that is darker than the bright end.
_BRIGHT = 0.98
#: The least light of which a part shows: somewhat less than that of an open wall in a room.
_KNEE = 0.57
#: Shadow rays for each ray of ambient light: lamps themselves have no grain.
_SHADOWS = 0.25
#: Points that stand for all surfaces.
_POINTS = 4096


@dataclass(frozen=True)
class LightMix:
    """The light of a building besides ambient light.

    Attributes
    ----------
    lamps: `measure_lamps`; None without any.
    sky: whether the sky is seen from some surface.
    slope: the part that shows of light above the knee.
    """

    lamps: Lamps | None = None
    sky: bool = False
    slope: float = 1.0

    def look(self, rays: RayLight) -> MixedLight | RayLight:
        """The light of the faces of ``rays``."""
        if self.lamps is None and not self.sky:
            return rays
        lamps = None if self.lamps is None else lamps_near(self.lamps, rays.corner)
        return MixedLight(rays, lamps, self)

    def tone(self, total: Singles) -> Singles:
        """(n,) all light as it shows."""
        above = np.maximum(total - _KNEE, 0)
        return np.asarray(total - (1 - self.slope) * above, np.float32)


@dataclass(frozen=True)
class MixedLight:
    """The light of the faces of ``rays``, and of the ``lamps`` that matter there."""

    rays: RayLight
    lamps: Lamps | None
    mix: LightMix

    @property
    def grain(self) -> float:
        """See `Rays.grain`: few rays reach the sky, which counts the more."""
        return self.rays.grain * (2 if self.mix.sky else 1)

    def __call__(self, face: Ints, point: Floats, turn: Floats) -> Singles:
        total = _sum_light(self.rays, self.lamps, self.mix.sky, (face, point, turn))[0]
        return self.mix.tone(total)


def _sum_light(
    rays: RayLight, lamps: Lamps | None, sky: bool, places: tuple[Ints, Floats, Floats]
) -> tuple[Singles, Singles]:
    """(n,) all light, and the share of rays that reach the sky, at places as of `Look`."""
    # All of (n,) or (n, 3): ambient light and the share of rays that reach the sky come from the
    # same rays. Where few reach it, more rays measure that share again. The sky and the lamps each
    # add x / (1 + x), where x = 1 is their usual light.
    face, point, turn = places
    normal, around, samples, reach = rays.normal[face], rays.around, rays.samples, rays.reach
    ambient, seen = light_and_sky(around, point, normal, turn, samples, reach, rays.above, sky=sky)
    few = np.flatnonzero((seen > 0) & (seen < SKY))
    if len(few):
        again = point[few], normal[few], turn[few]
        seen[few] = light_and_sky(around, *again, _FINER * samples, reach)[1]
    total = ambient + seen / (np.float32(SKY) + seen)
    if lamps is not None:
        by_lamps = direct_light(around, lamps, point, normal, turn, shadow_rays(samples))
        total = total + (by_lamps / (1 + by_lamps)).astype(np.float32)
    return total, seen


def shadow_rays(samples: int) -> int:
    """The number of shadow rays, from the number of rays of ambient light."""
    return max(1, int(samples * _SHADOWS))


def light_mix(
    around: Occluders,
    pieces: Sequence[CellSurfaces],
    lamps: Lamps,
    options: LightOptions,
    above: float,
    white: float,
) -> LightMix:
    """The light of a building of these pieces. ``above``: see `light`; ``white``: the light that
    shows as white."""
    corner = np.concatenate([surfaces.corner[~surfaces.glass] for surfaces in pieces]).astype(
        np.float64
    )
    side = np.concatenate([surfaces.side[~surfaces.glass] for surfaces in pieces])
    area = areas(corner)
    if not area.sum() > 0:
        return LightMix()
    face = spread_over(area, np.zeros(len(area), np.int64), np.array([0]), _POINTS)[0]
    point, turn = points_on(corner[face], np.arange(_POINTS)), turns(_POINTS)
    normal = normals(corner[face]) * np.where(side[face] < 0, -1.0, 1.0)[:, None]
    measured_lamps = measure_lamps(
        around, lamps, point, normal, turn, shadow_rays(options.light_samples)
    )
    some = measured_lamps if len(measured_lamps) else None
    rays = RayLight(around, corner, options.light_samples, options.light_reach,
                side=np.where(side < 0, -1.0, 1.0), above=above)  # fmt: skip
    total, seen = _sum_light(rays, some, True, (face, point, turn))
    if some is None and not seen.any():
        return LightMix()
    bright = float(np.quantile(total.astype(np.float64), _BRIGHT))
    slope = (white - _KNEE) / max(bright - _KNEE, white - _KNEE)
    return LightMix(some, bool(seen.any()), slope)
