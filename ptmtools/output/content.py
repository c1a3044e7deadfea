"""The input of all emitters: artifacts, textures, viewpoints, and the values derived from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.output.emitter import Emitter
from ptmtools.output.geometry import Geometry
from ptmtools.output.model import TextureRecord, Viewpoint, WriterOptions
from ptmtools.output.numbers import shares_of, significant
from ptmtools.output.representation import Represented, object_maps, replaced_objects
from ptmtools.progress import Progress, silent
from ptmtools.scene.colors import to_linear, to_srgb
from ptmtools.scene.model import Material, Scene
from ptmtools.visibility.model import Pvs

if TYPE_CHECKING:
    from ptmtools.coverage.required_levels import Need
    from ptmtools.light.model import Light
    from ptmtools.output.mesh_levels import MeshLevels


@dataclass(frozen=True)
class EmitExtras:
    """Results of stages that a database may lack, and how `emit` runs.

    Attributes
    ----------
    light: the light of the cells, if baked.
    represented: other representations of objects, whose files are already written, one for each
        kind.
    need: the levels of the images' textures that each cell requires; None leaves them out.
    map_need: likewise of the normal maps of objects.
    force: overwrite files of the same names, gzip copies included.
    progress: called for every cell.
    workers: threads that may be used.
    """

    light: Light | None = None
    represented: tuple[Represented, ...] = ()
    need: Need | None = None
    map_need: Need | None = None
    force: bool = False
    progress: Progress = silent
    workers: int = 1


#: The place of a texture in the hints, and its record.
PlacedTexture = tuple[int, TextureRecord]


class TexturePlaces:
    """The places of textures in the hints.

    Attributes
    ----------
    of_image: by the image of the scene.
    of_cell, probe: of the lightmap and of the probe of each cell.
    of_object: of the normal map of each object.
    """

    def __init__(self, textures: Sequence[TextureRecord]) -> None:
        placed = list(enumerate(textures))
        self.of_image: dict[int, PlacedTexture] = {
            r.image: (i, r) for i, r in placed if r.image >= 0
        }
        self.of_cell: dict[int, PlacedTexture] = {r.cell: (i, r) for i, r in placed if r.cell >= 0}
        self.probe: dict[int, PlacedTexture] = {r.probe: (i, r) for i, r in placed if r.probe >= 0}
        self.of_object: dict[int, PlacedTexture] = {
            r.object: (i, r) for i, r in placed if r.object >= 0
        }


@dataclass(frozen=True)
class Content:
    """
    Attributes
    ----------
    textures: in the order of the hints; one for every image that a material in use names, and then
        the lightmaps and the probes of cells, and the normal maps of objects.
    viewpoints: where a walk may start.
    emitters: the forms that are written, in the order of writing.
    """

    scene: Scene
    cells: Cells
    pvs: Pvs
    ach: Ach
    textures: tuple[TextureRecord, ...]
    options: WriterOptions = WriterOptions()  # noqa: RUF009 - a frozen value
    extras: EmitExtras = EmitExtras()
    viewpoints: tuple[Viewpoint, ...] = ()
    emitters: tuple[Emitter, ...] = ()

    @cached_property
    def geometry(self) -> Geometry:
        """The shapes of all cells; raises PTM-D601 if a number is not finite in float32."""
        return Geometry(self.scene, self.cells)

    @cached_property
    def lit_geometry(self) -> Geometry:
        """`geometry` with the light, the coordinates in normal maps of objects, and the normals of
        what reflects."""
        light, maps = self.extras.light, object_maps(self.extras.represented)
        lit = self.geometry.with_light(light) if light else self.geometry
        lit = lit.with_object_maps(maps, self.scene, self.cells) if maps else lit
        return lit.with_normals(self.scene, self.cells) if light else lit

    @cached_property
    def lamp_whites(self) -> dict[int, float]:
        """The materials of lamps without an image, and the greatest component of their radiance, at
        the usual exposure; in a building with light."""
        light, materials = self.extras.light, self.scene.materials
        if light is None:
            return {}
        lamps = [k for k, m in enumerate(materials) if m.image < 0 and m.opacity == 1]
        lamps = [k for k in lamps if light.shine[k].any()]
        peaks = [_lamp_radiance(materials[k], light.shine[k]).max() for k in lamps]
        whites = significant(np.array(peaks))
        return {k: white or 1.0 for k, white in zip(lamps, whites, strict=True)}

    @cached_property
    def shown_materials(self) -> tuple[Material, ...]:
        """The materials of the scene; those of `lamp_whites` have the colours of their light."""
        materials, light = list(self.scene.materials), self.extras.light
        for k, white in self.lamp_whites.items():
            assert light
            shares = np.minimum(_lamp_radiance(materials[k], light.shine[k]) / white, 1)
            red, green, blue = to_srgb(shares).tolist()
            materials[k] = replace(materials[k], color=(red, green, blue))
        return tuple(materials)

    @cached_property
    def position_exponent(self) -> int:
        """Exponent of the step of positions in compressed cells, a power of two in metres."""
        from ptmtools.output.grid import position_exponent

        return position_exponent(self.scene, self.options.gltf_step)

    @cached_property
    def meshes(self) -> tuple[MeshLevels, ...]:
        """The levels of objects with many triangles, by cell and object."""
        from ptmtools.output.mesh_levels import mesh_levels

        if self.options.lods != "auto" or not any(form.has_meshes for form in self.emitters):
            return ()
        replaced = replaced_objects(self.extras.represented)
        return mesh_levels(self.lit_geometry, replaced, self.extras.progress)

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
    def places(self) -> TexturePlaces:
        """Where the hints list the textures."""
        return TexturePlaces(self.textures)

    @cached_property
    def paint(self) -> Ints:
        """(S,) the index of each shape's texture in `textures`; -1 for none."""
        of_image, materials = self.places.of_image, self.scene.materials
        place = [of_image[m.image][0] if m.image >= 0 else -1 for m in materials]
        paint: Ints = np.array(place, dtype=np.int64)[self.geometry.material]
        return paint

    @cached_property
    def cell_textures(self) -> list[Ints]:
        """For each cell the indices of its textures in `textures`, ascending."""
        start, places = self.geometry.cell_start[1:-1], self.places
        of_shapes = np.split(self.paint, start)
        map_place = np.full(len(self.scene.objects) + 1, -1)
        for number, (place, _) in places.of_object.items():
            map_place[number] = place
        of_maps = np.split(map_place[self.geometry.object], start)
        painted = []
        for cell, rows in enumerate(zip(of_shapes, of_maps, strict=True)):
            light = [kind.get(cell, (-1, None))[0] for kind in (places.of_cell, places.probe)]
            used = np.unique(np.concatenate([*rows, light]))
            painted.append(used[used >= 0])
        return painted

    @cached_property
    def shares(self) -> list[list[float]]:
        """For each cell its ACH as written, aligned with its row of the PVS."""
        return [shares_of(row) for row in np.split(self.ach.value, self.pvs.start[1:-1])]


def _lamp_radiance(material: Material, shine: Floats) -> Floats:
    """(3,) the radiance of a lamp: that which it sends, but no less than its colour."""
    return np.maximum(to_linear(np.array(material.color)), shine)
