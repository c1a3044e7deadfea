"""The best view from a place: the direction with the most visible detail of textures, and of about
equally good ones the longest.

`Panoramas` measures detail with rays in all directions. Each ray resolves as many texels as it has
pixels on a screen of 1080 lines, or fewer where a texel is larger than a pixel; a texture that
repeats, such as a floor tile, counts at most its own number of texels, at its finest visible scale.
The worth of a view is the sum over textures of the cube root of the visible texels times the
contrast: four pictures are worth more than one that fills the view, and a plastered wall next to
nothing. Near surfaces reduce the worth by their share of the view. Transparent surfaces without an
image are ignored.

`lengths` measures free distance in a horizontal section of the walls, as the mean over a sector
about a direction, so that a slit between two walls does not win; a direction that leaves the model
counts as blind.

(Tried: the longest view alone. It is often along a bare wall. Embree rays from the middle of a
cell, for the longest view: they see down doorways, but the middle of a hall is as often a table.
The texels themselves: the best view of a room is then that of one picture which does not fit into
it; with square roots it still is in a corridor. Texels counted in each 64th of a texture: five
times as slow, and hardly another view.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles, normals
from ptmtools.embree import ray_tree
from ptmtools.output.model import TextureRecord
from ptmtools.output.storeys import triangle_section
from ptmtools.scene.model import Scene

#: Directions tried.
DIRECTIONS = 72
#: Columns of rays around each place; rows are as far apart as columns.
_FINER = 2
_COLUMNS = _FINER * DIRECTIONS
_STEP = 2 * np.pi / _COLUMNS
#: A view has 60° from top to bottom, and 16:9. Only this share in its middle counts, so that
#: pictures are in view as a whole.
_UP = np.tan(np.radians(30))
_ASPECT = 16 / 9
_WITHIN = 0.8
_ACROSS = int(_WITHIN * np.arctan(_ASPECT * _UP) / _STEP)
_ROWS = int(_WITHIN * 2 * _UP / _STEP)
#: Pixels of a screen of 1080 lines, for a radian up or across its middle.
_PIXELS = 540 / _UP
#: Largest side of the level that `_contrast` uses; white in a texture's detail.
_SIDE, _WHITE = 64, 255
#: Nearer surfaces are near, metres; at most half of a view may be.
_NEAR = 2.0


def _contrast(texture: TextureRecord) -> float:
    """The contrast of a texture at the scale of a sixteenth of its width, as a share of white: the
    differences of the finest level of at most `_SIDE` texels and the one below it. Finer levels are
    grain: plaster and carpet have as much of it as a painting, and it is invisible from the usual
    distance of a painting."""
    if texture.detail is None:
        return 0.0
    small = [n for n, x in enumerate(texture.levels) if min(x.width, x.height) <= _SIDE]
    last = max(small, default=0)
    return sum(texture.detail.differences[max(last - 1, 0) : last + 1]) / _WHITE


class Panoramas:
    """The textures of a scene on its triangles."""

    def __init__(self, scene: Scene, textures: Sequence[TextureRecord]) -> None:
        self._texels = np.zeros(len(scene.images) + 1)
        self._detail = np.zeros(len(scene.images) + 1)
        for texture in textures:
            self._texels[texture.image] = texture.width * texture.height
            self._detail[texture.image] = _contrast(texture)
        image = np.array([m.image for m in scene.materials], dtype=np.int64)
        drawn = np.flatnonzero(scene.opaque | (image[scene.triangle_material] >= 0))
        corners = scene.corners[drawn]
        self._image = image[scene.triangle_material[drawn]]
        self._normal = normals(corners)
        twice_area = np.linalg.norm(self._normal, axis=1)
        self._normal /= np.maximum(twice_area, np.finfo(np.float64).tiny)[:, None]
        edge = scene.uv[drawn, 1:] - scene.uv[drawn, :1]
        twice_uv = abs(edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0])
        share = np.divide(twice_uv, twice_area, out=np.zeros_like(twice_uv), where=twice_area > 0)
        self._density = share * self._texels[self._image]  # texels to the square metre
        # Embree computes in float32.
        box = corners.reshape(-1, 3) if len(corners) else np.zeros((1, 3))
        self._middle = (box.min(axis=0) + box.max(axis=0)) / 2
        self._scale = 1 / scene.tolerance.extent
        self._local = self._normalise(corners)
        self._tree: Any = None

    def worth(self, places: Floats) -> Floats:
        """(n, DIRECTIONS) worth of the views from (n, 3) places; 0 where most of the view is near
        or empty."""
        worth = np.zeros((len(places), DIRECTIONS))
        if not (self._detail[self._image] > 0).any():
            return worth
        turn, rise = _STEP * np.arange(_COLUMNS), _STEP * (np.arange(_ROWS) - (_ROWS - 1) / 2)
        way = np.empty((_COLUMNS, _ROWS, 3))
        way[..., 0], way[..., 2] = -np.sin(turn)[:, None], -np.cos(turn)[:, None]
        way[..., 1] = rise
        ways = np.tile(way.reshape(-1, 3), (len(places), 1))
        triangle, distance = self._cast(np.repeat(places, _COLUMNS * _ROWS, axis=0), ways)
        near = (distance < _NEAR) | (triangle < 0)
        free = _sectors(1 - near.reshape(len(places), _COLUMNS, _ROWS).mean(axis=2))
        free /= 2 * _ACROSS + 1
        ray = np.flatnonzero((triangle >= 0) & (self._detail[self._image[triangle]] > 0))
        hit = triangle[ray]
        image, slant = self._image[hit], abs((self._normal[hit] * ways[ray]).sum(axis=1))
        # Texels and pixels to the square of a radian.
        texels = (
            self._density[hit] * distance[ray] ** 2 / np.maximum(slant, np.finfo(np.float64).eps)
        )
        pixels = np.minimum(texels, _PIXELS**2)
        place, column = np.divmod(ray // _ROWS, _COLUMNS)
        pairs, pair = np.unique(place * len(self._texels) + image, return_inverse=True)
        pixel_sum = np.bincount(pair * _COLUMNS + column, pixels, len(pairs) * _COLUMNS)
        visible = _sectors(_STEP**2 * pixel_sum.reshape(-1, _COLUMNS))
        best = np.zeros(len(pairs))
        share = np.divide(pixels, texels, out=np.zeros_like(texels), where=texels > 0)
        np.maximum.at(best, pair, share * self._texels[image])
        place, image = np.divmod(pairs, len(self._texels))
        value = self._detail[image, None] * np.cbrt(np.minimum(visible, best[:, None]))
        np.add.at(worth, place, value)
        return np.where(free >= 0.5, worth * free, 0.0)

    def _cast(self, origin: Floats, way: Floats) -> tuple[Ints, Floats]:
        """(k,) the first triangle that each of (k, 3) rays hits, or -1, and (k,) its distance in
        lengths of ``way``."""
        if self._tree is None:
            self._tree = ray_tree(self._local)
        hits = self._tree.run(self._normalise(origin), way.astype(np.float32), output=True)
        distance = hits["tfar"].astype(np.float64) / self._scale
        return hits["primID"].astype(np.int64), distance

    def _normalise(self, points: Floats) -> Singles:
        local: Singles = ((points - self._middle) * self._scale).astype(np.float32)
        return local


def _sectors(columns: NDArray[np.floating[Any]]) -> Floats:
    """(n, DIRECTIONS) sums over the columns that a view in each direction has, of (n, _COLUMNS)."""
    around = np.concatenate([columns[:, -_ACROSS:], columns, columns[:, :_ACROSS]], axis=1)
    sums = np.cumsum(np.insert(around, 0, 0.0, axis=1), axis=1)
    return np.asarray((sums[:, 2 * _ACROSS + 1 :] - sums[:, : -2 * _ACROSS - 1])[:, ::_FINER])


#: Views with at least this share of the best worth count as equally good.
_AS_GOOD = 0.97
#: Directions of a sector to either side (±15°).
_SECTOR = 3
#: Slack of angles, in steps from one direction to the next.
_LEEWAY = 1e-6
#: Pairs of a wall and a place at a time.
_AT_ONCE = 1 << 16
_YAW = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
_X, _Z = -np.sin(_YAW), -np.cos(_YAW)


@dataclass(frozen=True)
class BestView:
    """The best view from some places.

    Attributes
    ----------
    place: index of the place.
    yaw: radians, counter-clockwise from -Z.
    worth: see `Panoramas.worth`.
    """

    place: int
    yaw: float
    worth: float


class Outlook:
    """The views of a scene.

    Attributes
    ----------
    walls: (m, 2, 2) segments in plan, the section of the opaque triangles at a height; computed
        once for each height, which the rooms of a storey share.
    """

    def __init__(self, scene: Scene, textures: Sequence[TextureRecord]) -> None:
        self.walls: Callable[[float], Floats] = cache(
            partial(triangle_section, scene.corners[scene.opaque])
        )
        self._pictures = Panoramas(scene, textures)

    def best(self, places: Floats, height: float) -> BestView:
        """The best view from (n, 3) places at heights of about ``height``."""
        worth = self._pictures.worth(places)
        good = worth >= _AS_GOOD * worth.max()
        length = np.where(good, lengths(places[:, [0, 2]], self.walls(height)), -1.0)
        place, way = np.unravel_index(int(length.argmax()), length.shape)
        return BestView(int(place), float(_YAW[way]), float(worth[place, way]))


def lengths(places: Floats, walls: Floats) -> Floats:
    """(n, DIRECTIONS) mean free distance of the sector about each direction, metres, from (n, 2)
    places among (m, 2, 2) walls."""
    step = max(1, _AT_ONCE // max(len(walls), 1))
    free = np.concatenate([_free(places[i : i + step], walls) for i in range(0, len(places), step)])
    sector = np.arange(-_SECTOR, _SECTOR + 1)
    around = (np.arange(DIRECTIONS)[:, None] + sector) % DIRECTIONS
    mean: Floats = free[:, around].mean(axis=2)
    return mean


def _free(places: Floats, walls: Floats) -> Floats:
    """(n, 72) metres to the first wall in each direction; 0 where there is none."""
    along = walls[:, 1] - walls[:, 0]
    ends = walls - places[:, None, None]
    # Each wall is paired only with the directions that it can block.
    angle = np.arctan2(-ends[..., 0], -ends[..., 1]) * (DIRECTIONS / (2 * np.pi))
    turn = angle[..., 1] - angle[..., 0]
    turn -= DIRECTIONS * np.round(turn / DIRECTIONS)
    low = np.minimum(angle[..., 0], angle[..., 0] + turn)
    first = np.ceil(low - _LEEWAY).astype(np.int64).ravel()
    count = np.floor(low + abs(turn) + _LEEWAY).astype(np.int64).ravel() + 1 - first
    pair = np.repeat(np.arange(len(first)), count)
    step = np.arange(len(pair)) - np.repeat(np.cumsum(count) - count, count)
    way = (first[pair] + step) % DIRECTIONS
    a, b, x, z = ends[..., 0, :].reshape(-1, 2)[pair], along[pair % len(along)], _X[way], _Z[way]
    det = x * b[:, 1] - z * b[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / det
        share = (a[:, 0] * z - a[:, 1] * x) / det
    hit = (det != 0) & (distance > 0) & (share >= 0) & (share <= 1)
    nearest = np.full(len(places) * DIRECTIONS, np.inf)
    np.minimum.at(nearest, (pair // len(along) * DIRECTIONS + way)[hit], distance[hit])
    return np.where(np.isfinite(nearest), nearest, 0.0).reshape(-1, DIRECTIONS)
