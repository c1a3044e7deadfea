"""All levels of all textures as 8-bit RGB, in one array, for kernels that sample them."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError, InputError, LimitError
from ptmtools.output.served import BUILD, Served
from ptmtools.progress import Progress, silent
from ptmtools.rendering.records import Pyramids
from ptmtools.texture import reader
from ptmtools.texture.detail import difference_between
from ptmtools.texture.model import Limits
from ptmtools.texture.samples import in_eight_bits

#: A texture that needs more memory than this to decode is refused.
_LIMITS = Limits(decoded_bytes=1 << 33)


def read_pyramids(
    served: Served, progress: Progress = silent, only: Collection[int] | None = None
) -> Pyramids:
    """Decodes all textures, or ``only`` those of these numbers; the others have no levels.

    Raises
    ------
    DatabaseError: PTM-D005, D006 a texture is missing or damaged, or not what the index says.
    LimitError: those of `ptmtools.texture.open` and `PtmReader.levels`.
    """
    try:
        return _pyramids(served, progress, only)
    except LimitError:
        raise
    except InputError as fault:
        code = "PTM-D005" if fault.code == "PTM-I120" else "PTM-D006"
        raise DatabaseError(
            code, fault.message, file=fault.file, place=fault.place, remedy=BUILD
        ) from None


def _pyramids(served: Served, progress: Progress, only: Collection[int] | None = None) -> Pyramids:
    rows = served.index["textures"]
    deepest = max((len(row["ends"]) for row in rows), default=1)
    start, levels = np.zeros((len(rows), deepest), np.int64), np.zeros(len(rows), np.int64)
    size, mean = np.zeros((len(rows), deepest, 2), np.int64), np.zeros((len(rows), 3))
    differences = np.zeros((len(rows), deepest))
    parts: list[NDArray[np.uint8]] = []
    at = 0
    for t in range(len(rows)):
        if only is not None and t not in only:
            continue
        progress(t, len(rows), "decoding textures")
        below = None
        file = served.texture_file(t)
        with reader.open(file, limits=_LIMITS) as ptm:
            held = [level.end for level in ptm.header.levels[: ptm.whole]]
            finest = ptm.header.levels[-1]
            if (held, finest.width, finest.height) != (
                rows[t]["ends"], rows[t]["width"], rows[t]["height"],
            ):  # fmt: skip
                raise DatabaseError(
                    "PTM-D006", "is not the texture that the index has", file=file, remedy=BUILD
                )
            for n, samples in enumerate(ptm.levels()):
                level = rgb(samples)
                if below is None:
                    mean[t] = level.reshape(-1, 3).mean(axis=0)
                else:
                    texels = level.shape[0] * level.shape[1]
                    differences[t, n] = difference_between(level, below) / texels
                start[t, n], size[t, n] = at, (level.shape[1], level.shape[0])
                levels[t] = n + 1
                at += level.size
                parts.append(level.ravel())
                below = level
    texel = np.concatenate(parts) if parts else np.zeros(0, np.uint8)
    return Pyramids(texel, start, size, levels, mean, differences)


def rgb(samples: NDArray[Any]) -> NDArray[np.uint8]:
    """(h, w, 3) of (h, w, c) samples of any kind."""
    shown = in_eight_bits(samples)
    color = shown[:, :, :3] if shown.shape[2] >= 3 else np.repeat(shown[:, :, :1], 3, axis=2)
    return np.ascontiguousarray(color)
