"""Walk: position and view direction of a visitor's eye over time.

`ptm path` generates walks; the web page records those of visitors, at any rate, possibly unevenly.
Both use one JSON document with a published schema (docs/design/walkthrough.md).

A recording in a browser also holds its conditions, so that a simulated client can repeat it: frame
times and how long each frame kept the page busy, the age of the item buffer, the lines of the
screen, file sizes, and the requests of the page before its first frame.
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

#: Kinds of files that arrive without a request of the client; ``page``: files of the page itself.
KINDS = ("page", "index", "record", "geometry", "preview", "mesh")


class PushedFile(NamedTuple):
    """A file that arrived without a request of the client: seconds since navigation, one of
    `KINDS`, number of the cell, preview or mesh, bytes on the link."""

    asked: float
    kind: str
    number: int
    size: int


class Waits:
    """Waiting times by their start.

    Parameters
    ----------
    waited: (m, 2) s, intervals in which a request or response waited.
    busy: (k, 2) s, intervals in which any request or response would have waited.
    """

    def __init__(self, waited: Floats, busy: Floats | None = None) -> None:
        busy = np.zeros((0, 2)) if busy is None else busy
        self._spans = _merge_spans(np.concatenate([waited, busy]))
        self._ends = np.sort(waited[:, 1])

    def wait_end(self, moment: float) -> float:
        """Returns the end of a wait that starts at ``moment``, s: ``moment`` itself, or the next
        recorded end if it lies within a waiting interval."""
        row = int(np.searchsorted(self._spans[:, 0], moment, "right")) - 1
        if row < 0 or moment >= self._spans[row, 1]:
            return moment
        following = self._ends[np.searchsorted(self._ends, moment) :][:1]
        return float(min([self._spans[row, 1], *following]))


@dataclass(frozen=True)
class Browser:
    """Conditions of a recording in a browser.

    Attributes
    ----------
    begun: time of the first sample of the walk, s since navigation.
    lines: lines of the screen.
    budget: bytes of texture memory, including second copies of growing textures.
    policy: the page's policy.
    record_bytes, geometry_bytes: (C,) bytes on the link.
    files: pushed files, by time.
    cell: (n,) the page's cell at each sample, -1 for none.
    age: (n,) age of the available item buffer, s, -1 for none.
    sent: delays of requests until sent. taken: delays of responses until handled.

    Raises
    ------
    InputError: PTM-I801 the values are inconsistent.
    """

    begun: float
    lines: int
    budget: int
    policy: str
    record_bytes: Ints
    geometry_bytes: Ints
    files: tuple[PushedFile, ...]
    cell: Ints
    age: Floats
    sent: Waits
    taken: Waits

    def __post_init__(self) -> None:
        cells, problem = len(self.record_bytes), ""
        least, greatest = self.cell.min(initial=-1), self.cell.max(initial=-1)
        if any(
            f.kind not in KINDS or (f.number >= cells and f.kind not in ("preview", "mesh"))
            for f in self.files
        ):
            problem = "a file that cannot be"
        elif len(self.geometry_bytes) != cells or not -1 <= least <= greatest < cells:
            problem = f"a cell that is none of {cells}"
        if problem:
            raise InputError("PTM-I801", f"the recording of a browser has {problem}")


def browser_of(recorded: Mapping[str, Any], time: Floats) -> Browser:
    """Reads the conditions of a recording, valid by its schema, with samples at (n,) seconds.

    Raises InputError PTM-I801.
    """
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
    # The page was busy since its last recorded event, and before its client started.
    events = np.sort(np.concatenate([[0.0], time, taken[:, 1], sent[:, 0]]))
    since = events[np.maximum(np.searchsorted(events, taken[:, 0], "right") - 1, 0)]
    taken = np.column_stack([np.minimum(since, taken[:, 0]), taken[:, 1]])
    busy = np.column_stack([time - frames[:, 2], time])
    return Browser(
        begun=float(recorded["begun"]),
        lines=recorded["lines"],
        budget=recorded["budget"],
        policy=recorded["policy"],
        record_bytes=np.array(recorded["recordBytes"], dtype=np.int64),
        geometry_bytes=np.array(recorded["geometryBytes"], dtype=np.int64),
        files=tuple(sorted(PushedFile(*row) for row in recorded["files"])),
        cell=frames[:, 0].astype(np.int64),
        age=frames[:, 1],
        sent=Waits(sent),
        taken=Waits(taken, np.concatenate([[[0.0, time[0]]], busy]) if samples else busy),
    )


def _merge_spans(spans: Floats) -> Floats:
    """Merges overlapping (m, 2) intervals of time."""
    intervals: list[list[float]] = []
    for begin, end in sorted(spans.tolist()):
        if intervals and begin <= intervals[-1][1]:
            intervals[-1][1] = max(intervals[-1][1], end)
        elif begin < end:
            intervals.append([begin, end])
    return np.array(intervals).reshape(-1, 2)


FORMAT, SCHEMA = "ptmtools walk", 1
#: Maximum size of a walk file, bytes: a day at 60 samples a second.
MAX_BYTES = 1 << 30
#: Decimals in a file: 0.1 µm and 0.1 µs.
DIGITS = 7
#: Maximum deviation of a direction's length from 1 that is preserved, and that is corrected.
_EXACT_LENGTH, _NEAR_LENGTH = 1e-6, 1e-3


@dataclass(frozen=True)
class Walk:
    """The motion of a visitor's eye.

    Attributes
    ----------
    time: (n,) seconds, from 0, strictly increasing; n >= 2.
    eye: (n, 3) world metres, Y up.
    direction: (n, 3) unit view directions.
    field_of_view: vertical, radians.
    aspect: width of the picture over its height.
    browser: conditions of a recording in a browser, or None.

    Raises
    ------
    InputError: PTM-I801 a number is not finite, array shapes do not match, there are fewer than two
        samples, times do not increase from 0, a direction is no unit vector (deviations up to 1e-3
        are corrected), or field of view or aspect are out of range.
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
        unordered = np.diff(self.time, prepend=-1.0) <= 0
        unordered[0] = self.time[0] != 0
        _refuse(unordered, "PTM-I801", "times do not increase from 0")
        length = np.linalg.norm(self.direction, axis=1)
        _refuse(abs(length - 1) > _NEAR_LENGTH, "PTM-I801", "the direction is no unit vector")
        divisor = np.where(abs(length - 1) > _EXACT_LENGTH, length, 1.0)
        object.__setattr__(self, "direction", self.direction / divisor[:, None])
        if not 0 < self.field_of_view < math.pi:
            raise InputError(
                "PTM-I801",
                f"a field of view of {self.field_of_view:g} is not between 0 and pi radians",
            )
        if not 0 < self.aspect < math.inf:
            raise InputError("PTM-I801", f"an aspect of {self.aspect:g} is not above 0")

    @property
    def duration(self) -> float:
        """Duration, seconds."""
        return float(self.time[-1])

    @property
    def length(self) -> float:
        """Path length of the eye, metres."""
        return float(np.linalg.norm(np.diff(self.eye, axis=0), axis=1).sum())

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Interpolates (m, 3) eyes and (m, 3) unit directions at (m,) times, seconds, clamped to
        the walk.

        Half-way between opposite directions the first one holds.
        """
        times = np.clip(times, 0.0, self.duration)
        row = np.clip(np.searchsorted(self.time, times, "right") - 1, 0, len(self.time) - 2)
        share = ((times - self.time[row]) / (self.time[row + 1] - self.time[row]))[:, None]
        eye = (1 - share) * self.eye[row] + share * self.eye[row + 1]
        direction = (1 - share) * self.direction[row] + share * self.direction[row + 1]
        length = np.linalg.norm(direction, axis=1, keepdims=True)
        turned = np.divide(direction, length, out=self.direction[row], where=length > _EXACT_LENGTH)
        return eye, turned


def walk_text(walk: Walk) -> str:
    """Serialises a walk, one line per sample, with `DIGITS` decimals and without the conditions of
    a browser."""
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
    """Reads a walk from a file.

    Raises
    ------
    InputError: PTM-I122 the file cannot be read; PTM-I801 it is no walk, does not match its schema,
        or is rejected by `Walk` or `Browser`.
    LimitError: PTM-L204 it is larger than `MAX_BYTES`.
    """
    try:
        with open_regular(Path(path)) as stream:
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as fault:
        reason = getattr(fault, "strerror", None) or fault
        raise InputError("PTM-I122", f"cannot be read ({reason})", file=path) from fault
    with naming(path):
        if len(data) > MAX_BYTES:
            raise LimitError("PTM-L204", f"more than {MAX_BYTES >> 20} MiB, which is no walk")
        return parse_walk(data)


def parse_walk(data: bytes) -> Walk:
    """Parses the document of a walk; raises as `read_walk`."""
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
    recorded = document.get("browser")
    browser = browser_of(recorded, rows[:, 0]) if recorded is not None else None
    return Walk(rows[:, 0], rows[:, 1:4], rows[:, 4:], *view, browser)


def _no_walk(problem: str) -> InputError:
    return InputError(
        "PTM-I801", f"is no walk: {problem}", remedy="make one with `ptm path DB -o walk.json`"
    )


def _refuse(wrong: Any, code: str, message: str) -> None:
    """Raises InputError for the first invalid sample, if any."""
    if wrong.any():
        place = f"samples[{int(wrong.argmax())}]"
        raise InputError(code, message, place=place)
