"""The item-buffer tally: the pixels of each owner, by sample point and view.

A pixel counts for the owner, on the viewer's side, of the triangle that it shows. If the owner is a
cell outside the PVS, or missing, the pixel is in doubt and checked again in two steps:

1. a ray through it is cast. A rasteriser rounds corners to 1/256 pixel, and past a rounded edge it
   sees what no straight line reaches;
2. the point that the ray hits, moved a little towards the viewer, is located in the BSP tree.
   Geometry that reaches into a cell by less than a plane's tolerance is not cut off there.

Pixels still outside the PVS after that are missed mass: left out of the hints and reported.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Ints, ranges
from ptmtools.cells.model import Cells
from ptmtools.coverage.item_buffer import VIEWS, ItemRenderer, ItemSurfaces
from ptmtools.coverage.sample_points import SamplePoints

#: Weight of a pixel in the middle of a view where pixels are weighted by solid angle.
SOLID_ANGLE_UNIT = 2**16
#: Distance, in tolerances of a plane, that a hit is moved towards the viewer before it is located.
TOWARDS = 4.0


@dataclass(frozen=True)
class Owners:
    """The owners of pixels: each cell, or each image within each cell, where -1 stands for surfaces
    without an image; every cell has that owner."""

    cell: NDArray[np.int32]  # (S,) of each owner, ascending, and
    image: NDArray[np.int32]  # (S,) ascending within a cell
    first: Ints  # (C + 1,) where the owners of each cell begin
    of_side: NDArray[np.int32]  # (M, 2) of each triangle's front and back, -1 for none
    images: int  # more than any image of the scene, plus 1

    @staticmethod
    def from_surfaces(surfaces: ItemSurfaces, by_image: bool) -> Owners:
        """Cells, or images within cells."""
        image = surfaces.image if by_image else np.full(len(surfaces.image), -1, np.int32)
        images = int(image.max(initial=-1)) + 2
        key = surfaces.cell.astype(np.int64) * images + (image[:, None] + 1)
        bare = np.arange(surfaces.cell_count) * images
        every = np.unique(np.concatenate([key[surfaces.cell >= 0], bare]))
        cell = every // images
        return Owners(
            cell=cell.astype(np.int32),
            image=(every % images - 1).astype(np.int32),
            first=np.searchsorted(cell, np.arange(surfaces.cell_count + 1)),
            of_side=np.where(surfaces.cell < 0, -1, np.searchsorted(every, key)).astype(np.int32),
            images=images,
        )

    def in_cells(self, cells: NDArray[np.int32]) -> tuple[Ints, Ints]:
        """The owners in each of the (n,) cells, cell after cell, and where each cell's begin."""
        size = self.first[cells + 1] - self.first[cells]
        return ranges(self.first[cells], size), np.cumsum(size) - size

    def numbers(self, cell: NDArray[np.int32], image: NDArray[np.int32]) -> Ints:
        """(n,) the owner of each of the (n,) images in each of the (n,) cells; the owner without
        image if the cell does not use the image; -1 where the cell is -1."""
        every = self.cell.astype(np.int64) * self.images + self.image + 1
        key = cell.astype(np.int64) * self.images + image + 1
        place = np.minimum(np.searchsorted(every, key), len(every) - 1)
        bare = self.first[cell]
        return np.where(cell < 0, -1, np.where(every[place] == key, place, bare)).astype(np.int64)


@dataclass(frozen=True)
class PixelTally:
    """Weighted pixels seen from K points."""

    at_points: Ints  # (K, m) of each of the owners asked for, at each point
    in_views: Ints  # (6, m) of the same in each view, over all points
    missed: Ints  # (K,) of all other owners

    @staticmethod
    def join(parts: list[PixelTally]) -> PixelTally:
        """Concatenates the tallies of several sets of points."""
        return PixelTally(
            np.concatenate([part.at_points for part in parts]),
            np.sum([part.in_views for part in parts], axis=0),
            np.concatenate([part.missed for part in parts]),
        )

    def group(self, begin: Ints) -> PixelTally:
        """The owners from each of the (n,) ``begin`` to the next as one."""
        if len(begin) == self.at_points.shape[1]:
            return self
        at_points, in_views = (
            np.add.reduceat(counts, begin, axis=1) for counts in (self.at_points, self.in_views)
        )
        return PixelTally(at_points, in_views, self.missed)


class PixelCounter:
    """Counts the pixels of a renderer's views, of ``face`` pixels a side, for their owners.

    Pixels are weighted by solid angle if asked for, else alike; `unit` is the weight of one in the
    middle of a view. `owners` are cells, or images within cells.
    """

    def __init__(
        self,
        renderer: ItemRenderer,
        surfaces: ItemSurfaces,
        cells: Cells,
        face: int,
        *,
        by_angle: bool = False,
        by_image: bool = False,
    ) -> None:
        self.unit = SOLID_ANGLE_UNIT if by_angle else 1
        self.owners = Owners.from_surfaces(surfaces, by_image)
        self._renderer = renderer
        self._surfaces = surfaces
        self._cells = cells
        self._face = face
        self._towards = TOWARDS * cells.tolerance.plane

    def count(self, points: SamplePoints, wanted: Ints) -> PixelTally:
        """How many pixels show each of the (m,) ``wanted`` owners."""
        column = np.full(len(self.owners.cell) + 1, -1, dtype=np.int32)
        column[wanted] = np.arange(len(wanted))
        needed = np.zeros(self._surfaces.cell_count, dtype=np.bool_)
        needed[self.owners.cell[wanted]] = True
        tally = PixelTally(
            np.zeros((len(points), len(wanted)), dtype=np.int64),
            np.zeros((len(VIEWS), len(wanted)), dtype=np.int64),
            np.zeros(len(points), dtype=np.int64),
        )
        batch = self._renderer.most
        for first in range(0, len(points), batch):
            rows = slice(first, first + batch)
            part = PixelTally(tally.at_points[rows], tally.in_views, tally.missed[rows])
            self._add(points.part(rows), column, needed, part)
        return tally

    def _add(
        self, points: SamplePoints, column: NDArray[np.int32], needed: Bools, tally: PixelTally
    ) -> None:
        """Draws views of the cells ``needed`` and adds their pixels to the ``tally``, whose
        ``column`` of each owner is -1 for one that is not expected."""
        from ptmtools.coverage.kernels import add_pixels

        layers = self._renderer.show(points, needed)
        position = self._surfaces.normalise(points.position)
        weight = self.weight(points)
        size = self._face**2
        doubt = np.empty(layers[0].size, dtype=np.int64)
        for layer, shows in enumerate(layers):
            given = self._surfaces.plane, self.owners.of_side, column, weight
            doubted = add_pixels(shows, position, *given, tally.at_points, tally.in_views, doubt)
            if not doubted:
                continue
            pixel = doubt[:doubted]
            point, view = pixel // (len(VIEWS) * size), pixel // size % len(VIEWS)
            owner, hit = self._again(points, pixel, layer, column)
            weighs = weight[np.minimum(point, len(weight) - 1), pixel % size]
            expected, lost = owner >= 0, hit & (owner < 0)
            entry = column[owner[expected]]
            np.add.at(tally.at_points, (point[expected], entry), weighs[expected])
            np.add.at(tally.in_views, (view[expected], entry), weighs[expected])
            np.add.at(tally.missed, point[lost], weighs[lost])

    def _again(
        self, points: SamplePoints, pixel: Ints, layer: int, column: NDArray[np.int32]
    ) -> tuple[Ints, Bools]:
        """(n,) the expected owner that each of the (n,) pixels in doubt counts for, or -1; (n,)
        whether it shows anything."""
        shows, hits = (both[layer] for both in self._renderer.trace(points, pixel))
        viewer = points.position[pixel // (len(VIEWS) * self._face**2)]
        hit = shows >= 0
        plane = self._surfaces.plane[shows]
        side = np.einsum("ij,ij->i", plane[:, :3], self._surfaces.normalise(viewer)) + plane[:, 3]
        owner = self.owners.of_side[shows, np.where(side > 0, 0, 1)].astype(np.int64)
        owner[~hit | (column[owner] < 0)] = -1
        lost = np.flatnonzero(hit & (owner < 0))
        if len(lost):
            back = viewer[lost] - hits[lost]
            length = np.linalg.norm(back, axis=1, keepdims=True)
            step = np.minimum(self._towards / np.maximum(length, self._towards), 0.5)
            cell = self._cells.locate(hits[lost] + step * back)
            image = np.where(self.owners.images > 1, self._surfaces.image[shows[lost]], -1)
            nearer = self.owners.numbers(cell, image)
            owner[lost] = np.where(column[nearer] >= 0, nearer, -1)
        return owner, hit

    def weight(self, points: SamplePoints) -> Ints:
        """(1 or K, face²) weights of the pixels of a view: alike, or by solid angle,
        (1 + x² + y²)^(-3/2) in `unit`-ths."""
        if self.unit == 1:
            return np.ones((1, self._face**2), dtype=np.int64)
        centre = (2.0 * np.arange(self._face) + 1.0) / self._face - 1.0
        x, y = (centre + shift[:, None] for shift in (points.shift / self._face).T)
        weight = self.unit / (1.0 + x[:, None, :] ** 2 + y[:, :, None] ** 2) ** 1.5
        rounded: Ints = np.round(weight).astype(np.int64)
        return rounded.reshape(len(points), -1)
