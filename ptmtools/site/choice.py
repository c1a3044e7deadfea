"""The choice of the next bytes of textures (docs/formats/client.md), for the openings of sites and
the clients of the simulator; the page has it in JavaScript (``web/page/policy/allocation.js``).

Column c of a texture is its levels 0 to c − 1; column 0 is nothing. A column has several *sources*:
the `.ptm`, and previews. Tables by source have a row for each texture, then for each preview.

A preview of level c − 1 shows columns 1 to c. Its texels are off by `difference`, d, on average. In
a coarser column, whose texels are means of its own, that error averages out: at column j it is d ·
`AVERAGING` ^ (c − j). A pixel that wants column n as its finest sees the error of column n, or of
the resident column k if that is coarser. The shares of the pixels that want a column fall with the
column, so the loss of a preview at column k is the sum over columns 1 to k of their shares times
weights that do not depend on k (`Previews.losses`). A preview is therefore valued like the exact
levels: by the sum of shares times differences, less these weights.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import plain_kernel
from ptmtools.site.client import AVERAGING, LEAST_DIFFERENCE


class Previews(NamedTuple):
    """P previews, texture by texture, by ascending level; their numbers are those of requests.

    Attributes
    ----------
    texture: (P,) of each. first: (T + 1,) where those of each texture begin.
    column: (P,) the finest column that each shows.
    bytes: (P,) of the file.
    difference: (P,) mean difference of its texels to the exact ones, 0 to 255; 0 for an exact one,
        else at least `LEAST_DIFFERENCE`.
    exact: (P,) whether it is the exact form of its texture.
    state: (P,) the state before its first one, see `states_of`.
    """

    texture: Ints
    first: Ints
    column: Ints
    bytes: Ints
    difference: Floats
    exact: Bools
    state: Ints

    def losses(self, columns: int) -> Floats:
        """(P, K) error that each column of each preview adds, by the share of the pixels that want
        it; 0 to 255."""
        below = self.column[:, None] - np.arange(columns)
        error = self.difference[:, None] * AVERAGING ** np.maximum(below, 0)
        added = np.where(np.arange(columns) > 1, (1 - AVERAGING) * error, error)
        return np.where((below >= 0) & (np.arange(columns) > 0), added, 0.0)

    def gains(self, differences: Floats) -> Floats:
        """(R, K) error that each column of each source removes, from the (T, K) differences of the
        exact columns; 0 beyond the column of a preview."""
        columns = np.arange(differences.shape[1])
        gains = differences[self.texture] - self.losses(len(columns))
        gains[columns > self.column[:, None]] = 0.0
        return np.concatenate([differences, gains])

    def pad_to(self, textures: int) -> Previews:
        """The same previews of the first of more textures."""
        more = textures + 1 - len(self.first)
        return self._replace(first=np.pad(self.first, (0, more), "edge"))


def states_of(texture: Mapping[str, Any]) -> list[int]:
    """The state before the first one of each preview of a row of the index.

    *States* number the pictures that a texture can have. State 0 is nothing; states 1 to M are the
    columns of the exact levels, M of them; then come the columns of each lossy preview, 1 to its
    level + 1. A preview that is the exact form of its texture has the states of the exact levels.
    """
    previews = texture.get("previews", ())
    finest = previews[-1]["level"] + 1 if previews else 0
    result, following = [], max(len(texture["ends"]), finest)
    for preview in previews:
        lossy = not preview.get("exact", False)
        result.append(following if lossy else 0)
        following += (preview["level"] + 1) * lossy
    return result


def no_previews(textures: int) -> Previews:
    """The previews of ``textures`` without any."""
    return previews_of([{"ends": []}] * textures)


def previews_of(textures: Sequence[Mapping[str, Any]]) -> Previews:
    """The previews of rows of the index."""
    by_texture = [row.get("previews", ()) for row in textures]
    rows = [preview for of_texture in by_texture for preview in of_texture]
    count = np.array([len(of_texture) for of_texture in by_texture], dtype=np.int64)
    exact = np.array([row.get("exact", False) for row in rows], dtype=np.bool_)
    error = np.array([row["difference"] for row in rows], dtype=np.float64)
    return Previews(
        texture=np.repeat(np.arange(len(textures)), count),
        first=np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
        column=np.array([row["level"] + 1 for row in rows], dtype=np.int64),
        bytes=np.array([row["bytes"] for row in rows], dtype=np.int64),
        difference=np.where(exact, 0.0, np.maximum(error, LEAST_DIFFERENCE)),
        exact=exact,
        state=np.array([s for row in textures for s in states_of(row)], dtype=np.int64),
    )


@plain_kernel
def next_fetch(
    worth: Floats, ends: Ints, stored: Ints, requested: Ints, busy: Bools, last: Ints,
    previews: Previews, pending: Bools, overhead: int,
) -> tuple[float, int, int]:  # fmt: skip
    """The next bytes of greatest worth: worth per byte, source, and the column that they lead to;
    (0, -1, 0) if there are none.

    The worth is what they add to the greatest value of the requested sources at a wanted column;
    that of ranges, at one which the file has, so that its levels follow a preview of finer ones.

    Parameters
    ----------
    worth: (R, K). ends: (T, K) bytes up to each column, the finest of them ``stored`` (T,).
    requested: (T,) bytes requested already. busy: (T,) whether no more ranges may be requested.
    last: (T,) wanted columns.
    pending: (P,) whether a preview was requested.
    overhead: further bytes of a request.
    """
    best, source, column = 0.0, -1, 0
    for t in range(len(requested)):
        until, exact, value_before, reached = min(last[t], stored[t]), 0.0, 0.0, 0
        while reached < until and ends[t, reached + 1] <= requested[t]:
            reached += 1
            exact += worth[t, reached]
            value_before = max(value_before, exact)
        coarse = value_before
        for p in range(previews.first[t], previews.first[t + 1]):
            if pending[p]:
                row, finest = len(requested) + p, previews.column[p]
                value_before = max(value_before, greatest(worth[row], min(finest, last[t]))[0])
                coarse = max(coarse, greatest(worth[row], min(finest, until))[0])
        best_density, row_of_best, to = 0.0, -1, 0
        if not busy[t]:
            total = exact - coarse
            for k in range(reached + 1, until + 1):
                total += worth[t, k]
                density = total / max(ends[t, k] - requested[t] + overhead, 1)
                if total > 0.0 and density >= best_density:
                    best_density, row_of_best, to = density, t, k
        for p in range(previews.first[t], previews.first[t + 1]):
            if pending[p]:
                continue
            row = len(requested) + p
            value, k = greatest(worth[row], min(previews.column[p], last[t]))
            density = (value - value_before) / max(previews.bytes[p] + overhead, 1)
            if value > value_before and density >= best_density:
                best_density, row_of_best, to = density, row, k
        if best_density > best:
            best, source, column = best_density, row_of_best, to
    return best, source, column


@plain_kernel
def greatest(worth: Floats, last: int) -> tuple[float, int]:
    """The greatest value of the columns of a source (K,) up to ``last``, at least 0, and the finest
    column that has it."""
    best, column, total = 0.0, 0, 0.0
    for k in range(1, last + 1):
        total += worth[k]
        if total >= best:
            best, column = total, k
    return best, column
