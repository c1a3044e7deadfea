"""Materials of USD: what UsdPreviewSurface says of the colour and opacity of a surface.

Colours of USD are linear light and are converted to sRGB, as in glTF. Of networks
of shaders in other languages (MaterialX, MDL, OSL) nothing is read.

What the meshes of a USD stage are painted with: materials, texture coordinates and colours.

A mesh, and each subset of its faces, has a material by its own binding, that of a prim above it, or
that of a collection. Where none is read its displayed colour counts, as other programs show it."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Ar, Sdf, Usd, UsdGeom, UsdShade

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.colors import encoded, to_srgb
from ptmtools.scene.messages import NamedImage
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import SourceMaterial, SourceWrap
from ptmtools.scene.usd.layers import TIME
from ptmtools.scene.usd.mesh import Shape, array, at_corners

#: What UsdPreviewSurface has where nothing is said (its specification, "Core Nodes").
_DIFFUSE = (0.18, 0.18, 0.18)
_ONES, _ZEROS = (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0)
#: Where the library has its reader of packages, and where it had it in older releases.
_ARCHIVES = Sdf.ZipFile if hasattr(Sdf, "ZipFile") else Usd.ZipFile
_WRAPS: dict[str, SourceWrap] = {"repeat": "repeat", "clamp": "clamp", "mirror": "mirror"}
#: A network deeper than this goes round in a circle.
_DEEPEST = 32

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Surface:
    """What a material says.

    Attributes
    ----------
    color: sRGB; of an image white, and None where the material says nothing that is read.
    opacity, see_through, ignores_alpha, cutoff: see `ptmtools.scene.source.SourceMaterial`.
    image: as the stage names it.
    coords: the primvar with the image's coordinates, "" if there is none.
    matrix: (2, 3) by which they are transformed.
    painted: the primvar with the colours, "" if there is none.
    """

    name: str
    color: Color | None = None
    opacity: float = 1.0
    see_through: bool = False
    ignores_alpha: bool = False
    cutoff: float | None = None
    image: NamedImage | None = None
    coords: str = ""
    matrix: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    painted: str = ""


def tint(linear: Any) -> Color:
    """A colour of three numbers in sRGB."""
    r, g, b = to_srgb(np.array(linear, dtype=np.float64)).tolist()
    return r, g, b


class MaterialReader:
    """Reads each material once. ``model`` is the file, whose folder names are relative to."""

    def __init__(self, findings: Findings, model: Path) -> None:
        self._findings = findings
        self._model = model
        self._known: dict[Any, Surface] = {}

    def read(self, material: Any) -> Surface:
        """What a `UsdShade.Material` says."""
        prim = material.GetPrim()
        path = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath()
        if path not in self._known:
            self._known[path] = self._read(material)
        return self._known[path]

    def _read(self, material: Any) -> Surface:
        name, place = material.GetPrim().GetName(), str(material.GetPath())
        shader, *_ = material.ComputeSurfaceSource()
        if not shader or shader.GetIdAttr().Get(TIME) != "UsdPreviewSurface":
            self._findings.miss("PTM-N214", f"{name}: has no UsdPreviewSurface, not read", place)
            return Surface(name)
        opacity, see_through, from_image = self._opacity(shader, name, place)
        value, source, output = _followed(shader.GetInput("diffuseColor"))
        if source is None:
            color = tint(_numbers(value, _DIFFUSE))
            self._findings.note("PTM-N215", f"{name}: colour factor converted to sRGB", place)
            return Surface(name, color, opacity, see_through or from_image is not None)
        kind = str(source.GetIdAttr().Get(TIME))
        if kind.startswith("UsdPrimvarReader_float"):
            painted = str(_followed(source.GetInput("varname"))[0] or "")
            see_through |= from_image is not None
            return Surface(name, (1.0, 1.0, 1.0), opacity, see_through, painted=painted)
        if kind != "UsdUVTexture":
            self._findings.miss("PTM-N214", f"{name}: colours of {kind} are not read", place)
            return Surface(name, None, opacity, see_through or from_image is not None)
        file = _followed(source.GetInput("file"))[0]
        if from_image is not None and from_image != (_path_of(file), "a"):
            what = f"{name}: its opacity is an image of its own"
            self._findings.note(
                "PTM-N215", f"{what}, which makes it transparent and is not written", place
            )
            see_through = True
        if output not in ("rgb", "rgba"):
            self._findings.note("PTM-N215", f"{name}: ignored that its colour is {output}", place)
        image = self._image(source, file, name, place)
        if image is None:
            return Surface(name, None, opacity, see_through)
        coords, matrix = self._coords(source, name, place)
        turned = tuple((float(a), float(b), float(c)) for a, b, c in matrix.tolist())
        white = (1.0, 1.0, 1.0)
        own_alpha = from_image == (_path_of(file), "a")
        cutoff = _threshold(shader) if own_alpha else 0.0
        return Surface(
            name,
            white,
            opacity,
            see_through,
            ignores_alpha=not own_alpha,
            cutoff=cutoff or None,
            image=image,
            coords=coords,
            matrix=turned,
        )

    def _opacity(self, shader: Any, name: str, place: str) -> tuple[float, bool, Any]:
        """The opacity; whether it is not the same everywhere, other than by an image; and of an
        image the path and the output."""
        threshold = _threshold(shader)
        value, source, output = _followed(shader.GetInput("opacity"))
        if source is None:
            opacity = min(max(_number(value, 1.0), 0.0), 1.0)
            if threshold > 0:  # a mask: there, or not
                opacity = float(opacity >= threshold)
            return opacity, False, None
        if source.GetIdAttr().Get(TIME) == "UsdUVTexture":
            return 1.0, threshold > 0, (_path_of(_followed(source.GetInput("file"))[0]), output)
        self._findings.note("PTM-N215", f"{name}: ignored its opacity, it never occludes", place)
        return 1.0, True, None

    def _image(self, texture: Any, file: Any, name: str, place: str) -> NamedImage | None:
        path = _path_of(file)
        if not path:
            self._findings.miss("PTM-N204", f"{name}: its texture names no image", place)
            return None
        if "<UDIM>" in path:
            self._findings.miss("PTM-N214", f"{path}: tiles of UDIM are not carried over", place)
            return None
        scale = _numbers(_followed(texture.GetInput("scale"))[0], _ONES)
        bias = _numbers(_followed(texture.GetInput("bias"))[0], _ZEROS)
        if scale != _ONES or bias != _ZEROS:
            self._findings.note("PTM-N215", f"{path}: ignored scale and bias", place)
        wrap_s, wrap_t = (self._wrap(texture, key, path, place) for key in ("wrapS", "wrapT"))
        return self._named(file, place, wrap_s, wrap_t)

    def _named(
        self, file: Any, place: str, wrap_s: SourceWrap, wrap_t: SourceWrap
    ) -> NamedImage | None:
        """An image by its name relative to the model's folder, or in a package."""
        found = file.resolvedPath
        if not found:
            return NamedImage(file.path, place, wrap_s, wrap_t)
        folder = self._findings.folder.root
        if not Ar.IsPackageRelativePath(found):
            name = Path(os.path.relpath(found, folder)).as_posix()
            return NamedImage(name, place, wrap_s, wrap_t)
        package, inner = Ar.SplitPackageRelativePathOuter(found)
        offset, length = 0, None
        whole, rest = package, inner
        while rest:
            entry, deeper = rest, ""
            if Ar.IsPackageRelativePath(rest):
                entry, deeper = Ar.SplitPackageRelativePathOuter(rest)
            archive = _ARCHIVES.Open(whole)
            info = archive.GetFileInfo(entry) if archive else None
            if info is None or info.compressionMethod or info.encrypted:
                self._findings.miss(
                    "PTM-N206", f"{inner}: compressed, or not in its package", place
                )
                return None
            offset, length = offset + info.dataOffset, info.size
            whole, rest = Ar.JoinPackageRelativePath([whole, entry]), deeper
        beside = "" if Path(package) == self._model else os.path.relpath(package, folder)
        return NamedImage(
            inner, place, wrap_s, wrap_t, offset, length, Path(beside).as_posix() if beside else ""
        )

    def _wrap(self, texture: Any, key: str, path: str, place: str) -> SourceWrap:
        mode = str(_followed(texture.GetInput(key))[0] or "useMetadata")
        if mode not in _WRAPS:  # without metadata it is black, too
            self._findings.note("PTM-N215", f"{path}: black beyond its edge becomes clamp", place)
        return _WRAPS.get(mode, "clamp")

    def _coords(self, texture: Any, name: str, place: str) -> tuple[str, Floats]:
        """The primvar that a texture's coordinates come from, and how they are transformed."""
        matrix, moved = np.eye(3), False
        source = _followed(texture.GetInput("st"))[1]
        for _ in range(_DEEPEST):
            if source is None or source.GetIdAttr().Get(TIME) != "UsdTransform2d":
                break
            matrix, moved = matrix @ _transform(source), True
            source = _followed(source.GetInput("in"))[1]
        if moved:
            self._findings.note(
                "PTM-N215", f"{name}: UsdTransform2d is baked into its faces", place
            )
        if source is None or source.GetIdAttr().Get(TIME) != "UsdPrimvarReader_float2":
            return "", matrix[:2]
        return str(_followed(source.GetInput("varname"))[0] or ""), matrix[:2]


def _threshold(shader: Any) -> float:
    """Texels of less opacity are not drawn; 0 where they are blended."""
    return _number(_followed(shader.GetInput("opacityThreshold"))[0], 0.0)


def _followed(given: Any) -> tuple[Any, Any, str]:
    """What an input of a shader comes to: a value, or a shader and its output."""
    if not given:
        return None, None, ""
    for attribute in given.GetValueProducingAttributes():
        if UsdShade.Output.IsOutput(attribute):
            shader = UsdShade.Shader(attribute.GetPrim())
            return None, shader, str(UsdShade.Output(attribute).GetBaseName())
        return attribute.Get(TIME), None, ""
    return None, None, ""


def _number(value: Any, otherwise: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return otherwise
    return number if math.isfinite(number) else otherwise


def _numbers(value: Any, otherwise: tuple[float, ...]) -> tuple[float, ...]:
    """As many numbers as there are otherwise; what is of another type says nothing."""
    try:
        numbers = tuple(float(each) for each in value)
    except (TypeError, ValueError):
        return otherwise
    return numbers if len(numbers) == len(otherwise) else otherwise


def _path_of(file: Any) -> str:
    return str(file.path) if isinstance(file, Sdf.AssetPath) else ""


def _transform(shader: Any) -> Floats:
    """(3, 3) of UsdTransform2d: scale, then rotation, counter-clockwise, then translation."""
    angle = math.radians(_number(_followed(shader.GetInput("rotation"))[0], 0.0))
    c, s = math.cos(angle), math.sin(angle)
    sx, sy = _numbers(_followed(shader.GetInput("scale"))[0], (1.0, 1.0))
    tx, ty = _numbers(_followed(shader.GetInput("translation"))[0], (0.0, 0.0))
    return np.array([[c * sx, -s * sy, tx], [s * sx, c * sy, ty], [0.0, 0.0, 1.0]])


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
                ignores_alpha=surface.ignores_alpha,
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
                self._findings.miss("PTM-N214", f"{name}: does not fit the mesh, ignored", place)
            elif primvar.GetInterpolation() == UsdGeom.Tokens.constant:
                self._findings.note("PTM-N215", f"{name}: colour factor converted to sRGB")
                found = tint(values[0, 0]), None
            else:
                self._findings.note("PTM-N215", f"{name}: colour factor converted to sRGB")
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
        self._findings.note("PTM-N215", "displayOpacity: ignored, the mesh never occludes", place)
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
                self._findings.note("PTM-N229", bare, place, len(shape.face))
            else:
                values = at_corners(primvar, shape)
                if values is None or values.shape[2] != 2:
                    what = f"{surface.coords}: does not fit the mesh, ignored"
                    self._findings.miss("PTM-N214", what, place)
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
