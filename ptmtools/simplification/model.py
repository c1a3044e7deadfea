"""Arrays of a mesh, the options of its simplification, and the result."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats

#: The edge collapses of this package, or pymeshlab (meshes without attributes only).
Method = Literal["quadric", "meshlab"]


@dataclass(frozen=True)
class Mesh:
    """Triangles with optional materials, texture coordinates and colours.

    Attributes
    ----------
    points: (V, 3) float64, in any unit. Equal points are one vertex, whatever their indices.
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
        """Whether the mesh has neither materials nor texture coordinates nor colours."""
        return self.material is None and self.uv is None and self.colors is None


@dataclass(frozen=True)
class SimplifyOptions:
    """Options of `simplify`.

    Attributes
    ----------
    faces: target face count, at least 1; seams and boundaries may leave more faces.
    error: maximum error of a collapse (`Simplified.error`), in the unit of the points; takes
        precedence over the target face count. Method ``quadric`` only.
    method: ``quadric`` (this package) or ``meshlab`` (pymeshlab).
    keep_parts: fill no hole and keep every connected part that has a boundary, such as the panes of
        a building. Method ``quadric`` only; pymeshlab may drop any part.

    Raises
    ------
    ValueError: `faces` is less than 1, or `error` is negative or NaN.
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
    """Result of a simplification.

    Attributes
    ----------
    mesh: the simplified mesh, without unused points.
    source: (T',) int32, the source face of each face.
    error: the largest error of a collapse, as a distance in the unit of the points: root mean
        square over the planes merged into the vertex, including the movement of the texture. NaN
        if the method does not report it.
    notes: messages for the user, such as a missed target face count.
    """

    mesh: Mesh
    source: NDArray[np.int32]
    error: float
    notes: tuple[str, ...] = ()


def missed_target_notes(count: int, faces: int, inconsistent: int = 0) -> tuple[str, ...]:
    """Returns the note for a mesh that misses its target face count, or no note.

    ``inconsistent`` is the number of edges between two faces of inconsistent orientation.
    """
    if count <= faces:
        return ()
    reason = "borders, seams, small parts or the greatest error do not allow it"
    if inconsistent:
        reason += f"; {inconsistent:,} edges join faces that do not look the same way"
    return (f"{count:,} faces are left, not {faces:,}: {reason}",)
