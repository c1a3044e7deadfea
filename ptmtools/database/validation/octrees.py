"""Checks octree textures against `hints.json` (docs/formats/apo.md) and against the objects of the
GLBs that they belong to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.database.gltf.reader import ReadGlb, ReadPrimitive
from ptmtools.database.names import HINTS
from ptmtools.errors import InputError
from ptmtools.findings import Place

if TYPE_CHECKING:
    from ptmtools.apo.model import Octree
    from ptmtools.database.validation.hints import ReadHints
    from ptmtools.database.validation.served import ServedDatabase

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
    from ptmtools.apo.model import ADDRESS_BITS

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
    from ptmtools.apo.model import Octree
    from ptmtools.apo.reading import Stream, inflated
    from ptmtools.apo.texels import fault_of

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
    from ptmtools.apo.traversal import plain_look_up

    if not len(q):
        return 0.0
    # There the walk ends in a node with children.
    return float((octree.texels[plain_look_up(octree, q).address, 3] > 0).mean())
