"""What the meshes of a USD stage are painted with: materials, texture coordinates and colours.

A mesh, and each subset of its faces, has a material by its own binding, that of a prim above it, or
that of a collection. Where none is read its displayed colour counts, as other programs show it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom, UsdShade

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.colors import encoded
from ptmtools.scene.handed import NamedImage
from ptmtools.scene.source import Findings, SourceMaterial
from ptmtools.scene.usd.layers import TIME
from ptmtools.scene.usd.material import Color, MaterialReader, Surface, tint
from ptmtools.scene.usd.mesh import Shape, array, at_corners


class Painter:
    """The materials of the meshes, each (material, side, colour) once."""

    def __init__(self, reader: MaterialReader, findings: Findings) -> None:
        self._reader = reader
        self._findings = findings
        self._number: dict[tuple[SourceMaterial, NamedImage | None], int] = {}
        self._coords: dict[tuple[Any, ...], Floats] = {}
        self._colors: dict[tuple[Any, ...], Any] = {}

    @property
    def materials(self) -> tuple[SourceMaterial, ...]:
        return tuple(material for material, _ in self._number)

    @property
    def images(self) -> dict[int, NamedImage]:
        return {number: image for (_, image), number in self._number.items() if image is not None}

    def paint(
        self, prim: Any, shape: Shape, key: Any
    ) -> tuple[Ints, Floats, NDArray[np.uint8] | None]:
        """The (T,) materials, (T, 3, 2) coordinates and, if they have any, (T, 3, 3) colours of a
        mesh of this shape, whose ``key`` is the same for all of its instances."""
        two_sided = bool(UsdGeom.Gprim(prim).GetDoubleSidedAttr().Get(TIME))
        bound, face_surface = self._bound(prim, shape)
        which = face_surface[shape.face]
        material = np.zeros(len(which), dtype=np.int64)
        uv = np.zeros((len(which), 3, 2))
        colors: NDArray[np.uint8] | None = None
        for number, surface in enumerate(bound):
            faces = which == number
            if not faces.any():
                continue
            entry, image, painted = self._material(prim, shape, key, surface, two_sided)
            material[faces] = self._number.setdefault((entry, image), len(self._number))
            if image is not None:
                assert surface is not None
                uv[faces] = self._at(prim, shape, key, surface)[faces]
            if painted is not None:
                if colors is None:
                    colors = np.full((len(which), 3, 3), 255, dtype=np.uint8)
                colors[faces] = painted[faces]
        return material, uv, colors

    def _bound(self, prim: Any, shape: Shape) -> tuple[list[Surface | None], Ints]:
        """The surfaces of a mesh, and which of them each of its faces has."""
        binding = UsdShade.MaterialBindingAPI(prim)
        subsets = binding.GetMaterialBindSubsets()
        face_surface = np.zeros(shape.faces, dtype=np.int64)
        surfaces: list[Surface | None] = []
        prims = [prim, *(subset.GetPrim() for subset in subsets)]
        materials, full = (
            UsdShade.MaterialBindingAPI.ComputeBoundMaterials(prims, purpose)[0]
            for purpose in (UsdShade.Tokens.preview, UsdShade.Tokens.full)
        )
        for material, other in zip(materials, full, strict=True):
            bound = material or other
            surfaces.append(self._reader.read(bound) if bound else None)
        for number, subset in enumerate(subsets, start=1):
            index = array(subset.GetIndicesAttr().Get(TIME), np.int64)
            face_surface[index[(index >= 0) & (index < shape.faces)]] = number
        return surfaces, face_surface

    def _material(
        self, prim: Any, shape: Shape, key: Any, surface: Surface | None, two_sided: bool
    ) -> tuple[SourceMaterial, NamedImage | None, NDArray[np.uint8] | None]:
        """The material of a surface on this mesh, and the colours of its corners."""
        surface = surface or Surface("default")
        color, opacity, see_through = surface.color, surface.opacity, surface.see_through
        painted = None
        if surface.painted or (color is None and surface.image is None):
            color, painted = self._display(prim, shape, key, surface.painted or "displayColor")
            if not surface.painted:
                given, clear = self._clear(prim)
                opacity, see_through = opacity * given, see_through or clear
        return (
            SourceMaterial(
                name=surface.name,
                color=color,
                opacity=opacity,
                see_through=see_through,
                cutoff=surface.cutoff,
                two_sided=two_sided,
            ),
            surface.image,
            painted,
        )

    def _display(
        self, prim: Any, shape: Shape, key: Any, name: str
    ) -> tuple[Color | None, NDArray[np.uint8] | None]:
        """The colour of a mesh, or those of its corners, by a primvar."""
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
        if not primvar or not primvar.HasValue() or not primvar.Get(TIME):
            return None, None
        known = (key, key_of(primvar.GetAttr().GetPrim()), name)
        if known not in self._colors:
            values = at_corners(primvar, shape)
            place = str(prim.GetPath())
            found: Any = None, None
            if values is None or values.shape[2] != 3:
                self._findings.miss("PTM-N265", f"{name}: does not fit the mesh, ignored", place)
            elif primvar.GetInterpolation() == UsdGeom.Tokens.constant:
                self._findings.say("PTM-N226", f"{name}: colour factor converted to sRGB")
                found = tint(values[0, 0]), None
            else:
                self._findings.say("PTM-N226", f"{name}: colour factor converted to sRGB")
                found = (1.0, 1.0, 1.0), encoded(values)
            self._colors[known] = found
        found = self._colors[known]
        return found[0], found[1]

    def _clear(self, prim: Any) -> tuple[float, bool]:
        """The displayed opacity of a mesh, and whether it is not the same everywhere."""
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayOpacity")
        if not primvar or not primvar.HasValue():
            return 1.0, False
        values = np.clip(np.nan_to_num(array(primvar.Get(TIME), np.float64), nan=1.0), 0, 1)
        if not len(values):
            return 1.0, False
        if (values == values[0]).all():
            return float(values[0]), False
        place = str(prim.GetPath())
        self._findings.say("PTM-N215", "displayOpacity: ignored, the mesh never occludes", place)
        return 1.0, True

    def _at(self, prim: Any, shape: Shape, key: Any, surface: Surface) -> Floats:
        """(T, 3, 2) coordinates of a surface's image on this mesh."""
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(surface.coords)
        owner = key_of(primvar.GetAttr().GetPrim()) if primvar else None
        known = (key, owner, surface.coords, surface.matrix)
        if known not in self._coords:
            place = str(prim.GetPath())
            values = None
            if not surface.coords or not primvar or not primvar.HasValue():
                bare = f"faces of textured material {surface.name} have no texture coordinates"
                self._findings.say("PTM-N229", bare, place, len(shape.face))
            else:
                values = at_corners(primvar, shape)
                if values is None or values.shape[2] != 2:
                    what = f"{surface.coords}: does not fit the mesh, ignored"
                    self._findings.miss("PTM-N265", what, place)
                    values = None
            if values is None:
                values = np.zeros((len(shape.face), 3, 2))
            else:
                matrix = np.array(surface.matrix)
                with np.errstate(all="ignore"):
                    values = values @ matrix[:, :2].T + matrix[:, 2]
            self._coords[known] = values
        return self._coords[known]


def key_of(prim: Any) -> str:
    """The same for a prim in all instances of a prototype."""
    return str((prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath())
