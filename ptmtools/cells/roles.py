"""Roles of triangles: structural, detail or door, by the names and classes of objects and by shape.

The class of an object acts like an option that names the object, unless the user names the triangle
in `--structural`, `--detail` or `--door`; but triangles that are structural by class divide the
building only if their area suffices. Detail by shape is furniture, statues and plants: small, dense
and round connected pieces, or whole objects, since a plant is a thousand pieces. Errors are safe:
detail hides nothing, so visible sets can only grow.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Ints, sum_by_group
from ptmtools.cells.facets import Facets, Welded
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.search import connect
from ptmtools.scene.model import Scene

#: Words for a door, in lower case.
_DOOR = re.compile(
    r"doors?|port[ea]s?|puertas?|tür(en)?|tuer(en)?|deur(en)?|dörr(ar)?|døre?r?|drzwi|dv[eě]ře|ajtó|"
    r"двер[ьи]"
)
#: Compounds that end in such a word, like Haustür, or begin with it, like doorleaf.
_COMPOUND = re.compile(
    r".*(doors?|tür|tuer|deur|dörr|dør)|"
    r"(door|tür|tuer|deur|dörr|dør)(leaf|panel|slab|wing|blatt|flügel|fluegel|blad)"
)
#: Words that only end like one, and parts of a doorway that are no leaf.
_NO_DOOR = re.compile(
    r"(out|in)doors?|way|frame|jamb|lintel|casing|handle|knob|mat|walls?|wand|mur[ao]?|pared|"
    r"pare[td]e|muur|vägg|væg|ściana|стена|rahmen|zarge|griff|cadre|dormant|marco|telaio|kozijn|karm"
)
#: Words of a name: runs of letters, each beginning where a capital follows a small letter.
_WORD = re.compile(r"[^\W\d_]+")
_HUMP = re.compile(r"(?<=[^\W\d_A-ZÀ-ÖØ-Þ])(?=[A-ZÀ-ÖØ-Þ])|(?<=[A-Z])(?=[A-Z][a-z])")


@dataclass(frozen=True)
class Designated:
    """The roles of T triangles; none is both structural and something else."""

    forced: Bools  # (T,) whether it divides the building whatever its area
    structural: Bools  # (T,) forced, or structural by class
    detail: Bools  # (T,)
    door: Bools  # (T,)

    @staticmethod
    def from_options(scene: Scene, options: SubdivideOptions) -> Designated:
        """The roles that the options name, and otherwise those of the objects' classes."""
        forced, detail, door = (
            triangles_matching(scene, patterns)
            for patterns in (options.structural, options.detail, options.door)
        )
        structural = forced
        if scene.kinds:
            free = ~(forced | detail | door)
            kind = np.array(scene.kinds)[scene.triangle_object]
            structural = structural | (free & (kind == "structural"))
            detail = detail | (free & (kind == "detail"))
            door = door | (free & (kind == "door"))
        return Designated(forced, structural, detail & ~structural, door & ~structural)


def triangles_matching(scene: Scene, patterns: Sequence[str]) -> Bools:
    """(T,) which triangles have an object or a material whose name matches a pattern."""
    return triangles_named(scene, lambda name: matches(name, patterns))


def triangles_named(scene: Scene, test: Callable[[str], bool]) -> Bools:
    """(T,) which triangles have an object or a material whose name passes a test."""
    objects = np.array([test(name) for name in scene.objects], dtype=bool)
    materials = np.array([test(material.name) for material in scene.materials], dtype=bool)
    return np.asarray(objects[scene.triangle_object] | materials[scene.triangle_material])


def matches(name: str, patterns: Sequence[str]) -> bool:
    """Whether a name matches one of the patterns, with * and ?."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def is_door_name(name: str) -> bool:
    """Whether a name is that of a door: `door_leaf_03`, `IfcDoor`, `Haustür`, but not `doorway`,
    `door_frame` or `outdoor_wall`."""
    composed = unicodedata.normalize("NFC", name)
    words = [word.lower() for word in _WORD.findall(_HUMP.sub(" ", composed))]
    if any(map(_NO_DOOR.fullmatch, words)):
        return False
    return any(_DOOR.fullmatch(word) or _COMPOUND.fullmatch(word) for word in words)


#: Detail fits into a box of this side, metres: the longest sofas and shelves.
LARGEST = 3.0
#: It is dense: it has at least this many triangles,
DENSE = 256
#: and compact: neither a sheet nor a rod. Its box's shortest side over its longest.
COMPACT = 0.1
#: Flat regions smaller than this share of `SubdivideOptions.wall_area` neither split nor block.
FLAT_SHARE = 0.01
#: No flat region of it is larger than this share of `SubdivideOptions.wall_area`,
LARGEST_FLAT_SHARE = 0.25
#: and no more of its surface than this is flat.
FLAT = 2 / 3


def _detail_groups(group: Ints, facets: Facets, wall_area: float) -> Bools:
    """(g,) which groups of triangles are detail; ``group``: (n,) that of each, from 0."""
    size = np.bincount(group)
    order, begin = np.argsort(group, kind="stable"), np.cumsum(size) - size
    corners = facets.mesh.corners[order]
    low = np.minimum.reduceat(corners.min(axis=1), begin)
    high = np.maximum.reduceat(corners.max(axis=1), begin)
    shortest, _, longest = np.sort(high - low, axis=1).T
    # The area of the flat region of each triangle: what could split or block.
    region = np.where(facets.whole, facets.area, 0.0)[facets.region]
    flat = np.where(region >= FLAT_SHARE * wall_area, facets.areas, 0.0)
    curved = sum_by_group(group, flat, len(size)) <= FLAT * sum_by_group(
        group, facets.areas, len(size)
    )
    curved &= np.maximum.reduceat(region[order], begin) <= LARGEST_FLAT_SHARE * wall_area
    small = (longest <= LARGEST) & (shortest >= COMPACT * longest)
    return np.asarray((size >= DENSE) & small & curved)


def detail_by_shape(facets: Facets, object_of: NDArray[np.integer], wall_area: float) -> Bools:
    """(n,) which triangles of a mesh are detail by shape; ``object_of``: (n,) their objects."""
    if not len(object_of):
        return np.zeros(0, dtype=bool)
    result = np.zeros(len(object_of), dtype=bool)
    for group in (connected_pieces(facets.mesh), np.unique(object_of, return_inverse=True)[1]):
        result |= _detail_groups(group, facets, wall_area)[group]
    return result


def connected_pieces(mesh: Welded) -> Ints:
    """(n,) the connected piece of each triangle; pieces share no corners."""
    point = connect(len(mesh.point), mesh.triangle)
    return np.unique(point[mesh.triangle[:, 0]], return_inverse=True)[1].reshape(-1)
