"""Tolerances, all derived here; they scale with the scene.

All geometry behind ingest is float64 in metres with its origin at the centre of the model's
floor, so the extent of the scene bounds every coordinate. A tolerance is a fixed share of that
extent: the same building in other units, or moved, is treated alike. Where a file has its
coordinates on a grid that is coarser (compressed glTF), that grid counts instead, up to `COARSEST`:
two faces of one plane lie up to a step apart there. Ingest derives them once (`main_axes`);
`Scene.tolerance` and `Cells.tolerance` hand them on to every stage.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.store.archive import Stored

#: On-plane distance as a share of the extent: 0.4 mm in a building of 50 m, well above the
#: rounding of the float32 coordinates that model files carry (6e-8 of the extent).
PLANE_SHARE = 8e-6
#: Parallel polygons nearer than this count as one wall (a picture hung on it), unless the second
#: closes what the first leaves open: 5 cm in a building of 50 m.
CLUSTER_SHARE = 1e-3
#: Polygons farther apart than this share of the largest wall thickness (6 cm of the usual 50) do
#: not: in a building of 250 m the other face of a wall of 20 cm is no picture.
CLUSTER_OF_WALL = 0.12
#: Error of coordinates in model files, which have six decimals or 24 bits, and so the distance from
#: a plane of points meant to lie in it. 5 µm in a building of 50 m.
FILE_SHARE = 1e-7
#: A cell thinner than this is refused: it could be flat after rounding to float32, and it must be
#: thicker than the on-plane distance. 0.5 mm in a building of 50 m.
THIN_SHARE = 1e-5
#: A gap between walls narrower than this is a crack of the modelling, not an opening: 0.4 mm in a
#: building of 50 m.
HAIRLINE_SHARE = 8e-6
#: Error of the last digits of coordinates, in any unit and at any angle: half a picometre in a
#: building of 50 m.
NOISE_SHARE = 1e-14
#: Where coordinates lie on a coarser grid, in steps of it: distance from a plane of points meant to
#: lie in it, width of a crack, thickness of a cell. (A museum of 26 m, compressed with Draco at 14
#: bits: 51 cells, with planes of .75 of a step 35, from 1.1 on 21, as plain.)
PLANE_STEPS, HAIRLINE_STEPS, THIN_STEPS = 1.5, 2.0, 2.0
#: A step counts as this at most, metres. Terrains and models made of blocks lie on coarser grids,
#: where coordinates are exact.
COARSEST = 0.01
#: Rounding of float64 arithmetic on coordinates and their intersections, with a margin.
ROUNDING_SHARE = 1e-10
#: Polygons of one plane are united and cut on a grid of this step (`cells.planar`): well above the
#: rounding of float64, well below the distance that counts as rounding.
GRID_SHARE = 1e-13

#: Unit normals with a dot product of at least this are parallel: 1.4 mm over a metre.
PARALLEL_COSINE = 1.0 - 1e-6
#: Areas, volumes and scores that differ by less than this share are equal: above what reveals some
#: centimetres wide lose in a file 1e6 extents from its origin (with 1e-9 the office gets other
#: portals there), below anything that a model means. Ties go by the order of the model file, which
#: no transformation changes.
TIE_SHARE = 3e-7

#: Of two surfaces in one pixel, depths that differ by less than this share are the same depth:
#: 0.3 mm at 20 m, above the rounding of float32 depth and below a picture 1 mm off its wall.
DEPTH_SHARE = 2.0**-16
#: A ray that goes on behind a surface begins this share of the size of the scene, 1 m at least,
#: farther on: well above the rounding of float32 (6e-8).
RAY_STEP_SHARE = 1e-6
#: What is a radius away, but for this share of it, is not within the radius: polygons stand for
#: circles, and GEOS rounds.
TOUCH_SHARE = 1e-6
#: Rays with a smaller cosine to the normal of a plane count as having this one.
GRAZING_COSINE = 1e-9
#: Points examined beside an edge of a face lie this share of the way towards its middle: 5 mm in a
#: wall of 10 m, above the rounding of float32 in a face of a centimetre.
INWARD_SHARE = 1e-3


@dataclass(frozen=True)
class Tolerance:
    """Distances in metres and an angle, all derived from the scene's extent.

    Attributes
    ----------
    extent: largest side of the scene's bounding box, metres.
    step: step of the grid of the file's coordinates, metres, at most `COARSEST`; 0 for the grid of
        float32.
    plane: a point nearer than this to a plane lies in it.
    cluster: parallel planes nearer than this count as one wall.
    file: rounding of coordinates in model files.
    thin: the least thickness of a cell.
    hairline: an opening narrower than this is a crack.
    rounding: distances below this are rounding errors of the arithmetic itself.
    noise: coordinates are not known better than this, whatever arithmetic is done on them.
    grid: the step to which corners of polygons in a plane are snapped.
    cosine: unit normals with a dot product of at least this are parallel.
    """

    extent: float
    step: float
    plane: float
    cluster: float
    file: float
    thin: float
    hairline: float
    rounding: float
    noise: float
    grid: float
    cosine: float

    @staticmethod
    def for_points(points: NDArray[np.float64], step: float = 0.0) -> Tolerance:
        """Tolerances for the (n, 3) points of a scene; an empty scene counts as 1 m."""
        extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
        extent = extent if extent > 0 else 1.0
        return Tolerance.for_extent(extent, min(step, COARSEST, CLUSTER_SHARE * extent))

    def for_walls(self, thickness: float) -> Tolerance:
        """The same where walls are up to ``thickness`` metres thick; 0 changes nothing. However
        thin they are, polygons in one plane are one wall."""
        if thickness == 0:
            return self
        return replace(
            self, cluster=min(self.cluster, max(CLUSTER_OF_WALL * thickness, self.plane))
        )

    @staticmethod
    def for_extent(extent: float, step: float = 0.0) -> Tolerance:
        """Tolerances for a scene whose bounding box has the largest side ``extent``, and whose file
        has coordinates on a grid of this ``step``, metres; ValueError unless the one is positive,
        and the other less than it and not negative."""
        if not (extent > 0 and 0 <= step < extent):
            raise ValueError(f"{extent} is no extent, or {step} no step")
        return Tolerance(
            extent=extent,
            step=step,
            plane=max(PLANE_SHARE * extent, PLANE_STEPS * step),
            cluster=max(CLUSTER_SHARE * extent, PLANE_STEPS * step),
            file=max(FILE_SHARE * extent, step),
            thin=max(THIN_SHARE * extent, THIN_STEPS * step),
            hairline=max(HAIRLINE_SHARE * extent, HAIRLINE_STEPS * step),
            rounding=ROUNDING_SHARE * extent,
            noise=NOISE_SHARE * extent,
            grid=GRID_SHARE * extent,
            cosine=PARALLEL_COSINE,
        )

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The tolerances as arrays, for `from_arrays`."""
        step = {"step": np.array(self.step)} if self.step else {}
        return {"extent": np.array(self.extent), **step}

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Tolerance:
        """Inverse of `to_arrays`. Raises KeyError or ValueError for invalid arrays."""
        stored = Stored(arrays)
        extent, step = (
            stored.array(name, np.float64, finite=True).item() if name in arrays else 0.0
            for name in ("extent", "step")
        )
        return Tolerance.for_extent(extent, step)


def rank(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n,) indices of values >= 0 from the greatest to the least; values that differ by less than
    `TIE_SHARE` of themselves are in the order of their indices, whatever their last digits."""
    order = np.argsort(-values, kind="stable")
    value = values[order]
    run = np.concatenate([[0], np.cumsum(value[:-1] - value[1:] > TIE_SHARE * value[:-1])])
    return order[np.lexsort((order, run[: len(order)]))]
