"""Profile `fast`: every group by the shortest of four coders, chosen group by group.

- *Haar* (photographs, most textures): the three Haar differences of every 2×2 block, from which the
  residuals ε of the paper have been removed exactly (their information is in the low bits of the
  differences), predicted from the level below and from the planes before, coded with rANS under
  tables chosen by the activity of the neighbourhood. Planes with few distinct values are coded by
  rank.
- *Deflated* in two arrangements (drawings, palettes, repeats): the `raw` group as it is, and the
  texels of each block less the texel below them.
- *Stored* (noise): the `raw` group. No group is longer than that plus one byte.

Whole pyramids over PNG of the finest level alone, 12 Kodak images and 7 other textures of 1024²:
0.732 and 0.871. With the built-in weights only: 0.743 and 0.964. Without ranks: 0.732 and 0.902.
Without the Haar coder: 1.225 and 1.295.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.haar import coder as haar
from ptmtools.texture.coders.haar.tables import damaged
from ptmtools.texture.profiles import Tile
from ptmtools.texture.profiles.raw import RawProfile, group_length

STORED, HAAR, DEFLATED, DEFLATED_DIFFERENCES = 0, 1, 2, 3
#: Deflate is tried on all of a group if a quick try of a piece from its middle, of about so many
#: bytes, comes within this factor of the Haar coder's share of the stored size. It costs more time
#: than everything else and won no group above 2,000 bytes of the 19 images named above.
PROBE_BYTES = 1 << 16
PROBE_FACTOR = 1.5
#: The Haar coder writes at least this many bytes and is not tried on smaller groups.
HAAR_OVERHEAD = 52

_RAW = RawProfile()


@dataclass(frozen=True)
class FastProfile:
    """The shortest of four coders for each group; see the module."""

    name: str = "fast"

    def encode_base(self, level: NDArray[np.uint8]) -> bytes:
        """Stored or deflated."""
        stored = level.tobytes()
        return _shortest([(STORED, stored), (DEFLATED, _deflate(stored))])

    def decode_base(
        self, data: bytes, shape: tuple[int, int, int], dtype: np.dtype[Any]
    ) -> NDArray[np.uint8]:
        """The inverse of `encode_base`. Raises InputError PTM-I112."""
        coder, body = _split(data)
        if coder == DEFLATED:
            body = _inflate(body, shape[0] * shape[1] * shape[2])
        elif coder != STORED:
            raise damaged(f"coder {coder} is unknown for the coarsest level")
        return _RAW.decode_base(body, shape, dtype)

    def encode_tile(
        self,
        level: NDArray[np.uint8],
        below: NDArray[np.uint8],
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """One byte that names the coder, then what it wrote."""
        return Tile(self.encode_group(level, below), level)

    def decode_tile(
        self,
        data: bytes,
        below: NDArray[np.uint8],
        shape: tuple[int, int, int],
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """The inverse of `encode_tile`. Raises InputError PTM-I112."""
        return Tile(b"", self.decode_group(data, below, shape))

    def encode_group(self, level: NDArray[np.uint8], below: NDArray[np.uint8]) -> bytes:
        """One byte that names the coder, then what it wrote."""
        length = group_length((level.shape[0], level.shape[1], level.shape[2]))
        candidates: list[tuple[int, bytes]] = []
        if length > HAAR_OVERHEAD:
            candidates = [(HAAR, haar.encode(level, below))]
        if not candidates or _repeats(level, below, len(candidates[0][1]) / length):
            stored = _RAW.encode_group(level, below)
            candidates.append((DEFLATED, _deflate(stored)))
            candidates.append((DEFLATED_DIFFERENCES, _deflate(_differences(level, below))))
        if all(len(body) > length for _, body in candidates):
            candidates.append((STORED, _RAW.encode_group(level, below)))
        return _shortest(candidates)

    def decode_group(
        self, data: bytes, below: NDArray[np.uint8], shape: tuple[int, int, int]
    ) -> NDArray[np.uint8]:
        """The inverse of `encode_group`. Raises InputError PTM-I112."""
        coder, body = _split(data)
        if coder == HAAR:
            return haar.decode(body, below, shape)
        if coder == STORED:
            return _RAW.decode_group(body, below, shape)
        if coder == DEFLATED:
            return _RAW.decode_group(_inflate(body, group_length(shape)), below, shape)
        if coder == DEFLATED_DIFFERENCES:
            edges = shape[0] * shape[1] * shape[2] - 4 * below.size
            return _from_differences(_inflate(body, 4 * below.size + edges), below, shape)
        raise damaged(f"coder {coder} is unknown")


def _repeats(level: NDArray[np.uint8], below: NDArray[np.uint8], share: float) -> bool:
    """Whether deflate may beat a coder that brings the group to ``share`` of its stored size."""
    bh = below.shape[0]
    rows = min(bh, 1 + PROBE_BYTES // group_length((2, level.shape[1], level.shape[2])))
    y = (bh - rows) // 2
    piece = _RAW.encode_group(level[2 * y : 2 * (y + rows)], below[y : y + rows])
    return len(_deflate(piece, 1)) < PROBE_FACTOR * share * len(piece)


def _differences(level: NDArray[np.uint8], below: NDArray[np.uint8]) -> bytes:
    """Per block p−I, q−I, r−I, ε, modulo 256, each with all components; then the edge texels."""
    bh, bw, _ = below.shape
    p, q, r, s = _corners(level, bh, bw)
    residual = (p + q + r + s) & 3
    blocks = np.stack([p - below, q - below, r - below, residual], axis=2)
    return blocks.tobytes() + level[_edges(level.shape)].tobytes()


def _from_differences(
    data: bytes, below: NDArray[np.uint8], shape: tuple[int, int, int]
) -> NDArray[np.uint8]:
    bh, bw, c = below.shape
    level = np.empty(shape, np.uint8)
    level[_edges(shape)] = np.frombuffer(data, np.uint8, offset=4 * below.size).reshape(-1, c)
    blocks = np.frombuffer(data, np.uint8, 4 * below.size).reshape(bh, bw, 4, c)
    p, q, r, s = _corners(level, bh, bw)
    p[:], q[:], r[:] = (blocks[:, :, i] + below for i in range(3))
    s[:] = 4 * below + blocks[:, :, 3] - p - q - r
    return level


def _corners(level: NDArray[np.uint8], bh: int, bw: int) -> list[NDArray[np.uint8]]:
    """Views of the upper left, upper right, lower left and lower right texels of all blocks."""
    blocks = level[: 2 * bh, : 2 * bw]
    return [blocks[j::2, i::2] for j in range(2) for i in range(2)]


def _edges(shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which texels (h, w) belong to no block."""
    mask = np.zeros(shape[:2], np.bool_)
    mask[shape[0] & ~1 :] = True
    mask[:, shape[1] & ~1 :] = True
    return mask


def _shortest(candidates: list[tuple[int, bytes]]) -> bytes:
    coder, body = min(candidates, key=lambda candidate: len(candidate[1]))
    return bytes([coder]) + body


def _split(data: bytes) -> tuple[int, bytes]:
    if not data:
        raise damaged("it is empty")
    return data[0], data[1:]


def _deflate(data: bytes, effort: int = 6) -> bytes:
    packer = zlib.compressobj(effort, zlib.DEFLATED, -15)
    return packer.compress(data) + packer.flush()


def _inflate(data: bytes, length: int) -> bytes:
    """Exactly ``length`` bytes; more are never unpacked."""
    unpacker = zlib.decompressobj(-15)
    try:
        out = unpacker.decompress(data, length + 1)
    except zlib.error as error:
        raise damaged(f"its deflated data is invalid ({error})") from None
    if len(out) != length or not unpacker.eof or unpacker.unused_data:
        raise damaged(f"its deflated data does not hold {length} bytes")
    return out
