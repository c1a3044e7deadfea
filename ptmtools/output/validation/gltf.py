"""What the glTF files must satisfy: each by itself, and beside the hints and the VRML files.

A GLB has the shapes of its cell's VRML file, in the same order and bit for bit: the same triangles,
texture coordinates turned upside down, the same images and sides.

Checks octree textures against `hints.json` (docs/formats/apo.md) and against the objects of the
GLBs that they belong to."""

from __future__ import annotations

import posixpath
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.diagnostics import Place
from ptmtools.errors import InputError
from ptmtools.output.gltf import WRAPS, flipped, linear
from ptmtools.output.gltf_reader import ReadGlb, ReadMaterial, ReadPrimitive, read_glb
from ptmtools.output.names import CELL_FOLDER, GLTF_FOLDER, HINTS, UP, cell_name
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.vrml_reader import Document, Node
from ptmtools.scene.colors import to_srgb

if TYPE_CHECKING:
    from ptmtools.neighbours.apo.model import Octree
    from ptmtools.output.validation.hints import ReadHints


#: How far a colour may be off that went through the decimals of VRML.
_SLACK = 1e-5
#: Half a level of 255, and what is lost in 16 bits of linear light.
_LEVEL = 0.6 / 255


#: The form of the index that these files are.
_FORM = "gltf"


def read_file(path: str, data: bytes) -> ReadGlb | None:
    """A GLB; nothing of other files."""
    return read_glb(data) if path.endswith(".glb") else None


def check_files(database: ServedDatabase) -> Mapping[str, int]:
    """Holds them against each other, the hints and the VRML files; counts nothing."""
    files, held, hints = database.files, database.held, database.hints
    there = _stems(files, GLTF_FOLDER, ".glb")
    if hints is None:
        wanted = _stems(files, CELL_FOLDER, ".wrl") or there
    else:
        wanted = {posixpath.splitext(posixpath.basename(url))[0] for url in hints.urls(_FORM) or ()}
    for stem in sorted(wanted ^ there):
        what = "is missing" if stem in wanted else "belongs to no cell"
        database.at(f"{GLTF_FOLDER}/{stem}.glb").add("PTM-D730", what)
    textures = hints.index["textures"] if hints else None
    for stem in sorted(there):
        path = f"{GLTF_FOLDER}/{stem}.glb"
        cell: ReadGlb | None = held.get(path)
        if cell is None:
            continue
        if not cell.name == stem == cell_name(cell.cell):
            message = f"says that it is {cell.name!r}, cell {cell.cell}"
            database.at(path, "scene").add("PTM-D732", message)
        for material in dict.fromkeys(primitive.material for primitive in cell.primitives):
            for url in (material.image, material.ptm):
                if url is not None:
                    database.resolve(path, url)
            if textures is not None and material.texture is not None:
                _check_texture(material, textures, database.at(path, "materials"))
        document: Document | None = held.get(f"{CELL_FOLDER}/{stem}.wrl")
        if document is not None:
            _compare_shapes(cell, document.of_type("Shape"), database.at(path))
    return {}


def _check_texture(material: ReadMaterial, textures: list[Any], at: Place) -> None:
    """A material that says which texture of the hints it has."""
    place = material.texture
    assert place is not None
    if not 0 <= place < len(textures):
        at.add("PTM-D736", f"the hints have no texture {place}")
        return
    record = textures[place]
    named = [url and UP + url for url in (record["file"], record["fallback"])]
    if [material.ptm, material.image] != named:
        at.add("PTM-D736", f"{material.ptm} and {material.image} are not texture {place}")
    elif material.blends and material.factor[3] == 1 and record["components"] in (1, 3):
        at.add("PTM-D739", f"blends, but texture {place} is opaque")


def _compare_shapes(cell: ReadGlb, shapes: list[Node], at: Place) -> None:
    if len(shapes) != len(cell.primitives):
        at.add("PTM-D738", f"{len(cell.primitives)} primitives for {len(shapes)} shapes")
        return
    for primitive, shape in zip(cell.primitives, shapes, strict=True):
        here = at.at(primitive.place)
        corners = _corners(shape, "coord", "coordIndex")
        held = primitive.point[primitive.triangle]
        if corners is not None and not np.array_equal(corners.astype(np.float32), held):
            here.add("PTM-D738", f"not the triangles of {shape.name}")
        uv = None if primitive.uv is None else primitive.uv[primitive.triangle]
        mapped = _corners(shape, "texCoord", "texCoordIndex")
        if mapped is None:
            same = uv is None or "texCoord" in shape.at("geometry")
        else:
            same = uv is not None and np.array_equal(flipped(mapped.astype(np.float32)), uv)
        if not same:
            here.add("PTM-D738", f"not the texture coordinates of {shape.name}")
        if fault := _other_colors(primitive, shape) or _other_look(primitive.material, shape):
            here.add("PTM-D739", f"{fault} {shape.name}")


def _other_look(material: ReadMaterial, shape: Node) -> str:
    """In what a material differs from a VRML shape; "" if it does not."""
    geometry = shape.at("geometry")
    texture, surface = shape.at("appearance", "texture"), shape.at("appearance", "material")
    if material.two_sided == geometry.get("solid", True):
        return "not the sides of"
    urls = sorted(url for url in (material.image, material.ptm) if url is not None)
    if sorted(texture.get("url", ())) != urls:
        return "not the images of"
    wrap = tuple(
        WRAPS["repeat" if texture.get(name, True) else "clamp"] for name in ("repeatS", "repeatT")
    )
    if material.wrap != wrap:
        return "does not wrap as"
    faces = shape.at("geometry", "color").get("color", np.ones((1, 3)))
    if shape.at("geometry").get("colorPerVertex", True):  # of corners, which are no tint
        faces = np.ones((1, 3))
    color = surface.get("diffuseColor", faces)
    alpha = 1 - surface.get("transparency", np.zeros(1))
    wanted = np.array([*(linear(float(c)) for c in np.ravel(color)[:3]), *alpha])
    if len(wanted) != 4 or np.abs(wanted - material.factor).max() > _SLACK:
        return "not the colour of"
    if material.factor[3] < 1 and not material.blends:
        return "opaque, unlike"
    return ""


def _other_colors(primitive: ReadPrimitive, shape: Node) -> str:
    """The same of the colours of their corners."""
    geometry = shape.at("geometry")
    painted = "colorIndex" in geometry and geometry.get("colorPerVertex", True)
    if painted != (primitive.color is not None):
        return "not the colours of the corners of"
    colors = _corners(shape, "color", "colorIndex", "color") if painted else None
    if colors is None or primitive.color is None:
        return ""
    held = to_srgb(primitive.color)[primitive.triangle]
    same = held.shape == colors.shape and np.abs(held - colors).max(initial=0.0) <= _LEVEL
    return "" if same else "not the colours of the corners of"


def _corners(
    shape: Node, values: str, index: str, field: str = "point"
) -> NDArray[np.float64] | None:
    """(m, 3, k) the points of a shape's triangles; None without, or if the indices are wrong,
    which the check of the VRML file reports."""
    try:
        rows = shape.at("geometry")[index].reshape(-1, 4)[:, :3]
        corners: NDArray[np.float64] = shape.at("geometry", values)[field][rows]
    except (KeyError, ValueError, IndexError):
        return None
    return corners


def _stems(files: Collection[str], folder: str, suffix: str) -> set[str]:
    """The names, without suffix, of the files of one kind in a folder."""
    plain = (posixpath.splitext(file) for file in files if posixpath.dirname(file) == folder)
    return {posixpath.basename(stem) for stem, end in plain if end == suffix}


#: More than as many texels as there are addresses take, deflated in any way.
_MOST = 1 << 27
#: Points of an object may leave the cube by such a share of its side, for single precision.
_OUTSIDE = 1e-5
#: Of so many points of an object some fall between the samples that the octree was made of: some
#: percent; of another object's octree most do.
_BARE = 0.5

#: The shapes of an octree's object, and the file that each is in.
Shown = list[tuple[str, ReadPrimitive]]


def check_octrees(hints: ReadHints, database: ServedDatabase) -> None:
    """Holds each octree texture against its row: it ends with its last level, each level inflates
    by itself to the texels that it should have, and these are an octree; and against the objects
    of the GLBs that say that it is theirs."""
    rows = hints.index.get("octrees", ())
    files = database.resolve_each(HINTS, "octrees", [row["file"] for row in rows])
    shown = _shown(database, len(rows))
    for i, (row, file) in enumerate(zip(rows, files, strict=True)):
        if wrong := _contradiction(row):
            database.at(HINTS, f"octrees[{i}]").add("PTM-D860", wrong)
            continue
        if shown is not None and not shown[i]:
            database.at(HINTS, f"octrees[{i}]").add("PTM-D866", f"{row['object']!r} in no GLB")
        if file:
            head = database.head(file, row["ends"][-1] + 1)
            octree = _read(row, head, database.at(file))
            inside = [np.zeros((0, 3))]
            for path, shape in shown[i] if shown else ():
                q = _place(row, shape)
                if wrong := _misfit(row, q, shape):
                    database.at(path, shape.place).add("PTM-D865", wrong)
                else:
                    inside.append(q)
            if octree is not None and (bare := _bare(octree, np.concatenate(inside))) > _BARE:
                wrong = f"{bare:.0%} of the points of {row['object']!r} have no texel in it"
                database.at(HINTS, f"octrees[{i}]").add("PTM-D865", wrong)


def _shown(database: ServedDatabase, count: int) -> list[Shown] | None:
    """Of each octree the shapes that it is of; None without GLBs."""
    glbs = [(path, held) for path, held in database.held.items() if isinstance(held, ReadGlb)]
    found: list[Shown] = [[] for _ in range(count)]
    for path, glb in glbs:
        for shape in glb.primitives:
            if shape.octree is None:
                continue
            if shape.octree >= count:
                message = f"the hints have no octree texture {shape.octree}"
                database.at(path, shape.place).add("PTM-D865", message)
            else:
                found[shape.octree].append((path, shape))
    return found if glbs else None


def _contradiction(row: Mapping[str, Any]) -> str:
    """What is wrong with a row by itself; empty if nothing is."""
    from ptmtools.neighbours.apo.model import ADDRESS_BITS

    levels, ends = row["levels"], row["ends"]
    if not len(levels) == len(ends) == len(row["crc32"]):
        return "levels, ends and crc32 are not aligned"
    if min(b - a for a, b in zip([0, *ends], ends, strict=False)) <= 0:
        return "ends are not ascending"
    if sum(levels) > 1 << ADDRESS_BITS or ends[-1] > _MOST:
        return f"has {sum(levels):,} texels in {ends[-1]:,} bytes, more than there can be"
    return ""


def _read(row: Mapping[str, Any], data: bytes, at: Place) -> Octree | None:
    """The octree of a row; None, and a finding, if it is none."""
    from ptmtools.neighbours.apo.files import Stream, inflated
    from ptmtools.neighbours.apo.model import Octree
    from ptmtools.neighbours.apo.octree import fault_of

    start = np.concatenate([[0], np.cumsum(row["levels"], dtype=np.int64)])
    if len(data) != row["ends"][-1]:
        wrong = "ends before" if len(data) < row["ends"][-1] else "goes on behind"
        at.add("PTM-D861", f"{wrong} the last level")
    try:
        texels = inflated(data, start, Stream(row["file"], row["ends"], row["crc32"]))
    except InputError as fault:
        at.add("PTM-D862", fault.message, fault.place or "")
        return None
    octree = Octree(texels, start, np.array(row["cube"]["low"]), row["cube"]["side"])
    if wrong_place := fault_of(octree):
        place, wrong = wrong_place
        at.add("PTM-D863", wrong, place)
        return None
    return octree


def _place(row: Mapping[str, Any], shape: ReadPrimitive) -> Floats:
    """(n, 3) the corners and middles of a shape's triangles in a row's cube, 0 to 1."""
    corner = shape.point.astype(np.float64)[shape.triangle]
    points: Floats = np.concatenate([corner.reshape(-1, 3), corner.mean(axis=1)])
    q: Floats = (points - row["cube"]["low"]) / row["cube"]["side"]
    return q


def _misfit(row: Mapping[str, Any], q: Floats, shape: ReadPrimitive) -> str:
    """In what a shape, at ``q`` in the cube, is not of a row's object; empty if it is."""
    if shape.object != row["object"]:
        return f"is of {shape.object!r}, its octree texture of {row['object']!r}"
    if (abs(q - 0.5) > 0.5 + _OUTSIDE).any():
        return "leaves the cube of its octree texture"
    return ""


def _bare(octree: Octree, q: Floats) -> float:
    """The share of points of an object, all its shapes together, where the octree has none."""
    from ptmtools.neighbours.apo.traversal import plain_look_up

    if not len(q):
        return 0.0
    # There the walk ends in a node with children.
    return float((octree.texels[plain_look_up(octree, q).address, 3] > 0).mean())
