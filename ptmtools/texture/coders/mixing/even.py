"""Compiled loop for noise: all blocks that have the parent as their mean are equally likely.

A model that adapts pays for what it tries to learn; where there is nothing to learn, counting is
shorter. The number of ways to complete a block gives the exact probability of each bit of its
texels, in integers.
"""

from __future__ import annotations

from typing import Any

from ptmtools.compiled import plain_kernel
from ptmtools.texture.coders.mixing.decisions import code_bit


@plain_kernel
def code_even(
    encoding: bool, height: int, width: int, place: Any, cells: Any, parents: Any, goal: Any,
    ways: Any, coder: Any, buffer: Any,
) -> None:  # fmt: skip
    """One plane: its blocks row by row, then the edge texels.

    ways: (4, 772) int64. ways[r, u + 4]: how many choices of r texels sum to v … v + 3, for all
    v <= u together.
    """
    for by in range(height >> 1):
        for bx in range(width >> 1):
            rest = 4 * parents[place.parents + by * place.across + bx]
            for k in range(4):
                t = place.texels + (2 * by + (k >> 1)) * place.stride + 2 * bx + (k & 1)
                left = 3 - k
                low, high = max(rest - 255 * left, 0), min(rest + 3, 255)
                while low < high:
                    d = (low + high + 1) >> 1
                    nothing = ways[left, max(rest - high, -3) + 3]
                    upper = ways[left, rest - d + 4] - nothing
                    total = ways[left, rest - low + 4] - nothing
                    p = min(max(upper * 65536 // max(total, 1), 1), 65535)
                    bit = 1 if goal[t] >= d else 0
                    if code_bit(encoding, bit, p, coder, buffer):
                        low = d
                    else:
                        high = d - 1
                cells[t] = low
                rest -= low
    column = height & ~1 if width & 1 else 0
    for i in range(column + (width if height & 1 else 0)):
        y, x = (i, width - 1) if i < column else (height - 1, i - column)
        t = place.texels + y * place.stride + x
        value = 0
        for shift in range(7, -1, -1):
            bit = code_bit(encoding, (goal[t] >> shift) & 1, 32768, coder, buffer)
            value = 2 * value + bit
        cells[t] = value
