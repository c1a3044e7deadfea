"""Cells and textures of a database in the forms that the clients of a site read: the page and
`three-ptm`.

They read no names and no URIs of a cell's GLB, and the page draws shapes of one look together. The
document loses these, objects become one node, and shapes of one look that lie side by side one
primitive; the arrays stay byte for byte, but for colours. With gzip that saves 15 % in the sample
museum and 11 % in the hospital. Colours of vertices, linear light in 16 bits, have 256 values:
their sRGB codes, red and blue less green, take far fewer bytes. Textures that browsers do not read
are encoded again, and a site without exact levels has them without these.
"""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.errors import InputError, naming
from ptmtools.files import open_regular
from ptmtools.glb import COMPONENTS, UNSIGNED_BYTE
from ptmtools.meshopt.decoding import decode
from ptmtools.meshopt.encoding import encode_attributes
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.gltf_compressed import MESHOPT, WHOLE_BYTES
from ptmtools.output.model import offsets_of, sizes_of
from ptmtools.scene.colors import encode_srgb
from ptmtools.store.folder import damage_error, reading_error

#: Textures that the page decodes.
PROFILES, KIND, VERSION = ("fast", "raw"), "uint8", 2
#: The attribute of colours: sRGB codes of green, of red and blue less that, modulo 256, and 0.
CODES = "_COLOR"
#: The members of a material, of its surface and of its extras that the page reads.
_LOOK = ("alphaMode", "alphaCutoff", "doubleSided")
_SURFACE = ("baseColorFactor",)
#: Of what reflects.
_GLOSS = ("metallicFactor", "roughnessFactor")
_NORMAL = ("normal", "normalCoords", "normalScale", "normalWrapS", "normalWrapT")
_EXTRAS = ("texture", "wrapS", "wrapT", "mesh", "octree", "light", "white", "probe", *_NORMAL)


@dataclass(frozen=True)
class SiteTexture:
    """A texture of a site.

    Attributes
    ----------
    row: its row of the index, but for the name of the file.
    data: its bytes if it was encoded anew; None if the file is sent as it is.
    note: a remark for the user.
    """

    row: Mapping[str, Any]
    data: bytes | None = None
    note: str = ""


def web_texture(file: Path, row: Mapping[str, Any]) -> SiteTexture:
    """A texture of an index, in a form that browsers read. One of another profile, version or kind
    of sample is encoded again with the same levels: integers lose their low bits, floats count from
        0 to 1, as in every display of such a texture.

    Raises
    ------
    DatabaseError: PTM-D005, D006 the file is missing, damaged, or another than the index says.
    LimitError: those of `ptmtools.texture.open` and `PtmReader.level`.
    """
    from ptmtools.texture.container import HEAD_MAX, read_header

    try:
        with open_regular(file) as stream, naming(file):
            header = read_header(stream.read(HEAD_MAX))
            size = os.fstat(stream.fileno()).st_size
    except OSError as fault:
        raise reading_error(file, fault) from None
    except InputError as fault:
        raise damage_error(file, fault.message) from None
    if size != header.file_size or [level.end for level in header.levels] != row["ends"]:
        raise damage_error(file, "is not the texture that the index has")
    if header.profile in PROFILES and header.kind == KIND and header.version == VERSION:
        return SiteTexture(row)
    return _encoded_again(file, row)


def without_exact(file: Path, texture: SiteTexture) -> SiteTexture:
    """A texture of a site without the exact levels, or the lossless image, that previews replace,
    if a preview has the finest level; raises DatabaseError as `web_texture`."""
    from ptmtools.texture.container import cut, read_header
    from ptmtools.texture.previews import coarse_levels

    row, sizes = texture.row, sizes_of(texture.row)
    levels = coarse_levels([max(size) for size in sizes])
    previews = row.get("previews", ())
    if len(previews) > 1 and previews[-2]["level"] == previews[-1]["level"]:
        return SiteTexture({**row, "previews": previews[:-1]}, texture.data, texture.note)
    if not previews or previews[-1]["level"] < len(sizes) - 1 or levels >= len(row["ends"]):
        return texture
    data = texture.data
    if data is None:
        try:
            data = file.read_bytes()
        except OSError as fault:
            raise reading_error(file, fault) from None
    data = cut(data, levels)
    changed = {
        "width": sizes[levels - 1][0],
        "height": sizes[levels - 1][1],
        "ends": [level.end for level in read_header(data).levels],
    }
    return SiteTexture({**row, **changed}, data, texture.note)


def _encoded_again(file: Path, row: Mapping[str, Any]) -> SiteTexture:
    from ptmtools.texture import EncodeOptions, encode_to, open as open_ptm, read_header
    from ptmtools.texture.model import gpu_texel_bytes
    from ptmtools.texture.samples import in_eight_bits

    try:
        with open_ptm(file) as ptm:
            before = f"{ptm.header.profile}, {ptm.header.kind}"
            texels = in_eight_bits(ptm.level(len(ptm.header.levels) - 1))
    except InputError as fault:
        raise damage_error(file, fault.message) from None
    buffer = io.BytesIO()
    options = EncodeOptions(min_level=-len(row["ends"]))
    detail = encode_to(buffer, texels, options)
    data = buffer.getvalue()
    components = int(row["components"])
    # Of the levels that are not stored, the row knows more.
    kept = len(row["ends"])
    beyond = offsets_of(row)[kept - 1]
    changed = {
        "texelBytes": components,
        "gpuTexelBytes": gpu_texel_bytes(components, components),
        "ends": [level.end for level in read_header(data).levels],
        "differences": [*detail.differences, *row["differences"][kept:]],
        "color": [min(255, max(0, value + beyond)) for value in detail.color],
        "offsets": [*(n + beyond for n in detail.offsets), *offsets_of(row)[kept:]],
    }
    note = f"{file.name} was {before}, which browsers do not read: encoded again as fast, 8 bits"
    return SiteTexture({**row, **changed}, data, note)


def lean_glb(data: bytes) -> bytes:
    """A cell's GLB with nothing but what the page reads. Raises FileError as `unpack`."""
    document, binary = unpack(data)
    looks: list[Mapping[str, Any]] = []
    primitives = []
    for node in document.get("nodes", ()):
        for primitive in document["meshes"][node["mesh"]]["primitives"]:
            look = _look(document["materials"][primitive["material"]], node.get("extras", {}))
            if look not in looks:
                looks.append(look)
            primitives.append(primitive | {"material": looks.index(look)})
    accessors: list[dict[str, Any]] = document.get("accessors", [])
    # Equal arrays of plain cells share an accessor.
    required = document.get("extensionsRequired", [])
    merged = primitives
    if MESHOPT in required:
        binary = _code_colors(document, primitives, binary)
        merged = _merge(primitives, accessors)
    used = sorted({a for p in merged for a in (*p["attributes"].values(), p["indices"])})
    place = {accessor: n for n, accessor in enumerate(used)}
    for primitive in merged:
        attributes = primitive["attributes"].items()
        primitive["attributes"] = {name: place[number] for name, number in attributes}
        primitive["indices"] = place[primitive["indices"]]
    # Those of images go with the images.
    names = ("extensionsUsed", "extensionsRequired")
    lean = dict.fromkeys(names, required) if required else {}
    top = {"extras": document["scenes"][0]["extras"]}
    lean = {"asset": {"version": "2.0"}} | lean | {"scenes": [top]}
    if merged:
        top["nodes"] = [0]
        lean |= {"nodes": [{"mesh": 0}], "meshes": [{"primitives": merged}], "materials": looks}
        lean["accessors"] = [accessors[number] for number in used]
        lean |= {name: document[name] for name in ("bufferViews", "buffers")}
    return pack(lean, binary)


def _code_colors(
    document: Mapping[str, Any], primitives: Sequence[dict[str, Any]], binary: bytes
) -> bytes:
    """The buffer with codes in place of the colours of vertices; changes the document with it."""
    painted = [p["attributes"] for p in primitives if "COLOR_0" in p["attributes"]]
    colors = {document["accessors"][a["COLOR_0"]]["bufferView"] for a in painted}
    for number in {attributes["COLOR_0"] for attributes in painted}:
        document["accessors"][number] |= {"componentType": UNSIGNED_BYTE, "normalized": False}
    for attributes in painted:
        attributes[CODES] = attributes.pop("COLOR_0")
    data = b""
    for number, view in enumerate(document.get("bufferViews", ()) if colors else ()):
        coded = view["extensions"][MESHOPT]
        begin = coded.get("byteOffset", 0)
        stream = binary[begin : begin + coded["byteLength"]]
        if number in colors:
            code = encode_srgb(np.frombuffer(decode(stream, coded), "<u2").reshape(-1, 4) / 65535)
            code[:, [0, 2]] -= code[:, [1]]
            code[:, 3] = 0
            stream = encode_attributes(code, WHOLE_BYTES)
            view |= {"byteLength": code.size, "byteStride": 4}
            coded["byteStride"] = 4
        data += bytes(-len(data) % 4)
        coded |= {"byteOffset": len(data), "byteLength": len(stream)}
        data += stream
    if colors:
        document["buffers"][0]["byteLength"] = len(data)
    return data or binary


def _look(material: Mapping[str, Any], of_object: Mapping[str, Any]) -> dict[str, Any]:
    """What the page reads of a material, and of the extras of the object that has it."""
    look = {name: material[name] for name in _LOOK if name in material}
    surface = material["pbrMetallicRoughness"]
    extras = {**of_object, **material.get("extras", {})}
    for name, members, source in (
        ("pbrMetallicRoughness", _SURFACE + _GLOSS * ("probe" in extras), surface),
        ("extras", _EXTRAS, extras),
    ):
        if kept := {member: source[member] for member in members if member in source}:
            look[name] = kept
    return look


def _merge(
    primitives: list[dict[str, Any]], accessors: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Primitives in the order of their indices; neighbours with the same look and arrays as one.
    The accessors of their indices grow."""
    merged: list[dict[str, Any]] = []
    end = (-1, -1)
    for primitive in sorted(primitives, key=lambda p: _range(accessors[p["indices"]])):
        accessor = accessors[primitive["indices"]]
        view, begin, stop = _range(accessor)
        last = merged[-1] if merged else {}
        same = all(last.get(name) == primitive[name] for name in ("attributes", "material"))
        if same and (view, begin) == end:
            accessors[last["indices"]]["count"] += accessor["count"]
        else:
            merged.append(dict(primitive))
        end = view, stop
    return merged


def _range(accessor: Mapping[str, Any]) -> tuple[int, int, int]:
    """The view of indices, and the first and last byte in it."""
    begin = accessor.get("byteOffset", 0)
    size = int(COMPONENTS[accessor["componentType"]][-1]) * accessor["count"]
    return accessor["bufferView"], begin, begin + size
