"""Materials of USD: what UsdPreviewSurface says of the colour and opacity of a surface.

Colours of USD are linear light and are converted to sRGB, as in glTF. Of networks
of shaders in other languages (MaterialX, MDL, OSL) nothing is read.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf, Usd, UsdShade

from ptmtools.arrays import Floats
from ptmtools.scene.colors import to_srgb
from ptmtools.scene.handed import NamedImage
from ptmtools.scene.source import Findings, SourceWrap
from ptmtools.scene.usd.layers import TIME

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
    opacity, see_through, cutoff: see `ptmtools.scene.source.SourceMaterial`.
    image: as the stage names it.
    coords: the primvar with the image's coordinates, "" if there is none.
    matrix: (2, 3) by which they are transformed.
    painted: the primvar with the colours, "" if there is none.
    """

    name: str
    color: Color | None = None
    opacity: float = 1.0
    see_through: bool = False
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
            self._findings.miss("PTM-N263", f"{name}: has no UsdPreviewSurface, not read", place)
            return Surface(name)
        opacity, see_through, from_image = self._opacity(shader, name, place)
        value, source, output = _followed(shader.GetInput("diffuseColor"))
        if source is None:
            color = tint(_numbers(value, _DIFFUSE))
            self._findings.say("PTM-N226", f"{name}: colour factor converted to sRGB", place)
            return Surface(name, color, opacity, see_through or from_image is not None)
        kind = str(source.GetIdAttr().Get(TIME))
        if kind.startswith("UsdPrimvarReader_float"):
            painted = str(_followed(source.GetInput("varname"))[0] or "")
            see_through |= from_image is not None
            return Surface(name, (1.0, 1.0, 1.0), opacity, see_through, painted=painted)
        if kind != "UsdUVTexture":
            self._findings.miss("PTM-N263", f"{name}: colours of {kind} are not read", place)
            return Surface(name, None, opacity, see_through or from_image is not None)
        file = _followed(source.GetInput("file"))[0]
        if from_image is not None and from_image != (_path_of(file), "a"):
            what = f"{name}: its opacity is an image of its own"
            self._findings.say(
                "PTM-N217", f"{what}, which makes it transparent and is not written", place
            )
            see_through = True
        if output not in ("rgb", "rgba"):
            self._findings.say("PTM-N215", f"{name}: ignored that its colour is {output}", place)
        image = self._image(source, file, name, place)
        if image is None:
            return Surface(name, None, opacity, see_through)
        coords, matrix = self._coords(source, name, place)
        turned = tuple((float(a), float(b), float(c)) for a, b, c in matrix.tolist())
        white = (1.0, 1.0, 1.0)
        cutoff = _threshold(shader) if from_image == (_path_of(file), "a") else 0.0
        return Surface(name, white, opacity, see_through, cutoff or None, image, coords, turned)

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
        self._findings.say("PTM-N215", f"{name}: ignored its opacity, it never occludes", place)
        return 1.0, True, None

    def _image(self, texture: Any, file: Any, name: str, place: str) -> NamedImage | None:
        path = _path_of(file)
        if not path:
            self._findings.miss("PTM-N204", f"{name}: its texture names no image", place)
            return None
        if "<UDIM>" in path:
            self._findings.miss("PTM-N264", f"{path}: tiles of UDIM are not carried over", place)
            return None
        scale = _numbers(_followed(texture.GetInput("scale"))[0], _ONES)
        bias = _numbers(_followed(texture.GetInput("bias"))[0], _ZEROS)
        if scale != _ONES or bias != _ZEROS:
            self._findings.say("PTM-N215", f"{path}: ignored scale and bias", place)
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
            self._findings.say("PTM-N222", f"{path}: black beyond its edge becomes clamp", place)
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
            self._findings.say("PTM-N216", f"{name}: UsdTransform2d is baked into its faces", place)
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
