"""Display of baked light: a lit surface has a linear radiance, which exposure and tone curve bring
to the screen (docs/formats/hints.md, Colours).

A texel of a lightmap holds codes of the logarithm of light, with a multiple of their hue. For a
code c of 0 to 255 `light` is white · 2^(stops · (c / 255 − 1)), and at vertices the light is in
their colours, as a share of white. The radiance of the surface is base · light, with the linear
product of texel, factor and colour of the vertex as its base.

The curve "neutral" is Khronos PBR Neutral (https://github.com/KhronosGroup/ToneMapping) without its
offset of 0.04, which makes up for reflections. It leaves radiance up to 0.8 as it is, so that
colours stay those of the model; what is brighter is compressed and fades to white. "agx" is AgX
(Troy Sobotka), with its contrast as a polynomial (Benjamin Wrensch, Minimal AgX Implementation).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.light.model import scale_hue
from ptmtools.output.served import Served
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.footprints import corner_values, show_colors
from ptmtools.rendering.records import Sight, Triangles, triangles_of
from ptmtools.rendering.reflection import Images, Panorama, Reflections
from ptmtools.scene.colors import to_linear, to_srgb

#: Colour of the background in buildings without light, 0 to 255, as on the web page.
SKY = (0.16 * 255, 0.17 * 255, 0.19 * 255)
#: Least share of their colour that surfaces without texture and light show, and in buildings that
#: have light.
GLOW, LIT_GLOW = 0.25, 0.7
#: Greatest component of radiance that the curve keeps, and how fast brighter colours fade to white.
SHOULDER, FADING = 0.8, 0.15
#: Sine of the angle to the horizon at which the background is all sky, or all ground below it.
HORIZON = 0.02

#: Pixels that are lit at a time, for little memory.
_BLOCK = 1 << 16

#: (n, 3) of the pixels of a sight in lightmaps, the textures of triangles, 0 to 255; 255 without.
Codes = Callable[[Sight, Triangles], Floats]


@dataclass(frozen=True)
class Tone:
    """How a building with light is displayed to an eye.

    Attributes
    ----------
    stops: powers of two from code 0 to code 255. exposure: (3,) factors of radiance.
    curve: of `CURVES`, or "plain": radiance is clipped at 1.
    background: (2, 3) radiance of ground and sky; None: the background is `SKY`.
    hue: the multiple of the hue of codes that lightmaps have.
    """

    stops: float
    exposure: Floats
    curve: str
    background: Floats | None
    hue: float = 1.0

    def light(self, white: Floats, codes: Floats) -> Floats:
        """(n, 3) irradiance / π of (n, 3) codes, 0 to 255, and (n,) lights of the greatest code."""
        scale = np.exp2((scale_hue(codes, 1 / self.hue) / 255 - 1) * self.stops)
        return np.asarray(white[:, None] * scale)

    def display(self, radiance: Floats) -> Floats:
        """(n, 3) colours, 0 to 255, of linear (n, 3) radiance."""
        exposed = radiance * self.exposure
        curve = CURVES.get(self.curve)
        return 255 * to_srgb(curve(exposed) if curve else exposed)

    def background_colors(self, ray: Floats) -> Floats:
        """(n, 3) colours of the background, 0 to 255, along (n, 3) rays of any length, Y up."""
        if self.background is None:
            return np.tile(SKY, (len(ray), 1))
        height = ray[:, 1] / np.linalg.norm(ray, axis=1)
        share = np.clip((height / HORIZON + 1) / 2, 0, 1)
        share = (share * share * (3 - 2 * share))[:, None]
        ground, sky = self.background
        return self.display(ground * (1 - share) + sky * share)


def tone_of(index: Mapping[str, Any], cell: int = -1) -> Tone | None:
    """The display of a building to an eye in a cell, -1 for none; None of one without light.
    ``index``: `hints.json`."""
    head = index.get("light")
    if head is None:
        return None
    exposure, background = np.ones(3), None
    if head["tone"] in CURVES:
        if cell >= 0:
            exposure = np.array(index["cells"][cell].get("exposure", exposure), np.float64)
        if "sky" in head and "ground" in head:
            background = np.array([head["ground"], head["sky"]], np.float64)
    hue = float(head.get("hue", 1.0))
    return Tone(float(head["stops"]), exposure, head["tone"], background, hue)


def tone_at(served: Served, eye: Floats, cell: int | None = None) -> Tone | None:
    """The display of a building to an eye (3,), in metres; ``cell``: of it, if that is known."""
    if "light" not in served.index:
        return None
    if cell is None:
        (cell,) = served.locator.cells_along(eye[None]).tolist()
    return tone_of(served.index, cell)


def neutral(radiance: Floats) -> Floats:
    """(n, 3) linear light of the screen, 0 to 1, of (n, 3) radiance from 0 on."""
    # Of few columns, three times as fast as `max`.
    result, peak = radiance.copy(), np.maximum(np.maximum(*radiance.T[:2]), radiance[:, 2])
    bright = np.flatnonzero(peak > SHOULDER)
    peak, room = peak[bright, None], 1 - SHOULDER
    compressed = 1 - room * room / (peak + room - SHOULDER)
    fading = 1 - 1 / (FADING * (peak - compressed) + 1)
    color = result[bright] * (compressed / peak)
    result[bright] = color + (compressed - color) * fading
    return result


#: From Rec. 709 to the space of AgX, and from its curve to Rec. 2020 and back to Rec. 709.
_TO_AGX = np.array(
    [
        [0.544815, 0.373787, 0.081384],
        [0.140417, 0.754152, 0.105431],
        [0.088811, 0.178876, 0.732313],
    ]
)
_FROM_AGX = np.array(
    [
        [1.127101, -0.110607, -0.016494],
        [-0.141330, 1.157824, -0.016494],
        [-0.141330, -0.110607, 1.251936],
    ]
)
_FROM_2020 = np.array(
    [
        [1.660491, -0.587641, -0.072850],
        [-0.124550, 1.132900, -0.008349],
        [-0.018151, -0.100579, 1.118730],
    ]
)
#: Stops of the curve, from black to white, around 1.
_DARKEST, _BRIGHTEST = -12.47393, 4.026069
#: The contrast, a polynomial from the sixth power down.
_CONTRAST = 15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232


def agx(radiance: Floats) -> Floats:
    """As `neutral`, by AgX."""
    stops = np.log2(np.maximum(radiance @ _TO_AGX.T, 2.0**_DARKEST))
    share = np.clip((stops - _DARKEST) / (_BRIGHTEST - _DARKEST), 0, 1)
    shown = np.polyval(_CONTRAST, share) @ _FROM_AGX.T
    return np.asarray(np.clip(np.maximum(shown, 0) ** 2.2 @ _FROM_2020.T, 0, 1))


#: Tone curves by name.
CURVES: Mapping[str, Callable[[Floats], Floats]] = {"neutral": neutral, "agx": agx}


class LitSurfaces:
    """The lit surfaces among all of a database.

    Attributes
    ----------
    triangles: all; lit ones are white, so that they are sampled as their texels are.
    lightmaps: all with lightmaps as their textures; None if there are none.
    reflections: of them and of panes; None if nothing reflects.
    textures: (T,) numbers each, -1 for none: of all textures, lightmaps and probes.
    """

    def __init__(self, served: Served) -> None:
        surfaces, self._white = served.surfaces, _whites(served)
        self.triangles, self._vertex_colors = triangles_of(surfaces), surfaces.vertex_colors
        self.lightmaps: Triangles | None = None
        self.reflections: Reflections | None = None
        self.textures = [self.triangles.texture]
        if surfaces.gloss and served.index.get("light", {}).get("tone") in CURVES:
            self.reflections = Reflections(surfaces, self.triangles, served.index)
            self.textures.append(self.reflections.probe)
        if not (lit := self._white > 0).any():
            return
        if light := surfaces.light:
            self.lightmaps = triangles_of(light)
            self.textures.append(self.lightmaps.texture)
        #: (T, 3) linear factors of the texels; (T, 3, 3) of the corners, unlit ones are white.
        self._factor = to_linear(_factors(surfaces))
        self._corner_colors: Floats | None = None
        if (colors := surfaces.vertex_colors) is not None:
            self._corner_colors = np.ones_like(colors)
            self._corner_colors[lit] = to_linear(colors[lit])
            self._vertex_colors = np.where(lit[:, None, None], 1.0, colors)
        color = np.where(lit[:, None], 1.0, surfaces.color)
        self.triangles = self.triangles._replace(color=color)

    def show(
        self, sight: Sight, tone: Tone | None, codes: Codes, images: Images, shown: Floats
    ) -> None:
        """Turns pixels ``shown`` (n, 3) from the texels, or white, times the colours of `triangles`
        to what is displayed; those of the background as well. All are 0 to 255."""
        hit = np.flatnonzero(sight.triangle >= 0)
        lit = self._white[sight.triangle[hit]] > 0
        self._show_plain(sight, hit[~lit], GLOW if tone is None else LIT_GLOW, shown)
        if tone:
            pixel = hit[lit]
            probes: dict[int, Panorama] = {}
            if self.reflections:
                probes = self.reflections.probes(sight.triangle[pixel], images)
            for begin in range(0, len(pixel), _BLOCK):
                self._show_light(sight, pixel[begin : begin + _BLOCK], tone, codes, probes, shown)
        show_colors(sight, self.triangles, self._vertex_colors, shown)
        outside = np.flatnonzero(sight.triangle < 0)
        shown[outside] = tone.background_colors(sight.ray[outside]) if tone else SKY

    def _show_plain(self, sight: Sight, pixel: Ints, glow: float, shown: Floats) -> None:
        """Multiplies those of some pixels without texture by the cosine to the viewer, and some
        ``glow``."""
        pixel = pixel[self.triangles.texture[sight.triangle[pixel]] < 0]
        normal, ray = self.triangles.normal[sight.triangle[pixel]], sight.ray[pixel]
        length = np.linalg.norm(normal, axis=1) * np.linalg.norm(ray, axis=1)
        along = np.abs(np.einsum("ij,ij->i", normal, ray))
        facing = np.divide(along, length, out=np.zeros(len(along)), where=length > 0)
        shown[pixel] *= (glow + (1 - glow) * facing)[:, None]

    def _show_light(
        self,
        sight: Sight,
        pixel: Ints,
        tone: Tone,
        codes: Codes,
        probes: Mapping[int, Panorama],
        shown: Floats,
    ) -> None:
        triangle = sight.triangle[pixel]
        base = to_linear(shown[pixel] / 255) * self._factor[triangle]
        if self._corner_colors is not None:
            base *= corner_values(sight, pixel, self.triangles, self._corner_colors)
        code = np.full((len(pixel), 3), 255.0)
        if self.lightmaps is not None:
            part = sight._replace(triangle=triangle, ray=sight.ray[pixel])
            code = codes(part, self.lightmaps)
        light = tone.light(self._white[triangle], code)
        if probes and self.reflections:
            radiance = self.reflections.light_up(sight, pixel, probes, base, light)
        else:
            radiance = base * light
        shown[pixel] = tone.display(radiance)

    def layer(
        self, sight: Sight, tone: Tone | None, images: Images, share: Floats, shown: Floats
    ) -> tuple[Floats, Floats]:
        """(n, 3) colours and (n, 1) shares with which the pixels ``shown`` (n, 3) of a layer, whose
        (n, 1) shares are their opacity, are added to those behind: panes reflect.

        What is behind a pane is displayed before the pane is there, so what it reflects is the
        difference that it makes to the light that is expected there."""
        color, alpha = shown * share, share
        if tone and self.reflections:
            alpha = share.copy()
            triangle = sight.triangle
            panes = np.where(self._white[triangle] > 0, -1, triangle)
            probes = self.reflections.probes(panes, images)
            pane_sight = sight._replace(triangle=panes)
            for pixel, part, mirrored, behind in self.reflections.panes(pane_sight, probes):
                passed = 1 - part[:, None]
                glare = tone.display(behind * passed + mirrored * part[:, None])
                glare -= passed * tone.display(behind)
                color[pixel] = color[pixel] * passed + np.maximum(glare, 0)
                alpha[pixel] = 1 - passed * (1 - share[pixel])
        return color, alpha


def show_vertex_light(served: Served) -> Served:
    """The database with light at vertices as it is displayed on a white surface, times the colours;
    none of its surfaces is lit or reflects. For pictures that compute no light."""
    surfaces, white, tone = served.surfaces, _whites(served), tone_of(served.index)
    at_vertices = white > 0 if surfaces.lightmap is None else (white > 0) & (surfaces.lightmap < 0)
    color, colors = surfaces.color.copy(), surfaces.vertex_colors
    if tone and at_vertices.any():
        colors = np.ones((len(color), 3, 3)) if colors is None else colors.copy()
        light = white[at_vertices, None, None] * to_linear(colors[at_vertices])
        colors[at_vertices] = tone.display(light.reshape(-1, 3)).reshape(light.shape) / 255
        color[at_vertices] = _factors(surfaces)[at_vertices] * colors[at_vertices].mean(axis=1)
    unlit = replace(surfaces, white=None, color=color, vertex_colors=colors, gloss=None)
    return replace(served, surfaces=unlit)


def _whites(served: Served) -> Floats:
    """(T,) light of the greatest code, 0 of triangles that are not lit."""
    white = served.surfaces.white
    if white is None or "light" not in served.index:
        return np.zeros(len(served.surfaces.corner))
    return white


def _factors(surfaces: Surfaces) -> Floats:
    """(T, 3) the colours of triangles without those of their corners, encoded as sRGB."""
    if surfaces.vertex_colors is None:
        return surfaces.color
    mean = surfaces.vertex_colors.mean(axis=1)
    return np.asarray(np.divide(surfaces.color, mean, out=np.ones_like(mean), where=mean > 0))
