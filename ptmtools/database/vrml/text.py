"""Fields of VRML97 as text: strings, and lists of strings, points and indices.

The rows of a list are parted by a comma, or by a line's end after so many of them: one character,
which VRML97 reads as white space.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.floats import row_texts


def field(items: Sequence[str], per_line: int = 8, between: str = ",") -> str:
    """A multiple-valued field of these items, with a line's end after every ``per_line``."""
    if not items:
        return "[ ]"
    rows = [between.join(items[i : i + per_line]) for i in range(0, len(items), per_line)]
    return "[ " + "\n".join(rows) + " ]"


def listed(items: Sequence[str], per_line: int) -> str:
    """A field of strings or of single numbers."""
    return field(items, per_line, ", ")


def chosen(rows: Sequence[str], index: NDArray[np.integer], per_line: int = 8) -> str:
    """The field of some of the rows."""
    return field([rows[i] for i in index.tolist()], per_line)


def loops(polygons: NDArray[np.integer], per_line: int = 8) -> str:
    """The field of (m, k) indices, each row closed by -1."""
    return field([f"{row} -1" for row in row_texts(polygons)], per_line)


def quoted(text: str) -> str:
    """An SFString."""
    flat = " ".join(text.split())
    return '"' + flat.replace("\\", "\\\\").replace('"', '\\"') + '"'
