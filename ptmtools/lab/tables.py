"""Tables along a walk: what each pair of cell and texture covers, and its error at each level.

For every pixel of a frame the texture is sampled as OpenGL would, trilinearly, once with all of its
levels and once for each level as the finest that is there. The difference, root mean square over R,
G and B (0 to 255), is summed up by the pair. A run then only looks up: the error of a frame is the
sum over its pairs, each at the level that the client holds. Nothing that is no texture is wrong
once its cell is there; what is not there is grey.

The same casting of the rays serves textures in several forms (`ptmtools.lab.forms`). Of the
levels of one pyramid each pixel samples every one once; a form whose steps are pyramids of their
own (`Shows`) costs a sample of each.

The level of detail is that of a screen of 1080 lines, whatever the item buffer has: a coarser
buffer samples fewer pixels of the same picture.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.lab.relief.tables import Relief, Rows, Tally as ReliefTally
from ptmtools.output.served import Surfaces
from ptmtools.progress import Progress, silent
from ptmtools.rendering.rays import Camera, Caster
from ptmtools.rendering.records import Pyramids, Shows, Sight, Triangles, triangles_of


@dataclass(frozen=True)
class Views:
    """What is on the screen, frame by frame; the rows of a frame are its pairs.

    Attributes
    ----------
    start: (F + 1,) where the rows of each frame begin.
    cell, texture: (R,) int32 of each row; the texture is -1 for surfaces without. Behind the
        textures come octrees, see `ptmtools.lab.relief`.
    error, square: (R, L + 2) its part of the frame's mean of errors, and of squared errors, with as
        the finest that is there: nothing, the mean colour, level 0, level 1, …; in other forms
        their columns in place of levels.
    need: (R, L) the share of the pixels for which a level is wanted, beside the coarser ones; for
        surfaces without texture the first is the share that they cover.
    sight: (R, L) the same in the item buffer that a client draws, with half as many pixels each
        way.
    owner, depth: (V, n) int32, float32 of that item buffer's pixels: the cell that is on the
        screen, -1 for none, and how far away it is along the view, metres.
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
        """How many there are."""
        return len(self.start) - 1

    def rows(self, frame: int) -> slice:
        """Those of a frame."""
        return slice(int(self.start[frame]), int(self.start[frame + 1]))


def look(
    surfaces: Surfaces,
    pyramids: Pyramids,
    camera: Camera,
    eye: Floats,
    direction: Floats,
    progress: Progress = silent,
    *,
    full: Pyramids | None = None,
) -> Views:
    """The tables of (F, 3) eyes and unit directions of view; errors are against what ``full`` would
    show, which holds the same textures in other quality."""
    return look_at_forms(surfaces, pyramids, (), camera, eye, direction, progress, full=full)[0]


def look_at_forms(
    surfaces: Surfaces,
    pyramids: Pyramids,
    forms: Sequence[Shows],
    camera: Camera,
    eye: Floats,
    direction: Floats,
    progress: Progress = silent,
    *,
    full: Pyramids | None = None,
    relief: Relief | None = None,
) -> list[Views]:
    """The tables of `look`, and those of the same textures in other forms, against the same; with
    octrees, and what else is lit, if there are any."""
    triangles, caster, seen = triangles_of(surfaces), Caster(surfaces), camera.sparse
    full = pyramids if full is None else full
    shown: list[Pyramids | Shows] = [pyramids, *forms]
    tallies = [_Tally(triangles, textures, full, seen) for textures in shown]
    beside = ReliefTally(relief, surfaces, triangles, pyramids, seen) if relief else None
    owner = np.empty((len(eye), int(seen.sum())), np.int32)
    depth = np.empty(owner.shape, np.float32)
    for k in range(len(eye)):
        progress(k, len(eye), "looking along the walk")
        sight = caster.look(camera, eye[k], direction[k])
        plain = beside.add(sight) if beside else sight
        for tally in tallies:
            tally.add(plain)
        owner[k], depth[k] = _item_buffer(sight, triangles, seen)
    progress(len(eye), len(eye), "looking along the walk")
    views_of = [tally.views(owner, depth) for tally in tallies]
    return [with_rows(views, beside.rows) for views in views_of] if beside else views_of


class _Tally:
    """Adds up frames."""

    def __init__(
        self, triangles: Triangles, textures: Pyramids | Shows, full: Pyramids, seen: Bools
    ) -> None:
        from ptmtools.rendering.kernels import Sums, add_columns, add_frame

        keys = np.stack([triangles.cell, triangles.texture], axis=1)
        self._pairs, pair = np.unique(keys, axis=0, return_inverse=True)
        self._add: Callable[..., None]
        if isinstance(textures, Shows):
            self._add, deepest = add_columns, textures.row.shape[1] - 1
            self._what: tuple[Any, ...] = seen, triangles, textures, full
        else:
            self._add, deepest = add_frame, textures.start.shape[1]
            self._what = seen, triangles, textures, full, textures is full
        columns = (deepest + 2, deepest + 2, deepest, deepest)
        self._sums = Sums(pair.reshape(-1), *(np.zeros((len(self._pairs), n)) for n in columns))
        self._room = np.zeros((deepest + 7, 3))
        pixels = len(seen)
        self._pixels = (pixels, pixels, pixels, max(int(seen.sum()), 1))
        #: Of no frame, and of each: its pairs, and its rows of each table.
        self._nonzero = [np.zeros(0, np.int64)]
        self._rows = [[np.zeros((0, n), np.float32)] for n in columns]

    def add(self, sight: Sight) -> None:
        """Makes the rows of the next frame."""
        self._add(sight, *self._what, self._sums, self._room)
        nonzero = np.flatnonzero(self._sums.need[:, 0])
        self._nonzero.append(nonzero)
        for rows, table, pixels in zip(self._rows, self._sums[1:], self._pixels, strict=True):
            rows.append((table[nonzero] / pixels).astype(np.float32))
            table[nonzero] = 0.0

    def views(self, owner: NDArray[np.int32], depth: Singles) -> Views:
        """Those of all frames, with their item buffers."""
        start = np.cumsum([len(pairs) for pairs in self._nonzero])
        cell, texture = self._pairs[np.concatenate(self._nonzero)].T
        error, square, need, sight = map(np.concatenate, self._rows)
        return Views(start, cell, texture, error, square, need, sight, owner, depth)


def _item_buffer(
    sight: Sight, triangles: Triangles, seen: Bools
) -> tuple[NDArray[np.int32], Singles]:
    """(n,) ``owner`` and ``depth`` of `Views`, of the pixels that are seen."""
    shows, rays = sight.triangle[seen], sight.ray[seen]
    owner, depth = np.full(len(shows), -1, np.int32), np.full(len(shows), np.inf, np.float32)
    hit = np.flatnonzero(shows >= 0)
    shows = shows[hit]
    normal, offset = triangles.normal[shows], triangles.corner[shows, 0] - sight.eye
    owner[hit] = triangles.cell[shows]
    facing = np.einsum("ij,ij->i", normal, rays[hit])
    depth[hit] = np.einsum("ij,ij->i", normal, offset) / facing
    return owner, depth


def with_rows(views: Views, more: Rows) -> Views:
    """The same with more rows, each behind those of its frame."""
    of = np.repeat(np.arange(views.frames), np.diff(views.start))
    order = np.argsort(np.concatenate([of, more.frame]), kind="stable")

    def both(name: str) -> Any:
        tables = [getattr(views, name), getattr(more, name)]
        wide = max(table.shape[-1] for table in tables)
        if tables[0].ndim > 1:
            # Columns that a row does not have are never looked at.
            tables = [np.pad(t, ((0, 0), (0, wide - t.shape[1]))) for t in tables]
        return np.concatenate(tables)[order]

    names = ("cell", "texture", "error", "square", "need", "sight")
    start = np.searchsorted(np.sort(np.concatenate([of, more.frame])), np.arange(views.frames + 1))
    return replace(views, start=start, **{name: both(name) for name in names})


def limited(views: Views, count: Ints) -> Views:
    """The same views of textures that lack their finest levels; ``count`` (T,) is how many levels
    each has. What they cannot show stays an error."""
    deepest = int(count.max(initial=1))
    # One more, of surfaces without texture, which is the last.
    has = np.arange(deepest) < np.append(count, deepest)[views.texture, None]
    need, sight = (np.where(has, each[:, :deepest], 0) for each in (views.need, views.sight))
    error, square = (
        np.ascontiguousarray(each[:, : deepest + 2]) for each in (views.error, views.square)
    )
    return replace(views, error=error, square=square, need=need, sight=sight)
