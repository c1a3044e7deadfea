"""The viewpoint along a walk, frame by frame: of a planned walk, or of a recording in a browser."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.errors import InputError, LimitError
from ptmtools.output.served import Served
from ptmtools.site.client import STILL_DEGREES, STILL_METRES, STILL_SECONDS
from ptmtools.walk import Browser

if TYPE_CHECKING:
    from ptmtools.walk import Walk

#: Evaluated frames per second.
RATE = 5.0
#: Frames of a walk at most: some five hours.
MOST_FRAMES = 100_000
#: Share of the walk that may lie in no cell.
_ASTRAY = 0.05
_STILL_COSINE = np.cos(np.radians(STILL_DEGREES))


@dataclass(frozen=True)
class Track:
    """The frames of a walk.

    Attributes
    ----------
    time: (F,) s. eye, direction: (F, 3).
    cell: (F,) cell of the eye; outside of cells the last one.
    still: (F,) whether the viewpoint has not moved for a second.
    view: (F,) the row of each frame in the tables of the screen.
    rate: frames a second.
    browser: conditions of a recording in a browser, or None. Times are then since navigation, and a
        frame has the view of the available item buffer.
    drawn: (F,) the frame in which that item buffer was drawn, -1 without one; None unless in a
        browser.
    """

    time: Floats
    eye: Floats
    direction: Floats
    cell: Ints
    still: Bools
    view: Ints
    rate: float = RATE
    browser: Browser | None = None
    drawn: Ints | None = None

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.time)

    def still_after(self, seconds: float) -> Bools:
        """(F,) the frames in which the viewpoint has not moved for ``seconds``."""
        if seconds == STILL_SECONDS:
            return self.still
        return _still(self.time, self.eye, self.direction, seconds)

    def looking(self, frames: Ints | slice) -> Track:
        """The same times, with eye, direction, cell and view of other frames."""
        return replace(
            self,
            eye=self.eye[frames],
            direction=self.direction[frames],
            cell=self.cell[frames],
            view=self.view[frames],
        )

    def standing(self, seconds: float) -> Track:
        """A visitor who stays at the first frame for this time."""
        rate = RATE if self.browser else self.rate
        first = np.zeros(int(np.ceil(seconds * rate)) + 1, np.int64)
        time = np.arange(len(first)) / rate
        track = replace(self, time=time, still=time >= STILL_SECONDS, rate=rate)
        return replace(track.looking(first), browser=None, drawn=None)


def track_of(served: Served, walk: Walk, rate: float = RATE) -> tuple[Track, Floats]:
    """The track of a walk, and (V, 6) eye and direction of its different views.

    Raises
    ------
    InputError: PTM-I700 the walk does not lead through this database.
    LimitError: PTM-L400 it is too long.
    """
    time, browser = frame_times(walk, rate), walk.browser
    drawn = None
    if browser:
        _require_fitting(browser, served)
        rate, time = (len(walk.time) - 1) / walk.duration, walk.time
        eye, direction, cell = walk.eye, walk.direction, browser.cell
        if (cell < 0).any():
            cell = np.where(cell < 0, served.locator.cells_along(eye), cell)
        drawn = _drawn_frames(time, browser.age)
    else:
        eye, direction = walk.at(time)
        cell = served.locator.cells_along(eye)
    pose = np.concatenate([eye, direction], axis=1)
    if drawn is not None:
        pose = pose[np.where(drawn < 0, np.arange(len(time)), drawn)]
    poses, view = np.unique(pose, axis=0, return_inverse=True)
    track = Track(
        time=time + browser.begun if browser else time,
        eye=eye,
        direction=direction,
        cell=_last_cells(cell),
        still=_still(time, eye, direction),
        view=view.reshape(-1).astype(np.int64),
        rate=rate,
        browser=browser,
        drawn=drawn,
    )
    return track, poses


def _last_cells(cell: Ints) -> Ints:
    """(F,) cells, with the last one before, or else the first one, in place of -1."""
    astray = cell < 0
    if astray.mean() > _ASTRAY:
        raise InputError(
            "PTM-I700",
            f"{astray.mean():.0%} of the walk lies in none of the cells",
            remedy="use a walk through this very database, such as `ptm path DB` makes",
        )
    known = np.maximum.accumulate(np.where(astray, -1, np.arange(len(cell))))
    return cell[np.where(known < 0, int(np.argmax(~astray)), known)]


def frame_times(walk: Walk, rate: float) -> Floats:
    """(F,) s, the times of the frames of a walk at a rate. Raises LimitError PTM-L400 if they are
    too many."""
    if walk.duration * rate > MOST_FRAMES:
        raise LimitError(
            "PTM-L400",
            f"a walk of {walk.duration:g} s has more than {MOST_FRAMES:,} frames",
            remedy="use a shorter one",
        )
    return np.asarray(np.arange(int(np.floor(walk.duration * rate + 1e-9)) + 1) / rate)


def _require_fitting(browser: Browser, served: Served) -> None:
    previews = sum(len(row.get("previews", ())) for row in served.index["textures"])
    for kind, present in (("preview", previews), ("mesh", sum(map(len, served.mesh_bytes)))):
        numbers = [file.number for file in browser.files if file.kind == kind]
        if max(numbers, default=-1) >= present:
            raise InputError(
                "PTM-I700",
                f"was recorded with {kind} {max(numbers)}, and there are {present}",
                remedy="use the database whose site it was recorded on",
            )
    if len(browser.record_bytes) != served.cell_count:
        raise InputError(
            "PTM-I700",
            f"was recorded among {len(browser.record_bytes)} cells, not {served.cell_count}",
            remedy="use the database whose site it was recorded on",
        )


def _drawn_frames(time: Floats, age: Floats) -> Ints:
    """(F,) the frame in which the available item buffer of each frame was drawn, -1 without one."""
    # The time of an item buffer is the beginning of its frame, that of a frame its end.
    frames: Ints = np.where(age < 0, -1, np.searchsorted(time, time - age, "right"))
    return frames


def _still(time: Floats, eye: Floats, direction: Floats, seconds: float = STILL_SECONDS) -> Bools:
    still = np.zeros(len(time), dtype=bool)
    begin = np.searchsorted(time, time - seconds - 1e-9)
    for f in np.flatnonzero(time >= seconds).tolist():
        last = slice(int(begin[f]), f + 1)
        moved = np.abs(eye[last] - eye[f]).max()
        still[f] = moved < STILL_METRES and (direction[last] @ direction[f]).min() > _STILL_COSINE
    return still
