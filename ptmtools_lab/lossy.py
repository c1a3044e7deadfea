"""Pictures of lossy previews, by the states of textures (`ptmtools.site.choice.states_of`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.output.model import offsets_of
from ptmtools.output.served import Served
from ptmtools.progress import Progress, silent
from ptmtools.rendering.pyramids import Texels, pack_pyramids, read_preview
from ptmtools.rendering.records import Pyramids, Shows, own_levels
from ptmtools.site.choice import states_of
from ptmtools.texture.detail import with_offset


class Lossy(NamedTuple):
    """Pictures of the lossy previews of textures.

    Attributes
    ----------
    pyramids: a pyramid for each of Q previews, texture by texture, by ascending level; their levels
        are those of the texture, from the coarsest to that of the preview.
    first: (T + 1,) where the previews of each texture begin.
    state: (Q,) the state before the first one of each preview.
    """

    pyramids: Pyramids
    first: Ints
    state: Ints

    @property
    def states(self) -> int:
        """The greatest number of a state of lossy previews, 0 without any."""
        return int((self.state + self.pyramids.levels).max(initial=0))


def no_previews(textures: int) -> Lossy:
    """The pictures of ``textures`` without previews."""
    return Lossy(pack_pyramids([]), np.zeros(textures + 1, np.int64), np.zeros(0, np.int64))


def read_lossy(served: Served, progress: Progress = silent) -> Lossy:
    """The pictures of all lossy previews. Raises as `read_preview`."""
    rows = served.index["textures"]
    chains: list[list[Texels]] = []
    first, state = [0], []
    for t, row in enumerate(rows):
        progress(t, len(rows), "decoding previews")
        for number, before in enumerate(states_of(row)):
            if before:
                levels = zip(read_preview(served, t, number), offsets_of(row), strict=False)
                chains.append([with_offset(*level) for level in levels])
                state.append(before)
        first.append(len(chains))
    return Lossy(pack_pyramids(chains), np.array(first), np.array(state, dtype=np.int64))


def pictures(pyramids: Pyramids, lossy: Lossy) -> Shows:
    """The pictures of all states of textures; with previews, a copy of all texels."""
    if not len(lossy.state):
        return own_levels(pyramids)
    textures, columns = pyramids.start.shape
    texture = np.repeat(np.arange(textures), np.diff(lossy.first))
    # All levels have their place, so that the level of detail is that of the whole texture.
    start = np.zeros((len(texture), columns), np.int64)
    start[:, : lossy.pyramids.start.shape[1]] = lossy.pyramids.start + len(pyramids.texel)
    every = np.concatenate([np.arange(textures), texture])
    joined = Pyramids(
        np.concatenate([pyramids.texel, lossy.pyramids.texel]),
        np.concatenate([pyramids.start, start]),
        pyramids.size[every],
        pyramids.levels[every],
        pyramids.mean[every],
        pyramids.differences[every],
    )
    states = max(lossy.states, int(pyramids.levels.max(initial=0))) + 1
    row = np.repeat(np.arange(textures)[:, None], states, axis=1)
    finest, last = np.minimum(np.arange(states), pyramids.levels[:, None]), pyramids.levels.copy()
    for q, t in enumerate(texture.tolist()):
        levels, before = int(lossy.pyramids.levels[q]), int(lossy.state[q])
        of_state = slice(before + 1, before + levels + 1)
        row[t, of_state], finest[t, of_state] = textures + q, np.arange(1, levels + 1)
        last[t] = before + levels
    return Shows(joined, row, finest, last, pyramids.mean)
