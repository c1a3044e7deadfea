"""The check of the GLBs and of the octree textures of their objects (docs/formats/apo.md), each by
itself and against `hints.json`."""

from __future__ import annotations

import posixpath
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.diagnostics import Place
from ptmtools.errors import InputError
from ptmtools.output.gltf_reader import ReadGlb, ReadMaterial, ReadPrimitive, read_glb
from ptmtools.output.names import CELL_FOLDER, GLTF, GLTF_FOLDER, HINTS, UP, cell_name
from ptmtools.output.validation.files import ReadHints, ServedDatabase

if TYPE_CHECKING:
    from ptmtools.neighbours.apo.model import Octree

#: Texels of an octree take less than this many bytes, however they are deflated: the texels are
#: fewer than the addresses.
_MOST_BYTES = 1 << 27
#: Slack of an object's points beyond the cube, for single precision, as a share of its side.
_CUBE_SLACK = 1e-5
#: Largest share of an object's points without a texel. A few percent lie between the samples that
#: the octree was made from; of another object's octree most do.
_MOST_BARE = 0.5

#: The shapes of an octree's object, each with the path of its file.
Shapes = list[tuple[str, ReadPrimitive]]


def read_file(path: str, data: bytes) -> ReadGlb | None:
    """A GLB; None of other files."""
    return read_glb(data) if path.endswith(".glb") else None


def check_files(database: ServedDatabase) -> Mapping[str, int]:
    """Compares the GLBs with the hints; returns no counts."""
    files, hints = database.files, database.hints
    present = _stems(files, GLTF_FOLDER, ".glb")
    if hints is None:
        expected = _stems(files, CELL_FOLDER, ".wrl") or present
    else:
        urls = hints.urls(GLTF) or ()
        expected = {posixpath.splitext(posixpath.basename(url))[0] for url in urls}
    for stem in sorted(expected ^ present):
        message = "is missing" if stem in expected else "belongs to no cell"
        database.at(f"{GLTF_FOLDER}/{stem}.glb").add("PTM-D699", message)
    textures = hints.index["textures"] if hints else None
    for stem in sorted(present):
        path = f"{GLTF_FOLDER}/{stem}.glb"
        cell: ReadGlb | None = database.contents.get(path)
        if cell is None:
            continue
        if not cell.name == stem == cell_name(cell.cell):
            message = f"is named {cell.name!r}, cell {cell.cell}"
            database.at(path, "scene").add("PTM-D731", message)
        for material in dict.fromkeys(primitive.material for primitive in cell.primitives):
            for url in (material.image, material.ptm):
                if url is not None:
                    database.resolve(path, url)
            if textures is not None and material.texture is not None:
                _check_texture(material, textures, database.at(path, "materials"))
    return {}


def _check_texture(material: ReadMaterial, textures: list[Any], at: Place) -> None:
    """Checks a material that names a texture of the hints."""
    place = material.texture
    assert place is not None
    if not 0 <= place < len(textures):
        at.add("PTM-D704", f"the hints have no texture {place}")
        return
    record = textures[place]
    urls = [url and UP + url for url in (record["file"], record["fallback"])]
    if [material.ptm, material.image] != urls:
        at.add("PTM-D704", f"{material.ptm} and {material.image} are not texture {place}")
    elif material.blends and material.factor[3] == 1 and record["components"] in (1, 3):
        at.add("PTM-D704", f"the material blends, but texture {place} is opaque")


def _stems(files: Collection[str], folder: str, suffix: str) -> set[str]:
    """The names, without suffix, of the files of one kind in a folder."""
    plain = (posixpath.splitext(file) for file in files if posixpath.dirname(file) == folder)
    return {posixpath.basename(stem) for stem, end in plain if end == suffix}


def check_octrees(hints: ReadHints, database: ServedDatabase) -> None:
    """Compares each octree texture with its row (it ends with its last level, each level inflates
    by itself to the right number of texels, and these form an octree) and with the objects of
    the GLBs that name it."""
    rows = hints.index.get("octrees", ())
    files = database.resolve_each(HINTS, "octrees", [row["file"] for row in rows])
    shapes_of = _shapes(database, len(rows))
    for i, (row, file) in enumerate(zip(rows, files, strict=True)):
        at = database.at(HINTS, f"octrees[{i}]")
        if fault := _row_fault(row):
            at.add("PTM-D700", fault)
            continue
        if shapes_of is not None and not shapes_of[i]:
            at.add("PTM-D677", f"no GLB has {row['object']!r}")
        if file:
            head = database.head(file, row["ends"][-1] + 1)
            octree = _read(row, head, database.at(file))
            inside = [np.zeros((0, 3))]
            for path, shape in shapes_of[i] if shapes_of else ():
                q = _place(row, shape)
                if fault := _shape_fault(row, q, shape):
                    database.at(path, shape.place).add("PTM-D704", fault)
                else:
                    inside.append(q)
            if octree is not None and (bare := _bare(octree, np.concatenate(inside))) > _MOST_BARE:
                at.add("PTM-D704", f"{bare:.0%} of the points of {row['object']!r} have no texel")


def _shapes(database: ServedDatabase, count: int) -> list[Shapes] | None:
    """For each octree the shapes that name it; None without GLBs."""
    glbs = [(path, glb) for path, glb in database.contents.items() if isinstance(glb, ReadGlb)]
    shapes: list[Shapes] = [[] for _ in range(count)]
    for path, glb in glbs:
        for shape in glb.primitives:
            if shape.octree is None:
                continue
            if shape.octree >= count:
                message = f"the hints have no octree texture {shape.octree}"
                database.at(path, shape.place).add("PTM-D704", message)
            else:
                shapes[shape.octree].append((path, shape))
    return shapes if glbs else None


def _row_fault(row: Mapping[str, Any]) -> str:
    """The fault of a row by itself; "" if there is none."""
    from ptmtools.neighbours.apo.model import ADDRESS_BITS

    levels, ends = row["levels"], row["ends"]
    if not len(levels) == len(ends) == len(row["crc32"]):
        return "levels, ends and crc32 are not aligned"
    if min(b - a for a, b in zip([0, *ends], ends, strict=False)) <= 0:
        return "ends are not in ascending order"
    if sum(levels) > 1 << ADDRESS_BITS or ends[-1] > _MOST_BYTES:
        return f"has {sum(levels):,} texels in {ends[-1]:,} bytes, more than an octree can have"
    return ""


def _read(row: Mapping[str, Any], data: bytes, at: Place) -> Octree | None:
    """The octree of a row; None, with an issue, if it is invalid."""
    from ptmtools.neighbours.apo.files import Stream, inflated
    from ptmtools.neighbours.apo.model import Octree
    from ptmtools.neighbours.apo.octree import fault_of

    start = np.concatenate([[0], np.cumsum(row["levels"], dtype=np.int64)])
    if len(data) != row["ends"][-1]:
        less = len(data) < row["ends"][-1]
        at.add("PTM-D710", f"ends {'before' if less else 'after'} the last level")
    try:
        texels = inflated(data, start, Stream(row["file"], row["ends"], row["crc32"]))
    except InputError as error:
        at.add("PTM-D710", error.message, error.place or "")
        return None
    octree = Octree(texels, start, np.array(row["cube"]["low"]), row["cube"]["side"])
    if fault := fault_of(octree):
        place, message = fault
        at.add("PTM-D710", message, place)
        return None
    return octree


def _place(row: Mapping[str, Any], shape: ReadPrimitive) -> Floats:
    """(n, 3) the corners and centroids of a shape's triangles in a row's cube, 0 to 1."""
    corner = shape.point.astype(np.float64)[shape.triangle]
    points: Floats = np.concatenate([corner.reshape(-1, 3), corner.mean(axis=1)])
    q: Floats = (points - row["cube"]["low"]) / row["cube"]["side"]
    return q


def _shape_fault(row: Mapping[str, Any], q: Floats, shape: ReadPrimitive) -> str:
    """The reason why a shape, at ``q`` in the cube, cannot have a row's octree; "" if it can."""
    if shape.object != row["object"]:
        return f"belongs to {shape.object!r}, its octree texture to {row['object']!r}"
    if (abs(q - 0.5) > 0.5 + _CUBE_SLACK).any():
        return "leaves the cube of its octree texture"
    return ""


def _bare(octree: Octree, q: Floats) -> float:
    """The share of an object's points, over all its shapes, without a texel in the octree."""
    from ptmtools.neighbours.apo.traversal import plain_look_up

    if not len(q):
        return 0.0
    # The walk ends in an inner node where there is no texel.
    return float((octree.texels[plain_look_up(octree, q).address, 3] > 0).mean())
