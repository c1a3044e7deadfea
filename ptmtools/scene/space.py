"""Settles the unit and the up axis of a model, and brings it to world metres, Y up.

What neither the user nor the format says is guessed (`readings`), and noted. A format that says it
is believed: a glTF file is in metres and has Y up by its specification, and one that seems to lie
about that is noted, not turned. Whoever wrote it wrote the same lie for every other program, and
which of them the model was looked at in is known to its user alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import InputError, LimitError
from ptmtools.scene.model import Space
from ptmtools.scene.source import Findings
from ptmtools.scene.up_axis import (
    CLOSE_AXIS,
    CLOSE_UNIT,
    CONVENTION,
    DOUBT_AXIS,
    UNITS,
    USUAL_UP,
    Named,
    Reading,
    Up,
    looks,
    readings,
)

#: So many signs are named for a reading.
_REASONS = 3
#: A scene of less than a micrometre or more than a million kilometres is a mistake in the unit;
#: in between, products of coordinates stay far from the ends of float64 and float32.
SMALLEST_EXTENT, LARGEST_EXTENT = 1e-6, 1e9


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


@dataclass(frozen=True)
class Said:
    """What somebody says of a model's space: metres in one unit, and the up axis."""

    metres: float | None = None
    up: Up | None = None


def settle(
    model: Path,
    points: Floats,
    triangles: NDArray[np.integer],
    named: Named,
    said: Said,
    by_format: Said,
    findings: Findings,
) -> Space:
    """The space of a model of (T, 3) triangles over (V, 3) finite points: as the user has ``said``,
    else as its format says, else as guessed.

    Raises LimitError PTM-L201 if the model has no possible size.
    """
    low = points.min(axis=0)
    with np.errstate(over="ignore"):
        side = points.max(axis=0) - low
    if not np.isfinite(side).all():
        raise LimitError("PTM-L201", "coordinates are too large for float64", file=model)
    metres, up = said.metres or by_format.metres, said.up or by_format.up
    if said.metres is None or said.up is None:
        seen = looks(points, triangles, named)
        usual = None if by_format.up else USUAL_UP.get(model.suffix.lower())
        ranked = readings(seen, metres, usual)
        judged = said.up or _judge_axis(ranked, by_format.up, findings)
        up = up or judged
        if said.metres is None:
            ranked = readings(seen, usual=usual)
            upright = [reading for reading in ranked if reading.up == judged]
            metres = _judge_unit(upright, by_format.metres, findings)
    assert metres
    assert up
    extent = float(side.max()) * metres
    if not SMALLEST_EXTENT <= extent <= LARGEST_EXTENT:
        raise LimitError(
            "PTM-L201",
            f"the scene would be {extent:.3g} m large",
            file=model,
            remedy=f"give a --unit that makes it {SMALLEST_EXTENT:g} to {LARGEST_EXTENT:g} m",
        )
    origin = low + side / 2
    floor = 1 if up == "y" else 2
    origin[floor] = low[floor]
    x, y, z = origin.tolist()
    return Space(
        (x, y, z),
        metres,
        up,
        unit_guessed=not (said.metres or by_format.metres),
        up_guessed=not (said.up or by_format.up),
    )


def _judge_axis(ranked: list[Reading], by_format: Up | None, findings: Findings) -> Up:
    """The axis that is up by the looks of the model, and a note on it."""
    best = ranked[0]
    rival = next(reading for reading in ranked if reading.up != best.up)
    # A convention decides, but leaves the model as uncertain as it looks.
    ahead = rival.cost - best.cost - rival.costs[CONVENTION]
    for_best, for_rival = _because(best, rival), _because(rival, best)
    if by_format:
        # What is flat has no rooms that could lie on their side.
        if best.up == by_format or ahead < DOUBT_AXIS or best.flat:
            return by_format
        if ahead < CLOSE_AXIS:
            findings.say(
                "PTM-N232",
                f"the up axis is uncertain: the format has {by_format} up, {rival.size}"
                f"{for_rival}, but {best.up} is rather more likely, {best.size}{for_best}; give "
                f"--up {by_format} or --up {best.up}",
            )
        else:
            findings.say(
                "PTM-N234",
                f"the format has {by_format} up, but the model seems to lie on its side: with "
                f"{by_format} up it is {rival.size}, with {best.up} up {best.size}{for_best}; give "
                f"--up {best.up} to turn it",
            )
    elif ahead < CLOSE_AXIS:
        findings.say(
            "PTM-N232",
            f"the up axis is uncertain: {best.up} is taken, {best.size}{for_best}, but "
            f"{rival.up} is nearly as likely, {rival.size}{for_rival}; give --up {best.up} or "
            f"--up {rival.up}",
        )
    else:
        findings.say(
            "PTM-N202", f"up axis guessed: {best.up}, {best.size}{for_best}; give --up to override"
        )
        if rival.rivals(best):
            unit = f" in {rival.unit}" if rival.unit != best.unit else ""
            findings.say(
                "PTM-N238",
                f"the runner-up is {rival.up} up{unit}: {rival.size}{for_rival}; give "
                f"--up {rival.up} to take it",
            )
    return best.up


def _because(reading: Reading, other: Reading) -> str:
    reasons = reading.reasons(other)[:_REASONS]
    return f" ({', '.join(reasons)})" if reasons else ""


def _judge_unit(ranked: list[Reading], by_format: float | None, findings: Findings) -> float:
    """Metres in one unit as the format says, else by the looks of the model, and a note on it."""
    best, rival = ranked[:2]
    if by_format is None:
        if rival.cost - best.cost < CLOSE_UNIT:
            findings.say(
                "PTM-N233",
                f"the unit is uncertain: {best.unit} is taken (it would be {best.size}), but "
                f"{rival.unit} is nearly as likely ({rival.size}); give --unit {best.unit} or "
                f"--unit {rival.unit}",
            )
        else:
            findings.say(
                "PTM-N201",
                f"unit guessed: {best.unit} (it would be {best.size}); give --unit to override",
            )
        return best.metres
    known = by_format in UNITS.values()  # others are not among the readings
    if known and best.metres != by_format:
        unit = "metres" if by_format == 1 else f"units of {by_format:g} m"
        findings.say(
            "PTM-N227",
            f"the format is in {unit}, but {best.unit} would be more likely (it would be "
            f"{best.size}); give --unit to override",
        )
    return by_format


def to_world(points: Floats, space: Space) -> Floats:
    """(n, 3) points of the model in world metres, Y up."""
    return turned((points - np.array(space.origin)) * space.metres, space.up)


def turned(vectors: Floats, up: Up) -> Floats:
    """(n, 3) model vectors in world axes: Z up maps (x, y, z) to (x, z, -y)."""
    if up == "y":
        return vectors
    # 0.0 - y rather than -y, which would make negative zeros.
    return np.stack([vectors[:, 0], vectors[:, 2], 0.0 - vectors[:, 1]], axis=1)
