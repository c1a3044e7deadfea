"""Reads materials of USD (UsdPreviewSurface), and assigns materials, coordinates and colours to
meshes.

Colours of USD are linear light and are converted to sRGB, as in glTF. Networks of shaders in other
languages (MaterialX, MDL, OSL) are not supported. The material of a mesh, or of a subset of its
faces, follows from its own binding, that of a parent, or that of a collection. Without a supported
material the displayed colour is used, as in other programs.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Ar, Sdf, Usd, UsdGeom, UsdShade

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.colors import encode_srgb, to_srgb
from ptmtools.scene.messages import ROLES, Images, NamedImage
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import DARK, SourceMaterial, SourceWrap
from ptmtools.scene.usd.layers import TIME
from ptmtools.scene.usd.mesh import UsdMesh, array, at_corners

#: Defaults of UsdPreviewSurface (its specification, "Core Nodes").
_DIFFUSE, _ROUGHNESS = (0.18, 0.18, 0.18), 0.5
_ONES, _ZEROS, _WHITE = (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
_IMAGE = "UsdUVTexture"
#: The reader of packages, which older releases have in another module.
_ARCHIVES = Sdf.ZipFile if hasattr(Sdf, "ZipFile") else Usd.ZipFile
_WRAPS: dict[str, SourceWrap] = {"repeat": "repeat", "clamp": "clamp", "mirror": "mirror"}
#: Largest depth of a network, which is circular in a damaged file.
_DEEPEST = 32

Color = tuple[float, float, float]


@dataclass(frozen=True)
class UsdSurface:
    """The supported properties of a material.

    Attributes
    ----------
    material: its colour is white with an image, None without a supported colour.
    image: the image of its colour.
    coords: the primvar with the coordinates of the image, or of the image of emission if that may
        be shown; "" without one.
    matrix: (2, 3) transformation of the coordinates.
    colors: the primvar with the colours, "" without one.
    glow_map: the image of its emission.
    """

    material: SourceMaterial
    image: NamedImage | None = None
    coords: str = ""
    matrix: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    colors: str = ""
    glow_map: NamedImage | None = None


def tint(linear: Any) -> Color:
    """A colour of three numbers in sRGB."""
    r, g, b = to_srgb(np.array(linear, dtype=np.float64)).tolist()
    return r, g, b


def _matter(shader: Any, name: str, place: str, notes: IngestNotes) -> dict[str, Any]:
    """Metallic and roughness of a shader, as the fields of a `SourceMaterial`; images have no
    effect."""
    fields: dict[str, Any] = {}
    for key, default in (("metallic", 0.0), ("roughness", _ROUGHNESS)):
        value, source, _ = _resolve(shader.GetInput(key))
        if source is not None:
            notes.note("PTM-N215", f"{name}: image of {key} ignored", place)
        fields[key] = _number(value, default)
    if _number(_resolve(shader.GetInput("useSpecularWorkflow"))[0], 0.0):
        fields["metallic"] = 0.0
    return fields


class UsdMaterialReader:
    """Reads each material of the file ``model`` once."""

    def __init__(self, notes: IngestNotes, model: Path) -> None:
        self._notes = notes
        self._model = model
        self._surfaces: dict[str, UsdSurface] = {}

    def read(self, material: Any) -> UsdSurface:
        """The surface of a `UsdShade.Material`."""
        key = key_of(material.GetPrim())
        if key not in self._surfaces:
            self._surfaces[key] = self._read(material)
        return self._surfaces[key]

    def _read(self, material: Any) -> UsdSurface:
        name, place = material.GetPrim().GetName(), str(material.GetPath())
        shader, *_ = material.ComputeSurfaceSource()
        if not shader or _kind(shader) != "UsdPreviewSurface":
            self._notes.miss("PTM-N214", f"{name}: no UsdPreviewSurface, ignored", place)
            return UsdSurface(SourceMaterial(name))
        opacity, varies, from_image = self._opacity(shader, name, place)
        see_through = varies or from_image is not None
        matter = _matter(shader, name, place, self._notes)
        glow, glow_map, emitter = self._glow(shader, name, place)
        plain = SourceMaterial(name, opacity=opacity, see_through=see_through, glow=glow, **matter)
        surface = UsdSurface(plain, glow_map=glow_map)
        value, source, output = _resolve(shader.GetInput("diffuseColor"))
        if source is None:
            self._notes.note("PTM-N215", f"{name}: colour factor converted to sRGB", place)
            color = tint(_numbers(value, _DIFFUSE))
            surface = replace(surface, material=replace(plain, color=color))
            if glow_map is None or max(color) > DARK:
                return surface
            coords, matrix = self._coords(emitter, name, place)
            return replace(surface, coords=coords, matrix=matrix)
        kind = _kind(source)
        if kind.startswith("UsdPrimvarReader_float"):
            colors = str(_resolve(source.GetInput("varname"))[0] or "")
            return replace(surface, material=replace(plain, color=_WHITE), colors=colors)
        if kind != _IMAGE:
            self._notes.miss("PTM-N214", f"{name}: colours of {kind} ignored", place)
            return surface
        file = _resolve(source.GetInput("file"))[0]
        own_alpha = from_image == (_path_of(file), "a")
        if own_alpha:
            plain = replace(plain, see_through=varies)
        elif from_image is not None:
            message = f"{name}: image of opacities ignored, the material is transparent"
            self._notes.note("PTM-N215", message, place)
        if output not in ("rgb", "rgba"):
            self._notes.note("PTM-N215", f"{name}: colour output {output} ignored", place)
        image = self._image(source, file, name, place)
        if image is None:
            return replace(surface, material=plain)
        cutoff = _threshold(shader) if own_alpha else 0.0
        material = replace(plain, color=_WHITE, ignores_alpha=not own_alpha, cutoff=cutoff or None)
        return UsdSurface(material, image, *self._coords(source, name, place), glow_map=glow_map)

    def _glow(self, shader: Any, name: str, place: str) -> tuple[Color, NamedImage | None, Any]:
        """The linear radiance that a shader emits, a factor of an image if there is one, and the
        shader of that."""
        value, source, _ = _resolve(shader.GetInput("emissiveColor"))
        image = None
        if source is not None and _kind(source) == _IMAGE:
            with self._notes.optional():
                file = _resolve(source.GetInput("file"))[0]
                image = self._image(source, file, name, place, scaled=True)
            if image is not None:
                value = _numbers(_resolve(source.GetInput("scale"))[0], _ONES)[:3]
        elif source is not None:
            self._notes.note("PTM-N215", f"{name}: emission of {_kind(source)} ignored", place)
        red, green, blue = (max(0.0, part) for part in _numbers(value, _ZEROS[:3]))
        return (red, green, blue), image, source

    def _opacity(self, shader: Any, name: str, place: str) -> tuple[float, bool, Any]:
        """The opacity; whether it varies or is tested, other than by the colour's image; and the
        path and output of an image of opacities."""
        threshold = _threshold(shader)
        value, source, output = _resolve(shader.GetInput("opacity"))
        if source is None:
            opacity = min(max(_number(value, 1.0), 0.0), 1.0)
            if threshold > 0:  # alpha testing
                opacity = float(opacity >= threshold)
            return opacity, False, None
        if _kind(source) == _IMAGE:
            return 1.0, threshold > 0, (_path_of(_resolve(source.GetInput("file"))[0]), output)
        message = f"{name}: opacity ignored, the material is transparent"
        self._notes.note("PTM-N215", message, place)
        return 1.0, True, None

    def _image(
        self, texture: Any, file: Any, name: str, place: str, *, scaled: bool = False
    ) -> NamedImage | None:
        """The image of a texture; ``scaled``: whether the caller applies its scale."""
        path = _path_of(file)
        if not path:
            self._notes.miss("PTM-N204", f"{name}: texture without an image", place)
            return None
        if "<UDIM>" in path:
            self._notes.miss("PTM-N214", f"{path}: UDIM tiles ignored", place)
            return None
        scale = _ONES if scaled else _numbers(_resolve(texture.GetInput("scale"))[0], _ONES)
        bias = _numbers(_resolve(texture.GetInput("bias"))[0], _ZEROS)
        if scale != _ONES or bias != _ZEROS:
            what = "bias" if scaled else "scale and bias"
            self._notes.note("PTM-N215", f"{path}: {what} ignored", place)
        wrap_s, wrap_t = (self._wrap(texture, key, path, place) for key in ("wrapS", "wrapT"))
        return self._named_image(file, place, wrap_s, wrap_t)

    def _named_image(
        self, file: Any, place: str, wrap_s: SourceWrap, wrap_t: SourceWrap
    ) -> NamedImage | None:
        """An image of a separate file, relative to the model's folder, or of a package."""
        resolved = file.resolvedPath
        if not resolved:
            return NamedImage(file.path, place, wrap_s, wrap_t)
        folder = self._notes.folder.root
        if not Ar.IsPackageRelativePath(resolved):
            name = Path(os.path.relpath(resolved, folder)).as_posix()
            return NamedImage(name, place, wrap_s, wrap_t)
        package, inner = Ar.SplitPackageRelativePathOuter(resolved)
        offset, length = 0, None
        container, rest = package, inner
        while rest:
            entry, nested = rest, ""
            if Ar.IsPackageRelativePath(rest):
                entry, nested = Ar.SplitPackageRelativePathOuter(rest)
            archive = _ARCHIVES.Open(container)
            info = archive.GetFileInfo(entry) if archive else None
            if info is None or info.compressionMethod or info.encrypted:
                message = f"{inner}: compressed, or missing in its package"
                self._notes.miss("PTM-N206", message, place)
                return None
            offset, length = offset + info.dataOffset, info.size
            container, rest = Ar.JoinPackageRelativePath([container, entry]), nested
        outer = ""
        if Path(package) != self._model:
            outer = Path(os.path.relpath(package, folder)).as_posix()
        return NamedImage(inner, place, wrap_s, wrap_t, offset, length, outer)

    def _wrap(self, texture: Any, key: str, path: str, place: str) -> SourceWrap:
        mode = str(_resolve(texture.GetInput(key))[0] or "useMetadata")
        if mode not in _WRAPS:  # useMetadata without metadata is black, too
            self._notes.note("PTM-N215", f"{path}: wrap mode black becomes clamp", place)
        return _WRAPS.get(mode, "clamp")

    def _coords(
        self, texture: Any, name: str, place: str
    ) -> tuple[str, tuple[tuple[float, float, float], ...]]:
        """The primvar with a texture's coordinates, and their (2, 3) transformation."""
        matrix, transformed = np.eye(3), False
        source = _resolve(texture.GetInput("st"))[1]
        for _ in range(_DEEPEST):
            if source is None or _kind(source) != "UsdTransform2d":
                break
            matrix, transformed = matrix @ _transform(source), True
            source = _resolve(source.GetInput("in"))[1]
        if transformed:
            self._notes.note("PTM-N215", f"{name}: UsdTransform2d baked into its faces", place)
        coords = ""
        if source is not None and _kind(source) == "UsdPrimvarReader_float2":
            coords = str(_resolve(source.GetInput("varname"))[0] or "")
        return coords, tuple((a, b, c) for a, b, c in matrix[:2].tolist())


def _kind(shader: Any) -> str:
    """The type of a node."""
    return str(shader.GetIdAttr().Get(TIME))


def _threshold(shader: Any) -> float:
    """The opacity below which texels are not drawn; 0 if they are blended."""
    return _number(_resolve(shader.GetInput("opacityThreshold"))[0], 0.0)


def _resolve(source: Any) -> tuple[Any, Any, str]:
    """The value of an input of a shader, or the shader and output that it is connected to."""
    if not source:
        return None, None, ""
    for attribute in source.GetValueProducingAttributes():
        if UsdShade.Output.IsOutput(attribute):
            shader = UsdShade.Shader(attribute.GetPrim())
            return None, shader, str(UsdShade.Output(attribute).GetBaseName())
        return attribute.Get(TIME), None, ""
    return None, None, ""


def _number(value: Any, default: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return default
    return number if math.isfinite(number) else default


def _numbers(value: Any, default: tuple[float, ...]) -> tuple[float, ...]:
    """The finite numbers of a value, or the default if these differ in type or count."""
    try:
        numbers = tuple(map(float, value))
    except (TypeError, ValueError):
        return default
    finite = all(map(math.isfinite, numbers))
    return numbers if finite and len(numbers) == len(default) else default


def _path_of(file: Any) -> str:
    return str(file.path) if isinstance(file, Sdf.AssetPath) else ""


def _transform(shader: Any) -> Floats:
    """(3, 3) of UsdTransform2d: scale, then rotation, counter-clockwise, then translation."""
    angle = math.radians(_number(_resolve(shader.GetInput("rotation"))[0], 0.0))
    c, s = math.cos(angle), math.sin(angle)
    sx, sy = _numbers(_resolve(shader.GetInput("scale"))[0], (1.0, 1.0))
    tx, ty = _numbers(_resolve(shader.GetInput("translation"))[0], (0.0, 0.0))
    return np.array([[c * sx, -s * sy, tx], [s * sx, c * sy, ty], [0.0, 0.0, 1.0]])


class UsdPainter:
    """Assigns materials to meshes; each combination of material, sides and colour is one."""

    def __init__(self, reader: UsdMaterialReader, notes: IngestNotes) -> None:
        self._reader = reader
        self._notes = notes
        self._number: dict[tuple[SourceMaterial, NamedImage | None, NamedImage | None], int] = {}
        self._coords: dict[tuple[Any, ...], Floats] = {}
        self._colors: dict[tuple[Any, ...], tuple[Color | None, NDArray[np.uint8] | None]] = {}

    @property
    def materials(self) -> tuple[SourceMaterial, ...]:
        return tuple(material for material, *_ in self._number)

    @property
    def images(self) -> Images:
        numbers = self._number.items()
        return {
            name: {n: image for (_, *images), n in numbers if (image := images[k]) is not None}
            for k, name in enumerate(ROLES)
        }

    def paint(
        self, prim: Any, shape: UsdMesh, key: Any
    ) -> tuple[Ints, Floats, NDArray[np.uint8] | None]:
        """The (T,) materials, (T, 3, 2) coordinates and, if there are any, (T, 3, 3) colours of a
        mesh, whose ``key`` is that of all its instances (`key_of`)."""
        two_sided = bool(UsdGeom.Gprim(prim).GetDoubleSidedAttr().Get(TIME))
        surfaces, face_surface = self._bind(prim, shape)
        index = face_surface[shape.face]
        material = np.zeros(len(index), dtype=np.int64)
        uv = np.zeros((len(index), 3, 2))
        colors: NDArray[np.uint8] | None = None
        for number, surface in enumerate(surfaces):
            faces = index == number
            if not faces.any():
                continue
            surface = surface or UsdSurface(SourceMaterial("default"))
            entry, corners = self._material(prim, shape, key, surface, two_sided)
            use = entry, surface.image, surface.glow_map
            material[faces] = self._number.setdefault(use, len(self._number))
            if surface.image is not None:
                uv[faces] = self._coordinates(prim, shape, key, surface)[faces]
            elif surface.coords:
                # Of an image of emission: lights are optional.
                with self._notes.optional():
                    uv[faces] = self._coordinates(prim, shape, key, surface)[faces]
            if corners is not None:
                if colors is None:
                    colors = np.full((len(index), 3, 3), 255, dtype=np.uint8)
                colors[faces] = corners[faces]
        return material, uv, colors

    def _bind(self, prim: Any, shape: UsdMesh) -> tuple[list[UsdSurface | None], Ints]:
        """The surfaces of a mesh, and (F,) the surface of each of its faces."""
        binding = UsdShade.MaterialBindingAPI(prim)
        subsets = binding.GetMaterialBindSubsets()
        face_surface = np.zeros(shape.faces, dtype=np.int64)
        surfaces: list[UsdSurface | None] = []
        prims = [prim, *(subset.GetPrim() for subset in subsets)]
        materials, full = (
            UsdShade.MaterialBindingAPI.ComputeBoundMaterials(prims, purpose)[0]
            for purpose in (UsdShade.Tokens.preview, UsdShade.Tokens.full)
        )
        for material, fallback in zip(materials, full, strict=True):
            bound = material or fallback
            surfaces.append(self._reader.read(bound) if bound else None)
        for number, subset in enumerate(subsets, start=1):
            index = array(subset.GetIndicesAttr().Get(TIME), np.int64)
            face_surface[index[(index >= 0) & (index < shape.faces)]] = number
        return surfaces, face_surface

    def _material(
        self, prim: Any, shape: UsdMesh, key: Any, surface: UsdSurface, two_sided: bool
    ) -> tuple[SourceMaterial, NDArray[np.uint8] | None]:
        """The material of a surface on this mesh, and the colours of its corners."""
        material, corners = replace(surface.material, two_sided=two_sided), None
        if surface.colors or (material.color is None and surface.image is None):
            color, corners = self._display(prim, shape, key, surface.colors or "displayColor")
            material = replace(material, color=color)
            if not surface.colors:
                displayed, varies = self._display_opacity(prim)
                material = replace(
                    material,
                    opacity=material.opacity * displayed,
                    see_through=material.see_through or varies,
                )
        return material, corners

    def _display(
        self, prim: Any, shape: UsdMesh, key: Any, name: str
    ) -> tuple[Color | None, NDArray[np.uint8] | None]:
        """The colour of a mesh, and the colours of its corners, from a primvar."""
        primvar = _primvar(prim, name)
        if not primvar or not primvar.Get(TIME):
            return None, None
        cached = (key, key_of(primvar.GetAttr().GetPrim()), name)
        if cached not in self._colors:
            values = self._at_corners(primvar, name, 3, prim, shape)
            colors: tuple[Color | None, NDArray[np.uint8] | None] = None, None
            if values is not None:
                self._notes.note("PTM-N215", f"{name}: colour factor converted to sRGB")
                constant = primvar.GetInterpolation() == UsdGeom.Tokens.constant
                colors = (tint(values[0, 0]), None) if constant else (_WHITE, encode_srgb(values))
            self._colors[cached] = colors
        return self._colors[cached]

    def _display_opacity(self, prim: Any) -> tuple[float, bool]:
        """The displayed opacity of a mesh, and whether it varies."""
        primvar = _primvar(prim, "displayOpacity")
        stored = array(primvar.Get(TIME) if primvar else None, np.float64)
        values = np.clip(np.nan_to_num(stored, nan=1.0), 0, 1)
        if not len(values):
            return 1.0, False
        if (values == values[0]).all():
            return float(values[0]), False
        message = "varying displayOpacity ignored, the mesh is transparent"
        self._notes.note("PTM-N215", message, str(prim.GetPath()))
        return 1.0, True

    def _coordinates(self, prim: Any, shape: UsdMesh, key: Any, surface: UsdSurface) -> Floats:
        """(T, 3, 2) coordinates of a surface's image on a mesh."""
        primvar = _primvar(prim, surface.coords)
        owner = key_of(primvar.GetAttr().GetPrim()) if primvar else None
        cached = (key, owner, surface.coords, surface.matrix)
        if cached not in self._coords:
            values = None
            if primvar is None:
                name = surface.material.name
                bare = f"faces of textured material {name} have no texture coordinates"
                self._notes.note("PTM-N229", bare, str(prim.GetPath()), len(shape.face))
            else:
                values = self._at_corners(primvar, surface.coords, 2, prim, shape)
            if values is None:
                values = np.zeros((len(shape.face), 3, 2))
            else:
                matrix = np.array(surface.matrix)
                with np.errstate(all="ignore"):
                    values = values @ matrix[:, :2].T + matrix[:, 2]
            self._coords[cached] = values
        return self._coords[cached]

    def _at_corners(
        self, primvar: Any, name: str, size: int, prim: Any, shape: UsdMesh
    ) -> Floats | None:
        """(T, 3, size) values of a primvar; None, and a miss, if they do not match the mesh."""
        values = at_corners(primvar, shape)
        if values is None or values.shape[2] != size:
            message = f"{name}: does not match the mesh, ignored"
            self._notes.miss("PTM-N214", message, str(prim.GetPath()))
            return None
        return values


def _primvar(prim: Any, name: str) -> Any | None:
    """A primvar of a prim or its parents; None if it has no value."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name) if name else None
    return primvar if primvar and primvar.HasValue() else None


def key_of(prim: Any) -> str:
    """A key of a prim that is equal in all instances of a prototype."""
    return str((prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath())
