"""Tables of a walk where octrees, or another geometry, are on the screen.

The pixels of an octree's object are compared with their reference by the levels of the octree, in
rows with the octree as texture. If the object also has a texture, that has its own rows as usual,
with the light on the simplified mesh; an error of both counts twice, and an error of one once.

With another database of the same model as the reference, pixels of different geometry have a fixed
error, whatever is fetched: in rows of the texture without levels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.light import lamps
from ptmtools.rendering.pyramids import full_colors
from ptmtools.rendering.rays import Caster
from ptmtools.rendering.records import Pyramids, Sight, Triangles, triangles_of
from ptmtools_lab.rows import RowSums
from ptmtools_systems.apo.served_octrees import Octrees

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

    def shown(self, sight: Sight) -> Floats:
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


class Tally:
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
        from ptmtools_lab.relief.kernels import add_relief, depths, mark_special

        reference, octrees = self._relief.reference, self._relief.octrees
        count = len(sight.triangle)
        far, other, exact = np.zeros(count), np.zeros(count), np.zeros((count, 3))
        depths(sight, self._triangles, far)
        if reference is not None:
            seen = reference.look(sight)
            depths(seen, reference.triangles, other)
            exact = reference.shown(seen)
        special, plain = np.zeros(count, dtype=np.bool_), np.empty(count, np.int64)
        given = reference is not None
        mark_special(
            sight, far, other, given, octrees.of, self._triangles.texture, APART, special, plain
        )
        add_relief(
            sight, self._triangles, self._lamps, octrees, self._full, exact, given, special,
            self._seen, self._sums, self._stuck,
        )  # fmt: skip
        self._rows.end_frame(np.asarray(self._sums.error.any(axis=1)))
        return sight._replace(triangle=plain)
