"""Which levels of a texture no eye resolves: those that a picture is never drawn from.

A pixel's *footprint* on a surface is what it covers there, in texels. Graphics cards draw from the
levels ⌊λ⌋ and ⌊λ⌋ + 1, counted from the finest, 0, with λ = log2(Pmax / N), where Pmax and Pmin are
the lengths of the footprint across and down a pixel, the larger and the smaller one, and N the
least of ⌈Pmax / Pmin⌉ and 16 (EXT_texture_filter_anisotropic; 1 where the filter is isotropic). So
Pmax / N is at least Pmin / 2 and at least Pmax / 16, and from below:

- at a distance r from the eye, φ off the middle of the picture, a pixel covers r·p·cos²φ or more of
  a surface in any direction, where p is a pixel's size at distance 1; φ is largest in a corner;
- r is at least the distance from a piece of the surface to the eyes of those who may see it: the
  eye region (`ptmtools.cells.eyes`) of the cells that see its owner, by boxes;
- a metre on the surface is at least σ2 texels and, in one direction, σ1, the singular values of the
  texels' gradient; Pmax is at least σ1 / √2 times the metres that a pixel covers.

That is within 2.3 octaves of λ itself where an eye gets as near as the boxes say.

(Tried: the pixel in the middle of the picture, and λ = log2(Pmin). The corners of a picture have
smaller pixels, 0.42 of it in both directions, and where a footprint is not quite square N is 2:
eyes that were drawn at random in a room needed levels that were trimmed.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.cells.vectors import cross, normals, ranges
from ptmtools.scene.mapping import gradients
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

#: Screens are at most so many times as wide as high.
ASPECT = 16 / 9
#: Samples along a footprint that is longer than wide, at most.
ANISOTROPY = 16
#: More levels than any image has.
ALL = 64
#: Pieces held against boxes at a time.
_AT_ONCE = 1 << 16


@dataclass(frozen=True)
class Screen:
    """What a visitor looks at.

    Attributes
    ----------
    height: pixels.
    field_of_view: from top to bottom, degrees.
    distance: from the eye to the nearest surface, metres, at least.
    """

    height: int
    field_of_view: float
    distance: float

    @property
    def pixel(self) -> float:
        """How much a pixel covers at a distance of 1, at least, wherever it is in the picture."""
        half = np.tan(np.radians(self.field_of_view) / 2)
        corner = 1 + half**2 * (1 + ASPECT**2)  # 1 / cos²φ
        return float(2 * half / self.height / corner)


def unresolved_levels(
    scene: Scene, cells: Cells, pvs: Pvs, sizes: Sequence[tuple[int, int]], screen: Screen
) -> Ints:
    """(I,) of each image how many of its finest levels no eye resolves; `ALL` if none sees it.

    Parameters
    ----------
    sizes: (width, height) of each of the scene's images, texels.
    """
    image = np.array([m.image for m in scene.materials], dtype=np.int64)
    piece, owner = cells.emitted(scene.two_sided)
    shown = image[scene.triangle_material[cells.triangle_source[piece]]]
    painted = shown >= 0
    piece, owner, shown = piece[painted], owner[painted], shown[painted]
    texels = _texels(scene, np.array(sizes, dtype=np.float64).reshape(-1, 2))
    distance = np.maximum(_distances(cells, pvs, piece, owner), screen.distance)
    footprint = screen.pixel * distance * texels[cells.triangle_source[piece]]
    least = np.full(len(sizes), np.inf)
    np.minimum.at(least, shown, footprint)
    # The exponent of a number from 1 up is what its logarithm is rounded down to, and 1.
    levels = np.frexp(np.where(np.isfinite(least), least, 0.0))[1].astype(np.int64) - 1
    return np.where(np.isfinite(least), np.clip(levels, 0, ALL), ALL)


def _texels(scene: Scene, sizes: Floats) -> Floats:
    """(T,) texels that count for a metre of each triangle, in any direction; 0 where the texture is
    drawn out without end, inf where the triangle is none."""
    image = np.array([m.image for m in scene.materials], dtype=np.int64)[scene.triangle_material]
    size = np.ones((len(image), 2))
    size[image >= 0] = sizes[image[image >= 0]]
    gradient = gradients(scene.corners, scene.uv) * size[..., None]
    # Sum and root of the product of the squares of the singular values.
    total = (gradient**2).sum(axis=(1, 2))
    product = np.linalg.norm(cross(gradient[:, 0], gradient[:, 1]), axis=1)
    most = np.sqrt((total + np.sqrt(np.maximum(total**2 - 4 * product**2, 0.0))) / 2)
    least = np.divide(product, most, out=np.zeros_like(most), where=most > 0)
    counted = np.maximum(least / 2, most / (ANISOTROPY * np.sqrt(2)))
    flat = ~normals(scene.corners).any(axis=1)
    return np.asarray(np.where(flat, np.inf, counted))


def _distances(
    cells: Cells, pvs: Pvs, piece: NDArray[np.int64], owner: NDArray[np.int32]
) -> Floats:
    """(n,) metres from pieces to the nearest eye that may see them, at least; inf if none may.
    ``owner`` (n,) ascends."""
    corners = cells.vertex[cells.triangle[piece]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    bottom, top, start = _eye_boxes(cells)
    everyone = np.arange(cells.cell_count, dtype=np.int32)
    nearest = np.full(len(piece), np.inf)
    first = np.searchsorted(owner, np.arange(cells.cell_count + 1))
    for cell in np.unique(owner).tolist():
        viewers = pvs.row(cell) if pvs.conservative else everyone
        box = ranges(start[viewers], start[viewers + 1] - start[viewers])
        step = max(1, _AT_ONCE // max(len(box), 1))
        for begin in range(first[cell], first[cell + 1], step):
            some = slice(begin, min(begin + step, first[cell + 1]))
            gap = np.maximum(bottom[box] - high[some, None], low[some, None] - top[box])
            square = (np.maximum(gap, 0.0) ** 2).sum(axis=2)
            nearest[some] = square.min(axis=1, initial=np.inf)
    return np.asarray(np.sqrt(nearest))


def _eye_boxes(cells: Cells) -> tuple[Floats, Floats, Ints]:
    """(b, 3) and (b, 3) corners of boxes that hold all places where eyes can be, and (C + 1,) CSR
    of those in each cell."""
    eyes, leaf = cells.eyes, np.flatnonzero(cells.leaf_standing & (cells.leaf_cell >= 0))
    leaf = leaf[np.argsort(cells.leaf_cell[leaf], kind="stable")]
    boxes = np.empty((2, len(leaf), 3))
    for i, points in enumerate(map(cells.leaf_points, leaf.tolist())):
        boxes[:, i] = eyes.clipped(points.min(axis=0), points.max(axis=0))
    start = np.searchsorted(cells.leaf_cell[leaf], np.arange(cells.cell_count + 1))
    return boxes[0], boxes[1], start
