"""How a walk was walked in a browser, so that a simulated client can walk it in the same way: when
each frame was and for how long it kept the page busy, how old the item buffer was in it, how fine
the screen, how large the files, and what the page had asked for before its first frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError

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

    Raises InputError PTM-I807 for what no browser says.
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
            raise InputError("PTM-I807", f"the recording of a browser has {wrong}")


def browser_of(told: Mapping[str, Any], time: Floats) -> Browser:
    """What a document of a walk with samples at (n,) seconds says, as its schema has it; raises
    InputError PTM-I807."""
    samples = len(time)
    if len(told["frames"]) != samples:
        raise InputError(
            "PTM-I807", f"the recording of a browser has {len(told['frames'])} frames, "
            f"and {samples} samples",
        )  # fmt: skip
    frames = np.array(told["frames"], dtype=np.float64).reshape(-1, 3)
    sent, taken = (np.array(told[k], dtype=np.float64).reshape(-1, 2) for k in ("sent", "taken"))
    time = told["begun"] + time
    # It was busy since it last gave a sign, and before there was a client at all.
    signs = np.sort(np.concatenate([[0.0], time, taken[:, 1], sent[:, 0]]))
    since = signs[np.maximum(np.searchsorted(signs, taken[:, 0], "right") - 1, 0)]
    taken = np.column_stack([np.minimum(since, taken[:, 0]), taken[:, 1]])
    busy = np.column_stack([time - frames[:, 2], time])
    return Browser(
        begun=float(told["begun"]),
        lines=told["lines"],
        budget=told["budget"],
        policy=told["policy"],
        record_bytes=np.array(told["recordBytes"], dtype=np.int64),
        geometry_bytes=np.array(told["geometryBytes"], dtype=np.int64),
        files=tuple(sorted(Given(*row) for row in told["files"])),
        cell=frames[:, 0].astype(np.int64),
        age=frames[:, 1],
        sent=Waits(sent),
        taken=Waits(taken, np.concatenate([[[0.0, time[0]]], busy]) if samples else busy),
    )


def _apart(spans: Floats) -> Floats:
    """(m, 2) spans of time, those that meet joined into one."""
    found: list[list[float]] = []
    for begin, end in sorted(spans.tolist()):
        if found and begin <= found[-1][1]:
            found[-1][1] = max(found[-1][1], end)
        elif begin < end:
            found.append([begin, end])
    return np.array(found).reshape(-1, 2)
