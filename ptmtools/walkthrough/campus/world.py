"""All that the runs of a walk through a campus share."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.campus.model import SIZES
from ptmtools.errors import InputError, LimitError
from ptmtools.progress import Progress, silent
from ptmtools.walkthrough.campus.stock import Stock, read_stock
from ptmtools.walkthrough.campus.surfaces import read_surfaces, read_textures
from ptmtools.walkthrough.campus.tables import Full, Tables, look
from ptmtools.walkthrough.served import Served
from ptmtools.walkthrough.view.pyramids import read_pyramids
from ptmtools.walkthrough.view.rays import Camera
from ptmtools.walkthrough.view.records import Pyramids
from ptmtools.walkthrough.walk import Walk
from ptmtools.walkthrough.world import MOST_FRAMES, PIXELS, RATE


@dataclass(frozen=True)
class CampusWorld:
    """A walk through a campus.

    Attributes
    ----------
    stock: what can be fetched.
    tables: of the errors, None if nobody asks for them. view: (F,) which of them each frame has, -1
        for none.
    time: (F,) s. eye: (F, 3) metres.
    rate: frames a second.
    """

    stock: Stock
    tables: Tables | None
    view: Ints
    time: Floats
    eye: Floats
    rate: float

    @property
    def frames(self) -> int:
        """How many there are."""
        return len(self.time)

    @property
    def lacking(self) -> float:
        """e of what its meshes never show, on average over the frames that have tables; 0 without
        any."""
        some = self.view[self.view >= 0]
        return 0.0 if self.tables is None else float(self.tables.least[some].mean())

    def standing(self, seconds: float, frame: int = 0) -> CampusWorld:
        """Who stays at a frame of this, so long."""
        count = int(np.ceil(seconds * self.rate)) + 1
        held = np.full(count, frame)
        time = np.arange(count) / self.rate
        return replace(self, view=self.view[held], time=time, eye=self.eye[held])


def prepare_campus(
    folder: str | os.PathLike[str],
    walk: Walk,
    served: Served | None = None,
    pyramids: Pyramids | None = None,
    *,
    rate: float = RATE,
    pixels: tuple[int, int] = PIXELS,
    every: int = 1,
    only: str = "*",
    progress: Progress = silent,
) -> CampusWorld:
    """The world of a walk through a campus.

    Parameters
    ----------
    served: a database of the same model; its full picture is what pictures are compared with. If
        it is None, that is the campus with all finest meshes and largest textures: what
        compression and a lesser size did to the images is then no error.
    pyramids: its textures, if they have been read already.
    rate: frames a second. pixels: of the pictures, across and down.
    every: errors are tabulated of each frame whose number it divides, which takes most of the time;
        0: of none.
    only: names of the objects that there are, with * and ?.

    Raises
    ------
    InputError: PTM-I701 the walk was recorded in a browser; PTM-I714, I832, I833 the campus is
        incomplete or damaged, or has no such object.
    LimitError: PTM-L700 the walk is too long; PTM-L831 the index is.
    DatabaseError, LimitError: those of `read_pyramids`.
    """
    if walk.duration * rate > MOST_FRAMES:
        raise LimitError(
            "PTM-L700",
            f"a walk of {walk.duration:g} s has more than {MOST_FRAMES:,} frames",
            remedy="give a shorter one",
        )
    if walk.browser:
        raise InputError(
            "PTM-I701",
            "a walk that was recorded in a browser is of its client, not of one of a campus",
            remedy="give a walk of `ptm path`",
        )
    folder = Path(folder)
    stock = read_stock(folder, only)
    time = np.arange(int(np.floor(walk.duration * rate + 1e-9)) + 1) / rate
    eye, direction = walk.at(time)
    view, tables = np.full(len(time), -1, np.int64), None
    if every:
        pose = np.concatenate([eye, direction], axis=1)[::every]
        seen, found = np.unique(pose, axis=0, return_inverse=True)
        view[::every] = found.reshape(-1)
        finest, coarsest = (read_surfaces(folder, stock, level) for level in (-1, 0))
        small, middle, large = (read_textures(folder, stock, size) for size in SIZES)
        full = Full(finest, large)
        if served is not None:
            textures = read_pyramids(served, progress) if pyramids is None else pyramids
            full = Full(served.surfaces, textures)
        camera = Camera(*pixels, walk.field_of_view, walk.aspect)
        sizes = small, middle, large
        tables = look(full, finest, coarsest, sizes, camera, seen[:, :3], seen[:, 3:], progress)
    return CampusWorld(stock, tables, view, time, eye, rate)
