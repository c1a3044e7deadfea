"""Sample statues: solids with fine relief, as triangle meshes, to try `ptm apo` on.

Metres, Y up, facing +Z: a bust, a relief, a dragon and the capital of a column. Each is one closed
surface of triangles of about equal size, 50,000 to 1,000,000 of them. The same seed gives the same
bytes on every machine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools_samples.files import File, Note, ignore
from ptmtools_samples.options import StatueOptions
from ptmtools_samples.statues import bust, column, dragon, relief
from ptmtools_samples.statues.fields import Points, Values
from ptmtools_samples.statues.files import FORMATS
from ptmtools_samples.statues.surface import evaluate, mesh

#: Name: class of the solid, and its bounding box.
STATUES: dict[str, tuple[Any, tuple[float, ...], tuple[float, ...]]] = {
    "bust": (bust.Bust, bust.LOW, bust.HIGH),
    "relief": (relief.ReliefSolid, relief.LOW, relief.HIGH),
    "dragon": (dragon.Dragon, dragon.LOW, dragon.HIGH),
    "column": (column.Column, column.LOW, column.HIGH),
}


@dataclass(frozen=True)
class Statue:
    """(P, 3) points, (T, 3) triangles, counterclockwise from outside, and (P, 3) colours."""

    points: NDArray[np.float32]
    triangles: NDArray[np.int64]
    colors: NDArray[np.uint8] | None


def make_statue(name: str, options: StatueOptions) -> Statue:
    """Generates the statue of a name in `STATUES`."""
    kind, low, high = STATUES[name]
    stream = list(STATUES).index(name)
    solid = kind(np.random.Generator(np.random.PCG64([options.seed, stream])))
    points, triangles = mesh(solid, low, high, options.triangles)
    colors = None
    if options.colors:
        channels = [partial(_channel, solid, k) for k in range(3)]
        share = np.stack([evaluate(channel, points.T) for channel in channels], 1)
        colors = np.rint(255 * np.clip(share, 0, 1)).astype(np.uint8)
    return Statue(points.astype(np.float32), triangles, colors)


def _channel(solid: Any, k: int, points: Points) -> Values:
    """Red, green or blue of the surface at (3, n) points."""
    return np.asarray(solid.colors(points)[k])


def make_statues(options: StatueOptions, note: Note = ignore) -> Iterator[File]:
    """Returns the files of the statues: name and a function that returns the bytes."""

    def loader(name: str) -> Callable[[], bytes]:
        def load() -> bytes:
            statue = make_statue(name, options)
            about = f"{name}, {len(statue.triangles)} triangles, seed {options.seed}"
            return FORMATS[options.format](statue.points, statue.triangles, statue.colors, about)

        return load

    for name in options.only or STATUES:
        yield f"{name}.{options.format}", loader(name)
