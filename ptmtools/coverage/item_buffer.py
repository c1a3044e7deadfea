"""The item buffer: which surface shows in each pixel of six square views around a point (§5).

Both backends answer the same question, *which triangle does pixel (view, row, column) show*, for
the same pixel centres; whose triangle that is is decided here, once, in float64. A triangle in a
boundary belongs to a cell on either side, and the pixel counts for the viewer's side (design,
"Ownership"), so of coincident faces it does not matter which one wins.

The paper draws each object in its cell's colour. The triangle's own number was preferred: with
colours, OpenGL picks the side from a triangle rounded to 1/256 pixel and Embree from one rounded
to float32, and slivers came out on different sides.

Transparent surfaces: a pixel shows the nearest opaque surface, and *also* the nearest transparent
one before it. Both count.

Numbers: positions are brought to a cube of about 1 around the middle of the geometry by a
subtraction in float64 and a power of two, so neither the unit nor the place of a model changes a
pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.scene.model import Scene
from ptmtools.tolerance import DEPTH_SHARE

#: The six views as rows (right, up, forward); a pixel's direction is
#: ``forward + x * right + y * up`` with x and y in (-1, 1).
VIEWS = np.array(
    [
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
    ],
    dtype=np.float64,
)

#: What a transparent surface's depth is multiplied with before it is compared with the opaque
#: one's, so that a pane lying in a wall counts whichever way rounding falls.
BEFORE = 1.0 - DEPTH_SHARE


def pixel_centres(face: int) -> NDArray[np.float64]:
    """(face,) where the centres of a row of pixels lie in (-1, 1); exact for powers of two."""
    return (2.0 * np.arange(face) + 1.0) / face - 1.0


@dataclass(frozen=True)
class Surfaces:
    """The geometry cut to the cells, as the backends take it.

    Attributes
    ----------
    centre, scale: ``(world - centre) * scale`` lies within about 1 of the origin; scale is a
        power of two.
    place: (W, 3) float64 normalised vertices.
    triangle: (M, 3) int32 into `place`.
    normal: (M, 3) float64 unit normal of the scene's triangle that each is a piece of, which is
        better known than that of a sliver.
    cell: (M, 2) int32 the cell on the front and on the back, -1 for none.
    opaque: (M,) bool.
    cell_count: cells in all.
    """

    centre: NDArray[np.float64]
    scale: float
    place: NDArray[np.float64]
    triangle: NDArray[np.int32]
    normal: NDArray[np.float64]
    cell: NDArray[np.int32]
    opaque: NDArray[np.bool_]
    cell_count: int

    @staticmethod
    def of(scene: Scene, cells: Cells) -> Surfaces:
        """The surfaces of a subdivided scene."""
        low, high = cells.root_box
        if len(cells.vertex):
            low = np.minimum(low, cells.vertex.min(axis=0))
            high = np.maximum(high, cells.vertex.max(axis=0))
        centre = low + (high - low) / 2
        extent = float((high - low).max())
        scale = 2.0 ** -np.frexp(extent)[1] if extent > 0 else 1.0
        source = scene.corners[cells.triangle_source]
        normal = np.cross(source[:, 1] - source[:, 0], source[:, 2] - source[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
        return Surfaces(
            centre=centre,
            scale=float(scale),
            place=(cells.vertex - centre) * scale,
            triangle=cells.triangle,
            normal=normal,
            cell=cells.triangle_cell,
            opaque=scene.opaque[cells.triangle_source],
            cell_count=cells.cell_count,
        )

    def normalised(self, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """A (3,) point in world metres, in the coordinates of `place`."""
        return np.asarray((point - self.centre) * self.scale)

    def viewer_cell(
        self, triangle: NDArray[np.int64], point: NDArray[np.float64]
    ) -> NDArray[np.int32]:
        """(n,) the cell for which each of the (n,) triangles counts, seen from a (3,) point in
        world metres; -1 for none."""
        towards = self.normalised(point) - self.place[self.triangle[triangle, 0]]
        in_front = np.einsum("ij,ij->i", towards, self.normal[triangle]) > 0
        return np.asarray(self.cell[triangle, np.where(in_front, 0, 1)], dtype=np.int32)


class Renderer(Protocol):
    """A backend, ready to draw the surfaces it was made with.

    Attributes
    ----------
    backend: "gl" or "embree".
    name: the renderer's own name.
    """

    @property
    def backend(self) -> str: ...

    @property
    def name(self) -> str: ...

    def layers(self, point: NDArray[np.float64], near: float) -> NDArray[np.int64]:
        """(L, 6 face²) the triangle that each pixel of the six views from a (3,) point (world
        metres) shows, -1 for none, in the order (view, row, column); opaque surfaces first, then
        the transparent ones before them, if the scene has any. No surface is nearer to the point
        than ``near`` metres."""

    def traced(self, point: NDArray[np.float64], pixels: NDArray[np.int64]) -> NDArray[np.int64]:
        """(L, n) what a ray through the centre of each of the (n,) pixels says of its layers."""

    def close(self) -> None:
        """Gives back what the backend holds."""


def sample_coverage(
    renderer: Renderer,
    surfaces: Surfaces,
    point: NDArray[np.float64],
    near: float,
    expected: NDArray[np.bool_] | None = None,
) -> NDArray[np.int64]:
    """(C + 1,) pixels covered, seen from a (3,) point in world metres, by each of the C cells,
    and last by what belongs to no cell. ``near``: see `Renderer.layers`.

    ``expected`` (C,) are the cells that may be seen, if that is known. A pixel that shows another
    one is not believed before a ray has confirmed it: a rasteriser rounds corners to 1/256 pixel,
    and past a rounded edge it sees what no straight line reaches.
    """
    layers = renderer.layers(point, near)
    seen, owner = _owners(surfaces, layers, point)
    if expected is not None:
        doubted = seen[~np.append(expected, False)[owner]]
        if len(doubted):
            pixels = np.flatnonzero(np.isin(layers, doubted).any(axis=0))
            layers[:, pixels] = renderer.traced(point, pixels)
            seen, owner = _owners(surfaces, layers, point)
    pixels_of = np.bincount(layers[layers >= 0], minlength=len(surfaces.cell))
    covered = np.zeros(surfaces.cell_count + 1, dtype=np.int64)
    np.add.at(covered, owner, pixels_of[seen])  # -1 is the last
    return covered


def _owners(
    surfaces: Surfaces, layers: NDArray[np.int64], point: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """The triangles that show anywhere, ascending, and the cell for which each of them counts."""
    shows = np.zeros(len(surfaces.cell), dtype=np.bool_)
    shows[layers[layers >= 0]] = True
    seen = np.flatnonzero(shows)
    return seen, surfaces.viewer_cell(seen, point)
