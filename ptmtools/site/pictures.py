"""Pictures of views, as the page draws them: a poster, a small one for each viewpoint in the menu,
and one for each work in the catalogue.

Rays find the surfaces of the pixels (`ptmtools.rendering.rays`) and the layers before them
(`ptmtools.rendering.layers`), and textures are sampled trilinearly, up to a number of texels a
side: textures that no picture shows are not read, and only the first bytes of the others. (Tried:
the compiled sampling of `ptmtools.rendering`: where it is not compiled yet that takes four
seconds.)
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.light.model import PROBE_SIZE
from ptmtools.output.model import offsets_of, sizes_of
from ptmtools.output.served import Served
from ptmtools.parallel import map_in_order
from ptmtools.rendering.footprints import detail_of_pixels, footprints
from ptmtools.rendering.layers import Layer, Layers, blend, transparent_of
from ptmtools.rendering.light import as_bytes
from ptmtools.rendering.pyramids import in_colors, read_preview
from ptmtools.rendering.rays import Caster, RayCamera
from ptmtools.rendering.records import Sight, Triangles
from ptmtools.rendering.tone import LitSurfaces, Tone, tone_at
from ptmtools.site.catalogue import PICTURE
from ptmtools.texture.detail import with_offset
from ptmtools.texture.model import Limits


@dataclass(frozen=True)
class PictureKind:
    """A kind of picture: width and height in pixels, the bytes that it may have, and the texels of
    the longer side of the finest level that is sampled."""

    size: tuple[int, int]
    most: int
    finest: int = 256


POSTER = PictureKind((640, 360), 12_000, 512)
SMALL = PictureKind((160, 90), 3_000)
#: Of a work.
WORK = PictureKind(PICTURE, 40_000, 512)
#: Rays for a pixel, each way, as `ptm render` casts.
_SAMPLES = 2
#: Viewpoints that have a picture at most.
MOST = 32
#: Rays in memory, 50 bytes each, and 12 for each layer that blends before a surface.
_TOGETHER = 1 << 22
_LIMITS = Limits(decoded_bytes=1 << 33)
_THREADS = 4
#: The least quality of a JPEG, and the first beyond the greatest.
_QUALITIES = 8, 81

#: The levels of a texture: (h, w, 3) each, or (h, w, 4) with alpha, coarsest first.
Levels = Sequence[NDArray[np.uint8]]


def pictures(served: Served) -> tuple[bytes, list[bytes]]:
    """JPEGs of a database's viewpoints: a poster of the first, and small ones of the first `MOST`;
    raises as `pictures_of`."""
    viewpoints = served.index["viewpoints"][:MOST]
    views = [(POSTER, viewpoints[0]), *((SMALL, viewpoint) for viewpoint in viewpoints)]
    poster, *small = pictures_of(served, views)
    return poster, small


def pictures_of(
    served: Served, views: Sequence[tuple[PictureKind, Mapping[str, Any]]]
) -> Iterator[bytes]:
    """JPEGs of views: position, direction and fieldOfView as those of viewpoints.

    Raises
    ------
    ImportError: Embree is missing.
    InputError, LimitError: those of `ptmtools.texture.open` and `PtmReader.levels`.
    """
    scene = _Scene(served)
    rays = np.cumsum([math.prod(_rays(kind.size)) for kind, _ in views])
    for _, group in groupby(zip(rays // _TOGETHER, views, strict=True), lambda row: row[0]):
        yield from scene.draw([view for _, view in group])


@dataclass(frozen=True)
class _View:
    """The surfaces of a picture, the layers before them, and the display of their light."""

    kind: PictureKind
    sight: Sight
    layers: Sequence[Layer]
    tone: Tone | None

    def triangles(self) -> Ints:
        """Those of both, each once, with -1 where it shows none."""
        parts = [np.unique(self.sight.triangle)]
        parts += [np.unique(layer.triangle.astype(np.int64)) for layer in self.layers]
        return np.unique(np.concatenate(parts))


class _Textures(dict[int, Levels]):
    """Textures up to a number of texels a side, which are read once they are asked for."""

    def __init__(self, served: Served, finest: int) -> None:
        self._served, self._finest = served, finest

    def __missing__(self, texture: int) -> Levels:
        self[texture] = _levels(self._served, self._finest, texture)
        return self[texture]

    def finer(self, texture: int) -> int:
        """The number of levels that were not read of a texture."""
        return len(sizes_of(self._served.index["textures"][texture])) - len(self[texture])

    def read(self, textures: Iterable[int]) -> None:
        """Reads several, by threads: the lock of the interpreter is free while levels are
        decoded."""
        for _ in map_in_order(self.__getitem__, sorted(textures), _THREADS):
            pass


class _Scene:
    """What the pictures of a database share."""

    def __init__(self, served: Served) -> None:
        surfaces = served.surfaces
        self._served, self._light = served, LitSurfaces(served)
        self._triangles = self._light.triangles
        self._caster, self._layers = Caster(surfaces, transparent_of(surfaces)), Layers(surfaces)

    def draw(self, views: Sequence[tuple[PictureKind, Mapping[str, Any]]]) -> Iterator[bytes]:
        """The pictures of some views, with the textures that they show in memory."""
        textures = _Textures(self._served, max(kind.finest for kind, _ in views))
        frames = [self._view(kind, view, textures) for kind, view in views]
        shown = np.unique(np.concatenate([frame.triangles() for frame in frames]))
        numbers = (texture[shown[shown >= 0]].tolist() for texture in self._light.textures)
        textures.read({number for group in numbers for number in group} - {-1})
        yield from map_in_order(partial(self._jpeg, textures), frames, _THREADS)

    def _view(self, kind: PictureKind, view: Mapping[str, Any], textures: _Textures) -> _View:
        sight = _look(self._caster, kind.size, view)
        sight, layers = self._layers.split(sight, partial(_alpha, self._triangles, textures))
        tone = tone_at(self._served, sight.eye, view.get("cell"))
        return _View(kind, sight, layers, tone)

    def _jpeg(self, textures: _Textures, view: _View) -> bytes:
        colors = self._colors(textures, view.tone, view.sight)
        blend(view.layers, view.sight, partial(self._layer, textures, view.tone), colors)
        return jpeg(colors, view.kind.size, view.kind.most)

    def _colors(self, textures: _Textures, tone: Tone | None, sight: Sight) -> Floats:
        """(n, 3) colours of the rays, 0 to 255."""
        colors = _texels(textures, sight, self._triangles)
        hit = np.flatnonzero(sight.triangle >= 0)
        colors[hit] *= self._triangles.color[sight.triangle[hit]]
        codes, images = partial(_texels, textures), partial(_image, textures)
        self._light.show(sight, tone, codes, images, colors)
        return colors

    def _layer(
        self, textures: _Textures, tone: Tone | None, sight: Sight, share: Floats
    ) -> tuple[Floats, Floats]:
        """See `ptmtools.rendering.layers.Paint`."""
        colors = self._colors(textures, tone, sight)
        return self._light.layer(sight, tone, partial(_image, textures), share, colors)


def jpeg(colors: Floats, size: tuple[int, int], limit: int) -> bytes:
    """A JPEG of the (n, 3) colours of rays, of the best quality with at most ``limit`` bytes, or of
    the least."""
    from PIL import Image

    means = colors.reshape(size[1], _SAMPLES, size[0], _SAMPLES, 3).mean(axis=(1, 3))
    image = Image.fromarray(as_bytes(means))

    def encode(quality: int) -> bytes:
        out = io.BytesIO()
        image.save(out, "JPEG", quality=quality, optimize=True, progressive=True)
        return out.getvalue()

    best, beyond = _QUALITIES
    data = encode(best)
    while beyond - best > 1:
        middle = (best + beyond) // 2
        tried = encode(middle)
        if len(tried) <= limit:
            best, data = middle, tried
        else:
            beyond = middle
    return data


def _rays(size: tuple[int, int]) -> tuple[int, int]:
    return size[0] * _SAMPLES, size[1] * _SAMPLES


def _look(caster: Caster, size: tuple[int, int], viewpoint: Mapping[str, Any]) -> Sight:
    width, height = _rays(size)
    camera = RayCamera(width, height, viewpoint["fieldOfView"], width / height)
    sight = caster.look(camera, np.array(viewpoint["position"]), np.array(viewpoint["direction"]))
    # Levels are chosen for the pixels of the picture.
    return sight._replace(pixel=2 * np.tan(camera.field_of_view / 2) / size[1])


def _levels(served: Served, finest: int, texture: int) -> Levels:
    """The levels of a texture up to ``finest`` texels, always with the coarsest: those of the
    `.ptm`, or, of one that has too few, of a preview."""
    from ptmtools.texture import open as open_ptm

    row = served.index["textures"][texture]
    count = max(1, sum(max(size) <= finest for size in sizes_of(row)))
    if count > len(row["ends"]):
        fine = (n for n, preview in enumerate(row["previews"]) if preview["level"] >= count - 1)
        alpha = row["components"] in (2, 4)
        return _with_offsets(row, read_preview(served, texture, next(fine), alpha=alpha)[:count])
    colors: list[NDArray[np.uint8]] = []
    with open_ptm(served.texture_file(texture), limits=_LIMITS) as ptm:
        for samples in islice(ptm.levels(), count):
            colors.append(in_colors(samples))
    return _with_offsets(row, colors)


def _with_offsets(row: Mapping[str, Any], levels: Levels) -> Levels:
    return [with_offset(*pair) for pair in zip(levels, offsets_of(row), strict=False)]


def _texels(textures: Mapping[int, Levels], sight: Sight, triangles: Triangles) -> Floats:
    """(n, 3) texels that pixels show, 0 to 255; 255 without a texture."""
    colors = np.full((len(sight.ray), 3), 255.0)
    hit = np.flatnonzero(sight.triangle >= 0)
    texture = triangles.texture[sight.triangle[hit]]
    for number, levels in textures.items():
        rows = hit[texture == number]
        if len(rows):
            colors[rows] = _sample_texels(sight, rows, triangles, levels)[0][:, :3]
    return colors


def _image(textures: Mapping[int, Levels], number: int) -> NDArray[np.uint8] | None:
    """The finest level of a probe; None if it was not read."""
    finest = textures[number][-1]
    return finest if finest.shape[1::-1] == PROBE_SIZE else None


def _alpha(triangles: Triangles, textures: _Textures, sight: Sight) -> tuple[Floats, Floats]:
    """See `ptmtools.rendering.layers.Alpha`, of pixels that show a texture."""
    texture = triangles.texture[sight.triangle]
    result, detail = np.ones(len(texture)), np.zeros(len(texture))
    for number in np.unique(texture).tolist():
        levels = textures[number]
        if levels[0].shape[2] > 3:
            rows = np.flatnonzero(texture == number)
            texels, detail[rows] = _sample_texels(sight, rows, triangles, levels)
            result[rows] = texels[:, 3] / 255
            detail[rows] += textures.finer(number)
    return result, detail


def _sample_texels(
    sight: Sight, pixel: Ints, triangles: Triangles, levels: Levels
) -> tuple[Floats, Floats]:
    """(n, 3) colours that some pixels show of a texture, or (n, 4) with alpha: between those of the
    two levels next to the size of a pixel. And (n,) their level of detail, 0 for the last."""
    uv, moves = footprints(sight, pixel, triangles)
    height, width = levels[-1].shape[:2]
    finest = len(levels) - 1
    detail = np.minimum(detail_of_pixels(moves, width, height), finest)
    step = detail.astype(np.int64)
    share = detail - step
    clamped = triangles.clamped[sight.triangle[pixel]]
    colors = np.zeros((len(pixel), levels[0].shape[2]))
    for number, level in enumerate(reversed(levels)):
        for more, weight in (0, 1 - share), (1, share):
            rows = np.flatnonzero((step + more == number) & (weight > 0))
            if len(rows):
                texels = _bilinear(level, uv[rows], clamped[rows])
                colors[rows] += texels * weight[rows, None]
    return colors, detail


def _bilinear(level: NDArray[np.uint8], uv: Floats, clamped: NDArray[np.bool_]) -> Floats:
    """(n, c) of a level at (n, 2) texture coordinates."""
    height, width, channels = level.shape
    columns, rows = (
        _adjacent_texels(uv[:, k], side, clamped[:, k]) for k, side in enumerate((width, height))
    )
    texels = level.reshape(-1, channels)
    across, down = columns[2][:, None], rows[2][:, None]
    upper, lower = (
        texels.take(row * width + columns[0], axis=0) * (1 - across)
        + texels.take(row * width + columns[1], axis=0) * across
        for row in rows[:2]
    )
    return np.asarray(upper * (1 - down) + lower * down)


def _adjacent_texels(
    at: Floats, side: int, clamped: NDArray[np.bool_]
) -> tuple[Ints, Ints, Floats]:
    """(n,) texels before and after coordinates in a row of ``side``, and shares of the latter."""
    place = at * side - 0.5
    low = np.floor(place)
    first = np.where(clamped, np.clip(low, 0, side - 1), low % side).astype(np.int64)
    after = np.where(clamped, np.clip(low + 1, 0, side - 1), (first + 1) % side).astype(np.int64)
    return first, after, place - low
