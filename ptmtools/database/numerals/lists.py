"""The rows of arrays as the contents of multiple-valued fields, many lists at a time.

Rows are parted by a comma, or by a line's end after so many of them: one character, which VRML97
reads as white space. A scene of usual size takes less time than loading the compiled loops (0.5 s
with numba itself): there every distinct row becomes a string once, and lists are joined. The text
is the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.numerals.decimals import LONGEST, numerals

#: From this many numbers in the lists on the compiled loops are worth their loading.
WORTHWHILE = 1_500_000


class Rows:
    """The rows of an array, to be written over and over.

    Parameters
    ----------
    values: (n, k) float32, finite, without negative zeros.
    compiled: whether the compiled loops write.
    """

    def __init__(self, values: NDArray[np.float32], compiled: bool = False) -> None:
        self._values = np.ascontiguousarray(values)
        self._text: list[str] | None = None
        if not compiled:
            text = numerals(self._values.ravel())
            k = values.shape[1]
            self._text = [" ".join(text[i : i + k]) for i in range(0, len(text), k)]

    def lists(
        self, index: NDArray[np.integer], start: NDArray[np.integer], per_line: int = 8
    ) -> list[str]:
        """The rows ``index`` (m,) as lists of which list i is rows ``start[i]`` to
        ``start[i + 1]`` of ``index``."""
        if self._text is not None:
            row = self._text
            text = [row[i] for i in index.tolist()]
            bounds = start.tolist()
            return [lines(text[a:b], per_line, ",") for a, b in pairwise(bounds)]
        from ptmtools.database.numerals.kernels import put_rows

        room = len(index) * self._values.shape[1] * (LONGEST + 1)
        out, end = np.empty(room, np.uint8), np.empty(len(start) - 1, np.int64)
        put_rows(self._values.view(np.uint32), _wide(index), _wide(start), per_line, out, end)
        return _cut(out, end)

    def list(self, index: NDArray[np.integer], per_line: int = 8) -> str:
        """One list."""
        (text,) = self.lists(index, np.array([0, len(index)]), per_line)
        return text


def loops(
    loop: NDArray[np.integer],
    start: NDArray[np.integer],
    per_line: int = 8,
    compiled: bool = False,
) -> list[str]:
    """(m, k) indices as lists like those of `Rows.lists`, each row closed by -1."""
    most = int(loop.max(initial=0))
    if compiled:
        from ptmtools.database.numerals.kernels import put_loops

        room = len(loop) * (loop.shape[1] * (len(str(most)) + 1) + 3)
        out, end = np.empty(room, np.uint8), np.empty(len(start) - 1, np.int64)
        put_loops(_wide(loop), _wide(start), per_line, out, end)
        return _cut(out, end)
    word = [f"{i} " for i in range(most + 1)] + ["-1,", "-1\n"]
    place = np.arange(len(loop)) - np.repeat(start[:-1], np.diff(start))
    close = most + 1 + ((place + 1) % per_line == 0)
    code = np.column_stack([loop, close]).tolist()
    bounds = start.tolist()
    return ["".join([word[i] for row in code[a:b] for i in row])[:-1] for a, b in pairwise(bounds)]


def field(text: str) -> str:
    """A multiple-valued field of this content."""
    return f"[ {text} ]" if text else "[ ]"


def listed(items: Sequence[str], per_line: int) -> str:
    """A multiple-valued field of these items."""
    return field(lines(items, per_line, ", "))


def quoted(text: str) -> str:
    """An SFString."""
    flat = " ".join(text.split())
    return '"' + flat.replace("\\", "\\\\").replace('"', '\\"') + '"'


def lines(items: Sequence[str], per_line: int, between: str) -> str:
    """Items with ``between`` them, and a line's end instead after every ``per_line``."""
    if len(items) <= per_line:
        return between.join(items)
    return "\n".join(between.join(items[i : i + per_line]) for i in range(0, len(items), per_line))


def _wide(values: NDArray[np.integer]) -> NDArray[np.int64]:
    return values.astype(np.int64, copy=False)


def _cut(out: NDArray[np.uint8], end: NDArray[np.int64]) -> list[str]:
    """The lists in a buffer, without what parts each from the next."""
    whole = out[: int(end[-1]) if len(end) else 0].tobytes().decode("ascii")
    first = [0, *end[:-1].tolist()]
    return [whole[a : max(a, b - 1)] for a, b in zip(first, end.tolist(), strict=True)]
