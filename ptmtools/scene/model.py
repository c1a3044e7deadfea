"""The scene: the result of ingest and the input of all later stages.

Coordinates are world coordinates: float64, metres, Y up, with the centre of the model's floor at
the origin (docs/design/architecture.md). Arrays are never modified in place.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.arrays import Bools, Floats
from ptmtools.scene.lights import Lights
from ptmtools.scene.orientation.main_axes import tolerance_of
from ptmtools.store.archive import Stored, without_repeats
from ptmtools.tolerance import Tolerance

#: Names of the arrays that the output of a reader and a scene have in common.
FACE_ARRAYS = ("points", "triangles", "uv", "triangle_object", "triangle_material")
#: Arrays of which all rows are equal in many models.
_OFTEN_ALIKE = ("uv", "triangle_object", "triangle_material", "two_sided")
Wrap = Literal["repeat", "clamp"]
#: The role of an object by its class in the model: structure, never structure, a door leaf, or ""
#: if its shape and name decide.
Kind = Literal["structural", "detail", "door", ""]


@dataclass(frozen=True)
class Space:
    """The map from model to world coordinates: ``world = R(up) @ (model - origin) * metres``.

    Attributes
    ----------
    origin: (3,) centre of the floor of the bounding box, in the model's units and axes.
    metres: length of one unit of the model.
    up: "y" or "z", the model's up axis; Z-up maps (x, y, z) to (x, z, -y).
    unit_guessed, up_guessed: whether neither the user nor the format defines the value.
    """

    origin: tuple[float, float, float]
    metres: float
    up: Literal["y", "z"]
    unit_guessed: bool = False
    up_guessed: bool = False


@dataclass(frozen=True)
class NormalImage:
    """The normal map of a material (glTF's normalTexture, ``norm`` and ``map_Bump`` of OBJ).

    Attributes
    ----------
    image: index into `Scene.images`; linear values, tangent space, green up.
    scale: factor of x and y of its normals.
    wrap_s, wrap_t: wrap modes beyond [0, 1].
    own: whether its coordinates are those of `Scene.normal_uv` instead of `Scene.uv`.
    """

    image: int
    scale: float = 1.0
    wrap_s: Wrap = "repeat"
    wrap_t: Wrap = "repeat"
    own: bool = False


@dataclass(frozen=True)
class Material:
    """A material as emitted.

    Attributes
    ----------
    name: its name in the model.
    color: (r, g, b) in [0, 1], multiplied with the image if there is one (Kd, baseColorFactor).
    opacity: in [0, 1].
    image: index into `Scene.images`, or -1.
    wrap_s, wrap_t: wrap modes beyond [0, 1].
    transparent: never occludes: `opacity` < 1, or a used texel with alpha < 255 unless the mode of
        the material ignores alpha, or see-through by its definition.
    cutoff: texels with less alpha than this, in [0, 1], are not drawn, and all others are opaque;
        None if texels are blended.
    normal: its normal map, or None.
    metallic, roughness: in [0, 1], as in glTF, on average.
    """

    name: str
    color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    opacity: float = 1.0
    image: int = -1
    wrap_s: Wrap = "repeat"
    wrap_t: Wrap = "repeat"
    transparent: bool = False
    cutoff: float | None = None
    normal: NormalImage | None = None
    metallic: float = 0.0
    roughness: float = 1.0

    @property
    def glossy(self) -> bool:
        """Whether shapes show in what it reflects: not in metals of unstated roughness, 1."""
        return self.roughness < 0.8

    @property
    def pane(self) -> bool:
        """Whether it is glass: seen through, without an image."""
        return self.opacity < 1 and self.image < 0


@dataclass(frozen=True)
class SourceImage:
    """A distinct image of the model, as the bytes of its file.

    Attributes
    ----------
    name: file name with suffix, unique in the scene regardless of case, valid on any system.
    sha256: hex digest of the bytes; distinct images have distinct digests.
    load: returns the bytes.
    files: the files with exactly these bytes, relative to the model's folder, "/" between names;
        none if the image is part of a larger file.
    plain: nothing else in the scene depends on its texels: it has no alpha channel, and no other
        image is derived from it.
    """

    name: str
    sha256: str
    load: Callable[[], bytes] = field(compare=False, repr=False)
    files: tuple[str, ...] = ()
    plain: bool = False


@dataclass(frozen=True)
class Shine:
    """The reflection map of a material (``map_Ks`` of OBJ), not yet looked up.

    Attributes
    ----------
    file: name of the image as written in the model.
    base: folder that the name is relative to.
    fault: why it cannot be combined with the colours, or "".
    """

    file: str
    base: Path
    fault: str = ""


@dataclass(frozen=True)
class Camera:
    """A viewpoint: eye and a unit viewing direction in world coordinates, vertical field of view
    in radians."""

    name: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    field_of_view: float = np.pi / 4


@dataclass(frozen=True)
class Storey:
    """A storey named by the model, and the height of its floor in world metres."""

    name: str
    height: float


@dataclass(frozen=True, eq=False)
class RoomVolume:
    """The volume of a room by the model, an IfcSpace: a mesh that nothing draws.

    Attributes
    ----------
    name: "" if it has none.
    points: (P, 3) float64, metres.
    triangles: (T, 3) int32 indices into `points`. Not checked: the mesh may be open.
    """

    name: str
    points: Floats
    triangles: NDArray[np.int32]

    def __eq__(self, value: object) -> bool:
        return isinstance(value, RoomVolume) and all(
            map(np.array_equal, vars(self).values(), vars(value).values())
        )


@dataclass(frozen=True)
class Note:
    """A guess, conversion or omission of ingest: stable code, one line of text, place, count."""

    code: str
    message: str
    place: str = ""
    count: int = 1


@dataclass(frozen=True)
class Scene:
    """Triangles in world metres with their objects, materials and images.

    Attributes
    ----------
    points: (V, 3) float64, metres.
    triangles: (T, 3) int32 indices into `points`, counter-clockwise seen from the front.
    uv: (T, 3, 2) float64 per corner, origin at the image's lower left; 0 without coordinates.
    triangle_object: (T,) int32 index into `objects`.
    triangle_material: (T,) int32 index into `materials`.
    two_sided: (T,) bool; False for glTF faces whose material is not doubleSided, and for both of
        two coincident faces of opposite winding (each belongs to the side that it faces).
    objects: names, unique not required.
    tolerance: derived once, for all stages.
    materials, images, cameras: see their classes.
    colors: (T, 3, 3) uint8 sRGB per corner, multiplied with the image's; None if no corner has a
        colour. Materials of triangles with colours other than white are white.
    normal_uv: (T, 3, 2) float64 per corner, as `uv`, coordinates in normal maps that have their
        own; 0 elsewhere. None if no normal map has its own.
    kinds: for each object its role by class; empty for formats without classes.
    storeys: named by the model, from the lowest.
    rooms: volumes of rooms in the order of the model file; empty for formats without them.
    space: the map from model to world coordinates.
    notes: in the order of the model file.
    files: other files that were read or are missing, relative to the model's folder, "/" between
        names: a change to any of them may change the scene. Not part of the artifact.
    shines: for each material its reflection map, or None. Not part of the artifact.
    lights: lamps, emission and lightmaps, stored beside the artifact.
    """

    points: Floats
    triangles: NDArray[np.int32]
    uv: Floats
    triangle_object: NDArray[np.int32]
    triangle_material: NDArray[np.int32]
    two_sided: Bools
    objects: tuple[str, ...]
    materials: tuple[Material, ...]
    tolerance: Tolerance
    images: tuple[SourceImage, ...] = ()
    cameras: tuple[Camera, ...] = ()
    colors: NDArray[np.uint8] | None = None
    normal_uv: Floats | None = None
    kinds: tuple[Kind, ...] = ()
    storeys: tuple[Storey, ...] = ()
    rooms: tuple[RoomVolume, ...] = ()
    space: Space = Space((0.0, 0.0, 0.0), 1.0, "y")
    notes: tuple[Note, ...] = ()
    files: tuple[str, ...] = field(default=(), compare=False)
    shines: tuple[Shine | None, ...] = field(default=(), compare=False)
    lights: Lights | None = field(default=None, compare=False)

    @property
    def corners(self) -> Floats:
        """(T, 3, 3) corner positions, metres."""
        return self.points[self.triangles]

    @property
    def opaque(self) -> Bools:
        """(T,) whether each triangle occludes."""
        opaque = np.array([not m.transparent for m in self.materials], dtype=bool)
        return opaque[self.triangle_material]

    def with_points(self, points: Floats) -> Scene:
        """The same triangles over other points (V, 3), with the tolerances of those."""
        return replace(
            self, points=points, tolerance=tolerance_of(points, self.triangles, self.tolerance.step)
        )

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The scene as plain arrays, without its images: stages that read only the arrays do not
        depend on the images."""
        about = {
            "objects": self.objects,
            "materials": [_material_row(m) for m in self.materials],
            "cameras": [vars(c) for c in self.cameras],
            "space": vars(self.space),
            "notes": [vars(n) for n in self.notes],
            **({"kinds": self.kinds} if self.kinds else {}),
            **({"storeys": [vars(s) for s in self.storeys]} if self.storeys else {}),
            **({"rooms": [room.name for room in self.rooms]} if self.rooms else {}),
        }
        text = json.dumps(about, sort_keys=True, ensure_ascii=False)
        arrays = {name: getattr(self, name) for name in (*FACE_ARRAYS, "two_sided")}
        if self.colors is not None:
            arrays["colors"] = self.colors
        if self.normal_uv is not None:
            arrays["normal_uv"] = self.normal_uv
        arrays["about"] = np.frombuffer(text.encode(), dtype=np.uint8)
        arrays = without_repeats(arrays, *_OFTEN_ALIKE)
        return arrays | room_arrays(self.rooms) | self.tolerance.to_arrays()

    @staticmethod
    def from_arrays(
        arrays: Mapping[str, NDArray[np.generic]], images: Sequence[SourceImage] = ()
    ) -> Scene:
        """Inverse of `to_arrays`; ``images`` in the order of `Material.image`.

        Raises KeyError or ValueError for arrays that are not those of a scene.
        """
        stored = Stored(arrays)
        text = stored.array("about", np.uint8, None).tobytes()
        about = schemas.read(text, schemas.SCENE)
        objects, images = tuple(about["objects"]), tuple(images)
        materials = tuple(map(_material_of, about["materials"]))
        used = [m.image for m in materials] + [m.normal.image for m in materials if m.normal]
        if max(used, default=-1) >= len(images):
            raise ValueError("a material refers to a missing image")
        points = stored.array("points", np.float64, None, 3, finite=True)
        triangles = stored.indices("triangles", np.int32, None, 3, high=len(points))
        n = len(triangles)
        stored = stored.repeat_rows(n, *_OFTEN_ALIKE)
        normal_uv = None
        if any(material.normal and material.normal.own for material in materials):
            normal_uv = stored.array("normal_uv", np.float64, n, 3, 2, finite=True)
        return Scene(
            points=points,
            triangles=triangles,
            uv=stored.array("uv", np.float64, n, 3, 2, finite=True),
            triangle_object=stored.indices("triangle_object", np.int32, n, high=len(objects)),
            triangle_material=stored.indices("triangle_material", np.int32, n, high=len(materials)),
            two_sided=stored.array("two_sided", np.bool_, n),
            colors=stored.array("colors", np.uint8, n, 3, 3) if "colors" in arrays else None,
            normal_uv=normal_uv,
            objects=objects,
            materials=materials,
            tolerance=Tolerance.from_arrays(arrays),
            images=images,
            cameras=tuple(Camera(**fields_of(row)) for row in about["cameras"]),
            kinds=_kinds(about.get("kinds", []), len(objects)),
            storeys=tuple(Storey(**row) for row in about.get("storeys", [])),
            rooms=rooms_of(stored, about.get("rooms", [])),
            space=Space(**fields_of(about["space"])),
            notes=tuple(Note(**row) for row in about["notes"]),
        )


def room_arrays(rooms: Sequence[RoomVolume]) -> dict[str, NDArray[np.generic]]:
    """The meshes of rooms as CSR arrays; no arrays without rooms."""
    if not rooms:
        return {}
    sizes = [(len(room.points), len(room.triangles)) for room in rooms]
    points, triangles = np.cumsum([(0, 0), *sizes], axis=0).T.astype(np.int64)
    return {
        "room_points": np.concatenate([room.points for room in rooms]),
        "room_point_start": points,
        "room_triangles": np.concatenate([room.triangles for room in rooms]).astype(np.int32),
        "room_triangle_start": triangles,
    }


def rooms_of(stored: Stored, names: Sequence[str]) -> tuple[RoomVolume, ...]:
    """Inverse of `room_arrays` for rooms of these names.

    Raises KeyError or ValueError for arrays that are not those of as many rooms.
    """
    if not names:
        return ()
    count = len(names)
    points = stored.array("room_points", np.float64, None, 3, finite=True)
    triangles = stored.indices("room_triangles", np.int32, None, 3, high=len(points))
    first = stored.starts("room_point_start", count, len(points))
    begin = stored.starts("room_triangle_start", count, len(triangles))
    rooms = []
    for k, name in enumerate(names):
        part = points[first[k] : first[k + 1]]
        faces = triangles[begin[k] : begin[k + 1]]
        if faces.max(initial=-1) >= len(part):
            raise ValueError("a triangle of a room refers to a missing point")
        rooms.append(RoomVolume(name, part, faces))
    return tuple(rooms)


def _material_row(material: Material) -> dict[str, Any]:
    """The fields of a material, without an absent `cutoff` or `normal`."""
    row = {name: v for name, v in vars(material).items() if v is not None}
    return row | ({"normal": vars(material.normal)} if material.normal else {})


def _material_of(row: Mapping[str, Any]) -> Material:
    """Inverse of `_material_row`."""
    normal = {"normal": NormalImage(**row["normal"])} if "normal" in row else {}
    return Material(**fields_of(row) | normal)


def _kinds(kinds: Sequence[Kind], objects: int) -> tuple[Kind, ...]:
    if kinds and len(kinds) != objects:
        raise ValueError("the numbers of kinds and objects differ")
    return tuple(kinds)


def fields_of(row: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a dataclass from JSON, with lists as tuples."""
    return {name: tuple(v) if isinstance(v, list) else v for name, v in row.items()}
