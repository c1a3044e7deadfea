"""Numbers as text: the shortest decimals that read back to the same float32.

VRML97 readers hold single precision, so nothing beyond it is written. NumPy's own conversion of
float32 to text (Dragon4) is shortest; it writes "1.0" and "1e-05", which this trims to "1" and
"1e-5". Every distinct value is converted once: a room's coordinates repeat. (Tried: "%.9g", 1.6
times the bytes.)
"""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ptmtools.errors import DatabaseError

_EXPONENT = re.compile(r"e([+-]?)0*(\d)")


def single(values: ArrayLike, what: str) -> NDArray[np.float32]:
    """``values`` rounded to float32, without negative zeros.

    Raises
    ------
    DatabaseError: PTM-D601 if one of them is not finite there; ``what`` says whose they are.
    """
    with np.errstate(over="ignore"):
        rounded = np.asarray(values, dtype=np.float64).astype(np.float32)
    if not np.isfinite(rounded).all():
        raise DatabaseError(
            "PTM-D601",
            f"{what}: a number is not finite in single precision",
            remedy="check the model for NaN, infinite or huge values",
        )
    return rounded + np.float32(0)


def numeral(value: float | np.float32) -> str:
    """One finite number as text."""
    text = str(np.float32(value) + np.float32(0))
    if text.endswith(".0"):
        return text[:-2]
    return _EXPONENT.sub(lambda m: f"e{m[1].strip('+')}{m[2]}", text)


def numerals(values: NDArray[np.float32]) -> list[str]:
    """Every number of a (n,) array as text."""
    distinct, place = np.unique(values, return_inverse=True)
    text = [numeral(v) for v in distinct]
    return [text[i] for i in place.ravel().tolist()]


def tuples(values: NDArray[np.float32]) -> list[str]:
    """The rows of a (n, k) array as text, "x y z"."""
    text = numerals(values.ravel())
    k = values.shape[1]
    return [" ".join(text[i : i + k]) for i in range(0, len(text), k)]


def listed(items: Iterable[str], per_line: int, indent: str) -> str:
    """A multiple-valued field's content, broken into lines of ``per_line`` items."""
    text = list(items)
    if len(text) <= per_line:
        return f"[ {', '.join(text)} ]" if text else "[ ]"
    lines = (", ".join(text[i : i + per_line]) for i in range(0, len(text), per_line))
    body = f",\n{indent}  ".join(lines)
    return f"[\n{indent}  {body}\n{indent}]"


def quoted(text: str) -> str:
    """An SFString."""
    flat = " ".join(text.split())
    return '"' + flat.replace("\\", "\\\\").replace('"', '\\"') + '"'
