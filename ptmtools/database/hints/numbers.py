"""Numbers in as few digits as they are good for, and the JSON of them.

Geometry has the float32 coordinates of the VRML files and the GLBs, in their shortest decimals: a
hundred times finer than the distance within which a point lies in a plane (`PLANE_SHARE`), and no
leaf is flat in them. Shares have `DIGITS` significant digits; sampling leaves two or three.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import orjson
from numpy.typing import ArrayLike, NDArray

from ptmtools.database.floats import single
from ptmtools.errors import DatabaseError

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
    """An object of JSON, a field a line; of its ``lists`` an entry a line, so that a difference
    between two databases can be read."""
    lines = [f"{json_text(name)}:{json_text(value)}" for name, value in head.items()]
    for name, rows in lists.items():
        text = ",\n".join(map(json_text, rows))
        lines.append(f"{json_text(name)}:[\n{text}\n]" if rows else f"{json_text(name)}:[]")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def coordinates(values: ArrayLike, what: str) -> Any:
    """Lists of numbers, nested as ``values`` are: the shortest that are the same in float32.

    Raises DatabaseError: PTM-D601 if one of them is not finite there; ``what`` says whose they are.
    """
    text = orjson.dumps(single(values, what), option=orjson.OPT_SERIALIZE_NUMPY).decode()
    return json.loads(text.replace(".0,", ",").replace(".0]", "]"))


def significant(values: NDArray[np.floating], digits: int = DIGITS) -> list[float | None]:
    """Numbers with so many significant digits; None for NaN."""
    return [None if v != v else _short(v, digits) for v in values.tolist()]


def shares_of(row: NDArray[np.float64]) -> list[float]:
    """The shares of a cell with `DIGITS` significant digits, but for the greatest, which has so
    many that they sum to 1 within 1e-9.

    From the least on, each takes over what the one before it was rounded by, so none is off by more
    than a unit of its last digit, and what is 0 stays 0.
    """
    order = np.argsort(row, kind="stable").tolist()
    values: list[float] = row.tolist()
    carried = 0.0
    for i in order[:-1]:
        wanted = values[i] + carried
        values[i] = _short(wanted)
        carried = wanted - values[i]
    if order:
        rest = float(np.sum([values[i] for i in order[:-1]]))
        values[order[-1]] = whole(round(1 - rest, _SUM_DECIMALS))
    return values


def _short(value: float, digits: int = DIGITS) -> float:
    return whole(float(f"{value:.{digits}g}"))


def whole(value: float) -> float:
    """An int where that is the same, which JSON writes shorter."""
    return int(value) if value.is_integer() else value
