"""Writes ``docs/formats/ptm-vectors.md``: small groups in hex with what a decoder meets on its way.

    PYTHONPATH=. python tests/texture/vectors/page.py

All numbers come from the decoders in plain Python, written line by line from the specification.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture import EncodeOptions, encode, read_header
from ptmtools.texture.coders import haar, repeats, texel
from ptmtools.texture.coders.group import plane_order
from ptmtools.texture.pyramid import mean_below
from tests.texture.oracles import (
    haar as haar_reference,
    repeats as repeats_reference,
    texel as texel_reference,
)
from tests.texture.oracles.rans import Symbols, built_in

PAGE = Path(__file__).resolve().parents[3] / "docs/formats/ptm-vectors.md"
Texels = NDArray[np.uint8]

#: Sorts of symbols of the coder repeats, by their first table.
SORTS = {
    0: "is it the first guess",
    12: "which guess",
    24: "p: which texel",
    36: "q: which texel",
    48: "r: which texel",
    60: "s: which texel",
    72: "edge: which texel",
    84: "edge: a residual",
    85: "a Haar difference",
    145: "p, q, r: a residual",
    185: "s: a remainder",
    188: "a run",
}
COEFFICIENTS = "Vhg"
NAMES = ("red", "green", "blue")


class Traced(Symbols):
    """Symbols that are remembered: table, state before, symbol."""

    #: Of the group decoded last.
    steps: list[tuple[int, int, int]]
    begin: tuple[list[list[int]], list[int]]

    def __init__(self, reader: Any, tables: list[list[int]], *more: Any) -> None:
        super().__init__(reader, tables, *more)
        Traced.steps = []
        Traced.begin = tables, list(self._states)

    def next(self, table: int) -> int:
        state = self._states[self._i & 3]
        symbol = super().next(table)
        Traced.steps.append((table, state, symbol))
        return symbol


def photo() -> Texels:
    """6 × 4 texels, RGB: a ramp and an edge."""
    y, x = np.mgrid[:4, :6]
    ramp = 20 + 3 * x + 5 * y + np.where(x + y > 5, 60, 0) + x * y % 3
    return np.stack([ramp, ramp + 9 * (x & 1), 2 * ramp - y], axis=2).astype(np.uint8)


def pattern() -> Texels:
    """10 × 7 texels, grey: what is flat, what repeats, and an odd last row."""
    image = np.full((7, 10, 1), 40)
    image[:4, 6:8] = np.array([[9, 90], [90, 9], [9, 90], [90, 9]])[:, :, None]
    image[5, 1] = image[6, ::3] = 200
    return image.astype(np.uint8)


def hexadecimal(data: bytes) -> str:
    """Bytes in lines of 24."""
    lines = (data[at : at + 24].hex(" ") for at in range(0, len(data), 24))
    return "\n".join(lines)


def rows_of(texels: Texels) -> str:
    """A row of texels to a line, components together."""
    return "\n".join(" ".join(bytes(texel).hex() for texel in row) for row in texels)


def block(title: str, text: str) -> str:
    return f"{title}:\n\n```\n{text}\n```\n"


def stream_parts(below: Texels, texels: Texels, group: bytes) -> str:
    tables, states = Traced.begin
    used = dict.fromkeys(table for table, _, _ in Traced.steps)
    table = next(iter(used))
    return "\n".join(
        [
            block("Texels of the level below", rows_of(below)),
            block("The group, from the byte that names its coder or form on", hexadecimal(group)),
            block("Texels that it decodes to", rows_of(texels)),
            f"States at the start: {' '.join(map(hex, states))}. Frequencies of table {table}, by "
            f"which the first symbol is coded: {told(tables[table])}.",
            "",
        ]
    )


def tables_of(group: bytes, at: int) -> str:
    """The numbers that tell the tables, whose length is at that place."""
    numbers: list[int] = []
    n = shift = 0
    for byte in group[at + 2 : at + 2 + int.from_bytes(group[at : at + 2], "little")]:
        for nibble in (byte & 15, byte >> 4):
            n |= (nibble & 7) << shift
            shift += 3
            if nibble < 8:
                numbers.append(n)
                n = shift = 0
    return f"\nThe numbers that tell the tables: {' '.join(map(str, numbers))}.\n"


def symbols_table(meanings: Iterator[str], count: int) -> str:
    lines = ["| symbol | table | state before | is | |", "|---|---|---|---|---|"]
    for i, ((table, state, symbol), meaning) in enumerate(
        zip(Traced.steps, meanings, strict=False)
    ):
        if i < count:
            lines.append(f"| {i} | {table} | {state:#x} | {symbol} | {meaning} |")
    lines.append(f"| … | | | | {len(Traced.steps)} symbols in all |")
    return "\n".join(lines) + "\n"


def told(frequencies: list[int]) -> str:
    used = max(z for z in range(255) if frequencies[z]) + 1
    return f"{' '.join(map(str, frequencies[:used]))}; of the escape {frequencies[255]}"


def signed(z: int) -> int:
    return -((z + 1) >> 1) if z & 1 else z >> 1


def haar_meanings(texels: Texels) -> Iterator[str]:
    """Difference, plane and block of each symbol, with what was predicted."""
    wide = texels.astype(int)
    p, q, r, s = (wide[j::2, i::2] for j in range(2) for i in range(2))
    values = {"V": p + q - r - s, "h": p - q, "g": (r - s) >> 1}
    bh, bw = p.shape[:2]
    steps = iter(Traced.steps)
    for y in range(bh + 1):
        for plane in plane_order(texels.shape[2]):
            for kind in COEFFICIENTS:
                row = y - (kind == "g")
                for x in range(bw if 0 <= row < bh else 0):
                    value, e = int(values[kind][row, x, plane]), signed(next(steps)[2])
                    yield (
                        f"{kind} of {NAMES[plane]}, block ({x}, {row}): residual {e}, "
                        f"prediction {value - e}, {kind} = {value}"
                    )


def repeats_meanings() -> Iterator[str]:
    for table, _, _ in Traced.steps:
        yield SORTS[max(first for first in SORTS if first <= table)]


def texel_meanings(texels: Texels) -> Iterator[str]:
    for y in range(0, texels.shape[0], 2):
        for x in range(0, texels.shape[1], 2):
            for plane in plane_order(texels.shape[2]):
                for k in range(4):
                    value = texels[y + k // 2, x + k % 2, plane]
                    yield f"{'pqrs'[k]} of {NAMES[plane]}, block ({x // 2}, {y // 2}): {value}"


def head_section() -> str:
    image = photo()[:3, :5, :1]
    file = encode(image, EncodeOptions("raw"))
    header = read_header(file)
    level = header.levels[-1]
    group = file[level.offset : level.end]
    head = header.description[0]
    (crc,) = struct.unpack_from("<I", file, head - 4)
    blocks = (level.width // 2) * (level.height // 2)
    remainders = ", ".join(str(group[0] >> 2 * i & 3) for i in range(blocks))
    return "\n".join(
        [
            "## A file of profile `raw`\n",
            f"{header.width} × {header.height} texels, grey, {len(header.levels)} levels, "
            f"{len(file)} bytes.\n",
            block("The file", hexadecimal(file)),
            block("Its finest level", rows_of(image)),
            block("The level below", rows_of(mean_below(image))),
            f"The head has {head} bytes; its CRC-32, the last four of them, is {crc:08x}. The "
            f"description has {header.description[1]}. The group of level 1 is `{group.hex(' ')}`: "
            f"a byte of residual array (ε = {remainders}), then the partial level.\n",
        ]
    )


def haar_section() -> str:
    image = photo()
    below = mean_below(image)
    group = haar.encode(image, below)
    with patch.object(haar_reference, "Symbols", Traced):
        texels = haar_reference.decode_haar(group, below, image.shape)
    assert np.array_equal(texels, image)
    parts = stream_parts(below, texels, bytes([4]) + group) + tables_of(group, 1)
    return f"## Haar\n\n{parts}\n{symbols_table(haar_meanings(texels), 24)}"


def repeats_section() -> str:
    image = pattern()
    below = mean_below(image)
    group = repeats.write(repeats.find(image, below))
    with patch.object(repeats_reference, "Symbols", Traced):
        texels = repeats_reference.decode_repeats(group, below, image.shape)
    assert np.array_equal(texels, image)
    parts = stream_parts(below, texels, bytes([5]) + group) + tables_of(group, 0)
    return f"## Repeats\n\n{parts}\n{symbols_table(repeats_meanings(), 40)}\n{slots()}"


def slots() -> str:
    """Slots of some keys, which a port gets wrong first."""
    level = object.__new__(repeats_reference._Level)
    lines = ["| key | slot, b = 6 | slot, b = 13 |", "|---|---|---|"]
    for key in (0, 1, 0x9E3779B1, 0x80000000, 0xFFFFFFFF):
        actual = []
        for level.bits in (6, 13):
            actual.append(level.hashed(key))
        lines.append(f"| {key:08X} | {actual[0]} | {actual[1]} |")
    minus = repeats_reference._minus((1, 200, 0, 255), (2, 100, 255, 255))
    return (
        "\n".join(lines)
        + "\n\nThe difference of the texels (1, 200, 0, 255) and (2, 100, 255, 255), byte by byte "
        f"modulo 256, is ({', '.join(map(str, minus))}).\n"
    )


def texel_section() -> str:
    image = np.tile(photo(), (2, 2, 1))
    below = mean_below(image)
    group, _ = texel.encode(image, below, 9)
    with patch.object(texel_reference, "Symbols", Traced):
        texels = texel_reference.decode_texels(group, below, image.shape, 9)
    parts = stream_parts(below, texels, group)
    return (
        "## Texels within an error of 9\n\nThe file would have a byte 1 before the group.\n\n"
        f"{parts}\n{symbols_table(texel_meanings(texels), 16)}"
    )


def table_section() -> str:
    return (
        "## Built-in tables\n\nFrequencies from symbol 0 on. Haar and repeats:\n\n"
        + "".join(f"- table {k}: {told(built_in(k))}\n" for k in (1, 4, 13))
        + "\nThe texel coder:\n\n"
        + "".join(f"- table {k}: {told(texel_reference.built_in(k))}\n" for k in (5, 14))
    )


def page() -> str:
    """All of it."""
    return "\n".join(
        [
            "# The `.ptm` format: test vectors\n",
            "Small files and groups with the intermediate values of their decoding, to debug an "
            "implementation of\n[ptm.md](ptm.md). Bytes and "
            "texels are in hexadecimal,\nother numbers in decimal unless they begin with 0x. "
            "`tests/texture/vectors/page.py` writes this page,\nfrom decoders that were written "
            "line by line from the specification.\n",
            head_section(),
            table_section(),
            haar_section(),
            repeats_section(),
            texel_section(),
        ]
    )


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
