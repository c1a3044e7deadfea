"""Numbers of seven bits a byte, lowest first, 128 added where more follow."""

from __future__ import annotations

from ptmtools.texture.coders.damage import damaged


def pack_varints(*numbers: int) -> bytes:
    """The numbers one after another."""
    out = bytearray()
    for number in numbers:
        while number > 127:
            out.append(128 | number & 127)
            number >>= 7
        out.append(number)
    return bytes(out)


def read_varints(data: bytes, at: int, n: int) -> tuple[list[int], int]:
    """n numbers below 2^35 from byte ``at`` on, and where they end. Raises InputError PTM-I112."""
    numbers: list[int] = []
    number = shift = 0
    while len(numbers) < n:
        if at >= len(data) or shift > 28:
            raise damaged("a number is cut short or too long")
        number |= (data[at] & 127) << shift
        shift += 7
        at += 1
        if data[at - 1] < 128:
            numbers.append(number)
            number = shift = 0
    return numbers, at
