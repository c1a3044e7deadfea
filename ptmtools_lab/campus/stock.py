"""The files of a campus: their sizes on the link and in graphics memory, and the files of each
object.

Every file is one request. The index and the meshes count as compressed by gzip, as for other
clients (docs/design/walkthrough.md); images count as stored. In graphics memory a mesh takes the
bytes of its vertices and indices, and a texture or lightmap four bytes per texel and a third for
its mip levels, whatever its channel.

`read_surfaces` reads the meshes as surfaces, and `read_textures` the textures with their mip
levels.
"""

from __future__ import annotations

import io
import os
import zlib
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError, PtmError
from ptmtools.files import open_below
from ptmtools.glb import glb_chunks
from ptmtools.output.served import on_link
from ptmtools.output.surfaces import Surfaces, stack_rows
from ptmtools.rendering.pyramids import pack_pyramids
from ptmtools.rendering.records import Pyramids
from ptmtools.scene.colors import to_srgb
from ptmtools.texture.images.opening import load, open_image, pillow_faults
from ptmtools.texture.model import Limits
from ptmtools_lab.forms import mip_levels
from ptmtools_systems.campus.meshes import Primitive, read_mesh, view_bytes
from ptmtools_systems.campus.model import (
    CHANNELS,
    INDEX,
    LIGHT,
    PRESETS,
    RECORDS,
    SIZES,
    Campus,
    Quality,
    texture_file,
)
from ptmtools_systems.campus.reading import LONGEST, read_campus

#: Bytes of a texel in graphics memory.
_TEXEL = 4
_AGAIN = "write it again with `ptm campus`"


@dataclass(frozen=True)
class Stock:
    """Files of a campus; number 0 is the index.

    Attributes
    ----------
    campus: content of the index.
    names: (n,) of the files. sent: (n,) bytes on the link. stored: (n,) bytes as stored.
    memory: (n,) bytes of graphics memory; 0 for the index. most: (n,) upper bound of it that a
        client knows from the index: of a mesh the bytes of its file.
    boxes, barycentres: (m, 6), (m, 3) of the objects, metres.
    bases: texture bases of the objects that have a diffuse channel, by number.
    """

    campus: Campus
    names: tuple[str, ...]
    sent: Ints
    stored: Ints
    memory: Ints
    most: Ints
    boxes: Floats
    barycentres: Floats
    bases: tuple[str, ...]

    @property
    def objects(self) -> int:
        """Number of objects."""
        return len(self.campus.objects)

    def meshes(self, number: int) -> tuple[int, ...]:
        """Files of an object's meshes, from the coarsest to the finest."""
        return tuple(self._number[mesh.file] for mesh in self.campus.objects[number].meshes)

    def low(self, number: int) -> tuple[int, ...]:
        """Files of an object in low detail: its coarsest mesh and textures of the least size."""
        return (self.meshes(number)[0], *self.textures(number, SIZES[0]))

    def high(self, number: int, quality: Quality, lightmaps: bool) -> tuple[int, ...]:
        """Files of an object in high detail: its finest mesh, textures and lightmap of a preset."""
        item = self.campus.objects[number]
        files = [self.meshes(number)[-1], *self.textures(number, quality.diffuse)]
        if lightmaps and item.lightmap is not None:
            files.append(self._number[texture_file(item.lightmap, quality.light, LIGHT)])
        return tuple(files)

    def textures(self, number: int, size: int) -> tuple[int, ...]:
        """Files of all channels of an object's materials, each once, in their order."""
        materials = [self.campus.materials[m] for m in self.campus.objects[number].materials]
        names = [
            texture_file(m.base, size, channel)
            for m in materials
            if m.base is not None
            for channel in CHANNELS
            if channel in m.channels
        ]
        return tuple(dict.fromkeys(self._number[name] for name in names))

    def diffuse(self, base: int, size: int) -> int:
        """The file of the colours of a base."""
        return self._number[texture_file(self.bases[base], size, CHANNELS[0])]

    @cached_property
    def _number(self) -> dict[str, int]:
        return {name: number for number, name in enumerate(self.names)}


def read_stock(folder: str | os.PathLike[str], only: str = "*") -> Stock:
    """Reads the files of a campus, for the objects whose names match ``only``, with * and ?.

    Raises
    ------
    InputError: PTM-I122 the index or a file is missing or cannot be read, or a file does not match
        the index; PTM-I302 no object has such a name; PTM-I821 the index is damaged.
    LimitError: PTM-L204 the index is too long.
    """
    folder = Path(folder)
    campus = read_campus(folder)
    kept = tuple(item for item in campus.objects if fnmatchcase(item.name, only))
    if not kept:
        raise InputError(
            "PTM-I302",
            f"has no object {only}",
            file=folder / INDEX,
            remedy="use names that it has",
        )
    campus = replace(campus, objects=kept)
    index = _bytes(folder, INDEX, LONGEST)
    rows = [(on_link(index), len(index), 0, 0)]
    sizes = {texture.file: texture.size for texture in campus.textures}
    # A visitor asks for the records of objects.
    files = {
        name: item for name, item in campus.files().items() if not name.startswith(f"{RECORDS}/")
    }
    for name in files:
        data = file_bytes(folder, name, files[name])
        if name in sizes:
            taken = _TEXEL * _texels_with_mips(sizes[name])
            rows.append((len(data), len(data), taken, taken))
        else:
            rows.append((on_link(data), len(data), _mesh_bytes(folder, name, data), len(data)))
    sent, stored, memory, largest = np.array(rows, dtype=np.int64).T.copy()
    stock = Stock(
        campus=campus,
        names=(INDEX, *files),
        sent=sent,
        stored=stored,
        memory=memory,
        most=largest,
        boxes=np.array([o.box for o in campus.objects], dtype=np.float64).reshape(-1, 6),
        barycentres=np.array([o.barycentre for o in campus.objects]).reshape(-1, 3),
        bases=_bases(campus),
    )
    _require_textures(folder, stock)
    return stock


def file_bytes(folder: Path, name: str, listed: tuple[int, int] | None = None) -> bytes:
    """Reads a file of a campus, of which the index lists size and CRC-32. The schema of the index
    excludes names that lead out of the folder.

    Raises InputError PTM-I122.
    """
    data = _bytes(folder, name, LONGEST if listed is None else listed[0])
    if listed is not None and (len(data), zlib.crc32(data)) != listed:
        raise stock_error(folder / name, "is not the file that the index of the campus lists")
    return data


def _bytes(folder: Path, name: str, limit: int) -> bytes:
    """Reads a file, at most ``limit`` bytes and one more."""
    try:
        with open_below(folder, name) as stream:
            return stream.read(limit + 1)
    except OSError as fault:
        raise stock_error(folder / name, f"cannot be read ({fault.strerror or fault})") from None


def _mesh_bytes(folder: Path, name: str, data: bytes) -> int:
    """Bytes of the vertices and indices of a mesh."""
    try:
        chunks = glb_chunks(data)
        return view_bytes(schemas.parse(chunks[0][2]), chunks[1][2])
    except (ValueError, LookupError, TypeError, schemas.ShapeError) as fault:
        raise stock_error(folder / name, f"is no mesh of a campus ({fault})") from None


def _texels_with_mips(side: int) -> int:
    """Texels of a square and of its mip levels."""
    total = 0
    while side:
        total += side * side
        side >>= 1
    return total


def _bases(campus: Campus) -> tuple[str, ...]:
    """Bases with colours that some object uses."""
    used = {number for item in campus.objects for number in item.materials}
    named = [
        m.base
        for number, m in enumerate(campus.materials)
        if number in used and m.base is not None and CHANNELS[0] in m.channels
    ]
    return tuple(dict.fromkeys(named))


def _require_textures(folder: Path, stock: Stock) -> None:
    """Checks that the index lists each file that an object may want."""
    campus = stock.campus
    for number, item in enumerate(campus.objects):
        if max(item.materials, default=-1) >= len(campus.materials):
            raise stock_error(folder / INDEX, f"{item.name} has a material that there is not")
        try:
            stock.low(number)
            for quality in PRESETS:
                stock.high(number, quality, True)
        except KeyError as fault:
            raise stock_error(folder / INDEX, f"does not list {fault.args[0]}") from None


def stock_error(file: Path, what: str) -> InputError:
    """PTM-I122."""
    return InputError("PTM-I122", what, file=file, remedy=_AGAIN)


def read_surfaces(folder: Path, stock: Stock, level: int) -> Surfaces:
    """The meshes of all objects of one level, 0 or -1: the coarsest or the finest.

    ``cell`` is the object, ``texture`` the number in `Stock.bases`. Light in vertex colours is left
    out, and with it the vertex colours of the model.

    Raises InputError PTM-I122.
    """
    campus = stock.campus
    rows: list[tuple[int, Primitive]] = []
    for number, item in enumerate(campus.objects):
        name = item.meshes[level].file
        try:
            primitives = read_mesh(file_bytes(folder, name))
        except ValueError as fault:
            raise stock_error(folder / name, f"is no mesh of a campus ({fault})") from None
        if max(p.material for p in primitives) >= len(campus.materials):
            raise stock_error(folder / name, "has a material that the campus does not have")
        rows += [(number, p) for p in primitives]
    count = [len(p.triangle) for _, p in rows]
    looks = [campus.materials[p.material] for _, p in rows]
    base = {name: number for number, name in enumerate(stock.bases)}
    texture = [
        base.get(m.base or "", -1) if p.uv is not None else -1
        for m, (_, p) in zip(looks, rows, strict=True)
    ]

    def spread(values: object, kind: type[np.generic], *shape: int) -> NDArray[Any]:
        rows_of = np.array(values, dtype=kind).reshape(len(rows), *shape)
        return np.repeat(rows_of, count, axis=0)

    corner = stack_rows([p.point[p.triangle] for _, p in rows], 3)
    lit = campus.lightmaps != "none" and any(len(o.meshes) > 1 for o in campus.objects)
    bright = [_brightness(p, lit and level == 0) for _, p in rows]
    color = np.concatenate([np.zeros((0, 3)), *bright])
    color = color * spread([m.color for m in looks], np.float64, 3)
    glass = [m.alpha == "blend" and t < 0 for m, t in zip(looks, texture, strict=True)]
    return Surfaces(
        corner=corner,
        uv=stack_rows([_texture_points(p) for _, p in rows], 2),
        cell=spread([number for number, _ in rows], np.int32),
        shape=np.repeat(np.arange(len(rows), dtype=np.int32), count),
        texture=spread(texture, np.int32),
        color=color,
        two_sided=spread([m.two_sided for m in looks], np.bool_),
        glass=spread(glass, np.bool_),
        clamped=spread([[w == "clamp" for w in m.wrap] for m in looks], np.bool_, 2),
        seen=np.repeat(np.arange(len(corner))[:, None], 2, axis=1),
    )


def read_textures(folder: Path, stock: Stock, size: int) -> Pyramids:
    """The colours of all bases in one size, with mip levels as of `generateMipmap`.

    Raises InputError PTM-I122.
    """
    names = [stock.names[stock.diffuse(base, size)] for base in range(len(stock.bases))]
    return pack_pyramids([mip_levels(_image(folder, name, size)) for name in names])


def _image(folder: Path, name: str, size: int) -> NDArray[np.uint8]:
    limits = Limits()
    try:
        with pillow_faults():
            image = open_image(io.BytesIO(file_bytes(folder, name)), limits)
            load(image)
            pixels = np.asarray(image.convert("RGB"))
    except PtmError as fault:
        raise stock_error(folder / name, fault.message) from None
    if pixels.shape[:2] != (size, size):
        raise stock_error(folder / name, f"is not a square of {size} texels")
    return np.ascontiguousarray(pixels)


def _brightness(primitive: Primitive, lit: bool) -> Floats:
    """(m, 3) sRGB factor of each triangle's texels, without the material's colour."""
    if primitive.color is None or lit:
        return np.ones((len(primitive.triangle), 3))
    colors: Floats = to_srgb(primitive.color)[primitive.triangle].mean(axis=1)
    return colors


def _texture_points(primitive: Primitive) -> Floats:
    if primitive.uv is None:
        return np.zeros((len(primitive.triangle), 3, 2))
    return primitive.uv[primitive.triangle]
