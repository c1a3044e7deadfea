"""A site with light whose pixels follow from a formula: strips before an eye, and what is around
them, in the files of a site of two rooms."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.glb import elements
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.gltf_compressed import CompressedBuffer
from ptmtools.output.gltf_shapes import Vertices
from ptmtools.rendering.tone import agx
from ptmtools.scene.colors import to_linear, to_srgb
from ptmtools.site.content import Site
from ptmtools.site.conversion import lean_glb
from ptmtools.site.entry import SiteEntry
from ptmtools.texture import EncodeOptions, encode, read_header

Floats = NDArray[np.float64]

#: The plane of the strips, m; their ends, m; the heights of each, m.
Z, LEFT, RIGHT = -6.0, -6.0, 2.5
STRIPS = {
    "mapped": (2.2, 3.2),
    "vertices": (1.0, 2.0),
    "unlit": (-0.2, 0.8),
    "bumpy": (-1.4, -0.4),
}
#: Eyes, one in each room, which look along -z; exposures of their cells.
EYES = [(-1.5, 1.5, 0.0), (1.5, 1.5, 0.0)]
EXPOSURE = [[0.6, 0.5, 0.7], [2.5, 3.0, 2.0]]
LIGHT = {
    "stops": 10,
    "hue": 2,
    "tone": "neutral",
    "sky": [0.5, 0.7, 1.4],
    "ground": [0.3, 0.2, 0.1],
}
#: Of the image, sRGB; the factors of the others, linear; white of lightmap and vertices.
BASE, FACTOR = (180, 120, 60), (0.5, 0.7, 0.9)
WHITE = {"mapped": 4.0, "bumpy": 4.0, "vertices": 2.0}
#: Codes of the texels of a row of the lightmap, and linear colours of vertices at its ends.
RAMP = np.rint(np.linspace((100.0, 240.0, 180.0), (240.0, 120.0, 180.0), 64))
COLORS = to_linear(np.array([(63, 243, 149), (231, 37, 149)]) / 255)
SLATE = np.array([0.16, 0.17, 0.19])


def lit_site(
    plain: Site,
    change: Callable[[dict[str, Any]], None] = lambda index: None,
    extras: Mapping[str, Any] | None = None,
) -> Site:
    """The site. ``change`` is called with its index; ``extras`` are others of the mapped strip,
    without those that are None."""
    (place,) = (name for name in plain.entries if name.startswith("data/index-"))
    document = json.loads(plain.entries[place].read())
    first = len(document["textures"])
    images = {
        "base": np.full((8, 8, 3), BASE, np.uint8),
        "light": np.broadcast_to(RAMP, (8, len(RAMP), 3)).astype(np.uint8),
        "flat": np.full((8, 8, 3), (128, 128, 255), np.uint8),
    }
    entries = dict(plain.entries)
    for name, image in images.items():
        data = encode(image, EncodeOptions())
        entries[f"data/{name}.ptm"] = SiteEntry(
            f"data/{name}.ptm", data, "application/octet-stream"
        )
        document["textures"].append(row_of(f"{name}.ptm", image, data))
    document["textures"][first + 1]["light"] = 0
    document["textures"][first + 2]["normals"] = True
    document.pop("meshes", None)
    for cell, exposure in zip(document["cells"], EXPOSURE, strict=True):
        cell["exposure"] = exposure
    document["light"] = dict(LIGHT)
    change(document)
    mapped = {"texture": first, "light": first + 1, "white": WHITE["mapped"]}
    bump = {"normal": first + 2, "normalCoords": 0, "white": WHITE["bumpy"]}
    materials = {
        "mapped": {"extras": {k: v for k, v in (mapped | (extras or {})).items() if v is not None}},
        "vertices": {"extras": {"white": WHITE["vertices"]}} | factor(FACTOR),
        "unlit": factor(FACTOR),
        "bumpy": {"extras": mapped | bump},
    }
    geometry = [glb(0, materials), glb(1, {})]
    for cell, data in zip(document["cells"], geometry, strict=True):
        name = f"data/{cell['geometry']}"
        entries[name] = replace(entries[name], source=data, state=None, digest="")
        name = f"data/{cell['record']}"
        record = json.loads(entries[name].read())
        for textures in record["textures"]:
            textures += [first, first + 1]
        entries[name] = changed(entries[name], record)
    entries[place] = changed(entries[place], document)
    return Site(entries, document)


def changed(entry: SiteEntry, document: Mapping[str, Any]) -> SiteEntry:
    """An entry with another document."""
    return replace(entry, source=json.dumps(document).encode(), state=None, digest="")


def row_of(file: str, image: NDArray[np.uint8], data: bytes) -> dict[str, Any]:
    """A texture of the index."""
    ends = [level.end for level in read_header(data).levels]
    sizes = {"width": image.shape[1], "height": image.shape[0], "components": 3}
    bytes_of = {"texelBytes": 3, "gpuTexelBytes": 4}
    color = np.rint(image.mean(axis=(0, 1))).astype(int).tolist()
    differences = [1] * len(ends)
    return (
        {"file": file, "ends": ends, "differences": differences, "color": color} | sizes | bytes_of
    )


def factor(color: tuple[float, float, float]) -> dict[str, Any]:
    return {"pbrMetallicRoughness": {"baseColorFactor": [*color, 1]}}


def glb(
    cell: int,
    materials: Mapping[str, Mapping[str, Any]],
    strips: Mapping[str, tuple[float, float]] = STRIPS,
    bent: Mapping[str, int] | None = None,
) -> bytes:
    """A strip of each material, one that blends a millimetre before the others. ``bent``: the x of
    normals at the ends of strips that have them, of 127."""
    scene = {"extras": {"cell": cell}, "nodes": list(range(len(materials)))}
    tree: dict[str, Any] = {"asset": {"version": "2.0"}, "scenes": [scene], "scene": 0}
    tree |= {"nodes": [], "meshes": [], "materials": [], "accessors": [], "bufferViews": []}
    binary = bytearray()

    def add(array: NDArray[Any], kind: str) -> int:
        view: dict[str, int] = {"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes}
        tree["bufferViews"].append(view)
        number = {"float32": 5126, "uint16": 5123, "int8": 5120}[array.dtype.name]
        row: dict[str, Any] = {"componentType": number, "count": len(array), "type": kind}
        row["normalized"] = kind == "VEC4"
        if array.dtype == np.int8:
            row["normalized"], view["byteStride"] = True, array.strides[0]
        elif kind != "SCALAR":
            row |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        tree["accessors"].append({"bufferView": len(tree["accessors"]), **row})
        binary.extend(array.tobytes())
        binary.extend(bytes(-len(binary) % 4))
        return len(tree["accessors"]) - 1

    for number, (name, material) in enumerate(materials.items()):
        low, high = strips[name]
        corners = np.array([(LEFT, low), (RIGHT, low), (RIGHT, high), (LEFT, high)])
        uv = add(np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32), "VEC2")
        z = Z + 0.001 * (material.get("alphaMode") == "BLEND")
        attributes = {"POSITION": add(np.insert(corners, 2, z, axis=1).astype(np.float32), "VEC3")}
        if bent and name in bent:
            normals = np.array([(x, 0, 100, 0) for x in (-bent[name], bent[name])], np.int8)
            attributes["NORMAL"] = add(normals[[0, 1, 1, 0]], "VEC3")
        if "light" in material.get("extras", {}):
            attributes |= {"TEXCOORD_0": uv, "TEXCOORD_1": uv}
        if name == "vertices":
            colors = np.insert(COLORS[[0, 1, 1, 0]], 3, 1, axis=1)
            attributes["COLOR_0"] = add(np.rint(65535 * colors).astype(np.uint16), "VEC4")
        indices = add(np.array([0, 1, 2, 0, 2, 3], np.uint16), "SCALAR")
        primitive = {"attributes": attributes, "indices": indices, "material": number}
        tree["meshes"].append({"primitives": [primitive]})
        tree["nodes"].append({"mesh": number})
        tree["materials"].append(material)
    return pack(tree | {"buffers": [{"byteLength": len(binary)}]}, bytes(binary))


def compressed(data: bytes) -> bytes:
    """A GLB of `glb` without normals as a published site has it."""
    tree, binary = unpack(data)
    buffer = CompressedBuffer(-10)

    def rows(numbers: Mapping[str, int], name: str) -> Any:
        if name not in numbers:
            return None
        accessor = tree["accessors"][numbers[name]]
        return elements(accessor, tree["bufferViews"][accessor["bufferView"]], binary)

    for mesh in tree["meshes"]:
        (primitive,) = mesh["primitives"]
        names = ("POSITION", "TEXCOORD_0", "COLOR_0", "TEXCOORD_1")
        point, uv, color, light = (rows(primitive["attributes"], name) for name in names)
        corner = rows(primitive, "indices").reshape(-1, 3).astype(np.int64)
        shape = Vertices(point, uv, color, corner, light)
        mesh["primitives"] = [buffer.take(shape, primitive["material"], (None, None, None))]
    for material in tree["materials"]:
        material.setdefault("pbrMetallicRoughness", {})
    buffer.finish()
    return lean_glb(pack(tree | buffer.members(), buffer.bytes()))


def developed(light: Floats, tone: str) -> Floats:
    """sRGB, 0 to 1, of exposed linear light (docs/formats/hints.md)."""
    if tone == "plain":
        return to_srgb(light.clip(0, 1))
    if tone == "agx":
        return to_srgb(agx(light))
    peak = light.max(axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        pressed = 1 - 0.04 / (peak - 0.6)
        white = 1 - 1 / (0.15 * (peak - pressed) + 1)
        bright = (light * pressed / peak) * (1 - white) + pressed * white
    return to_srgb(np.where(peak > 0.8, bright, light))


def evened(texel: Floats) -> Floats:
    """(..., 3) codes of texels."""
    luma = (texel * [0.299, 0.587, 0.114]).sum(axis=-1, keepdims=True)
    return np.asarray(luma + (texel - luma) / float(str(LIGHT["hue"])))


def view_of(
    eye: tuple[float, float, float],
    angle: float,
    size: tuple[int, int],
    exposure: Sequence[float],
    tone: str,
) -> tuple[Floats, dict[str, NDArray[np.bool_]]]:
    """(h, w, 3) of 255 what an eye sees along -z, in a picture of (w, h) pixels, and (h, w) where
    it sees each strip and the rest, without the edges."""
    width, height = size
    y, x = np.mgrid[0:height, 0:width]
    half = np.tan(angle / 2)
    across = (2 * (x + 0.5) / width - 1) * half * width / height
    up = (1 - 2 * (y + 0.5) / height) * half
    far = eye[2] - Z
    at, high = eye[0] + far * across, eye[1] + far * up
    t = ((at - LEFT) / (RIGHT - LEFT))[..., None]
    facing = 1 / np.sqrt(1 + across**2 + up**2)
    texel = t[..., 0] * len(RAMP) - 0.5
    code = np.stack([np.interp(texel, np.arange(len(RAMP)), part) for part in RAMP.T], axis=-1)
    code = evened(code)
    mapped = to_linear(np.array(BASE) / 255) * 4 * 2 ** (10 * (code / 255 - 1))
    vertices = np.array(FACTOR) * (COLORS[0] + (COLORS[1] - COLORS[0]) * t) * WHITE["vertices"]
    plain = to_srgb(np.array(FACTOR)) * (0.7 + 0.3 * facing[..., None])
    share = ((up * facing + 0.02) / 0.04).clip(0, 1)[..., None]
    share = share * share * (3 - 2 * share)
    around = np.array(LIGHT["ground"]) * (1 - share) + np.array(LIGHT["sky"]) * share
    around = (
        np.broadcast_to(SLATE, around.shape)
        if tone == "plain"
        else developed(around * np.array(exposure), tone)
    )
    colors = {
        "mapped": developed(mapped * np.array(exposure), tone),
        "vertices": developed(vertices * np.array(exposure), tone),
        "unlit": plain,
        "bumpy": developed(mapped * np.array(exposure), tone),
    }
    picture, masks, edge = around.copy(), {}, 0.1
    beyond = np.ones(at.shape, bool)
    for name, (low, top) in STRIPS.items():
        inside = (at > LEFT) & (at < RIGHT) & (high > low) & (high < top)
        picture[inside] = colors[name][inside]
        near = (abs(high - (low + top) / 2) < (top - low) / 2 + edge) & (at < RIGHT + edge)
        beyond &= ~(near & (at > LEFT - edge))
        masks[name] = (
            (at > LEFT + edge) & (at < RIGHT - edge) & (high > low + edge) & (high < top - edge)
        )
    return 255 * picture, masks | {"around": beyond}
