"""Octree textures on a walk (`ptm build-scene --apo`): lit pictures, which show relief, and octrees
as files of clients beside textures.

To a client an octree is one more texture: a file that refines the screen, whose columns
(`Catalogue`) are its levels. So links, budgets, policies and measures need no knowledge of normals.
Octrees come after the textures, and after all of them comes one texture without levels: the errors
of the simplified meshes themselves, which no download reduces.

In tables of a walk, the pixels of an octree's object are compared with their reference by the
levels of the octree, in rows with the octree as texture. If the object also has a texture, that has
its own rows as usual, with the light on the simplified mesh; an error of both counts twice, and an
error of one once.

With another database of the same model as the reference, pixels of different geometry have a fixed
error, whatever is fetched: in rows of the texture without levels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import kernel, plain_kernel
from ptmtools.output.served import Served
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.kernels import GREY, blend, texel_under
from ptmtools.rendering.light import lamps
from ptmtools.rendering.pyramids import full_colors
from ptmtools.rendering.rays import Caster
from ptmtools.rendering.records import Pyramids, Sight, Triangles, triangles_of
from ptmtools.site.client import LEAST_DIFFERENCE
from ptmtools_lab.catalogue import Catalogue, Columns, Shapes, align_columns
from ptmtools_lab.rows import RowSums, Sums, distance
from ptmtools_systems.apo.lighting import depth_of, descend, stop_of
from ptmtools_systems.apo.model import Octrees
from ptmtools_systems.apo.served_octrees import level_differences


@plain_kernel
def depths(sight: Sight, triangles: Triangles, depth: Floats) -> None:
    """Writes `depth_of` each pixel to ``depth`` (n,)."""
    for i in range(len(depth)):
        depth[i] = depth_of(sight, i, triangles)


@kernel
def add_relief(
    sight: Sight,
    triangles: Triangles,
    lamps: Floats,
    octrees: Octrees,
    full: Pyramids,
    exact: Floats,
    given: bool,
    special: Bools,
    seen: Bools,
    sums: Sums,
    stuck: Ints,
) -> None:
    """Adds the errors of the ``special`` (n,) pixels of a frame.

    Parameters
    ----------
    triangles: with the flat lighting of ``lamps`` (m,).
    full: the textures with all levels.
    exact: (n, 3) the reference colours if ``given``, else the output for those of all octree
        levels.
    seen: (n,) as in `add_frame`.
    sums: ``pair`` (m,) is that of the octree, whose columns are its levels in place of a texture's.
    stuck: (m,) the pair of errors that no download reduces.
    """
    wide = sums.error.shape[1]
    grey, color, work, coarse = np.full(3, GREY), np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    flat, light = np.zeros(3), np.zeros(wide)
    last = stuck[0] if len(stuck) else 0
    for i in range(len(special)):
        if not special[i]:
            continue
        f = sight.triangle[i]
        if f < 0:
            flat[:] = 0.0
            square = distance(flat, exact[i])
            for n in range(wide):
                sums.error[last, n] += np.sqrt(square)
                sums.square[last, n] += square
            continue
        last, t, o = stuck[f], triangles.texture[f], octrees.of[f]
        flat[:] = 255.0
        if t >= 0:
            u, v, detail = texel_under(sight, i, triangles, full, t, work)
            blend(full, t, detail, u, v, triangles.clamped[f], flat, coarse)
        for k in range(3):
            flat[k] *= triangles.color[f, k]
        if o < 0:
            for n in range(wide):
                square = distance(flat if n else grey, exact[i])
                sums.error[last, n] += np.sqrt(square)
                sums.square[last, n] += square
            continue
        p, depth, ray = sums.pair[f], depth_of(sight, i, triangles), sight.ray[i]
        stop = stop_of(sight, i, triangles, depth, octrees.side[o])
        place = depth * ray + sight.eye
        count = descend(octrees, o, place[0], place[1], place[2], stop, light)
        if not given:
            for k in range(3):
                exact[i, k] = flat[k] * light[count - 1] / lamps[f]
        for n in range(octrees.levels[o] + 2):
            if n == 0 and t >= 0:
                continue  # in the row of the texture
            for k in range(3):
                level = light[min(n - 2, count - 1)] / lamps[f] if n > 1 else 1.0
                color[k] = flat[k] * level if n else GREY
            square = distance(color, exact[i])
            sums.error[p, n] += np.sqrt(square)
            sums.square[p, n] += square
        for n in range(min(stop + 1, octrees.levels[o])):
            sums.need[p, n] += 1.0
            if seen[i]:
                sums.sight[p, n] += 1.0


@plain_kernel
def mark_special(
    sight: Sight, depth: Floats, reference_depth: Floats, given: bool, octree_of: NDArray[np.int32],
    texture: NDArray[np.int32], apart: float, special: Bools, plain: Ints,
) -> None:  # fmt: skip
    """Marks the ``special`` (n,) pixels: those of an octree's object, or whose depths ``depth`` and
    ``reference_depth`` (n,) in the two geometries differ by more than the share ``apart``. Writes
    to ``plain`` (n,) the triangles for other tables, which have the textures of octrees'
    objects."""
    for i in range(len(special)):
        f = sight.triangle[i]
        octree = f >= 0 and octree_of[f] >= 0
        differs = False
        if given and depth[i] != reference_depth[i]:
            # Also if one of them is infinite.
            nearest = min(depth[i], reference_depth[i])
            differs = not abs(depth[i] - reference_depth[i]) <= apart * nearest
        special[i] = octree or differs
        plain[i] = f if not special[i] or (octree and texture[f] >= 0) else -1


#: Largest relative difference of the depths of the same surface.
APART = 1e-3


@dataclass(frozen=True)
class Reference:
    """Another database of the same model, whose full picture is the reference."""

    surfaces: Surfaces
    pyramids: Pyramids

    @cached_property
    def triangles(self) -> Triangles:
        """Its triangles for kernels."""
        return triangles_of(self.surfaces)

    @cached_property
    def caster(self) -> Caster:
        """Its ray caster."""
        return Caster(self.surfaces)

    def look(self, sight: Sight) -> Sight:
        """Its surfaces along the rays of ``sight``."""
        return sight._replace(triangle=self.caster.first(sight.eye, sight.ray))

    def full_picture(self, sight: Sight) -> Floats:
        """(n, 3) its full picture of them, 0 to 255."""
        return full_colors(sight, self.triangles, self.pyramids)


@dataclass(frozen=True)
class Relief:
    """Octrees of a lit walk, and its reference.

    Attributes
    ----------
    octrees: those of the walked database, maybe none.
    reference: None: the database's own full picture.
    """

    octrees: Octrees
    reference: Reference | None = None


class ReliefTally:
    """Sums up errors of frames.

    Parameters
    ----------
    surfaces, triangles: of the walked database, lit.
    full: their textures. seen: (n,) the pixels of a client's item buffer.
    """

    def __init__(
        self,
        relief: Relief,
        surfaces: Surfaces,
        triangles: Triangles,
        full: Pyramids,
        seen: Bools,
    ) -> None:
        self._relief, self._triangles, self._full, self._seen = relief, triangles, full, seen
        self._lamps = lamps(surfaces.corner)
        octrees, first = relief.octrees, len(full.levels)
        # After the textures come the octrees, and one texture without levels.
        wanted = np.where(octrees.of < 0, octrees.number, octrees.of) + first
        stuck = np.full(len(wanted), first + octrees.number)
        keys = np.stack([np.tile(triangles.cell, 2), np.concatenate([wanted, stuck])], axis=1)
        levels = int(octrees.levels.max(initial=1))
        self._rows = RowSums(keys, levels, levels, seen)
        pair, self._stuck = self._rows.pair.reshape(2, -1)
        self._sums = self._rows.sums._replace(pair=pair)
        self.rows = self._rows.rows

    def add(self, sight: Sight) -> Sight:
        """Adds the rows of the next frame; returns the rest of it for other tables."""

        reference, octrees = self._relief.reference, self._relief.octrees
        count = len(sight.triangle)
        depth, reference_depth, exact = np.zeros(count), np.zeros(count), np.zeros((count, 3))
        depths(sight, self._triangles, depth)
        if reference is not None:
            seen = reference.look(sight)
            depths(seen, reference.triangles, reference_depth)
            exact = reference.full_picture(seen)
        special, plain = np.zeros(count, dtype=np.bool_), np.empty(count, np.int64)
        given = reference is not None
        mark_special(
            sight,
            depth,
            reference_depth,
            given,
            octrees.of,
            self._triangles.texture,
            APART,
            special,
            plain,
        )
        add_relief(
            sight, self._triangles, self._lamps, octrees, self._full, exact, given, special,
            self._seen, self._sums, self._stuck,
        )  # fmt: skip
        self._rows.end_frame(np.asarray(self._sums.error.any(axis=1)))
        return sight._replace(triangle=plain)


#: Bytes of a texel in texture memory.
_TEXEL = 4


def octree_columns(served: Served) -> Columns:
    """The columns of each octree: a column is a level, its size the number of nodes along a
    side."""
    rows = []
    for row in served.index.get("octrees", ()):
        across = 1 << np.arange(len(row["levels"]))
        memory = np.cumsum(row["levels"]) * _TEXEL
        rows.append((row["ends"], memory, np.stack([across, across], axis=1)))
    return align_columns(rows)


def without_octrees(stock: Catalogue, octrees: Octrees) -> Catalogue:
    """The catalogue of a client that draws no octrees, with nothing to fetch of them.

    It has as many columns as the tables of the walk.
    """
    return _with_empty(stock, octrees.number + 1, octrees)


def with_octrees(stock: Catalogue, served: Served, octrees: Octrees) -> Catalogue:
    """The catalogue of a client that draws octrees; ``stock`` is that of the textures alone."""
    columns = octree_columns(served)
    extended = stock.extend(
        columns, _differences(served, octrees, columns), _shapes(served, octrees)
    )
    # After them, errors that no download reduces; see the package.
    return _with_empty(extended, 1, octrees)


def _with_empty(stock: Catalogue, count: int, octrees: Octrees) -> Catalogue:
    """The catalogue with ``count`` more textures without columns."""
    wide = 1 + int(octrees.levels.max(initial=1))
    last, table = np.zeros(count, np.int64), np.zeros((count, wide), np.int64)
    nothing = Columns(last, last, table, table, np.zeros((count, wide, 2), np.int64))
    return stock.extend(nothing, np.zeros((count, wide)))


def _differences(served: Served, octrees: Octrees, columns: Columns) -> Floats:
    """(O, K) mean difference of each level to the one before, at least `LEAST_DIFFERENCE`."""
    result = np.zeros(columns.ends.shape)
    for o, steps in enumerate(level_differences(served.surfaces, octrees)):
        levels = int(octrees.levels[o])
        result[o, 1 : levels + 1] = np.maximum(steps[:levels], LEAST_DIFFERENCE)
    return result


def _shapes(served: Served, octrees: Octrees) -> Shapes:
    """The shapes with octrees, once more with these as textures."""
    surfaces, first = served.surfaces, len(served.index["textures"])
    low, high = surfaces.boxes()
    shape, where = np.unique(surfaces.shape, return_index=True)
    some = octrees.of[where] >= 0
    shape, where = shape[some], where[some]
    cell, number = surfaces.cell[where].astype(np.int64), octrees.of[where].astype(np.int64)
    side = np.repeat(octrees.side[number][:, None], 2, axis=1)
    return Shapes(cell, first + number, low[shape], high[shape], side)
