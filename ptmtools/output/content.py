"""The input of all emitters: artifacts, textures, viewpoints, and what is derived from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.output.emitter import Emitter
from ptmtools.output.geometry import Geometry
from ptmtools.output.model import TextureRecord, Viewpoint, WriterOptions
from ptmtools.output.numbers import shares_of
from ptmtools.output.representation import Represented
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

if TYPE_CHECKING:
    from ptmtools.coverage.required_levels import Need
    from ptmtools.light.model import Light
    from ptmtools.output.mesh_levels import MeshLevels
    from ptmtools.output.object_maps import ObjectMaps


@dataclass(frozen=True)
class Content:
    """
    Attributes
    ----------
    textures: in the order of the hints; one for every image that a material in use names, and then
        the lightmaps of cells, and the normal maps of objects.
    viewpoints: where a walk may start.
    progress: called for every cell.
    need: the required levels of textures, if measured.
    represented: other representations of objects, one for each kind.
    workers: number of threads.
    emitters: the forms that are written, in the order of writing.
    light: the light of the cells, if baked.
    map_need: the required levels of the normal maps of objects, if measured.
    """

    scene: Scene
    cells: Cells
    pvs: Pvs
    ach: Ach
    textures: tuple[TextureRecord, ...]
    viewpoints: tuple[Viewpoint, ...] = ()
    options: WriterOptions = WriterOptions()  # noqa: RUF009 - a frozen value
    progress: Progress = silent
    need: Need | None = None
    represented: tuple[Represented, ...] = ()
    workers: int = 1
    emitters: tuple[Emitter, ...] = ()
    light: Light | None = None
    map_need: Need | None = None

    @cached_property
    def geometry(self) -> Geometry:
        """The shapes of all cells; raises PTM-D601 if a number is not finite in float32."""
        return Geometry(self.scene, self.cells)

    @cached_property
    def lit(self) -> Geometry:
        """`geometry` with the light, and the coordinates in normal maps of objects."""
        lit = self.geometry.lit_by(self.light) if self.light else self.geometry
        return lit.mapped_by(self.object_maps, self.scene, self.cells) if self.object_maps else lit

    @cached_property
    def position_exponent(self) -> int:
        """Exponent of the step of positions in compressed cells, a power of two in metres."""
        from ptmtools.output.grid import position_exponent

        return position_exponent(self.scene, self.options.gltf_step)

    @cached_property
    def meshes(self) -> tuple[MeshLevels, ...]:
        """The levels of objects with many triangles, by cell and object."""
        from ptmtools.output.mesh_levels import mesh_levels

        if self.options.lods != "auto" or not any(one.has_meshes for one in self.emitters):
            return ()
        return mesh_levels(self.lit, self.replaced, self.progress)

    @cached_property
    def mesh_of(self) -> Mapping[tuple[int, int], int]:
        """Cell and object → the place of its levels in `meshes`."""
        return {(mesh.cell, mesh.object): place for place, mesh in enumerate(self.meshes)}

    @cached_property
    def leaves(self) -> list[list[int]]:
        """The leaves of each cell, ascending."""
        order, count = np.argsort(self.cells.leaf_cell, kind="stable"), self.cells.cell_count
        first = np.searchsorted(self.cells.leaf_cell[order], np.arange(count))
        return [leaves.tolist() for leaves in np.split(order, first)[1:]]

    @cached_property
    def records(self) -> Mapping[int, tuple[int, TextureRecord]]:
        """Image of the scene → its index in `textures`, and its record."""
        return {r.image: (place, r) for place, r in enumerate(self.textures) if r.image >= 0}

    @cached_property
    def lightmap_of(self) -> Mapping[int, tuple[int, TextureRecord]]:
        """Cell → the index of its lightmap in `textures`, and the record of that."""
        return {r.cell: (place, r) for place, r in enumerate(self.textures) if r.cell >= 0}

    @cached_property
    def object_maps(self) -> ObjectMaps | None:
        """The places of objects in their normal maps, if there are any."""
        return next((r.maps for r in self.represented if r.maps), None)

    @cached_property
    def map_of(self) -> Mapping[int, tuple[int, TextureRecord]]:
        """Object → the index of its normal map in `textures`, and the record of that."""
        return {r.object: (place, r) for place, r in enumerate(self.textures) if r.object >= 0}

    @cached_property
    def replaced(self) -> frozenset[int]:
        """The objects of the scene with another representation."""
        return frozenset(number for kind in self.represented for number in kind.objects)

    @cached_property
    def extras(self) -> Mapping[int, Mapping[str, int]]:
        """Object of the scene → the members of its nodes' "extras": of each kind of representation
        the number of its row."""
        extras: dict[int, dict[str, int]] = {}
        for represented in self.represented:
            if represented.kind:
                for row, number in enumerate(represented.objects):
                    extras.setdefault(number, {})[represented.kind.member] = row
        return extras

    @cached_property
    def normal_maps(self) -> frozenset[int]:
        """The images of the scene that are normal maps of materials, and nothing else."""
        maps = {m.normal.image for m in self.scene.materials if m.normal}
        return frozenset(maps - {m.image for m in self.scene.materials})

    @cached_property
    def paint(self) -> NDArray[np.int64]:
        """(S,) the index of each shape's texture in `textures`; -1 for none."""
        place = [self.records[m.image][0] if m.image >= 0 else -1 for m in self.scene.materials]
        paint: NDArray[np.int64] = np.array(place, dtype=np.int64)[self.geometry.material]
        return paint

    @cached_property
    def painted(self) -> list[NDArray[np.int64]]:
        """For each cell the indices of its textures in `textures`, ascending."""
        start = self.geometry.cell_start[1:-1]
        cells = np.split(self.paint, start)
        light = [self.lightmap_of[c][0] if c in self.lightmap_of else -1 for c in range(len(cells))]
        map_place = np.full(len(self.scene.objects) + 1, -1)
        for number, (place, _) in self.map_of.items():
            map_place[number] = place
        maps = np.split(map_place[self.geometry.object], start)
        used = (np.concatenate([own, [c], m]) for own, c, m in zip(cells, light, maps, strict=True))
        return [np.unique(own[own >= 0]) for own in used]

    @cached_property
    def shares(self) -> list[list[float]]:
        """For each cell its ACH as written, aligned with its row of the PVS."""
        return [shares_of(row) for row in np.split(self.ach.value, self.pvs.start[1:-1])]
