"""Pictures of lossy previews, and the states of textures that have some.

*States* number the pictures that a texture can have. State 0 is nothing; states 1 to M are the
columns of the exact levels, M of them; then come the columns of each lossy preview, 1 to its level
+ 1. A preview that is the exact form of its texture has the states of the exact levels.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ptmtools.output.model import offsets_of
from ptmtools.output.served import Served
from ptmtools.progress import Progress, silent
from ptmtools.rendering.previews import Texels, read_preview
from ptmtools.rendering.pyramids import pack_pyramids
from ptmtools.rendering.records import Lossy, Pyramids, Shows, own_levels
from ptmtools.texture.detail import with_offset


def no_previews(textures: int) -> Lossy:
    """The pictures of ``textures`` without previews."""
    return Lossy(pack_pyramids([]), np.zeros(textures + 1, np.int64), np.zeros(0, np.int64))


def states_of(texture: Mapping[str, Any]) -> list[int]:
    """The state before the first one of each preview of a row of the index."""
    previews = texture.get("previews", ())
    finest = previews[-1]["level"] + 1 if previews else 0
    result, following = [], max(len(texture["ends"]), finest)
    for preview in previews:
        lossy = not preview.get("exact", False)
        result.append(following if lossy else 0)
        following += (preview["level"] + 1) * lossy
    return result


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
