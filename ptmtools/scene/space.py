"""Guesses the unit and the up axis of a model, and brings it to world metres, Y up.

Up: floors and ceilings are large and level, and buildings are wider than high. Both are measured
as shares and added. Unit: the one in which a building of this size is most plausible. Neither
can be certain (a house drawn in feet may pass for a hall in metres), so both are noted, and the
user can give them.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError

#: Metres in one unit, in the order of preference where two are equally plausible.
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
#: Heights of buildings in metres: below the first nobody can stand; above the second it has
#: several storeys, which is less usual and not impossible.
HEIGHTS = (2.0, 15.0)
#: Widths of buildings in metres.
WIDTHS = (5.0, 500.0)
#: What a unit costs beforehand, in the same measure as `_implausible`.
PRIOR = {"m": 0.0, "cm": 0.1, "mm": 0.1, "in": 0.5, "ft": 0.5}
#: Faces whose normal is within 8 degrees of an axis count as level or upright.
AXIS_COSINE = 0.99


def parse_unit(unit: str | float) -> float:
    """Metres in one unit, from a name of `UNITS` or a positive number; InputError otherwise."""
    if isinstance(unit, str) and unit.strip().lower() in UNITS:
        return UNITS[unit.strip().lower()]
    try:
        metres = float(unit)
    except ValueError:
        metres = math.nan
    if not (math.isfinite(metres) and metres > 0):
        raise InputError(
            "PTM-I250",
            f"unit {unit!r} is not known",
            remedy=f"give {', '.join(UNITS)} or the metres in one unit",
        )
    return metres


def guess_up(corners: NDArray[np.float64]) -> tuple[Literal["y", "z"], str]:
    """The up axis of (T, 3, 3) triangles in any unit, and the reason in a few words."""
    points = corners.reshape(-1, 3)
    side = np.ptp(points, axis=0)
    scale = float(side.max()) or 1.0
    local = (corners - points.min(axis=0)) / scale
    normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    area = np.linalg.norm(normal, axis=1)
    level = [float(area[np.abs(normal[:, k]) > AXIS_COSINE * area].sum()) for k in (1, 2)]
    floor = level[0] / sum(level) if sum(level) > 0 else 0.5
    flat = float(side[2] / (side[1] + side[2])) if side[1] + side[2] > 0 else 0.5
    up: Literal["y", "z"] = "y" if floor + flat >= 1 else "z"
    share = floor if up == "y" else 1 - floor
    other = "z" if up == "y" else "y"
    high, wide = (side[1], side[2]) if up == "y" else (side[2], side[1])
    return up, (
        f"with {up} up, {share:.0%} of the area square to y or z is level, "
        f"and the model is {high:.4g} high and {wide:.4g} along {other}"
    )


def guess_unit(width: float, height: float) -> tuple[str, str]:
    """The unit of a model of this horizontal and vertical size, and the reason in a few words."""
    unit = min(UNITS, key=lambda name: _implausible(width, height, name))
    metres = UNITS[unit]
    return unit, f"it would be {width * metres:.3g} m wide and {height * metres:.3g} m high"


def _implausible(width: float, height: float, unit: str) -> float:
    """How unusual a building of this size is: 0 and the unit's prior at the best."""
    w, h = width * UNITS[unit], height * UNITS[unit]
    cost = PRIOR[unit]
    if w > 0:
        cost += 2 * max(0.0, _orders(WIDTHS[0], w), _orders(w, WIDTHS[1]))
    if h > 0:
        cost += max(0.0, 4 * _orders(HEIGHTS[0], h), 0.25 * _orders(h, HEIGHTS[1]))
    return cost


def _orders(a: float, b: float) -> float:
    """The logarithm of a / b, which itself may be too small or too large for a number."""
    return math.log(a) - math.log(b)


def turned(vectors: NDArray[np.float64], up: Literal["y", "z"]) -> NDArray[np.float64]:
    """(n, 3) model vectors in world axes: Z up maps (x, y, z) to (x, z, -y)."""
    if up == "y":
        return vectors
    # 0.0 - y rather than -y, which would make negative zeros.
    return np.stack([vectors[:, 0], vectors[:, 2], 0.0 - vectors[:, 1]], axis=1)
