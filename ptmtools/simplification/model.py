"""A mesh as arrays, what may be asked of its simplification, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats

#: Our collapses, or those of pymeshlab, for plain meshes only.
Method = Literal["quadric", "meshlab"]


@dataclass(frozen=True)
class Mesh:
    """Triangles with what is painted on them.

    Attributes
    ----------
    points: (V, 3) float64, in any unit. Equal ones are one vertex, whatever their indices.
    triangles: (T, 3) int32 indices of points, counter-clockwise from the front.
    material: (T,) int32, or None.
    uv: (T, 3, 2) float64 texture coordinates of each corner, or None.
    colors: (T, 3, 3) uint8 of each corner, or None.
    """

    points: Floats
    triangles: NDArray[np.int32]
    material: NDArray[np.int32] | None = None
    uv: Floats | None = None
    colors: NDArray[np.uint8] | None = None

    @property
    def is_plain(self) -> bool:
        """Whether it has neither materials nor texture coordinates nor colours."""
        return self.material is None and self.uv is None and self.colors is None


@dataclass(frozen=True)
class SimplifyOptions:
    """What may be asked for.

    Attributes
    ----------
    faces: keep at most so many, where seams and borders allow it.
    error: make no collapse with a greater error (`Simplified.error`), in the unit of the points,
        even if more faces are left; for `quadric` alone.
    method: what makes them fewer.
    keep_parts: fill no hole, and let no part with a border vanish, however many there are: of a
        building, through whose windows one sees. For `quadric` alone; pymeshlab keeps nothing.
    """

    faces: int = 10_000
    error: float = inf
    method: Method = "quadric"
    keep_parts: bool = False

    def __post_init__(self) -> None:
        if self.faces < 1:
            raise ValueError(f"{self.faces} faces are too few")
        if not self.error >= 0:
            raise ValueError(f"{self.error} is no error")


@dataclass(frozen=True)
class Simplified:
    """A mesh of fewer faces.

    Attributes
    ----------
    mesh: what is left; points that no face uses are dropped.
    source: (T',) int32, the face of the given mesh that each face came from.
    error: the largest error of a collapse, as a distance in the unit of the points: the root of the
        mean square over the planes that met there, how far the texture moves counted in.
        NaN where the method does not say.
    notes: what the user should know, such as a number of faces that could not be reached.
    """

    mesh: Mesh
    source: NDArray[np.int32]
    error: float
    notes: tuple[str, ...] = ()


def too_many(left: int, faces: int, turned: int = 0) -> tuple[str, ...]:
    """The note for a mesh that has more faces than it should, of which so many edges join two faces
    that disagree on their front."""
    if left <= faces:
        return ()
    why = "borders, seams, small parts or the greatest error do not allow it"
    if turned:
        why += f"; {turned:,} edges join faces that do not look the same way"
    return (f"{left:,} faces are left, not {faces:,}: {why}",)
