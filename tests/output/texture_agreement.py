"""Compares the textures of one emitted database with the hints, the GLBs and other forms."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from ptmtools.errors import PtmError
from ptmtools.output.gltf_reader import ReadGlb, ReadMaterial, ReadPrimitive
from ptmtools.texture import load_image, read_header
from ptmtools.texture.detail import Detail, compare_levels, detail_of
from ptmtools.texture.pyramid import build_pyramid
from ptmtools.texture.reader import decode_levels
from ptmtools.texture.samples import KINDS, in_eight_bits
from ptmtools_systems.apo.files import inflate_texels
from ptmtools_systems.apo.model import Octree
from ptmtools_systems.apo.octree import fault_of
from ptmtools_systems.apo.traversal import look_up
from ptmtools_systems.interlace import deinterlace, read_manifest
from ptmtools_systems.interlace.steps import scale

#: Relative slack of `differences` of levels, which are rounded, and summed in another order here.
DIFFERENCE_SLACK = 0.01
#: Slack of an object's points beyond the cube, for single precision, as a share of its side.
CUBE_SLACK = 1e-5
#: Largest share of an object's points without a texel. A few percent lie between the samples that
#: the octree was made from; of another object's octree most do.
MOST_BARE = 0.5


def detail_of_levels(levels: Iterable[Any]) -> tuple[Detail, Any]:
    """The `Detail` of levels (h, w, c), given coarsest first; and the finest level."""
    following = iter(levels)
    coarsest = finest = next(following)
    above = []
    for level in following:
        above.append(compare_levels(level, finest))
        finest = level
    return detail_of(coarsest, above), finest


def textures(www: Path, index: Any, statistics: Any) -> Iterator[str]:
    """The differences between the `.ptm` files, their fallback images, the index, the statistics
    and the interlaced sets."""
    hashes = [row["sha256"] for row in statistics["textures"]] if statistics else []
    for i, row in enumerate(index["textures"]):
        with suppress(OSError, PtmError, KeyError, IndexError):
            data = (www / unquote(row["file"])).read_bytes()
            levels = list(decode_levels(data))
            if (previews := row.get("previews")) and previews[-1].get("exact"):
                image = load_image((www / unquote(previews[-1]["file"])).read_bytes()).array()
                whole = build_pyramid(image)
                if not all(map(np.array_equal, levels, whole)):
                    yield f"texture: {row['file']}: levels of another image"
                levels += whole[len(levels) :]
            for fault in _texture(row, levels, www):
                yield f"texture: {row['file']}: {fault}"
            if hashes and hashes[i] != hashlib.sha256(data).hexdigest():
                yield f"texture: {row['file']}: sha256"
            template = index.get("textureSets", {}).get("interlace", "")
            folder = www / template.replace("{name}", Path(row["file"]).stem)
            kind = KINDS[read_header(data).kind]
            if template and (fault := _set(folder, row, levels[-1], kind)):
                yield f"set: {row['file']}: {fault}"


def _texture(row: Mapping[str, Any], levels: Sequence[Any], www: Path) -> Iterator[str]:
    detail, _ = detail_of_levels(levels)
    listed = row.get("differences", detail.differences)
    if len(listed) != len(levels) or not np.allclose(
        listed, detail.differences, DIFFERENCE_SLACK, 0
    ):
        yield "differences"
    if row.get("color", list(detail.color)) != list(detail.color):
        yield "color"
    if row.get("offsets", [0] * len(levels)) != list(detail.offsets):
        yield "offsets"
    if row["fallback"] is not None:
        with suppress(OSError, PtmError, TypeError):
            image = load_image((www / unquote(row["fallback"])).read_bytes()).array()
            if not _same_image(levels[row["fallbackLevel"]], image):
                yield f"{row['fallback']} shows something else"


def _same_image(one: Any, other: Any) -> bool:
    if one.shape[2] != other.shape[2]:
        one, other = _rgba(one), _rgba(other)
    return one.dtype == other.dtype and np.array_equal(one, other)


def _rgba(texels: Any) -> Any:
    """Texels of integers, (h, w, 1 to 4), as red, green, blue and alpha."""
    count = texels.shape[2]
    top = np.iinfo(texels.dtype).max if texels.dtype.kind == "u" else 1
    colour = texels[:, :, :3] if count > 2 else np.repeat(texels[:, :, :1], 3, axis=2)
    alpha = texels[:, :, count - 1 :] if count in (2, 4) else np.full_like(colour[:, :, :1], top)
    return np.concatenate([colour, alpha], axis=2)


def _set(folder: Path, row: Mapping[str, Any], finest: Any, kind: Any) -> str:
    """The reason why an interlaced set is not that of a texture; "" if it is."""
    with suppress(PtmError):
        interlaced = read_manifest(folder)
        if not interlaced.lossless:
            return f"{interlaced.container} is not lossless"
        if interlaced.original != (row["width"], row["height"]):
            return "another size"
        if interlaced.components != row["components"]:
            return "other components"
        if interlaced.kind != ("uint8" if kind.is_float else kind.name):
            return "another kind of samples"
        joined = deinterlace(folder)
        texels = in_eight_bits(finest) if finest.dtype.kind == "f" else finest
        if texels.shape[:2] != (interlaced.height, interlaced.width):
            texels = scale(texels, interlaced.width, interlaced.height)
        differ = int((texels.reshape(joined.shape) != joined).any(axis=-1).sum())
        return f"{differ} texels differ" if differ else ""
    return ""


# GLBs and hints


def materials(name: str, glb: ReadGlb, index: Any) -> Iterator[str]:
    """The materials of a GLB that differ from the textures that they name."""
    for material in dict.fromkeys(p.material for p in glb.primitives):
        if material.texture is not None and 0 <= material.texture < len(index["textures"]):
            row = index["textures"][material.texture]
            if fault := _material(material, row):
                yield f"texture: {name}: {fault}"


def _material(material: ReadMaterial, row: Mapping[str, Any]) -> str:
    if [material.ptm, material.image] != [u and f"../{u}" for u in (row["file"], row["fallback"])]:
        return f"{material.ptm} and {material.image} are not texture {material.texture}"
    if material.blends and material.factor[3] == 1 and row["components"] in (1, 3):
        return f"the material blends, but texture {material.texture} is opaque"
    return ""


def octrees(www: Path, index: Any, glbs: Mapping[str, ReadGlb]) -> Iterator[str]:
    """The octree textures that do not fit the objects of the GLBs that name them."""
    rows = index.get("octrees", ())
    shapes: list[list[tuple[str, ReadPrimitive]]] = [[] for _ in rows]
    for name, glb in glbs.items():
        for shape in glb.primitives:
            if shape.extras.get("octree", len(rows)) < len(rows):
                shapes[shape.extras["octree"]].append((name, shape))
    for row, of_row in zip(rows, shapes, strict=True):
        if glbs and not of_row:
            yield f"octree: no GLB has {row['object']!r}"
        inside = [np.zeros((0, 3))]
        for name, shape in of_row:
            corner = shape.point.astype(np.float64)[shape.triangle]
            points = np.concatenate([corner.reshape(-1, 3), corner.mean(axis=1)])
            q = (points - row["cube"]["low"]) / row["cube"]["side"]
            if shape.object != row["object"]:
                yield f"octree: {name}: {shape.place}, another object"
            elif (abs(q - 0.5) > 0.5 + CUBE_SLACK).any():
                yield f"octree: {name}: {shape.place}, leaves the cube"
            else:
                inside.append(q)
        with suppress(OSError, PtmError, ValueError):
            if _bare(www, row, np.concatenate(inside)) > MOST_BARE:
                yield f"octree: points of {row['object']!r} have no texel"


def _bare(www: Path, row: Mapping[str, Any], q: Any) -> float:
    """The share of an object's points without a texel in its octree."""
    start = np.concatenate([[0], np.cumsum(row["levels"], dtype=np.int64)])
    data = (www / unquote(row["file"])).read_bytes()
    texels = inflate_texels(data, start, row)
    octree = Octree(texels, start, np.array(row["cube"]["low"]), row["cube"]["side"])
    if not len(q) or fault_of(octree):
        return 0.0
    # The walk ends in an inner node where there is no texel.
    return float((octree.texels[look_up(octree, q).address, 3] > 0).mean())
