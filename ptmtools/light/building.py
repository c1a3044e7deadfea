"""The light of a building: how bright the sky, the sun, lamps and ceilings are, and what surfaces
send.

A model states its lamps, but no sky. One with a sun has a sky of a fifth of its lux; any other that
of a cloudy day. Points and spots, surfaces that glow, and daylight keep the ratios that the model
gives them, unless these are implausible together: then the usual light of each, on the surfaces
that it reaches, is the same.

A model without lamps has ceilings that glow softly, beside what comes from the sky through windows:
level faces that look down on a floor. They light, but are shown as surfaces that reflect. So do the
ceilings of rooms that no light of the model reaches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas, sum_by_group
from ptmtools.light.lamps import (
    Lamps,
    direct_light,
    lamp_radiance,
    lamps_near,
    lamps_of,
)
from ptmtools.light.looks import planes
from ptmtools.light.occlusion import Occluders, normals, points_on, spread_over, turns
from ptmtools.light.patches import LightPatches, are_small
from ptmtools.light.transport import PASSES, Daylight, LightField, transport
from ptmtools.scene.colors import luminance

if TYPE_CHECKING:
    from ptmtools.light.model import CellSurfaces
    from ptmtools.scene.lights import Lights
    from ptmtools.scene.model import Scene

#: Luminance and colour of a cloudy sky; colour of a clear one, and its share of the sun's lux.
SKY, CLOUDY = 1000.0, np.array([0.98, 1.0, 1.05])
BLUE, OF_SUN = np.array([0.89, 1.0, 1.22]), 0.2
#: Reflectance of the ground.
GROUND = 0.3
#: Radiance of ceilings that glow, as a share of `SKY`, and its colour.
CEILING, WARM = 0.06, np.array([1.04, 1.0, 0.94])
#: A ceiling is this far above what is below it, metres, or this share of the highest, if that is
#: less; and its normal points down with this cosine.
_OVER, _OF_HIGHEST, _DOWN = 2.2, 0.6, 0.9
#: Largest ratio of the usual lights of kinds that are plausible together.
_PLAUSIBLE = 100.0
#: Metres of a patch; most patches of a building, whose patches are larger where necessary.
PATCH, MOST = 0.4, 400_000
#: Points of a patch at which lamps are looked for, one of a small one, and shadow rays of each.
_POINTS, _SHADOWS = 2, 4
#: Metres of the patches of lamps, and most lamps, as patches of the building see them.
_LAMP, _LAMPS = 0.4, 1024
#: Points that stand for all surfaces, rays of each, and shadow rays.
_SAMPLES, _RAYS = 4096, 32
#: Points with less than this share of the usual light are dark; ceilings over them glow if this
#: share of the surfaces is dark, and so much as a share of the usual light.
_DARK, _MANY, _LIFT = 0.02, 0.03, 0.5
#: Passes for what ceilings add to a light in balance.
_AGAIN = 6
#: Points of a face, and rays from each, that tell which side is brighter; sides are alike up to
#: this ratio of their light.
_SIDE_POINTS, _SIDE_RAYS, _ALIKE = 4, 8, 2.0
#: Share of rays to what is nearer than half a texel, or to the inside of walls, from which on a
#: point is covered.
_COVERED = 0.25


@dataclass(frozen=True)
class BuildingLight:
    """The light of a building.

    Attributes
    ----------
    field: what its surfaces send.
    lamps: in the units of the field.
    usual: luminance of the median of its light.
    sky, ceilings: whether the sky is seen from some surface, and whether ceilings glow.
    shine: (M, 3) what materials that are lamps send, in the units of the field; 0 of others.
    """

    field: LightField
    lamps: Lamps
    usual: float
    sky: bool
    ceilings: bool
    shine: Floats

    def look(self, corner: Floats, side: Floats, samples: int, near: float) -> GatheredLight:
        """The light of (n, 3, 3) faces on their (n,) sides, 1 for the front and -1 for the back, by
        rays of which those that end within ``near`` metres tell that a point is covered."""
        normal = normals(corner) * side[:, None]
        lamps = lamps_near(self.lamps, corner, self.usual)
        return GatheredLight(self, normal, lamps, samples, near)

    def brighter_sides(self, corner: Floats) -> Floats:
        """(n,) 1 where the front of (n, 3, 3) faces is lit more, -1 where the back is. Faces whose
        sides are alike follow those of the same plane that edges connect with them."""
        normal, area = normals(corner), areas(corner)
        wanted = area > 0
        plane = planes(corner, normal, wanted)
        along = np.where(np.einsum("tx,tx->t", normal, normal[plane]) < 0, -1.0, 1.0)
        face = np.repeat(np.arange(len(corner)), _SIDE_POINTS)
        point = points_on(corner[face], np.tile(np.arange(_SIDE_POINTS), len(corner)))
        turn, sums = turns(len(face)), []
        for sign in (1.0, -1.0):
            light = self._light(point, sign * normal[face], turn, _SIDE_RAYS)
            sums.append(luminance(light).reshape(-1, _SIDE_POINTS).mean(axis=1))
        front, back = sums
        difference = sum_by_group(plane, along * area * (front - back), len(corner))[plane]
        alike = np.maximum(front, back) < _ALIKE * np.minimum(front, back)
        return np.where(np.where(alike, along * difference, front - back) < 0, -1.0, 1.0)

    def _light(self, point: Floats, normal: Floats, turn: Floats, rays: int) -> Floats:
        return self.field.gather(point, normal, turn, rays).light + direct_light(
            self.field.around, self.lamps, point, normal, turn, max(1, rays // 8)
        )


@dataclass(frozen=True)
class GatheredLight:
    """The light of some faces: see `BuildingLight.look`; a `Look`.

    Attributes
    ----------
    normal: (n, 3) of their lit sides.
    lamps: those that matter.
    """

    building: BuildingLight
    normal: Floats
    lamps: Lamps
    samples: int
    near: float

    def goes_on(self, face: Ints, point: Floats, beyond: Floats) -> Bools:
        """(n,) whether the surface goes on, with nothing on it, from points of faces to (n, 3)
        others in their planes."""
        around = self.building.field.around
        lift = around.lift * self.normal[face]
        return around.free(point + lift, beyond + lift) & ~around.free(
            beyond + lift, beyond - 2 * lift
        )

    def indirect(
        self, face: Ints, point: Floats, turn: Floats, times: int = 1
    ) -> tuple[Singles, Singles, Bools]:
        """(n, 3) the light of the sky and of surfaces at points of faces, by ``times`` the usual
        number of rays; (n,) the variance of the mean of its colours; (n,) what is covered."""
        field, samples = self.building.field, times * self.samples
        light, blocked, variance = field.gather(point, self.normal[face], turn, samples, self.near)
        return light, variance, blocked > _COVERED

    def direct(self, face: Ints, point: Floats, turn: Floats) -> Singles:
        """(n, 3) the light of lamps."""
        around, rays = self.building.field.around, max(1, self.samples // 8)
        light = direct_light(around, self.lamps, point, self.normal[face], turn, rays)
        return light.astype(np.float32)

    def __call__(self, face: Ints, point: Floats, turn: Floats) -> Singles:
        light, _, covered = self.indirect(face, point, turn)
        light += self.direct(face, point, turn)
        light[covered] = np.nan
        return light


class BuildingBaking:
    """Computes the light of a building."""

    def __init__(
        self, scene: Scene, pieces: Sequence[CellSurfaces], lights: Lights | None, albedo: Floats
    ) -> None:
        """``albedo``: (T, 3) the mean reflectance of each face of the scene."""
        self._scene, self._lights, self._pieces = scene, lights, pieces
        self._around = Occluders.from_scene(scene, albedo, lights)
        faces = np.flatnonzero(scene.opaque)
        self._corner = scene.corners[faces]
        seen = _visible_sides(pieces, len(scene.triangles))[faces]
        size = PATCH
        while True:
            self._patches = LightPatches.of_faces(self._corner, seen, size)
            if self._patches.count <= max(MOST, 2 * len(faces)):
                break
            size *= 1.05 * math.sqrt(self._patches.count / MOST)
        self._albedo = albedo[faces]

    def light(self) -> BuildingLight:
        """The light in balance."""
        sun = [lamp for lamp in (self._lights.lamps if self._lights else ()) if lamp.kind == "sun"]
        lux = sum((k.intensity * np.array(k.color) * max(-k.direction[1], 0.0) for k in sun),
                  start=np.zeros(3))  # fmt: skip
        sky = max(lamp.intensity for lamp in sun) * OF_SUN * BLUE if sun else SKY * CLOUDY
        daylight = Daylight(sky, GROUND * (sky + lux / math.pi))
        lamps = lamps_of(self._scene, self._lights)
        self._shine = np.zeros((len(self._scene.materials), 3))
        coarse = lamps_of(self._scene, self._lights, _LAMP, _LAMPS)
        if not len(lamps.kind):
            emission = self._ceilings(CEILING * SKY * WARM)
            return self._balance(lamps, self._direct(coarse), daylight, emission)
        factors = self._factors(lamps, daylight)
        daylight = Daylight(factors[1] * daylight.sky, factors[1] * daylight.ground)
        lamps, coarse = (_strengthen(some, factors) for some in (lamps, coarse))
        if self._lights is not None:
            self._shine = factors[2] * lamp_radiance(self._scene, self._lights)
        direct = self._direct(coarse)
        building = self._balance(lamps, direct, daylight, None)
        point, normal, turn = self._points()
        light = luminance(building._light(point, normal, turn, _RAYS))
        dark = light < _DARK * building.usual
        if dark.mean() < _MANY:
            return building
        emission = self._ceilings(_LIFT * building.usual * WARM, building)
        if emission is None:
            return building
        return self._balance(lamps, direct, daylight, emission, building.field)

    def _points(self) -> tuple[Floats, Floats, Floats]:
        """(n, 3) points that stand for all surfaces, (n, 3) their normals and (n,) turns."""
        corner = np.concatenate([p.corner[~p.glass] for p in self._pieces]).astype(np.float64)
        side = np.concatenate([p.side[~p.glass] for p in self._pieces])
        area = areas(corner)
        if not area.sum() > 0:
            return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
        face = spread_over(area, np.zeros(len(area), np.int64), np.array([0]), _SAMPLES)[0]
        normal = normals(corner[face]) * np.where(side[face] < 0, -1.0, 1.0)[:, None]
        return points_on(corner[face], np.arange(_SAMPLES)), normal, turns(_SAMPLES)

    def _factors(self, lamps: Lamps, daylight: Daylight) -> tuple[float, float, float]:
        """The factors of points and spots, of daylight with suns, and of surfaces that glow."""
        point, normal, turn = self._points()
        dark = np.zeros((self._patches.count, 3), np.float32)
        sky = LightField(self._around, self._patches, dark, daylight)
        usual = []
        for number, group in enumerate(lamps.groups()):
            light = direct_light(self._around, lamps.only(group), point, normal, turn, _RAYS // 8)
            if number == 1:
                light = light + sky.gather(point, normal, turn, _RAYS).light
            bright = luminance(light)
            usual.append(float(np.median(bright[bright > 0])) if (bright > 0).any() else 0.0)
        present = [value for value in usual if value > 0]
        if not present or max(present) <= _PLAUSIBLE * min(present):
            return 1.0, 1.0, 1.0
        first, second, third = (max(present) / value if value else 1.0 for value in usual)
        return first, second, third

    def _direct(self, lamps: Lamps) -> Floats:
        """(patches, 3) the light of lamps."""
        light, spread = np.zeros((self._patches.count, 3)), turns(self._patches.count)
        if not len(lamps):
            return light
        small = are_small(self._patches.areas()[self._patches.faces()[0]])
        for k in range(_POINTS):
            point, normal = self._patch_points(k / _POINTS)
            part = np.flatnonzero(~small | (k == 0))
            given = point[part], normal[part], spread[part]
            light[part] += direct_light(self._around, lamps, *given, _SHADOWS)
        light[~small] /= _POINTS
        return light

    def _balance(
        self,
        lamps: Lamps,
        direct: Floats,
        daylight: Daylight,
        emission: Floats | None,
        start: LightField | None = None,
    ) -> BuildingLight:
        patches, around = self._patches, self._around
        glow = 0.0 if emission is None else emission
        passes = PASSES if start is None else _AGAIN
        field = transport(around, patches, self._albedo, direct, daylight, glow, passes, start)
        building = BuildingLight(field, lamps, 1.0, False, emission is not None, self._shine)
        point, normal, turn = self._points()
        light = luminance(building._light(point, normal, turn, _RAYS))
        lit = light[light > 0]
        above = Daylight(daylight.sky, np.zeros(3))
        sky = replace(field, radiance=np.zeros_like(field.radiance), daylight=above)
        return replace(
            building,
            usual=float(np.median(lit)) if len(lit) else 1.0,
            sky=bool((sky.gather(point, normal, turn, _RAYS).light > 0).any()),
        )

    def _patch_points(self, shift: float = 0.0) -> tuple[Floats, Floats]:
        """(patches, 3) a point of each patch, others for another ``shift``, and its normal."""
        face, side, number = self._patches.faces()
        spread = turns(len(face))
        across, along = (spread + shift) % 1, (3 * spread + shift) % 1
        normal = normals(self._corner)[face] * np.where(side == 0, 1.0, -1.0)[:, None]
        return self._patches.points(face, number, across, along), normal

    def _ceilings(self, radiance: Floats, dark: BuildingLight | None = None) -> Floats | None:
        """(patches, 3) what ceilings send that glow with (3,) ``radiance``; only those that are
        dark in a light, if there is one. None without any."""
        point, normal = self._patch_points()
        down = np.flatnonzero(normal[:, 1] < -_DOWN)
        under = point[down] + self._around.lift * normal[down]
        low, high = self._scene.points[:, 1].min(), self._scene.points[:, 1].max()
        height = under[:, 1] - self._around.upright(under, high - low + 1, -1.0)
        enough = min(_OVER, _OF_HIGHEST * float(height.max(initial=0.0)))
        chosen = down[(height >= enough) & (height > 0)]
        if dark is not None and len(chosen):
            light = dark._light(point[chosen], normal[chosen], turns(len(chosen)), _RAYS)
            chosen = chosen[luminance(light) < _DARK * dark.usual]
        if not len(chosen):
            return None
        emission = np.zeros((self._patches.count, 3))
        emission[chosen] = radiance
        return emission


def _strengthen(lamps: Lamps, factors: tuple[float, float, float]) -> Lamps:
    """The lamps with a factor for each group."""
    power = lamps.power.copy()
    for group, factor in zip(lamps.groups(), factors, strict=True):
        power[group] *= factor
    return replace(lamps, power=power)


def _visible_sides(pieces: Sequence[CellSurfaces], count: int) -> Bools:
    """(count, 2) which sides of faces pieces of cells show; both of those without pieces, which
    others in the same place may hide."""
    seen = np.zeros((count, 2), np.bool_)
    for piece in pieces:
        seen[piece.face[piece.side >= 0], 0] = True
        seen[piece.face[piece.side <= 0], 1] = True
    seen[~seen.any(axis=1)] = True
    return seen
