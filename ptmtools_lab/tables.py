"""Tables along a walk: the share of each pair of cell and texture on the screen, and its error at
each level.

For every pixel of a frame the texture is sampled as in OpenGL, trilinearly, once with all levels
and once for each level as the finest one. The difference, root mean square over R, G and B (0 to
255), is summed up by pair. A run only looks up errors: that of a frame is the sum over its pairs,
each at the client's level. Surfaces without texture have no error once their cell is loaded;
missing cells are grey.

The same rays serve textures in several forms (`ptmtools_lab.forms`). A pixel samples each level of
one pyramid once; a form whose steps are pyramids of their own (`Shows`) costs a sample of each, and
so does each level of a lossy preview (`ptmtools_lab.lossy`).

The level of detail is that of a screen of 1080 lines, whatever the size of the item buffer: a
coarser buffer samples fewer pixels of the same picture.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.output.surfaces import Surfaces
from ptmtools.progress import Progress, silent
from ptmtools.rendering.rays import Caster, RayCamera
from ptmtools.rendering.records import Pyramids, Shows, Sight, Triangles, triangles_of
from ptmtools.site.client import NORMALS
from ptmtools_lab.lossy import Lossy, no_previews
from ptmtools_lab.relief import Relief, ReliefTally
from ptmtools_lab.rows import RowSums, ViewRows, add_columns, add_frame


@dataclass(frozen=True)
class WalkViews:
    """Errors and coverage of the screen, frame by frame; the rows of a frame are its pairs.

    Attributes
    ----------
    start: (F + 1,) first row of each frame.
    cell, texture: (R,) int32 of each row; the texture is -1 for surfaces without. Octrees come
        after the textures, see `ptmtools_lab.relief`. A surface with a lightmap is in two rows, and
        one whose material has a normal map in another, and one that reflects in that of its probe.
    error, square: (R, S + 1) part of the frame's mean error, and mean squared error, with these as
        the finest data: nothing, the mean colour, then the states from 1 on (`Lossy`), which begin
        with level 0, level 1, …; in other forms their columns in place of states.
    need: (R, L) share of the pixels that want a level, besides the coarser ones; for surfaces
        without texture the first is the share that they cover.
    sight: (R, L) the same in the item buffer that a client draws, with half as many pixels each
        way.
    owner, depth: (V, n) int32, float32 of that item buffer's pixels: the visible cell, -1 for none,
        and its distance along the view, metres.
    """

    start: Ints
    cell: NDArray[np.int32]
    texture: NDArray[np.int32]
    error: Singles
    square: Singles
    need: Singles
    sight: Singles
    owner: NDArray[np.int32]
    depth: Singles

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.start) - 1

    def rows(self, frame: int) -> slice:
        """The rows of a frame."""
        return slice(int(self.start[frame]), int(self.start[frame + 1]))


class Drawing(NamedTuple):
    """What the pictures of a walk show besides the levels of its textures, and their reference.

    Attributes
    ----------
    lossy: previews of the textures.
    forms: the same textures in other forms, by name.
    full: the reference: the same textures in other quality; None: that of the relief, or the
        textures themselves.
    same_maps: whether ``full`` is also the reference of lightmaps and normal maps: their layouts
        agree.
    relief: octrees, and other relief as the reference.
    """

    lossy: Lossy | None = None
    forms: Mapping[str, Shows] = MappingProxyType({})
    full: Pyramids | None = None
    same_maps: bool = False
    relief: Relief | None = None

    def reference(self, pyramids: Pyramids) -> Pyramids:
        """The reference of textures."""
        if self.full is not None:
            return self.full
        relief = self.relief and self.relief.reference
        return relief.pyramids if relief else pyramids


#: Textures alone.
PLAIN = Drawing()


def look(
    surfaces: Surfaces,
    pyramids: Pyramids,
    camera: RayCamera,
    eye: Floats,
    direction: Floats,
    progress: Progress = silent,
    drawing: Drawing = PLAIN,
) -> list[WalkViews]:
    """The tables of (F, 3) eyes and unit directions of view: of ``pyramids``, then of the forms of
    the drawing."""
    triangles, caster, seen = triangles_of(surfaces), Caster(surfaces), camera.sparse
    full, relief = drawing.reference(pyramids), drawing.relief
    lossy = no_previews(len(pyramids.levels)) if drawing.lossy is None else drawing.lossy
    shown: list[Pyramids | Shows] = [pyramids, *drawing.forms.values()]
    whole = full if drawing.same_maps else pyramids
    tallies = [_Tally(triangles, textures, lossy, full, seen) for textures in shown]
    others = [
        (
            weight,
            [_Tally(triangles_of(maps), textures, lossy, whole, seen) for textures in shown],
        )
        for maps, weight in ((surfaces.light, 1.0), (surfaces.bump_surfaces, NORMALS))
        if maps is not None
    ]
    mirrors = [_ProbeTally(surfaces, textures, seen) for textures in shown if surfaces.gloss]
    relief_tally = ReliefTally(relief, surfaces, triangles, pyramids, seen) if relief else None
    owner = np.empty((len(eye), int(seen.sum())), np.int32)
    depth = np.empty(owner.shape, np.float32)
    for k in range(len(eye)):
        progress(k, len(eye), "looking along the walk")
        sight = caster.look(camera, eye[k], direction[k])
        plain = relief_tally.add(sight) if relief_tally else sight
        for tally in tallies:
            tally.add(plain)
        for tally in (tally for _, maps in others for tally in maps):
            tally.add(sight)
        for mirror in mirrors:
            mirror.add(sight)
        owner[k], depth[k] = _item_buffer(sight, triangles, seen)
    progress(len(eye), len(eye), "looking along the walk")
    more = [relief_tally.rows()] if relief_tally else []
    parts = [[tally.rows(), *more] for tally in tallies]
    for weight, maps in others:
        for rows, tally in zip(parts, maps, strict=True):
            rows.append(_of_maps(tally.rows(), weight))
    for rows, mirror in zip(parts, mirrors, strict=False):
        rows.append(mirror.rows())
    return [_views(rows, owner, depth) for rows in parts]


def _of_maps(rows: ViewRows, weight: float) -> ViewRows:
    """ViewRows of surfaces with a lightmap or normal map as their texture, without those of other
    surfaces; errors times ``weight``. The error of a missing cell is in the rows of its textures.
    """
    lit = rows.texture >= 0
    kept = {name: table[lit] for name, table in rows._asdict().items()}
    kept["error"][:, 0] = kept["square"][:, 0] = 0.0
    kept["error"] *= weight
    kept["square"] *= weight**2
    return ViewRows(**kept)


class _Tally:
    """Sums up errors of frames."""

    def __init__(
        self,
        triangles: Triangles,
        textures: Pyramids | Shows,
        lossy: Lossy,
        full: Pyramids,
        seen: Bools,
    ) -> None:
        self._add: Callable[..., None]
        if isinstance(textures, Shows):
            self._add, levels = add_columns, textures.row.shape[1] - 1
            self._what: tuple[Any, ...] = seen, triangles, textures, full
            states = levels
        else:
            self._add, levels = add_frame, textures.start.shape[1]
            self._what = seen, triangles, textures, lossy, full, textures is full
            states = max(levels, lossy.states)
        keys = np.stack([triangles.cell, triangles.texture], axis=1)
        self._sums = RowSums(keys, levels, states, seen)
        self._room = np.zeros((states + 7, 3))
        self.rows = self._sums.rows

    def add(self, sight: Sight) -> None:
        """Adds the rows of the next frame."""
        self._add(sight, *self._what, self._sums.sums, self._room)
        self._sums.end_frame(self._sums.sums.need[:, 0] != 0)


class _ProbeTally:
    """Sums up the pixels of surfaces that reflect. They want the finest level of their probe; what
    they show without it is no error of the tables, which know texels alone."""

    def __init__(self, surfaces: Surfaces, textures: Pyramids | Shows, seen: Bools) -> None:
        assert surfaces.gloss is not None
        probe = surfaces.gloss.probe
        columns = textures.last if isinstance(textures, Shows) else textures.levels
        self._sums = RowSums(np.stack([surfaces.cell, probe], axis=1), int(columns.max()), 0, seen)
        self._probe, self._seen, self._finest = probe, seen, columns[probe] - 1
        self.rows = self._sums.rows

    def add(self, sight: Sight) -> None:
        """Adds the rows of the next frame."""
        sums = self._sums.sums
        mirrors = (sight.triangle >= 0) & (self._probe[sight.triangle] >= 0)
        for table, pixels in (sums.need, mirrors), (sums.sight, mirrors & self._seen):
            triangle = sight.triangle[pixels]
            np.add.at(table, (sums.pair[triangle], self._finest[triangle]), 1.0)
        self._sums.end_frame(np.asarray(sums.need.any(axis=1)))


def _item_buffer(
    sight: Sight, triangles: Triangles, seen: Bools
) -> tuple[NDArray[np.int32], Singles]:
    """(n,) ``owner`` and ``depth`` of `WalkViews`, for the ``seen`` pixels."""
    shows, rays = sight.triangle[seen], sight.ray[seen]
    owner, depth = np.full(len(shows), -1, np.int32), np.full(len(shows), np.inf, np.float32)
    hit = np.flatnonzero(shows >= 0)
    shows = shows[hit]
    normal, offset = triangles.normal[shows], triangles.corner[shows, 0] - sight.eye
    owner[hit] = triangles.cell[shows]
    facing = np.einsum("ij,ij->i", normal, rays[hit])
    depth[hit] = np.einsum("ij,ij->i", normal, offset) / facing
    return owner, depth


def _views(parts: Sequence[ViewRows], owner: NDArray[np.int32], depth: Singles) -> WalkViews:
    """The views with the rows of all parts, frame by frame, and their item buffers."""
    frame = np.concatenate([rows.frame for rows in parts])
    order = np.argsort(frame, kind="stable")

    def join(*tables: NDArray[Any]) -> Any:
        wide = max(table.shape[-1] for table in tables)
        if tables[0].ndim > 1:
            # Columns beyond a row's own are never read.
            tables = tuple(np.pad(t, ((0, 0), (0, wide - t.shape[1]))) for t in tables)
        return np.concatenate(tables)[order]

    start = np.searchsorted(frame[order], np.arange(len(owner) + 1))
    _, cell, texture, *tables = (join(*part) for part in zip(*parts, strict=True))
    error, square, need, sight = tables
    return WalkViews(start, cell, texture, error, square, need, sight, owner, depth)


def limit_levels(views: WalkViews, count: Ints) -> WalkViews:
    """The views with textures that lack their finest levels and have no previews; ``count`` (T,) is
    the number of levels of each. Missing levels stay an error."""
    deepest = int(count.max(initial=1))
    # One more, for surfaces without texture: the last.
    has = np.arange(deepest) < np.append(count, deepest)[views.texture, None]
    need, sight = (np.where(has, table[:, :deepest], 0) for table in (views.need, views.sight))
    error, square = (
        np.ascontiguousarray(table[:, : deepest + 2]) for table in (views.error, views.square)
    )
    return replace(views, error=error, square=square, need=need, sight=sight)
