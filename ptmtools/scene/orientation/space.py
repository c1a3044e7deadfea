"""Determines the unit and the up axis of a model, and maps it to world metres, Y up.

Values that neither the user nor the format defines are guessed (`up_axis`) and noted. Values of the
format are trusted: a glTF file is in metres with Y up by its specification, and one that seems to
violate it is noted, not rotated. Other programs read the same wrong declaration, and only the user
knows which of them the model was viewed in.

The user is asked for the unit (PTM-I236) if no guess is possible: where no visitor can stand in the
rooms in any unit, as in a model of extent 1. A unit that the file records is not questioned, only
doubted, and that of an IFC file is judged by its spaces. A unit that the format prescribes is
questioned: many exporters write the units of their program instead. Where no visitor can stand in
the rooms of a glTF file, or most rooms are higher than any and another unit explains them, the one
unit with a name in which the rooms have a usual height is taken, with a warning; if there are
several or none, the user is asked. Models without floors between walls, such as statues, terrains
and caves, have no rooms to judge by; they are never refused.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import InputError, LimitError
from ptmtools.scene.model import Space
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.orientation.room_sizes import HEIGHT, RoomSizes
from ptmtools.scene.orientation.up_axis import (
    CLOSE_AXIS,
    CLOSE_UNIT,
    CONVENTION,
    DOUBT_AXIS,
    LEAD,
    STOREY,
    TRUST,
    UNITS,
    Candidate,
    Evidence,
    NamedFaces,
    Up,
    candidates,
    evidence,
)

#: Largest number of reasons in a note.
_REASONS = 3
_OVERRIDE = "use --unit to override"
#: Number of units from which the user may choose.
_CHOICE = 3
#: Extent of a scene in metres, from a micrometre to a million kilometres: beyond it the unit is
#: wrong; within it products of coordinates stay in the range of float64 and float32.
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
            "PTM-I111",
            f"unknown unit {unit!r}",
            remedy=f"use {', '.join(UNITS)} or the metres in one unit",
        )
    return metres


@dataclass(frozen=True)
class DeclaredSpace:
    """A declaration of a model's space by the user or the format.

    Attributes
    ----------
    metres, up: the length of one unit and the up axis, if they are declared.
    prescribed: the format prescribes the unit for all files instead of recording it in this one.
    usual_up: the up axis by convention, which counts only where none is declared.
    rooms: the clear heights of the rooms that the model has by name, in its units.
    """

    metres: float | None = None
    up: Up | None = None
    prescribed: bool = False
    usual_up: Up | None = None
    rooms: tuple[float, ...] = ()


def settle(
    points: Floats,
    triangles: NDArray[np.integer],
    named: NamedFaces,
    by_user: DeclaredSpace,
    by_format: DeclaredSpace,
    notes: IngestNotes,
    *,
    ask: bool = True,
) -> Space:
    """The space of a model of (T, 3) triangles over (V, 3) finite points: as declared by the user,
    else as declared by the format, else as guessed.

    Raises InputError PTM-I236 if the unit can neither be guessed nor be that of the format, which
    is a note without ``ask``, and LimitError PTM-L204 if the extent of the model is impossible.
    """
    low = points.min(axis=0)
    with np.errstate(over="ignore"):
        side = points.max(axis=0) - low
    if not np.isfinite(side).all():
        raise LimitError("PTM-L204", "coordinates are too large for float64", file=notes.model)
    if by_user.metres is None or by_user.up is None:
        measured = evidence(points, triangles, named)
        if by_format.up and (heights := tuple(sorted(by_format.rooms))):
            rooms = RoomSizes(heights, heights, roofed=True)
            measured[by_format.up] = replace(measured[by_format.up], rooms=rooms)
        metres, up = _judge(measured, by_user, by_format, notes, ask=ask)
    else:
        metres, up = by_user.metres, by_user.up
    extent = float(side.max()) * metres
    if not SMALLEST_EXTENT <= extent <= LARGEST_EXTENT:
        raise LimitError(
            "PTM-L204",
            f"the extent of the scene would be {extent:.3g} m",
            file=notes.model,
            remedy=f"use a --unit that makes it {SMALLEST_EXTENT:g} to {LARGEST_EXTENT:g} m",
        )
    origin = low + side / 2
    floor = 1 if up == "y" else 2
    origin[floor] = low[floor]
    x, y, z = origin.tolist()
    return Space(
        (x, y, z),
        metres,
        up,
        unit_guessed=metres not in (by_user.metres, by_format.metres),
        up_guessed=not (by_user.up or by_format.up),
    )


def _judge(
    measured: Mapping[Up, Evidence],
    by_user: DeclaredSpace,
    by_format: DeclaredSpace,
    notes: IngestNotes,
    *,
    ask: bool,
) -> tuple[float, Up]:
    """Unit and up axis of a model of which the user has declared one at the most; notes guesses
    and doubts. Raises InputError PTM-I236."""
    metres = by_user.metres or by_format.metres
    usual = None if by_format.up else by_format.usual_up
    # With numbers, so that a model in none of the units does not seem to lie on its side.
    numbers = metres is None and all(side.rooms.heights for side in measured.values())
    ranked = candidates(measured, metres, usual, numbers=numbers)
    judged = by_user.up or _judge_axis(ranked, by_format.up, notes)
    up = by_user.up or by_format.up or judged
    if by_user.metres is not None:
        return by_user.metres, up
    every = candidates(measured, usual=usual, numbers=True, stated=by_format.metres)
    ranked = [candidate for candidate in every if candidate.up == up]
    if by_format.metres is None:
        return _guess_unit(ranked, notes, ask), up
    # Units without a name follow from the rooms alone, unless doors confirm them.
    likely = next(
        c for c in every if c.up == judged and (c.unit in UNITS or c.stated or c.evidence.door)
    )
    return _judge_unit(likely, ranked, by_format.prescribed, notes, ask), up


def _judge_axis(ranked: list[Candidate], by_format: Up | None, notes: IngestNotes) -> Up:
    """The most likely up axis, or that of the format, with a note on it."""
    best = ranked[0]
    rival = next(candidate for candidate in ranked if candidate.up != best.up)
    # The convention decides, but does not make the guess more certain.
    lead = rival.cost - best.cost - rival.costs[CONVENTION]
    for_best, for_rival = _reasons(best, rival), _reasons(rival, best)
    if by_format:
        # A plan has no rooms that could lie on their side.
        low, high = (height / rival.metres for height in STOREY)
        one_storey = low <= rival.evidence.height <= high
        if best.up == by_format or lead < DOUBT_AXIS or best.flat or one_storey:
            return by_format
        if lead < CLOSE_AXIS:
            notes.note(
                "PTM-N232",
                f"the up axis is uncertain: the format prescribes {by_format.upper()}, "
                f"{rival.size}{for_rival}, but {best.up.upper()} is more likely, "
                f"{best.size}{for_best}; use --up {by_format} or --up {best.up}",
            )
        else:
            notes.note(
                "PTM-N234",
                f"the format prescribes {by_format.upper()} as the up axis, but the model seems "
                f"to lie on its side: with {by_format.upper()} up it is {rival.size}, with "
                f"{best.up.upper()} up {best.size}{for_best}; use --up {best.up} to rotate it",
            )
    elif lead < CLOSE_AXIS:
        notes.note(
            "PTM-N232",
            f"the up axis is uncertain: assuming {best.up.upper()}, {best.size}{for_best}, but "
            f"{rival.up.upper()} is nearly as likely, {rival.size}{for_rival}; use --up {best.up} "
            f"or --up {rival.up}",
        )
    else:
        notes.note(
            "PTM-N202",
            f"up axis guessed: {best.up.upper()}, {best.size}{for_best}; use --up to override",
        )
        # In the unit that will be guessed.
        rival = next((c for c in ranked if c.up == rival.up and c.unit in UNITS), rival)
        if rival.rivals(best):
            unit = f", unit {rival.unit}" if rival.unit != best.unit else ""
            notes.note(
                "PTM-N238",
                f"second-best guess: {rival.up.upper()} as the up axis{unit}, "
                f"{rival.size}{_reasons(rival, best)}; use --up {rival.up} to select it",
            )
    return best.up


def _reasons(candidate: Candidate, rival: Candidate) -> str:
    reasons = candidate.reasons(rival)[:_REASONS]
    return f" (reasons: {', '.join(reasons)})" if reasons else ""


def _guess_unit(ranked: list[Candidate], notes: IngestNotes, ask: bool) -> float:
    """Metres in the most likely unit with a name, with a note on it; the user is asked if it is
    impossible."""
    best, rival = [candidate for candidate in ranked if candidate.unit in UNITS][:2]
    if best.too_low:
        _ask("the unit cannot be guessed", best, ranked, notes, ask)
    elif best.small:
        notes.note(
            "PTM-N233",
            f"the unit is uncertain: assuming {best.unit}, the model is lower than a visitor "
            f"{HEIGHT:g} m tall ({best.size}); use --unit to override",
        )
    elif rival.cost - best.cost < CLOSE_UNIT:
        notes.note(
            "PTM-N233",
            f"the unit is uncertain: assuming {best.unit} ({best.size}), but {rival.unit} is "
            f"nearly as likely ({rival.size}); use --unit {best.unit} or --unit {rival.unit}",
        )
    else:
        notes.note("PTM-N201", f"unit guessed: {best.unit} ({best.size}); use --unit to override")
    return best.metres


def _judge_unit(
    likely: Candidate, ranked: list[Candidate], prescribed: bool, notes: IngestNotes, ask: bool
) -> float:
    """Metres in the unit that the format states, with a note if it is doubtful. If the format
    prescribes it and it is impossible, the one possible unit with a name, with a note; without one
    the user is asked."""
    given = next(candidate for candidate in ranked if candidate.stated)
    unit = "metres" if given.metres == 1 else f"units of {given.metres:g} m"
    hardly = given.cost - ranked[0].cost > TRUST[not prescribed]
    if prescribed and (given.too_low or (given.too_high and hardly)):
        usual = [c for c in ranked if c.unit in UNITS and c.usual]
        if len(usual) != 1 or usual[0].cost > given.cost:
            _ask(f"the format is in {unit}, but the model can hardly be", given, ranked, notes, ask)
            return given.metres
        text = f"can hardly be ({given.size}): assuming {usual[0].unit} ({usual[0].size})"
        notes.note("PTM-N227", f"the format is in {unit}, but the model {text}; {_OVERRIDE}")
        return usual[0].metres
    close = LEAD if prescribed and given.evidence.rooms.roofed else CLOSE_UNIT
    if given.too_low and hardly:
        text = f"its rooms are too small for a visitor {HEIGHT:g} m tall"
        notes.note("PTM-N227", f"the file is in {unit} ({given.size}), but {text}; {_OVERRIDE}")
    elif given.small and not given.evidence.rooms.heights:
        text = f"the model is lower than a visitor {HEIGHT:g} m tall ({given.size}); {_OVERRIDE}"
        notes.note("PTM-N233", f"the unit is uncertain: in {unit}, {text}")
    elif likely.metres != given.metres and given.cost - likely.cost > close:
        text = f"{likely.unit} is more likely ({likely.size}); use --unit {likely.unit} to override"
        notes.note("PTM-N227", f"the format is in {unit}, but {text}")
    return given.metres


def _ask(
    message: str, doubted: Candidate, ranked: list[Candidate], notes: IngestNotes, ask: bool
) -> None:
    """Raises an error with the likeliest units, among them the doubted one; without ``ask`` only
    notes it."""
    choice = ranked[:_CHOICE]
    if all(candidate.metres != doubted.metres for candidate in choice):
        choice[-1] = doubted
    if doubted.too_low:
        reason = f"its rooms would be too small for a visitor {HEIGHT:g} m tall"
    else:
        reason = "its rooms would be too high"
    message = f"{message}: with --unit {doubted.unit}, {reason}"
    *others, last = (f"--unit {candidate.unit} ({candidate.size})" for candidate in choice)
    remedy = f"use {', '.join(others)} or {last}, or the metres in one unit"
    if ask:
        raise InputError("PTM-I236", message, file=notes.model, remedy=remedy)
    notes.note("PTM-N236", f"{message}; {remedy}")


def to_world(points: Floats, space: Space) -> Floats:
    """(n, 3) points of the model in world metres, Y up."""
    return rotate((points - np.array(space.origin)) * space.metres, space.up)


def rotate(vectors: Floats, up: Up) -> Floats:
    """(n, 3) vectors of the model in world axes: Z up maps (x, y, z) to (x, z, -y)."""
    if up == "y":
        return vectors
    # 0.0 - y, because -y gives negative zeros.
    return np.stack([vectors[:, 0], vectors[:, 2], 0.0 - vectors[:, 1]], axis=1)
