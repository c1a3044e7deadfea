"""The item buffer: the surface in each pixel of six square views around a point (§5).

Every backend answers the same question, *which triangle does pixel (view, row, column) show*, for
the same directions; the owner of the triangle is decided in `tally`, in float64. A triangle in a
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

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.cells.model import Cells
from ptmtools.coverage.sample_points import SamplePoints
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

#: Factor of a transparent surface's depth before it is compared with the opaque one's, so that a
#: pane lying in a wall counts regardless of rounding.
BEFORE = 1.0 - DEPTH_SHARE


@dataclass(frozen=True)
class ItemSurfaces:
    """The geometry cut to the cells, in the form that the backends take.

    ``(world - centre) * scale`` lies within about 1 of the origin; scale is a power of two. Planes
    are those of the scene's triangles, better known than those of slivers.
    """

    centre: Floats
    scale: float
    vertex: Floats  # (W, 3) normalised
    triangle: NDArray[np.int32]  # (M, 3) into `vertex`
    plane: Floats  # (M, 4) unit normal and offset, in normalised coordinates
    cell: NDArray[np.int32]  # (M, 2) the cell on the front and on the back, -1 for none
    image: NDArray[np.int32]  # (M,) the image on each, -1 for none
    opaque: Bools  # (M,)
    cell_count: int

    @staticmethod
    def from_scene(scene: Scene, cells: Cells) -> ItemSurfaces:
        """The surfaces of a subdivided scene."""
        low, high = cells.root_box
        if len(cells.vertex):
            low = np.minimum(low, cells.vertex.min(axis=0))
            high = np.maximum(high, cells.vertex.max(axis=0))
        centre = low + (high - low) / 2
        extent = float((high - low).max())
        scale = 2.0 ** -np.frexp(extent)[1] if extent > 0 else 1.0
        vertex = (cells.vertex - centre) * scale
        normal = normals(scene.corners[cells.triangle_source])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
        offset = -np.einsum("ij,ij->i", normal, vertex[cells.triangle[:, 0]])
        image = np.array([m.image for m in scene.materials], dtype=np.int32)
        return ItemSurfaces(
            centre=centre,
            scale=float(scale),
            vertex=vertex,
            triangle=cells.triangle,
            plane=np.column_stack([normal, offset]),
            cell=cells.triangle_cell,
            image=image[scene.triangle_material[cells.triangle_source]],
            opaque=scene.opaque[cells.triangle_source],
            cell_count=cells.cell_count,
        )

    def normalise(self, points: Floats) -> Floats:
        """(…, 3) points in world metres, in the coordinates of `vertex`."""
        return np.asarray((points - self.centre) * self.scale)

    def world(self, points: Floats) -> Floats:
        """The inverse of `normalise`."""
        return np.asarray(points / self.scale + self.centre)


class ItemRenderer(Protocol):
    """A backend that holds its surfaces, ready to draw.

    Attributes
    ----------
    name: its own name, with its version or device, for the record.
    most: the most sample points that it takes at a time.
    """

    @property
    def name(self) -> str: ...

    @property
    def most(self) -> int: ...

    def show(self, points: SamplePoints, needed: Bools | None = None) -> NDArray[np.int32]:
        """(L, K, 6, face²) the triangle that each pixel shows, -1 for none, in the order (point,
        view, row, column); opaque surfaces first, then the transparent ones before them, if the
        scene has any. ``needed`` (C,) are the cells whose surfaces may show, if known: others need
        not be drawn."""

    def trace(self, points: SamplePoints, pixels: Ints) -> tuple[NDArray[np.int32], Floats]:
        """(L, n) the triangle that a ray through each of the (n,) pixels, numbered from 0 in the
        order of `show`, meets in each layer, and (L, n, 3) the points that it hits, in world
        metres."""

    def close(self) -> None:
        """Frees the backend's resources."""
