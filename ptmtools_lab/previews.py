"""Previews of textures as a client's catalogue knows them: lossy images of single levels.

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
from ptmtools.rendering.lossy import states_of
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
    state: (P,) the state before its first one, see `ptmtools.rendering.lossy`.
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

    def among(self, textures: int) -> Previews:
        """The same previews of the first of more textures."""
        more = textures + 1 - len(self.first)
        return self._replace(first=np.pad(self.first, (0, more), "edge"))


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
