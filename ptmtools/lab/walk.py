"""A walk: where a visitor's eye was, and where it looked, over time.

Walks are made (`ptmtools.lab.path`) or recorded from visitors, at any rate and not always
evenly. Both are the same JSON document, whose schema is published (docs/design/walkthrough.md).

How a walk was walked in a browser, so that a simulated client can walk it in the same way: when
each frame was and for how long it kept the page busy, how old the item buffer was in it, how fine
the screen, how large the files, and what the page had asked for before its first frame.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ptmtools import schemas
from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError, LimitError, naming
from ptmtools.files import open_regular

#: What comes without a client's asking for it; ``page`` are the files of the page itself.
KINDS = ("page", "index", "record", "geometry")


class Given(NamedTuple):
    """A file that came without the client's asking for it: s since navigation, one of `KINDS`, the
    number of the cell, bytes on the link."""

    asked: float
    kind: str
    number: int
    size: int


class Waits:
    """For how long things had to wait, by when they began to.

    Parameters
    ----------
    waited: (m, 2) s, from when to when something did.
    busy: (k, 2) s, from when to when whatever was there would have had to.
    """

    def __init__(self, waited: Floats, busy: Floats | None = None) -> None:
        busy = np.zeros((0, 2)) if busy is None else busy
        self._spans = _apart(np.concatenate([waited, busy]))
        self._ends = np.sort(waited[:, 1])

    def until(self, moment: float) -> float:
        """When something that is there at a moment, s, has waited for long enough: at once, or,
        where something had to wait, as soon as anything had."""
        row = int(np.searchsorted(self._spans[:, 0], moment, "right")) - 1
        if row < 0 or moment >= self._spans[row, 1]:
            return moment
        following = self._ends[np.searchsorted(self._ends, moment) :][:1]
        return float(min([self._spans[row, 1], *following]))


@dataclass(frozen=True)
class Browser:
    """
    Attributes
    ----------
    begun: s since navigation of the first sample of the walk.
    lines: of the screen. budget: bytes of texture memory, what grows and is there twice included.
    policy: that the page went by.
    record_bytes, geometry_bytes: (C,) on the link.
    files: by time.
    cell: (n,) that the page took the eye to be in at each sample, -1 for none.
    age: (n,) s of the item buffer that was at hand, -1 for none.
    sent: when a request that is made goes out. taken: when what has come is taken.

    Raises InputError PTM-I801 for what no browser says.
    """

    begun: float
    lines: int
    budget: int
    policy: str
    record_bytes: Ints
    geometry_bytes: Ints
    files: tuple[Given, ...]
    cell: Ints
    age: Floats
    sent: Waits
    taken: Waits

    def __post_init__(self) -> None:
        cells, wrong = len(self.record_bytes), ""
        least, most = self.cell.min(initial=-1), self.cell.max(initial=-1)
        if any(f.kind not in KINDS or f.number >= cells for f in self.files):
            wrong = "a file that cannot be"
        elif len(self.geometry_bytes) != cells or not -1 <= least <= most < cells:
            wrong = f"a cell that is none of {cells}"
        if wrong:
            raise InputError("PTM-I801", f"the recording of a browser has {wrong}")


def browser_of(recorded: Mapping[str, Any], time: Floats) -> Browser:
    """What a document of a walk with samples at (n,) seconds says, as its schema has it; raises
    InputError PTM-I801."""
    samples = len(time)
    if len(recorded["frames"]) != samples:
        raise InputError(
            "PTM-I801", f"the recording of a browser has {len(recorded['frames'])} frames, "
            f"and {samples} samples",
        )  # fmt: skip
    frames = np.array(recorded["frames"], dtype=np.float64).reshape(-1, 3)
    sent, taken = (
        np.array(recorded[k], dtype=np.float64).reshape(-1, 2) for k in ("sent", "taken")
    )
    time = recorded["begun"] + time
    # It was busy since it last gave a sign, and before there was a client at all.
    signs = np.sort(np.concatenate([[0.0], time, taken[:, 1], sent[:, 0]]))
    since = signs[np.maximum(np.searchsorted(signs, taken[:, 0], "right") - 1, 0)]
    taken = np.column_stack([np.minimum(since, taken[:, 0]), taken[:, 1]])
    busy = np.column_stack([time - frames[:, 2], time])
    return Browser(
        begun=float(recorded["begun"]),
        lines=recorded["lines"],
        budget=recorded["budget"],
        policy=recorded["policy"],
        record_bytes=np.array(recorded["recordBytes"], dtype=np.int64),
        geometry_bytes=np.array(recorded["geometryBytes"], dtype=np.int64),
        files=tuple(sorted(Given(*row) for row in recorded["files"])),
        cell=frames[:, 0].astype(np.int64),
        age=frames[:, 1],
        sent=Waits(sent),
        taken=Waits(taken, np.concatenate([[[0.0, time[0]]], busy]) if samples else busy),
    )


def _apart(spans: Floats) -> Floats:
    """(m, 2) spans of time, those that meet joined into one."""
    intervals: list[list[float]] = []
    for begin, end in sorted(spans.tolist()):
        if intervals and begin <= intervals[-1][1]:
            intervals[-1][1] = max(intervals[-1][1], end)
        elif begin < end:
            intervals.append([begin, end])
    return np.array(intervals).reshape(-1, 2)


FORMAT, SCHEMA = "ptmtools walk", 1
#: A larger file is no walk, bytes: this is a day at 60 samples a second.
LARGEST = 1 << 30
#: Digits after the point in a file: 0.1 µm and 0.1 µs.
DIGITS = 7
#: How far the length of a direction may be from 1 to be kept as it is, and to be put right.
_UNIT, _NEARLY = 1e-6, 1e-3


@dataclass(frozen=True)
class Walk:
    """What a visitor's eye did.

    Attributes
    ----------
    time: (n,) seconds, from 0, strictly increasing; n >= 2.
    eye: (n, 3) world metres, Y up.
    direction: (n, 3) unit vectors, where the eye looks.
    field_of_view: vertical, radians.
    aspect: width of the picture by its height.
    browser: how it was walked, if it was recorded in one; else None.

    Raises
    ------
    InputError: PTM-I801 a number is not finite, the arrays do not fit together, there are fewer
        than two samples, times do not increase from 0, a direction is no unit vector (up to 1e-3 it
        is put right), or field of view or aspect are out of range.
    """

    time: Floats
    eye: Floats
    direction: Floats
    field_of_view: float
    aspect: float
    browser: Browser | None = None

    def __post_init__(self) -> None:
        count = len(self.time)
        if self.eye.shape != (count, 3) or self.direction.shape != (count, 3):
            raise InputError("PTM-I801", "times, eyes and directions do not fit together")
        rows = np.column_stack([self.time, self.eye, self.direction])
        _refuse(~np.isfinite(rows).all(axis=1), "PTM-I801", "a number is not finite")
        if count < 2:
            raise InputError("PTM-I801", f"a walk of {count} samples", remedy="record at least two")
        early = np.diff(self.time, prepend=-1.0) <= 0
        early[0] = self.time[0] != 0
        _refuse(early, "PTM-I801", "times do not increase from 0")
        length = np.linalg.norm(self.direction, axis=1)
        _refuse(abs(length - 1) > _NEARLY, "PTM-I801", "the direction is no unit vector")
        whole = np.where(abs(length - 1) > _UNIT, length, 1.0)
        object.__setattr__(self, "direction", self.direction / whole[:, None])
        if not 0 < self.field_of_view < math.pi:
            raise InputError(
                "PTM-I801",
                f"a field of view of {self.field_of_view:g} is not between 0 and pi radians",
            )
        if not 0 < self.aspect < math.inf:
            raise InputError("PTM-I801", f"an aspect of {self.aspect:g} is not above 0")

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.time[-1])

    @property
    def length(self) -> float:
        """Metres that the eye moved."""
        return float(np.linalg.norm(np.diff(self.eye, axis=0), axis=1).sum())

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """(m, 3) eyes and (m, 3) unit directions at (m,) times, seconds; beyond the ends as there.

        Half-way between opposite directions it still looks in the first.
        """
        times = np.clip(times, 0.0, self.duration)
        row = np.clip(np.searchsorted(self.time, times, "right") - 1, 0, len(self.time) - 2)
        share = ((times - self.time[row]) / (self.time[row + 1] - self.time[row]))[:, None]
        eye = (1 - share) * self.eye[row] + share * self.eye[row + 1]
        direction = (1 - share) * self.direction[row] + share * self.direction[row + 1]
        length = np.linalg.norm(direction, axis=1, keepdims=True)
        turned = np.divide(direction, length, out=self.direction[row], where=length > _UNIT)
        return eye, turned


def walk_text(walk: Walk) -> str:
    """The document of a walk, a line for each sample, with `DIGITS` digits after the point; of one
    that was recorded in a browser only where it led."""
    rows = np.column_stack([walk.time, walk.eye, walk.direction]).round(DIGITS) + 0.0  # no -0
    head = json.dumps(
        {
            "format": FORMAT,
            "schema": SCHEMA,
            "fieldOfView": walk.field_of_view,
            "aspect": walk.aspect,
        }
    )
    samples = ",\n".join(json.dumps(row) for row in rows.tolist())
    return f'{head[:-1]}, "samples": [\n{samples}\n]}}\n'


def read_walk(path: str | os.PathLike[str]) -> Walk:
    """The walk in a file.

    Raises InputError: PTM-I122 the file cannot be read; PTM-I801 it is no walk, does not match its
    schema, or as `Walk` and `Browser`. LimitError PTM-L204: it is larger than any walk.
    """
    try:
        with open_regular(Path(path)) as stream:
            data = stream.read(LARGEST + 1)
    except (OSError, ValueError) as fault:
        reason = getattr(fault, "strerror", None) or fault
        raise InputError("PTM-I122", f"cannot be read ({reason})", file=path) from fault
    with naming(path):
        if len(data) > LARGEST:
            raise LimitError("PTM-L204", f"more than {LARGEST >> 20} MiB, which is no walk")
        return parse_walk(data)


def parse_walk(data: bytes) -> Walk:
    """The walk in a document; raises as `read_walk`."""
    try:
        document = schemas.parse(data)
    except schemas.ShapeError as fault:
        raise _no_walk(str(fault)) from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise _no_walk(f'its format is not "{FORMAT}"')
    if document.get("schema") != SCHEMA:
        raise InputError(
            "PTM-I801",
            f"a walk of schema {json.dumps(document.get('schema'))[:40]}, not {SCHEMA}",
            remedy="record it anew, or update ptmtools",
        )
    try:
        schemas.check(document, schemas.WALK)
    except schemas.ShapeError as fault:
        raise InputError("PTM-I801", fault.message, place=fault.place) from None
    rows = np.array(document["samples"], dtype=np.float64).reshape(-1, 7)
    view = float(document["fieldOfView"]), float(document["aspect"])
    told = document.get("browser")
    browser = browser_of(told, rows[:, 0]) if told is not None else None
    return Walk(rows[:, 0], rows[:, 1:4], rows[:, 4:], *view, browser)


def _no_walk(what: str) -> InputError:
    return InputError(
        "PTM-I801", f"is no walk: {what}", remedy="make one with `ptm path DB -o walk.json`"
    )


def _refuse(wrong: Any, code: str, message: str) -> None:
    """Raises for the first sample that is wrong, if any is."""
    if wrong.any():
        place = f"samples[{int(wrong.argmax())}]"
        raise InputError(code, message, place=place)
