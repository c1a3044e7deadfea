"""Reflections of baked light on lit surfaces and on panes (docs/formats/hints.md, Reflections).

A probe is a small image of the light around a point of a cell: four octahedral maps side by side,
each prefiltered for a roughness, whose texels are codes of light like those of lightmaps. The
direction of what a surface mirrors is corrected by the box of the probe. Karis' fit of the split
sum (Physically based shading on mobile, 2014) says how much of it shows.

Arrays are of the pixels of one material, so that its numbers are scalars.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, units
from ptmtools.light.model import PROBE_MAPS, PROBE_SIZE
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.footprints import corner_values
from ptmtools.rendering.records import Sight, Triangles
from ptmtools.scene.colors import luminance

#: Reflectance of what is no metal, seen from straight ahead.
DIELECTRIC = 0.04
#: Roughness up to which a surface mirrors the probe, and from which on its own light instead.
SHARP, MATT = 0.2, 0.8
#: Least cosine between normal and view.
_GRAZING = 0.001
#: Takes the place of 0 as a component of a direction, and as a length.
_NONE = 1e-30
#: Pixels of panes at a time, for little memory.
_BLOCK = 1 << 16

#: The image of a texture, (128, 192, 3) of 0 to 255; None until its finest level is there.
Images = Callable[[int], NDArray[np.uint8] | None]


@dataclass(frozen=True)
class Panorama:
    """The light around a point.

    Attributes
    ----------
    white: radiance of code 255. stops: powers of two from code 0 to it. mean: luminance of the
        radiance over all directions.
    centre, low, high: (3,) the point, and corners of the box around it, metres.
    texels: (128 · 192, 3) float32 codes, 0 to 255, or (1, 3): the same for all directions.
    """

    white: float
    stops: float
    mean: float
    centre: Floats
    low: Floats
    high: Floats
    texels: NDArray[np.float32]

    def mirror_ways(self, at: Floats, view: Floats, normal: Floats) -> Floats:
        """(n, 3) directions of any length in which surfaces at (n, 3) points show the probe, by
        (n, 3) unit vectors to the eye and unit normals."""
        ahead = normal * (2 * np.einsum("ij,ij->i", normal, view))[:, None] - view
        ahead[ahead == 0] = _NONE
        reach = np.maximum((self.high - at) / ahead, (self.low - at) / ahead)
        distance = np.maximum(np.minimum(np.minimum(*reach.T[:2]), reach[:, 2]), 0)
        return np.asarray(at + ahead * distance[:, None] - self.centre)

    def radiance(self, way: Floats, roughness: float) -> Floats:
        """(n, 3) along (n, 3) directions of any length, averaged over the lobe of a roughness."""
        if len(self.texels) == 1:
            codes = np.repeat(self.texels, len(way), axis=0)
        else:
            place = octahedral(way)
            first = min(int(3 * roughness), len(PROBE_MAPS) - 1)
            share = np.float32(3 * roughness - first)
            codes = self._codes(place, first)
            if share > 0:
                codes += share * (self._codes(place, first + 1) - codes)
        codes *= np.float32(self.stops / 255)
        codes -= np.float32(self.stops)
        return np.asarray(self.white * np.exp2(codes), np.float64)

    def _codes(self, place: Floats, number: int) -> NDArray[np.float32]:
        """(n, 3) bilinear samples of a map at (n, 2) places; its border is one texel wide."""
        column, line, side = PROBE_MAPS[number]
        at = (place + 1) * (side / 2 - 1) + 0.5
        low = np.minimum(at.astype(np.int32), side - 2)
        across, down = (at - low).astype(np.float32).T[..., None]
        row = PROBE_SIZE[0]
        index = (low[:, 1] + line) * row + low[:, 0] + column
        texels = (self.texels.take(index + step, axis=0) for step in (0, 1, row, row + 1))
        upper, upper_right, lower, lower_right = texels
        upper += across * (upper_right - upper)
        lower += across * (lower_right - lower)
        return np.asarray(upper + down * (lower - upper))


def octahedral(way: Floats) -> Floats:
    """(n, 2) places, −1 to 1, of (n, 3) directions in an octahedral map: x and z, Y upwards in the
    middle, and downwards in the corners."""
    x, y, z = np.abs(way).T
    total = (x + y + z)[:, None]
    known = (total > 0) & (total < np.inf)
    place = np.divide(way[:, ::2], total, out=np.zeros((len(way), 2)), where=known)
    below = np.flatnonzero(way[:, 1] < 0)
    folded = place[below]
    place[below] = (1 - np.abs(folded[:, ::-1])) * np.where(folded < 0, -1, 1)
    return np.asarray(place)


def split_sum(facing: Floats, roughness: float) -> tuple[Floats, Floats]:
    """(n,) factor and (n,) offset of the reflectance from straight ahead at (n,) cosines between
    normal and view."""
    x, y, z, w = roughness * np.array([-1, -0.0275, -0.572, 0.022]) + [1, 0.0425, 1.04, -0.04]
    a = np.minimum(x * x, np.exp2(-9.28 * facing)) * x + y
    return np.asarray(z - 1.04 * a), np.asarray(w + 1.04 * a)


def lit_radiance(
    base: Floats, light: Floats, reflected: Floats, facing: Floats, finish: tuple[float, float]
) -> Floats:
    """(n, 3) radiance of lit surfaces that reflect.

    Parameters
    ----------
    base, light, reflected: (n, 3) linear colours, light of a white matt surface there, radiance
        that is mirrored.
    facing: (n,) cosines between normal and view. finish: metallic and roughness.
    """
    metallic, roughness = finish
    scale, offset = split_sum(facing, roughness)
    ahead = DIELECTRIC + (base - DIELECTRIC) * metallic
    share = ahead * scale[:, None] + offset[:, None]
    matt = (1 - metallic) * (1 - np.maximum(np.maximum(*share.T[:2]), share[:, 2]))
    return np.asarray(base * light * matt[:, None] + reflected * share)


def mix_light(radiance: Floats, light: Floats, mean: float, roughness: float) -> Floats:
    """(n, 3) the radiance of a probe at places with (n, 3) light, which rough surfaces mirror less
    of where it is dark, down to the light itself."""
    dark = np.minimum(luminance(light) / max(mean, _NONE), 1)
    near = radiance * (1 + roughness * (dark - 1))[:, None]
    t = np.clip((roughness - SHARP) / (MATT - SHARP), 0, 1)
    return np.asarray(near + t * t * (3 - 2 * t) * (light - near))


def pane_share(facing: Floats, roughness: float) -> Floats:
    """(n,) the share of light that the two sides of a pane reflect."""
    scale, offset = split_sum(facing, roughness)
    side = DIELECTRIC * scale + offset
    return np.asarray(side * (1 + 0.9 * (1 - side)))


class Reflections:
    """The surfaces of a database that reflect.

    Attributes
    ----------
    probe: (T,) int32 of their probes in the hints' textures, -1 of those that do not reflect.
    """

    def __init__(self, surfaces: Surfaces, triangles: Triangles, index: Mapping[str, Any]) -> None:
        """``triangles``: of the surfaces, which are not all opaque."""
        gloss = surfaces.gloss
        assert gloss is not None
        self.probe, self._triangles, self._normals = gloss.probe, triangles, surfaces.normals
        #: (T, 3) unit normals of the faces, and (T,) the distances of their planes from the origin.
        self._normal = units(triangles.normal)
        self._plane = np.einsum("ij,ij->i", self._normal, triangles.corner[:, 0])
        if surfaces.normals is not None:
            self._curved = np.asarray(surfaces.normals.any(axis=(1, 2)))
        self._rows, self._stops = index["textures"], float(index["light"]["stops"])
        some = np.flatnonzero(gloss.probe >= 0)
        numbers = np.column_stack([gloss.probe, gloss.metallic, gloss.roughness])[some]
        #: (k, 3) probe, metallic and roughness of each finish; (T,) that of each triangle, or -1.
        self._finishes, finish = np.unique(numbers, axis=0, return_inverse=True)
        self._finish = np.full(len(gloss.probe), -1, np.int32)
        self._finish[some] = finish.reshape(-1)

    def probes(self, triangle: Ints, images: Images) -> dict[int, Panorama]:
        """Those of (n,) triangles, -1 for none, by number."""
        shown = np.zeros(len(self.probe) + 1, np.bool_)
        shown[triangle] = True
        return {n: self._read(n, images(n)) for n in _members(self.probe[shown[:-1]])}

    def light_up(
        self, sight: Sight, pixel: Ints, probes: Mapping[int, Panorama], base: Floats, light: Floats
    ) -> Floats:
        """(n, 3) radiance of some pixels, which show lit surfaces with (n, 3) base colours and
        light."""
        result = base * light
        for rows, probe, finish in self._finishes_of(sight.triangle[pixel], probes):
            at, view, normal, facing = self._facings(sight, pixel[rows])
            lit, roughness = light[rows], finish[1]
            reflected = lit
            if roughness < MATT:
                radiance = probe.radiance(probe.mirror_ways(at, view, normal), roughness)
                reflected = mix_light(radiance, lit, probe.mean, roughness)
            result[rows] = lit_radiance(base[rows], lit, reflected, facing, finish)
        return result

    def panes(
        self, sight: Sight, probes: Mapping[int, Panorama]
    ) -> Iterator[tuple[Ints, Floats, Floats, Floats]]:
        """Of the pixels of a sight that show panes which reflect: (n,) pixels, (n,) shares of
        light that is reflected, and (n, 3) radiance that is mirrored, and expected behind them."""
        for rows, probe, (_, roughness) in self._finishes_of(sight.triangle, probes):
            for begin in range(0, len(rows), _BLOCK):
                pixel = rows[begin : begin + _BLOCK]
                at, view, normal, facing = self._facings(sight, pixel)
                mirrored = probe.radiance(probe.mirror_ways(at, view, normal), roughness)
                yield pixel, pane_share(facing, roughness), mirrored, probe.radiance(-view, 1.0)

    def _finishes_of(
        self, triangle: Ints, probes: Mapping[int, Panorama]
    ) -> Iterator[tuple[Ints, Panorama, tuple[float, float]]]:
        """Of (n,) triangles: the rows of each finish, its probe, and metallic and roughness."""
        finish = np.where(triangle >= 0, self._finish[triangle], -1)
        for number in _members(finish):
            probe, metallic, roughness = self._finishes[number].tolist()
            yield np.flatnonzero(finish == number), probes[int(probe)], (metallic, roughness)

    def _facings(self, sight: Sight, pixel: Ints) -> tuple[Floats, Floats, Floats, Floats]:
        """(n, 3) points that some pixels show, unit vectors to the eye, unit normals of any side,
        and (n,) cosines between the eye and those that are turned to it."""
        triangle, ray = sight.triangle[pixel], sight.ray[pixel]
        normal = self._normal[triangle]
        along = np.einsum("ij,ij->i", normal, ray)
        along[along == 0] = _NONE
        at = sight.eye + ray * ((self._plane[triangle] - normal @ sight.eye) / along)[:, None]
        if self._normals is not None:
            curved = np.flatnonzero(self._curved[triangle])
            between = corner_values(sight, pixel[curved], self._triangles, self._normals)
            normal[curved] = units(between)
        view = ray / -np.sqrt(np.einsum("ij,ij->i", ray, ray))[:, None]
        facing = np.abs(np.einsum("ij,ij->i", normal, view))
        return at, view, normal, np.maximum(facing, _GRAZING)

    def _read(self, number: int, image: NDArray[np.uint8] | None) -> Panorama:
        row = self._rows[number]
        texels = np.array([row["color"]]) if image is None else image.reshape(-1, 3)
        probe = row["probe"]
        centre, low, high = (np.array(probe[k], np.float64) for k in ("centre", "low", "high"))
        white, mean = float(probe["white"]), float(probe["mean"])
        return Panorama(white, self._stops, mean, centre, low, high, texels.astype(np.float32))


def _members(numbers: NDArray[np.int32]) -> list[int]:
    """The numbers from 0 on, each once; faster than `numpy.unique` for few different ones."""
    return np.flatnonzero(np.bincount(numbers + 1)[1:]).tolist()
