"""The output of a reader: triangles, materials and textures in the units and axes of the file.

`MeshArrays` collects the triangles mesh by mesh, with all instances of each mesh.

A reader resolves the names of textures to files but opens no image: only the cleaning of the faces
(`faces`) shows which images some face uses.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.files import open_regular
from ptmtools.scene.faces import keep_faces
from ptmtools.scene.lights import Lamp, Radiance
from ptmtools.scene.model import Camera, Kind, Note, RoomVolume, Shine, Storey, Wrap

SourceWrap = Literal[Wrap, "mirror"]


def decode(raw: bytes) -> str:
    """The text of a model file: UTF-8 with or without a byte order mark, otherwise Latin-1."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


@dataclass(frozen=True)
class FileRange:
    """Reads a file from ``offset``: ``length`` bytes, or to its end."""

    path: Path
    offset: int = 0
    length: int | None = None

    def __call__(self) -> bytes:
        with open_regular(self.path) as stream:
            stream.seek(self.offset)
            return stream.read() if self.length is None else stream.read(self.length)

    def size(self) -> int:
        """The size of the range in bytes, without reading it. Raises OSError."""
        rest = max(0, os.stat(self.path).st_size - self.offset)
        return rest if self.length is None else min(rest, self.length)


@dataclass(frozen=True)
class HeldBytes:
    """Bytes without a file of their own (a data URI)."""

    data: bytes

    def __call__(self) -> bytes:
        return self.data


@dataclass(frozen=True)
class SourceTexture:
    """A reference of a material to an image.

    Attributes
    ----------
    read: returns the bytes of the image file.
    label: the emitted file is named after it.
    what: the reference as written in the model ("map_Kd bricks.png"), for notes.
    place: location of the reference ("museum.mtl:12").
    wrap_s, wrap_t: wrap modes beyond [0, 1]; "mirror" mirrors every second repetition.
    channel: the channel that contains the values of a mask: "m" (matte), "l" (luminance), "r",
        "g", "b", or "": matte if the image has one, otherwise luminance.
    strength: weight in [0, 1] (glTF's occlusionTexture).
    """

    read: Callable[[], bytes]
    label: str
    what: str
    place: str
    wrap_s: SourceWrap = "repeat"
    wrap_t: SourceWrap = "repeat"
    channel: str = ""
    strength: float = 1.0


@dataclass(frozen=True)
class NormalTexture:
    """A reference of a material to its normal map.

    Attributes
    ----------
    texture: its image, or that of heights.
    scale: factor of x and y of the normals; of heights, see `height`.
    height: whether the image holds heights if it is grey (``bump`` of OBJ).
    own: whether its coordinates are those of `ModelSource.normal_uv`.
    """

    texture: SourceTexture
    scale: float = 1.0
    height: bool = False
    own: bool = False


#: A material whose colour, sRGB, has no greater part than this shows nothing but its emission.
DARK = 0.15


@dataclass(frozen=True)
class SourceMaterial:
    """A material of the model.

    Attributes
    ----------
    color: tint in [0, 1], sRGB; None if the model defines none.
    opacity: in [0, 1].
    see_through: the material transmits light, or blends what its texture does not tell.
    ignores_alpha: the alpha of its texture has no effect, by the mode of the material (glTF, USD).
    cutoff: alpha testing: texels of less alpha are not drawn, all others are opaque; None if
        texels are blended.
    two_sided: whether both sides of its faces are drawn.
    texture, mask: colours, and a separate image of opacities (``map_d``).
    shine: its reflection map.
    normal: its normal map.
    unlit: the texture shows as it is, and contains its light (KHR_materials_unlit).
    glow, glow_map: linear radiance that it emits, a factor of the mean of the image if it has one.
    transmits: the share of light that passes, in its colour (KHR_materials_transmission).
    metallic, roughness: as in glTF, factors of the means of their images.
    metallic_map, roughness_map, gloss_map: images, of which `SourceTexture.channel` counts, or red;
        "m" is alpha. That of gloss multiplies 1 - roughness.
    """

    name: str
    color: tuple[float, float, float] | None = None
    opacity: float = 1.0
    see_through: bool = False
    ignores_alpha: bool = False
    cutoff: float | None = None
    two_sided: bool = True
    texture: SourceTexture | None = None
    mask: SourceTexture | None = None
    shine: Shine | None = None
    normal: NormalTexture | None = None
    unlit: bool = False
    glow: Radiance = (0.0, 0.0, 0.0)
    glow_map: SourceTexture | None = None
    transmits: float = 0.0
    metallic: float = 0.0
    roughness: float = 1.0
    metallic_map: SourceTexture | None = None
    roughness_map: SourceTexture | None = None
    gloss_map: SourceTexture | None = None


@dataclass(frozen=True)
class ModelSource:
    """Triangles in the units and axes of the file.

    Fields that a format does not define keep their defaults.

    Attributes
    ----------
    points: (P, 3) float64, may be non-finite, unused or repeated.
    triangles: (T, 3) int64 into `points`, in the order of the file.
    uv: (T, 3, 2) float64 per corner, origin at the lower left of the image.
    triangle_object, triangle_material: (T,) int64.
    objects, materials, cameras: see `ptmtools.scene.model`; cameras in the space of the file.
    metres, up: unit and up axis if the format defines them, otherwise None.
    colors: (T, 3, 3) uint8 sRGB per corner, multiplied with the material's; None if no corner has
        a colour.
    normal_uv: (T, 3, 2) float64 as `uv`, coordinates in the normal maps that have their own; None
        without such.
    step: step of the coarsest grid of coordinates, in units of the file; 0 for float32.
    kinds: the kind of each object by its class (IFC); empty for formats without classes.
    storeys: named by the file; heights along its up axis, in its units.
    rooms: volumes of rooms, finite, in the space of the file.
    lamps: finite, in the space of the file.
    """

    points: Floats
    triangles: Ints
    uv: Floats
    triangle_object: Ints
    triangle_material: Ints
    objects: tuple[str, ...]
    materials: tuple[SourceMaterial, ...]
    cameras: tuple[Camera, ...] = ()
    metres: float | None = None
    up: Literal["y", "z"] | None = None
    colors: NDArray[np.uint8] | None = None
    normal_uv: Floats | None = None
    step: float = 0.0
    kinds: tuple[Kind, ...] = ()
    storeys: tuple[Storey, ...] = ()
    rooms: tuple[RoomVolume, ...] = ()
    lamps: tuple[Lamp, ...] = ()


#: The textures of a material beside its colours that a second reading may ask for.
Purpose = Literal["lightmap", "reflection"]


@dataclass(frozen=True)
class FileFacts:
    """The version of its format and the program that wrote it, both "" if a file does not state
    them; and its extensions by name, with their support."""

    version: str = ""
    generator: str = ""
    extensions: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class SecondReading:
    """A model with other textures in place of the colours of its materials.

    Attributes
    ----------
    source: the file; coordinates are NaN where it has none for the texture.
    asked: for each of its materials, whether it names such a texture.
    missing: notes on missing and damaged textures, in the order of the materials.
    sought: the files that were looked for, as `Scene.files`.
    """

    source: ModelSource
    asked: tuple[bool, ...]
    missing: tuple[Note, ...]
    sought: tuple[str, ...]

    @cached_property
    def faces(self) -> Ints:
        """(T,) the faces that are in the scene: they are cleaned as those of the scene."""
        return keep_faces(self.source.points, self.source.triangles).source


_IDENTITY = np.eye(4)[None]


@dataclass
class MeshArrays:
    """The arrays of a source, one entry for each mesh."""

    points: list[Floats] = field(default_factory=list)
    triangles: list[Ints] = field(default_factory=list)
    uv: list[Floats] = field(default_factory=list)
    colors: list[NDArray[np.uint8] | None] = field(default_factory=list)
    normal_uv: list[Floats | None] = field(default_factory=list)
    object: list[Ints] = field(default_factory=list)
    material: list[Ints] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    count: int = 0

    def add_objects(self, name: str, count: int = 1) -> int:
        """Adds objects of one name; returns the number of the first."""
        self.names += [name] * count
        return len(self.names) - count

    def add(
        self,
        first_object: int,
        points: Floats,
        triangles: Ints,
        *,
        frames: Floats = _IDENTITY,
        uv: Floats | None = None,
        material: Ints | int = 0,
        colors: NDArray[np.uint8] | None = None,
        normal_uv: Floats | None = None,
    ) -> None:
        """Adds the instances of a mesh.

        Parameters
        ----------
        first_object: the object of the first instance; the others follow.
        points, triangles: (p, 3) and (t, 3) over these.
        frames: (k, 4, 4) from the mesh to the model, of each instance.
        uv, normal_uv: (t, 3, 2), 0 without. colors: (t, 3, 3), see `ModelSource`.
        material: (t,), or one number for all.
        """
        k, p, t = len(frames), len(points), len(triangles)
        if uv is None:
            uv = np.zeros((t, 3, 2))
        with np.errstate(all="ignore"):
            placed = points @ frames[:, :3, :3].transpose(0, 2, 1) + frames[:, None, :3, 3]
            mirrored = np.linalg.det(frames[:, :3, :3]) < 0
        first = self.count + p * np.arange(k)
        copies = triangles + first[:, None, None]
        copies[mirrored] = copies[mirrored][..., ::-1]  # mirroring reverses the winding
        self.points.append(placed.reshape(-1, 3))
        self.triangles.append(copies.reshape(-1, 3))
        self.uv.append(_repeat(uv, k, mirrored))
        self.colors.append(None if colors is None else _repeat(colors, k, mirrored))
        self.normal_uv.append(None if normal_uv is None else _repeat(normal_uv, k, mirrored))
        self.object.append(np.repeat(first_object + np.arange(k), t))
        self.material.append(np.tile(np.broadcast_to(material, t), k))
        self.count += k * p

    def source(
        self,
        *,
        materials: tuple[SourceMaterial, ...] = (SourceMaterial("default"),),
        **fields: Any,
    ) -> ModelSource:
        """The source of all meshes, white where a mesh has no colours and another has; ``fields``
        are the remaining ones of a `ModelSource`."""
        colors = None
        if any(part is not None for part in self.colors):
            parts = zip(self.colors, self.triangles, strict=True)
            colors = np.concatenate(
                [np.full((len(t), 3, 3), 255, np.uint8) if c is None else c for c, t in parts]
            )
        normal_uv = None
        if any(part is not None for part in self.normal_uv):
            pairs = zip(self.normal_uv, self.uv, strict=True)
            normal_uv = np.concatenate([np.zeros_like(uv) if n is None else n for n, uv in pairs])
        return ModelSource(
            points=np.concatenate(self.points),
            triangles=np.concatenate(self.triangles),
            uv=np.concatenate(self.uv),
            triangle_object=np.concatenate(self.object),
            triangle_material=np.concatenate(self.material).astype(np.int64),
            objects=tuple(self.names),
            materials=materials,
            colors=colors,
            normal_uv=normal_uv,
            **fields,
        )


def _repeat(values: NDArray[Any], times: int, mirrored: Bools) -> NDArray[Any]:
    """(times · t, 3, m) values of corners, in reverse order for mirrored instances."""
    copies = np.broadcast_to(values, (times, *values.shape)).copy()
    copies[mirrored] = copies[mirrored][..., ::-1, :]
    return copies.reshape(-1, *values.shape[1:])


_WHITE = (1.0, 1.0, 1.0)
#: Colours range to 255 if one is at least this; in the range to 1 rounding may exceed 1.
_BYTES = 2.0


def vertex_colors(
    materials: Sequence[SourceMaterial],
    triangles: Ints,
    triangle_material: Ints,
    colored: Ints,
    values: Floats,
) -> tuple[tuple[SourceMaterial, ...], NDArray[np.uint8]]:
    """The materials, white if a vertex of theirs has a colour, and (T, 3, 3) sRGB of corners.

    ``colored`` are the (n,) vertices with colours, and ``values`` the colours, (n, 3), from 0 to 1
    or to 255. Corners without a colour have that of their material; corners of materials without
    coloured vertices are white.
    """
    finite = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    scale = 1.0 if finite.max(initial=0.0) >= _BYTES else 255.0
    count = int(max(triangles.max(initial=-1), colored.max(initial=-1))) + 1
    has, color = np.zeros(count, dtype=bool), np.zeros((count, 3), dtype=np.uint8)
    has[colored] = True
    color[colored] = np.rint(np.clip(scale * finite, 0, 255)).astype(np.uint8)
    has_color = has[triangles]
    merged = np.zeros(len(materials), dtype=bool)
    merged[triangle_material[has_color.any(axis=1)]] = True
    tint = np.array([m.color or _WHITE for m in materials]) * merged[:, None] + ~merged[:, None]
    plain = np.rint(255 * tint).astype(np.uint8)[triangle_material]
    corners = np.where(has_color[..., None], color[triangles], plain[:, None])
    white = (replace(m, color=_WHITE) if t else m for m, t in zip(materials, merged, strict=True))
    return tuple(white), corners
