"""Rows of the tables along a walk: compiled sums of the errors of a frame, by pair of cell and
texture, with the sampling of `ptmtools.rendering.kernels`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.jit import inlined_kernel, plain_kernel
from ptmtools.rendering.kernels import GREY, blend, sample, texel_under
from ptmtools.rendering.records import Pyramids, Shows, Sight, Triangles
from ptmtools_lab.lossy import Lossy


class ViewRows(NamedTuple):
    """ViewRows of `ptmtools_lab.tables.WalkViews`, and (R,) the frame of each, ascending."""

    frame: Ints
    cell: NDArray[np.int32]
    texture: NDArray[np.int32]
    error: Singles
    square: Singles
    need: Singles
    sight: Singles


class Sums(NamedTuple):
    """Sums over the pixels of frames, by pair of cell and texture.

    Attributes
    ----------
    pair: (m,) pair of each triangle.
    error, square: (P, S + 1) root mean squares over R, G and B, and their squares. Columns: nothing
        loaded, the mean colour, then the states of `ptmtools_lab.lossy` from 1 on, the
        first of which are level 0, level 1, … as the finest loaded level; or the columns of `Shows`
        instead of states.
    need, sight: (P, L) demand for each level, 0 to 1 per pixel, over all pixels and over the pixels
        of a client's item buffer; column 0 counts surfaces without texture.
    """

    pair: Ints
    error: Floats
    square: Floats
    need: Floats
    sight: Floats


class RowSums:
    """Collects the rows of frames.

    Parameters
    ----------
    keys: (k, 2) pairs of cell and texture, each any number of times.
    levels: number of levels that pixels may want. states: number of states with an error, besides
        those of nothing and of the mean colour.
    seen: (n,) which pixels belong to the item buffer of a client.

    Attributes
    ----------
    pair: (k,) the pair of each key.
    sums: tables for the kernels, by pair; ``pair`` is that of the keys.
    """

    def __init__(
        self, keys: Ints | NDArray[np.int32], levels: int, states: int, seen: Bools
    ) -> None:
        self._pairs, pair = np.unique(keys, axis=0, return_inverse=True)
        self.pair: Ints = pair.reshape(-1).astype(np.int64)
        wide = (states + 2, states + 2, levels, levels)
        self.sums = Sums(self.pair, *(np.zeros((len(self._pairs), n)) for n in wide))
        self._pixels = (len(seen), len(seen), len(seen), max(int(seen.sum()), 1))
        #: Pairs, and rows of each table: first of no frame, then of each.
        self._shown = [np.zeros(0, np.int64)]
        self._rows = [[np.zeros((0, n), np.float32)] for n in wide]

    def end_frame(self, shown: Bools) -> None:
        """Makes rows of the sums of the (P,) ``shown`` pairs, and clears them."""
        pairs = np.flatnonzero(shown)
        self._shown.append(pairs)
        for rows, table, pixels in zip(self._rows, self.sums[1:], self._pixels, strict=True):
            rows.append((table[pairs] / pixels).astype(np.float32))
            table[pairs] = 0.0

    def rows(self) -> ViewRows:
        """The rows of all frames."""
        count = [len(pairs) for pairs in self._shown[1:]]
        cell, texture = self._pairs[np.concatenate(self._shown)].astype(np.int32).T
        tables = map(np.concatenate, self._rows)
        return ViewRows(np.repeat(np.arange(len(count)), count), cell, texture, *tables)


@plain_kernel
def distance(color: Floats, exact: Floats) -> float:
    """Mean squared difference of two colours (3,) over R, G and B."""
    total = 0.0
    for k in range(3):
        total += (color[k] - exact[k]) ** 2
    return total / 3.0


@plain_kernel
def add_frame(
    sight: Sight,
    seen: Bools,
    triangles: Triangles,
    textures: Pyramids,
    lossy: Lossy,
    full: Pyramids,
    same: bool,
    sums: Sums,
    scratch: Floats,
) -> None:
    """Adds the errors and demands of the pixels of a frame to ``sums``.

    Parameters
    ----------
    seen: (n,) whether the pixel belongs to the client's item buffer.
    full: reference textures; ``same`` if they are ``textures``.
    scratch: (S + 6, 3), overwritten.
    """
    exact, coarse, work, shown = scratch[0], scratch[1], scratch[2:5], scratch[5:]
    shown[0] = GREY
    for i in range(len(sight.triangle)):
        f = sight.triangle[i]
        if f < 0:
            continue
        p, t, color = sums.pair[f], triangles.texture[f], triangles.color[f]
        if t < 0:
            for k in range(3):
                exact[k] = 255.0 * color[k]
            square = distance(shown[0], exact)
            sums.error[p, 0] += np.sqrt(square)
            sums.square[p, 0] += square
            sums.need[p, 0] += 1.0
            if seen[i]:
                sums.sight[p, 0] += 1.0
            continue
        clamped, finest = triangles.clamped[f], textures.levels[t] - 1
        if not same:
            u, v, detail = texel_under(sight, i, triangles, full, t, work)
            blend(full, t, detail, u, v, clamped, exact, coarse)
        u, v, detail = texel_under(sight, i, triangles, textures, t, work)
        sharp = finest - int(detail)  # finest sampled level
        for n in range(sharp + 1):
            sample(textures, t, n, u, v, clamped, shown[n + 2])
        below = max(sharp - 1, 0)
        for k in range(3):
            step = shown[below + 2, k] - shown[sharp + 2, k]
            shown[sharp + 2, k] += (detail - int(detail)) * step
            shown[1, k] = textures.mean[t, k]
            if same:
                exact[k] = shown[sharp + 2, k]
            exact[k] *= color[k]
            for n in range(1, sharp + 3):
                shown[n, k] *= color[k]
        # Levels finer than the sampled one do not change the picture.
        last = sharp if same else finest
        for n in range(last + 3):
            square = distance(shown[min(n, sharp + 2)], exact)
            sums.error[p, n] += np.sqrt(square)
            sums.square[p, n] += square
        for n in range(last + 1):
            wanted = min(max(finest - n + 1.0 - detail, 0.0), 1.0)
            sums.need[p, n] += wanted
            if seen[i]:
                sums.sight[p, n] += wanted
        if lossy.first[t] < lossy.first[t + 1]:
            _add_previews(lossy, sums, p, t, sharp, detail, u, v, clamped, color, exact, shown)


@inlined_kernel
def _add_previews(
    lossy: Lossy,
    sums: Sums,
    p: int,
    t: int,
    sharp: int,
    detail: float,
    u: float,
    v: float,
    clamped: Bools,
    color: Floats,
    exact: Floats,
    shown: Floats,
) -> None:
    """Adds the errors of a pixel in the states of the lossy previews of its texture ``t``, of which
    ``sharp`` is the finest level that it samples."""
    below = max(sharp - 1, 0)
    for q in range(lossy.first[t], lossy.first[t + 1]):
        at, levels = lossy.state[q] + 2, lossy.pyramids.levels[q]
        drawn = min(sharp + 1, levels)
        for n in range(drawn):
            sample(lossy.pyramids, q, n, u, v, clamped, shown[at + n])
        if sharp < levels:
            for k in range(3):
                step = shown[at + below, k] - shown[at + sharp, k]
                shown[at + sharp, k] += (detail - int(detail)) * step
        for n in range(drawn):
            for k in range(3):
                shown[at + n, k] *= color[k]
            square = distance(shown[at + n], exact)
            # Finer levels that are not sampled do not change the picture.
            times = levels - n if n == drawn - 1 else 1
            for m in range(n, n + times):
                sums.error[p, at + m] += np.sqrt(square)
                sums.square[p, at + m] += square


@plain_kernel
def add_columns(
    sight: Sight,
    seen: Bools,
    triangles: Triangles,
    shows: Shows,
    full: Pyramids,
    sums: Sums,
    scratch: Floats,
) -> None:
    """Adds the errors and demands of a frame, for textures whose columns have levels of their own.

    The demand for a column is 1 if texels of its finest level are at least as large as a pixel, and
    falls to 0 at half that size; the demand for the first column is 1.
    """
    exact, coarse, work, color = scratch[0], scratch[1], scratch[2:5], scratch[5]
    for i in range(len(sight.triangle)):
        f = sight.triangle[i]
        if f < 0:
            continue
        p, t, tint = sums.pair[f], triangles.texture[f], triangles.color[f]
        if t < 0:
            for k in range(3):
                exact[k] = 255.0 * tint[k]
                color[k] = GREY
            square = distance(color, exact)
            sums.error[p, 0] += np.sqrt(square)
            sums.square[p, 0] += square
            sums.need[p, 0] += 1.0
            if seen[i]:
                sums.sight[p, 0] += 1.0
            continue
        clamped = triangles.clamped[f]
        u, v, detail = texel_under(sight, i, triangles, full, t, work)
        blend(full, t, detail, u, v, clamped, exact, coarse)
        for k in range(3):
            exact[k] *= tint[k]
        for n in range(shows.last[t] + 2):
            if n < 2:
                for k in range(3):
                    color[k] = shows.mean[t, k] * tint[k] if n else GREY
            else:
                row = shows.row[t, n - 1]
                below = float(shows.pyramids.levels[row] - shows.held[t, n - 1])
                u, v, detail = texel_under(sight, i, triangles, shows.pyramids, row, work)
                wanted = min(max(below + 1.0 - detail, 0.0), 1.0) if n > 2 else 1.0
                sums.need[p, n - 2] += wanted
                if seen[i]:
                    sums.sight[p, n - 2] += wanted
                at = max(detail, below)
                blend(shows.pyramids, row, at, u, v, clamped, color, coarse)
                for k in range(3):
                    color[k] *= tint[k]
            square = distance(color, exact)
            sums.error[p, n] += np.sqrt(square)
            sums.square[p, n] += square
