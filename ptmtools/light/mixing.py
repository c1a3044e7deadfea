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
from ptmtools.light.lamps import Lamps, direct, measured, near
from ptmtools.light.looks import Rays
from ptmtools.light.occlusion import (
    Surroundings,
    light_and_sky,
    normals,
    points_on,
    spread_over,
    turns,
)

if TYPE_CHECKING:
    from ptmtools.light.cells import Piece
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
class Mix:
    """The light of a building besides ambient light.

    Attributes
    ----------
    lamps: `measured`; None without any.
    sky: whether the sky is seen from some surface.
    slope: the part that shows of light above the knee.
    """

    lamps: Lamps | None = None
    sky: bool = False
    slope: float = 1.0

    def look(self, rays: Rays) -> Mixed | Rays:
        """The light of the faces of ``rays``."""
        if self.lamps is None and not self.sky:
            return rays
        lamps = None if self.lamps is None else near(self.lamps, rays.corner)
        return Mixed(rays, lamps, self)

    def shown(self, total: Singles) -> Singles:
        """(n,) all light as it shows."""
        above = np.maximum(total - _KNEE, 0)
        return np.asarray(total - (1 - self.slope) * above, np.float32)


@dataclass(frozen=True)
class Mixed:
    """The light of the faces of ``rays``, and of the ``lamps`` that matter there."""

    rays: Rays
    lamps: Lamps | None
    mix: Mix

    @property
    def grain(self) -> float:
        """See `Rays.grain`: few rays reach the sky, which counts the more."""
        return self.rays.grain * (2 if self.mix.sky else 1)

    def __call__(self, face: Ints, point: Floats, turn: Floats) -> Singles:
        total = _sum(self.rays, self.lamps, self.mix.sky, (face, point, turn))[0]
        return self.mix.shown(total)


def _sum(
    rays: Rays, lamps: Lamps | None, sky: bool, places: tuple[Ints, Floats, Floats]
) -> tuple[Singles, Singles]:
    """(n,) all light, and the share of rays that reach the sky, at places as of `Look`."""
    face, point, turn = places
    normal, around = rays.normal[face], rays.around
    of = around, point, normal, turn
    ambient, seen = light_and_sky(*of, rays.samples, rays.reach, rays.above, sky=sky)
    few = np.flatnonzero((seen > 0) & (seen < SKY))
    if len(few):
        finer = _FINER * rays.samples
        seen[few] = light_and_sky(around, point[few], normal[few], turn[few], finer, rays.reach)[1]
    total = ambient + seen / (np.float32(SKY) + seen)
    if lamps is not None:
        by_lamps = direct(around, lamps, point, normal, turn, shadow_rays(rays.samples))
        total = total + (by_lamps / (1 + by_lamps)).astype(np.float32)
    return total, seen


def shadow_rays(samples: int) -> int:
    """The number of shadow rays, from the number of rays of ambient light."""
    return max(1, int(samples * _SHADOWS))


def mixed(
    around: Surroundings,
    pieces: Sequence[Piece],
    lamps: Lamps,
    options: LightOptions,
    above: float,
    white: float,
) -> Mix:
    """The light of a building of these pieces. ``above``: see `light`; ``white``: the light that
    shows as white."""
    corner = np.concatenate([each.corner[~each.glass] for each in pieces]).astype(np.float64)
    side = np.concatenate([each.side[~each.glass] for each in pieces])
    area = areas(corner)
    if not area.sum() > 0:
        return Mix()
    face = spread_over(area, np.zeros(len(area), np.int64), np.array([0]), _POINTS)[0]
    point, turn = points_on(corner[face], np.arange(_POINTS)), turns(_POINTS)
    normal = normals(corner[face]) * np.where(side[face] < 0, -1.0, 1.0)[:, None]
    own = measured(around, lamps, point, normal, turn, shadow_rays(options.light_samples))
    some = own if len(own) else None
    rays = Rays(around, corner, options.light_samples, options.light_reach,
                side=np.where(side < 0, -1.0, 1.0), above=above)  # fmt: skip
    total, seen = _sum(rays, some, True, (face, point, turn))
    if some is None and not seen.any():
        return Mix()
    bright = float(np.quantile(total.astype(np.float64), _BRIGHT))
    slope = (white - _KNEE) / max(bright - _KNEE, white - _KNEE)
    return Mix(some, bool(seen.any()), slope)
