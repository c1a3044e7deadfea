"""All levels of all textures as one array of 8-bit RGB, for kernels that sample them.

Levels come from a `.ptm`, or from a preview: an ordinary lossy image of a single level. A preview
of level n shows that level and, halved by means of 2 × 2 texels, all coarser ones. Its image is as
Pillow decodes it; browsers decode JPEG with other chroma filters, which moves single texels by a
few steps of 255.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import DatabaseError, InputError, LimitError
from ptmtools.output.model import offsets_of, sizes_of
from ptmtools.output.served import BUILD, Served
from ptmtools.progress import Progress, silent
from ptmtools.rendering.records import Pyramids, Sight, Triangles, own_levels
from ptmtools.texture import reader
from ptmtools.texture.detail import difference_between, with_offset
from ptmtools.texture.model import Limits
from ptmtools.texture.previews import decode_preview
from ptmtools.texture.pyramid import build_pyramid
from ptmtools.texture.samples import in_eight_bits

Texels = NDArray[np.uint8]

#: Limit on the memory that decoding a texture may take.
_LIMITS = Limits(decoded_bytes=1 << 33)


def read_pyramids(
    served: Served,
    progress: Progress = silent,
    only: Collection[int] | None = None,
    decoded: Mapping[int, Sequence[Texels]] = MappingProxyType({}),
) -> Pyramids:
    """The colours of all textures, or only of those whose number is in ``only``; the others get no
    levels. ``decoded``: levels of some, as of `read_levels`. Raises as `read_levels`."""
    rows = served.index["textures"]
    chains: list[list[Texels]] = [[] for _ in rows]
    mean, differences = np.zeros((len(rows), 3)), [[0.0] for _ in rows]
    for t in range(len(rows)):
        if only is not None and t not in only:
            continue
        progress(t, len(rows), "decoding textures")
        levels = decoded[t] if t in decoded else read_levels(served, t)
        chains[t] = [np.ascontiguousarray(level[..., :3]) for level in levels]
        for below, level in pairwise(chains[t]):
            texels = level.shape[0] * level.shape[1]
            differences[t].append(difference_between(level, below) / texels)
        pairs = zip(chains[t], offsets_of(rows[t]), strict=True)
        chains[t] = [with_offset(level, offset) for level, offset in pairs]
        mean[t] = chains[t][0].reshape(-1, 3).mean(axis=0)
    result = pack_pyramids(chains)
    for row, values in zip(result.differences, differences, strict=True):
        row[: len(values)] = values
    return result._replace(mean=mean)


def read_levels(served: Served, texture: int) -> list[Texels]:
    """Decodes a texture: its levels, the coarsest first, (h, w, 3) RGB or (h, w, 4) with alpha,
    without offsets. Levels that are finer than those of the `.ptm` come from the finest preview.

    Raises
    ------
    DatabaseError: PTM-D005, D006 it is missing, damaged or does not match the index.
    LimitError: see `ptmtools.texture.open` and `PtmReader.levels`.
    """
    try:
        return _levels(served, texture)
    except LimitError:
        raise
    except InputError as fault:
        code = "PTM-D005" if fault.code == "PTM-I120" else "PTM-D006"
        raise DatabaseError(
            code, fault.message, file=fault.file, place=fault.place, remedy=BUILD
        ) from None


def _levels(served: Served, texture: int) -> list[Texels]:
    row, file = served.index["textures"][texture], served.texture_file(texture)
    with reader.open(file, limits=_LIMITS) as ptm:
        ends = [level.end for level in ptm.header.levels[: ptm.whole]]
        finest = ptm.header.levels[-1]
        if (ends, finest.width, finest.height) != (row["ends"], row["width"], row["height"]):
            raise DatabaseError(
                "PTM-D006", "is not the texture that the index has", file=file, remedy=BUILD
            )
        levels = [in_colors(samples) for samples in ptm.levels()]
        alpha = ptm.header.components in (2, 4)
    if (count := len(sizes_of(row))) > len(ends):
        levels += read_preview(served, texture, -1, alpha=alpha)[len(ends) : count]
    return levels


def read_preview(served: Served, texture: int, number: int, *, alpha: bool = False) -> list[Texels]:
    """The levels of a preview, the coarsest first, as (h, w, 3) RGB, or with ``alpha`` (h, w, 4),
    without offsets.

    Raises DatabaseError: PTM-D005, D006 it is missing, damaged or does not match the index.
    """
    row = served.index["textures"][texture]
    preview = row["previews"][number]
    file = served.file(preview["file"])
    sizes = sizes_of(row)[: preview["level"] + 1]
    levels = build_pyramid(_decode(file, served.read(preview["file"]), 3 + alpha))[-len(sizes) :]
    if [level.shape[1::-1] for level in levels] != sizes:
        raise _damage_error(file, "does not match the index")
    return [np.ascontiguousarray(level) for level in levels]


def _decode(file: Path, data: bytes, components: int) -> Texels:
    """(h, w, components) the texels of an image."""
    try:
        return decode_preview(data, components)
    except (OSError, ValueError, SyntaxError) as fault:
        raise _damage_error(file, f"cannot be decoded ({fault})") from None


def _damage_error(file: Path, problem: str) -> DatabaseError:
    return DatabaseError("PTM-D006", problem, file=file, remedy=BUILD)


def alpha_of(levels: Sequence[Texels]) -> Pyramids:
    """The alpha of the (h, w, 4) levels of a texture, as the colours of another."""
    return pack_pyramids([[np.repeat(level[..., 3:], 3, axis=2) for level in levels]])


def pack_pyramids(chains: list[list[NDArray[np.uint8]]]) -> Pyramids:
    """Packs textures of (h, w, 3) levels, the coarsest first, without means and differences.

    Empties each list after copying it, to limit peak memory.
    """
    levels = np.array([len(chain) for chain in chains], dtype=np.int64)
    start = np.zeros((len(chains), int(levels.max(initial=1))), np.int64)
    size = np.zeros((*start.shape, 2), np.int64)
    texel = np.empty(sum(level.size for chain in chains for level in chain), np.uint8)
    at = 0
    for t, chain in enumerate(chains):
        for n, level in enumerate(chain):
            start[t, n], size[t, n] = at, level.shape[1::-1]
            texel[at : at + level.size] = level.ravel()
            at += level.size
        chain.clear()
    return Pyramids(texel, start, size, levels, np.zeros((len(chains), 3)), np.zeros(start.shape))


def full_colors(sight: Sight, triangles: Triangles, pyramids: Pyramids) -> Floats:
    """(n, 3) colours of pixels with all levels and all geometry, 0 to 255."""
    from ptmtools.rendering.kernels import shade

    shows, result = own_levels(pyramids), np.empty((len(sight.ray), 3))
    loaded = np.ones(int(triangles.cell.max(initial=-1)) + 1, dtype=np.bool_)
    shade(sight, triangles, shows, loaded, shows.last, result)
    return result


def in_colors(samples: NDArray[Any]) -> Texels:
    """Converts (h, w, c) samples of any type to (h, w, 3) RGB, or (h, w, 4) with alpha."""
    shown, components = in_eight_bits(samples), samples.shape[2]
    if components < 3:
        return shown[..., [0, 0, 0, 1][: components + 2]]
    return shown[..., : 3 + (components == 4)]
