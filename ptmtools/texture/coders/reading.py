"""What every decoder reads its bytes with, and the error for bytes that no encoder writes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError

if TYPE_CHECKING:
    from ptmtools.texture.profiles import Samples, Shape


def damaged(what: str) -> InputError:
    """The error for a group whose contents contradict each other."""
    return InputError(
        "PTM-I112",
        f"the group cannot be decoded: {what}",
        remedy="the file is damaged or was not written by a conforming encoder; encode it again",
    )


class Reader:
    """Bytes from the front; asking for more than there are raises InputError PTM-I112."""

    def __init__(self, data: bytes | memoryview) -> None:
        self._left = memoryview(data)

    def take(self, size: int) -> memoryview:
        """So many bytes; nothing is copied."""
        if size > len(self._left):
            raise damaged("it is cut short")
        taken, self._left = self._left[:size], self._left[size:]
        return taken

    def number(self, size: int) -> int:
        """Of so many bytes, little endian."""
        return int.from_bytes(self.take(size), "little")

    def varint(self) -> int:
        """A number below 2^35, as `pack_varints` writes it."""
        number = 0
        for shift in range(0, 35, 7):
            byte = self.take(1)[0]
            number |= (byte & 127) << shift
            if byte < 128:
                return number
        raise damaged("a number is too long")

    def numbers(self, dtype: str, count: int) -> NDArray[Any]:
        """So many numbers (count,) of a little-endian type, a copy."""
        return np.frombuffer(self.take(count * np.dtype(dtype).itemsize), dtype).copy()

    def texels(self, shape: Shape, dtype: np.dtype[Any]) -> Samples:
        """Samples one after another, little endian, as an array of that shape."""
        size = shape[0] * shape[1] * shape[2] * dtype.itemsize
        samples = np.frombuffer(self.take(size), dtype.newbyteorder("<"))
        return samples.astype(dtype).reshape(shape)

    def rest(self) -> memoryview:
        """All that is left."""
        return self.take(len(self._left))

    def end(self) -> None:
        """Raise InputError PTM-I112 if anything is left."""
        if self._left:
            raise damaged(f"{len(self._left)} bytes are left over")


def pack_varints(*numbers: int) -> bytes:
    """Numbers one after another, seven bits a byte, lowest first, 128 added where more follow."""
    out = bytearray()
    for number in numbers:
        while number > 127:
            out.append(128 | number & 127)
            number >>= 7
        out.append(number)
    return bytes(out)
