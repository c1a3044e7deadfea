"""The records of campus.json, whose schema has their meaning and units; names of its files, safe on
any system and unique without regard to case; and distances from viewpoints.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.whole_folder import FolderForm

INDEX = "campus.json"
FORMAT, SCHEMA = "ptmtools campus", 1
MESHES, TEXTURES, RECORDS = "meshes", "textures", "records"
#: Sides of textures and of lightmaps, texels (the paper's table 1).
SIZES = (128, 256, 512)
LIGHT_SIZES = (512, 1024, 2048)
#: Channels of a material: diffuse, alpha, mask; and of an object, light.
DIFFUSE, ALPHA, MASK, LIGHT = "d", "a", "m", "l"
CHANNELS = (DIFFUSE, ALPHA, MASK)
#: Icons of points of interest that the page draws.
ICONS = ("books", "entrance", "food", "garden", "info", "parking")
HIGHEST_RANK = 9999

Vector = tuple[float, float, float]
Box = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Quality:
    """A preset (the paper's table 2): sides of textures and lightmaps; whether the browser has all
    files already."""

    name: str
    diffuse: int
    light: int
    cached: bool = False


PRESETS = (
    Quality("Low", 128, 512),
    Quality("Medium", 256, 1024),
    Quality("High", 256, 2048),
    Quality("Ultra", 512, 2048),
    Quality("Ultra cached", 512, 2048, cached=True),
)


@dataclass(frozen=True)
class MeshFile:
    """A mesh of an object; `error` is the simplification's, metres, 0 of the finest."""

    file: str
    faces: int
    bytes: int
    crc32: int
    error: float


@dataclass(frozen=True)
class RecordFile:
    """The HTML of an object's record (`ptmtools_systems.campus.records`)."""

    file: str
    bytes: int
    crc32: int


@dataclass(frozen=True)
class CampusObject:
    """A building, or another element.

    Attributes
    ----------
    name: prefix of its files.
    label: name for visitors.
    parts: names of the model's objects in it.
    box: least x, y, z, greatest x, y, z of all its meshes, metres.
    barycentre: the centre of the surface of its finest mesh.
    viewpoint: position and unit direction of a view of it.
    materials: indices of the materials of its meshes.
    lightmap: base name of its lightmaps, or None.
    meshes: from the coarsest to the finest.
    record: further information for visitors, or None.
    icon: the picture before its name, one of `ICONS`, or None.
    rank: its place in the menu, before those with greater ranks or none.
    """

    name: str
    label: str
    parts: tuple[str, ...]
    box: Box
    barycentre: Vector
    viewpoint: tuple[Vector, Vector]
    materials: tuple[int, ...]
    lightmap: str | None
    meshes: tuple[MeshFile, ...]
    record: RecordFile | None = None
    icon: str | None = None
    rank: int | None = None


@dataclass(frozen=True)
class CampusMaterial:
    """The appearance of surfaces.

    Attributes
    ----------
    base: base name of its textures, None without.
    channels: channels of its textures that apply.
    color: sRGB, multiplied with the diffuse texture.
    alpha: "opaque", "mask" (tested against `cutoff`) or "blend".
    two_sided: whether its faces have a back.
    """

    name: str
    base: str | None = None
    channels: tuple[str, ...] = ()
    wrap: tuple[str, str] = ("repeat", "repeat")
    color: Vector = (1.0, 1.0, 1.0)
    opacity: float = 1.0
    alpha: Literal["opaque", "mask", "blend"] = "opaque"
    cutoff: float | None = None
    two_sided: bool = True


@dataclass(frozen=True)
class TextureFile:
    """A texture or lightmap of one size and channel; `source`: width and height of its source,
    which may be less."""

    file: str
    base: str
    size: int
    channel: str
    bytes: int
    crc32: int
    source: tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class Preset(Quality):
    """A quality with its cost: `bytes` of all files that it needs, `download` the rest to load."""

    bytes: int
    download: int


@dataclass(frozen=True)
class Campus:
    """The index.

    Attributes
    ----------
    origin, unit, up: transformation of the model's coordinates to world metres, as in hints.json.
    lods: meshes of each object.
    lightmaps: "bake", "model" or "none".
    start: bytes that every visitor loads first: the coarsest mesh of each object and all textures
        of the least size.
    """

    origin: Vector
    unit: float
    up: str
    lods: int
    lightmaps: str
    objects: tuple[CampusObject, ...]
    materials: tuple[CampusMaterial, ...]
    textures: tuple[TextureFile, ...]

    @property
    def start(self) -> int:
        return sum(o.meshes[0].bytes for o in self.objects) + self._bytes(SIZES[0], CHANNELS)

    @property
    def presets(self) -> tuple[Preset, ...]:
        """The cost of all of the campus in each quality: every mesh, textures of the least size and
        of the preset's, and its lightmaps."""
        meshes = sum(mesh.bytes for item in self.objects for mesh in item.meshes)
        parts = []
        for quality in PRESETS:
            total = meshes + self._bytes(quality.light, (LIGHT,))
            total += sum(self._bytes(size, CHANNELS) for size in {SIZES[0], quality.diffuse})
            parts.append(
                Preset(**vars(quality), bytes=total, download=0 if quality.cached else total)
            )
        return tuple(parts)

    def _bytes(self, size: int, channels: tuple[str, ...]) -> int:
        return sum(t.bytes for t in self.textures if t.size == size and t.channel in channels)

    def files(self) -> dict[str, tuple[int, int]]:
        """Bytes and CRC-32 of every file but the index, by name."""
        result = {t.file: (t.bytes, t.crc32) for t in self.textures}
        for item in self.objects:
            result |= {mesh.file: (mesh.bytes, mesh.crc32) for mesh in item.meshes}
            if item.record is not None:
                result[item.record.file] = item.record.bytes, item.record.crc32
        return result

    def to_document(self) -> dict[str, Any]:
        """The document of campus.json."""
        return {
            "format": FORMAT,
            "schema": SCHEMA,
            "origin": self.origin,
            "unit": self.unit,
            "up": self.up,
            "lods": self.lods,
            "lightmaps": self.lightmaps,
            "start": self.start,
            "presets": [vars(preset) for preset in self.presets],
            "objects": [_object_document(item) for item in self.objects],
            "materials": [_material_document(material) for material in self.materials],
            "textures": [vars(texture) for texture in self.textures],
        }

    @staticmethod
    def from_document(document: Mapping[str, Any]) -> Campus:
        """The campus of a valid document."""
        return Campus(
            origin=tuple(document["origin"]),
            unit=document["unit"],
            up=document["up"],
            lods=document["lods"],
            lightmaps=document["lightmaps"],
            objects=tuple(map(_object, document["objects"])),
            materials=tuple(map(_material, document["materials"])),
            textures=tuple(
                TextureFile(**_fields(TextureFile, row) | {"source": tuple(row["source"])})
                for row in document["textures"]
            ),
        )


def _object_document(item: CampusObject) -> dict[str, Any]:
    result = {
        **vars(item),
        "viewpoint": dict(zip(("position", "direction"), item.viewpoint, strict=True)),
        "meshes": [vars(mesh) for mesh in item.meshes],
    }
    if item.record is not None:
        result["record"] = vars(item.record)
    absent = [name for name in ("record", "icon", "rank") if result[name] is None]
    return {name: value for name, value in result.items() if name not in absent}


def _material_document(material: CampusMaterial) -> dict[str, Any]:
    result = {**vars(material), "twoSided": material.two_sided}
    del result["two_sided"]
    return result


def _fields(cls: Any, row: Mapping[str, Any]) -> dict[str, Any]:
    """The known members of a record: others may have been added."""
    return {name: row[name] for name in cls.__dataclass_fields__ if name in row}


def _material(row: Mapping[str, Any]) -> CampusMaterial:
    fields = _fields(CampusMaterial, row) | {"two_sided": row["twoSided"]}
    for name in ("channels", "wrap", "color"):
        fields[name] = tuple(fields[name])
    return CampusMaterial(**fields)


def _object(row: Mapping[str, Any]) -> CampusObject:
    fields = _fields(CampusObject, row)
    for name in ("parts", "box", "barycentre", "materials"):
        fields[name] = tuple(fields[name])
    viewpoint = row["viewpoint"]
    fields["viewpoint"] = tuple(viewpoint["position"]), tuple(viewpoint["direction"])
    fields["meshes"] = tuple(MeshFile(**_fields(MeshFile, mesh)) for mesh in row["meshes"])
    if "record" in row:
        fields["record"] = RecordFile(**_fields(RecordFile, row["record"]))
    return CampusObject(**fields)


#: Names that Windows keeps for devices, with or without a suffix.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)$", re.IGNORECASE)
#: Longest name, in characters; a number may follow.
_LONGEST = 60
#: Files of a campus folder besides its index.
_OURS = re.compile(
    rf"({MESHES}/[A-Za-z0-9_-]+_\d+\.glb|{RECORDS}/[A-Za-z0-9_-]+\.txt|"
    rf"{TEXTURES}/[A-Za-z0-9_-]+_\d+_[{DIFFUSE}{ALPHA}{MASK}{LIGHT}]\.jpg)"
)
FORM = FolderForm(
    INDEX, FORMAT, "ptm campus", lambda name: name == INDEX or bool(_OURS.fullmatch(name))
)


class Names:
    """Unique names of files."""

    def __init__(self) -> None:
        self._taken: set[str] = set()
        #: The last number that was added to each name.
        self._last: dict[str, int] = {}

    def take(self, text: str, otherwise: str) -> str:
        """A name like ``text``, or like ``otherwise`` if no character of that is allowed."""
        plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
        stem = re.sub(r"[^A-Za-z0-9-]+", "_", plain).strip("_")[:_LONGEST].strip("_") or otherwise
        if _DEVICES.match(stem):
            stem = f"{otherwise}_{stem}"
        unique, count = stem, self._last.get(stem.lower(), 1)
        while unique.lower() in self._taken:
            count += 1
            unique = f"{stem}-{count}"
        self._taken.add(unique.lower())
        self._last[stem.lower()] = count
        return unique


def mesh_file(name: str, lod: int) -> str:
    """``meshes/library_0.glb``; 0 is the coarsest."""
    return f"{MESHES}/{name}_{lod}.glb"


def record_file(name: str) -> str:
    """``records/library.txt``."""
    return f"{RECORDS}/{name}.txt"


def texture_file(base: str, size: int, channel: str) -> str:
    """``textures/wall_512_d.jpg``."""
    return f"{TEXTURES}/{base}_{size}_{channel}.jpg"


def distances(eye: Floats, boxes: Floats, barycentres: Floats) -> Floats:
    """(…, m) metres from each viewpoint to each object, approximately (the paper's III, figure 4).

    The distance is that from the viewpoint to the point in which the segment from the barycentre
    leaves the box; 0 in the box. It is between the distances to the box and to the barycentre.

    Parameters
    ----------
    eye: (…, 3) viewpoints.
    boxes: (m, 6) least x, y, z, then greatest x, y, z.
    barycentres: (m, 3), each within its box.
    """
    low, high = boxes[:, :3], boxes[:, 3:]
    way = np.asarray(eye, np.float64)[..., None, :] - barycentres
    # The share of the way at which it passes the last side, along each axis; never where it is
    # parallel to them.
    room = np.where(way > 0, high - barycentres, low - barycentres)
    share = np.divide(room, way, out=np.full(way.shape, np.inf), where=way != 0)
    share_to_box = np.clip(share, 0.0, 1.0).min(axis=-1)
    return np.asarray((1.0 - share_to_box) * np.linalg.norm(way, axis=-1))
