"""What all emitters write from: the artifacts, the textures and viewpoints, and what is derived
from them once for all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.database.geometry import Geometry
from ptmtools.database.hints.numbers import shares_of
from ptmtools.database.model import EmitOptions, OctreeRecord, TextureRecord, Viewpoint
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

if TYPE_CHECKING:
    from ptmtools.coverage.need import Need


@dataclass(frozen=True)
class Content:
    """
    Attributes
    ----------
    textures: in the order of the hints; one for every image that a material in use names.
    viewpoints: the places to start from.
    progress: is called for every cell.
    need: how fine textures are needed, where that was measured.
    octrees: the octree textures of objects.
    workers: threads that may be used.
    """

    scene: Scene
    cells: Cells
    pvs: Pvs
    ach: Ach
    textures: tuple[TextureRecord, ...]
    viewpoints: tuple[Viewpoint, ...] = ()
    options: EmitOptions = EmitOptions()  # noqa: RUF009 - a frozen value
    progress: Progress = silent
    need: Need | None = None
    octrees: tuple[OctreeRecord, ...] = ()
    workers: int = 1

    @cached_property
    def geometry(self) -> Geometry:
        """The shapes of all cells; raises PTM-D601 if a number is not finite in float32."""
        return Geometry(self.scene, self.cells)

    @cached_property
    def leaves(self) -> list[list[int]]:
        """The leaves of each cell, ascending."""
        order, count = np.argsort(self.cells.leaf_cell, kind="stable"), self.cells.cell_count
        first = np.searchsorted(self.cells.leaf_cell[order], np.arange(count))
        return [leaves.tolist() for leaves in np.split(order, first)[1:]]

    @cached_property
    def records(self) -> Mapping[int, tuple[int, TextureRecord]]:
        """Image of the scene → its place in `textures`, and its record there."""
        return {record.image: (place, record) for place, record in enumerate(self.textures)}

    @cached_property
    def octree_of(self) -> Mapping[int, int]:
        """Object of the scene → the place of its octree in `octrees`."""
        return {record.number: place for place, record in enumerate(self.octrees)}

    @cached_property
    def paint(self) -> NDArray[np.int64]:
        """(S,) of each shape its texture's place in `textures`; -1 for none."""
        place = [self.records[m.image][0] if m.image >= 0 else -1 for m in self.scene.materials]
        paint: NDArray[np.int64] = np.array(place, dtype=np.int64)[self.geometry.material]
        return paint

    @cached_property
    def painted(self) -> list[NDArray[np.int64]]:
        """Of each cell the places in `textures` that its shapes use, ascending."""
        cells = np.split(self.paint, self.geometry.cell_start[1:-1])
        return [np.unique(used[used >= 0]) for used in cells]

    @cached_property
    def shares(self) -> list[list[float]]:
        """Of each cell its ACH as it is written, aligned with its row of the PVS."""
        return [shares_of(row) for row in np.split(self.ach.value, self.pvs.start[1:-1])]
