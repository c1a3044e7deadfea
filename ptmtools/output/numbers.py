"""Numbers as text: float32 in the shortest decimals that read back to it, shares in few digits.

VRML97 readers use single precision, so geometry has no more: float32 coordinates in their shortest
decimals, the nearest of several equally short ones, in VRML files and hints alike. They are a
hundred times finer than the distance within which a point lies in a plane (`PLANE_SHARE`), and no
leaf is flat in them. (Tried: "%.9g", 1.6 times the bytes.) A number is written plainly ("0.5",
"120") or, where that is shorter, as a whole number with an exponent ("1e3", "12e-7"). (Rejected:
".5", which VRML97 allows but JSON does not, and which not every reader accepts; it would save 1 %
of a database.) Shares have `DIGITS` significant digits; sampling leaves two or three.

orjson computes the digits, the same as NumPy's Dragon4 does. It writes "1.0" for 1 and "1000.0" for
1e3, so the few numbers that it writes differently are taken out beforehand and put back into its
text (speeds and alternatives: docs/formats/database.md, "Measurements").
"""

from __future__ import annotations

import json
import re
from functools import lru_cache
from itertools import chain, zip_longest
from typing import Any

import numpy as np
import orjson
from numpy.typing import ArrayLike, NDArray

from ptmtools.arrays import Floats, Singles
from ptmtools.errors import DatabaseError

#: Whole numbers below this are exact; greater ones may end in zeros as decimals only.
_EXACT = 1 << 24
#: A whole number of thousands has a shorter form, and so has a number smaller than this.
_THOUSAND, _SMALL = 1000, np.float32(0.01)
_PARTS = re.compile(r"(-?)(\d+)(?:\.(\d+))?(?:e([-+]\d+))?")


def single(values: ArrayLike, name: str) -> Singles:
    """``values`` rounded to float32, without negative zeros.

    Raises DatabaseError: PTM-D601 if one is not finite there; ``name`` says which values.
    """
    with np.errstate(over="ignore"):
        rounded = np.asarray(values, dtype=np.float64).astype(np.float32)
    if not np.isfinite(rounded).all():
        raise DatabaseError(
            "PTM-D601",
            f"{name}: a number is not finite in single precision",
            remedy="check the model for NaN, infinite or huge values",
        )
    return rounded + np.float32(0)


@lru_cache(maxsize=4096)
def decimal(value: float) -> str:
    """One finite number as text."""
    return row_texts(single([[value]], "a number"))[0]


def row_texts(values: NDArray[np.floating] | NDArray[np.integer]) -> list[str]:
    """Each row of an (n, k) array of finite numbers as text, with spaces in between: the shortest
    decimals that read back to the same number of the array's type."""
    if not len(values):
        return []
    text = _json(values) if values.dtype.kind == "f" else _plain(values)
    return text[2:-2].replace("],[", ";").replace(",", " ").split(";")


def _json(values: NDArray[Any]) -> str:
    """The JSON of an array, each number in its shortest form."""
    size = abs(values)
    special = (size >= _EXACT) | ((size >= _THOUSAND) & (size % _THOUSAND == 0))
    special |= (size < _SMALL) & (size > 0)
    rare = values[special]
    text = _plain(np.where(special, np.float32(np.nan), values))
    text = text.replace(".0,", ",").replace(".0]", "]")
    if not len(rare):
        return text
    shortest = map(_shortest, _plain(rare)[1:-1].split(","))
    return "".join(chain(*zip_longest(text.split("null"), shortest, fillvalue="")))


def _plain(values: NDArray[np.generic]) -> str:
    """The JSON of an array; NaN is null."""
    return orjson.dumps(np.ascontiguousarray(values), option=orjson.OPT_SERIALIZE_NUMPY).decode()


def _shortest(number: str) -> str:
    """The shorter form of a number of JSON, the plain one where both are as long."""
    parts = _PARTS.fullmatch(number)
    assert parts is not None
    sign, whole, fraction, power = parts.groups(default="")
    every = (whole + fraction).rstrip("0")
    exponent = int(power or 0) + len(whole) - len(every)
    digits = every.lstrip("0")
    if exponent >= 0:
        plain = digits + "0" * exponent
    elif len(digits) > -exponent:
        plain = f"{digits[:exponent]}.{digits[exponent:]}"
    else:
        plain = f"0.{digits:0>{-exponent}}"
    return sign + min(plain, f"{digits}e{exponent}", key=len)


#: Significant digits of shares and statistics.
DIGITS = 5
#: Decimals of the one share of a row that makes its sum 1 within 1e-9.
_SUM_DECIMALS = 10


def json_text(value: object) -> str:
    """One line of JSON; raises DatabaseError PTM-D601 for a number that is not finite."""
    try:
        return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    except ValueError as fault:
        raise DatabaseError(
            "PTM-D601",
            "hints: a number is not finite",
            remedy="check the model for NaN, infinite or huge values",
        ) from fault


def document_text(head: dict[str, object], lists: dict[str, list[Any]]) -> str:
    """A JSON object with a field on each line and an entry of ``lists`` on each line, so that a
    difference between two databases can be read."""
    lines = [f"{json_text(name)}:{json_text(value)}" for name, value in head.items()]
    for name, rows in lists.items():
        text = ",\n".join(map(json_text, rows))
        lines.append(f"{json_text(name)}:[\n{text}\n]" if rows else f"{json_text(name)}:[]")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def coordinates(values: ArrayLike, name: str) -> Any:
    """Lists of numbers, nested as ``values`` are: the shortest that are the same in float32.

    Raises DatabaseError: PTM-D601 if one is not finite there; ``name`` says which values.
    """
    text = orjson.dumps(single(values, name), option=orjson.OPT_SERIALIZE_NUMPY).decode()
    return json.loads(text.replace(".0,", ",").replace(".0]", "]"))


def significant(values: NDArray[np.floating], digits: int = DIGITS) -> list[float | None]:
    """Numbers with ``digits`` significant digits; None for NaN."""
    return [None if v != v else _short(v, digits) for v in values.tolist()]


def shares_of(row: Floats) -> list[float]:
    """The shares of a cell with `DIGITS` significant digits; the greatest has as many as make
    the sum 1 within 1e-9.

    From the least on, each share takes over the rounding error of the one before, so none is off by
    more than a unit of its last digit, and 0 stays 0.
    """
    order = np.argsort(row, kind="stable").tolist()
    values: list[float] = row.tolist()
    carried = 0.0
    for i in order[:-1]:
        exact = values[i] + carried
        values[i] = _short(exact)
        carried = exact - values[i]
    if order:
        rest = float(np.sum([values[i] for i in order[:-1]]))
        values[order[-1]] = whole(round(1 - rest, _SUM_DECIMALS))
    return values


def _short(value: float, digits: int = DIGITS) -> float:
    return whole(float(f"{value:.{digits}g}"))


def whole(value: float) -> float:
    """An int if equal, which JSON writes shorter."""
    return int(value) if value.is_integer() else value
