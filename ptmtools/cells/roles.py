"""Which triangles may bound a leaf, and which are of doors, by the names of their objects and
materials, and by the classes of their objects.

A class counts as an option that names the object, `--structural`, `--detail` or `--door`. Where
the user names a triangle in any of these, its class says nothing. There is one difference: what is
structural by its class is never detail and never a door leaf, but divides the building only as far
as its area says, like everything else. (Tried: whatever its area, as with `--structural`. Then each
tread and riser of a stair does: an office building of 8 storeys with a stair of 18 steps in each
had 836 leaves instead of 353, 2,170 portals instead of 506, 19.4 % of the volume at hand instead of
15.3, and visibility took 23 s instead of 0.2.)

Detail recognised by its shape: furniture, statues, plants, which can neither split nor block.

What divides a building and what hides is flat: a polygon that lies in a plane with others, a jamb,
the edge of a slab. A sofa of 50,000 triangles has none of that, but each of its triangles would be
asked whether it does. So what is small, dense and round is taken for detail, as if `--detail` named
it: connected pieces first, then whole objects, for a plant is a thousand pieces.

To err is safe: what is taken for detail hides nothing, so the visible sets can only grow.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, summed
from ptmtools.cells.connectivity import Welded
from ptmtools.cells.facets import Facets
from ptmtools.cells.options import SubdivideOptions
from ptmtools.scene.model import Scene

#: What a door is called: a word of a name, in lower case.
_DOOR = re.compile(
    r"doors?|port[ea]s?|puertas?|tür(en)?|tuer(en)?|deur(en)?|dörr(ar)?|døre?r?|drzwi|dv[eě]ře|ajtó|"
    r"двер[ьи]"
)
#: Words like Haustür, where what is before it says which door it is, and like doorleaf.
_COMPOUND = re.compile(
    r".*(doors?|tür|tuer|deur|dörr|dør)|"
    r"(door|tür|tuer|deur|dörr|dør)(leaf|panel|slab|wing|blatt|flügel|fluegel|blad)"
)
#: Words that only end like one, and what a thing is whose name says that it is at a door.
_NO_DOOR = re.compile(
    r"(out|in)doors?|way|frame|jamb|lintel|casing|handle|knob|mat|walls?|wand|mur[ao]?|pared|"
    r"pare[td]e|muur|vägg|væg|ściana|стена|rahmen|zarge|griff|cadre|dormant|marco|telaio|kozijn|karm"
)
#: Words of a name: runs of letters, each beginning where a capital follows a small letter.
_WORD = re.compile(r"[^\W\d_]+")
_HUMP = re.compile(r"(?<=[^\W\d_A-ZÀ-ÖØ-Þ])(?=[A-ZÀ-ÖØ-Þ])|(?<=[A-Z])(?=[A-Z][a-z])")


@dataclass(frozen=True)
class Designated:
    """Which triangles are said to be what; none is both structural and something else."""

    forced: Bools  # (T,) which divide the building whatever their area
    structural: Bools  # (T,) these and others
    detail: Bools  # (T,)
    door: Bools  # (T,)

    @staticmethod
    def of(scene: Scene, options: SubdivideOptions) -> Designated:
        """As the user says, and else as the classes of objects do."""
        forced, detail, door = (
            named(scene, patterns)
            for patterns in (options.structural, options.detail, options.door)
        )
        structural = forced
        if scene.kinds:
            untold = ~(forced | detail | door)
            kind = np.array(scene.kinds)[scene.triangle_object]
            structural = structural | (untold & (kind == "structural"))
            detail = detail | (untold & (kind == "detail"))
            door = door | (untold & (kind == "door"))
        return Designated(forced, structural, detail & ~structural, door & ~structural)


def named(scene: Scene, patterns: Sequence[str]) -> Bools:
    """(T,) which triangles have an object or a material of such a name."""
    return called(scene, lambda name: matches(name, patterns))


def called(scene: Scene, says: Callable[[str], bool]) -> Bools:
    """(T,) which triangles have an object or a material whose name says something."""
    objects = np.array([says(name) for name in scene.objects], dtype=bool)
    materials = np.array([says(material.name) for material in scene.materials], dtype=bool)
    return np.asarray(objects[scene.triangle_object] | materials[scene.triangle_material])


def matches(name: str, patterns: Sequence[str]) -> bool:
    """Whether one of the patterns, with * and ?, is a name's."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def says_door(name: str) -> bool:
    """Whether a name is that of a door: `door_leaf_03`, `IfcDoor`, `Haustür`, but not `doorway`,
    `door_frame` or `outdoor_wall`."""
    composed = unicodedata.normalize("NFC", name)
    words = [word.lower() for word in _WORD.findall(_HUMP.sub(" ", composed))]
    if any(map(_NO_DOOR.fullmatch, words)):
        return False
    return any(_DOOR.fullmatch(word) or _COMPOUND.fullmatch(word) for word in words)


#: Detail fits into a box of this side, metres: the longest sofas and shelves.
LARGEST = 3.0
#: It is dense: it has at least so many triangles,
DENSE = 256
#: and compact: neither a sheet nor a rod. Its box's shortest side over its longest.
COMPACT = 0.1
#: Flat regions smaller than this share of `SubdivideOptions.wall_area` neither split nor block.
FLAT_SHARE = 0.01
#: No flat region of it is larger than this share of `SubdivideOptions.wall_area`,
LARGEST_FLAT_SHARE = 0.25
#: and no more of its surface than this is flat.
FLAT = 2 / 3


@dataclass(frozen=True)
class Groups:
    """Triangles in groups, and what their shape is."""

    size: Ints  # (g,) triangles
    box: Floats  # (g, 3) sides of their bounding boxes, ascending, metres
    area: Floats  # (g,) m²
    flat: Floats  # (g,) m² in flat regions that could split or block
    flattest: Floats  # (g,) m² of the largest flat region

    @staticmethod
    def of(group: Ints, facets: Facets, wall_area: float) -> Groups:
        """``group``: (n,) of each triangle, from 0."""
        count = int(group.max(initial=-1)) + 1
        order = np.argsort(group, kind="stable")
        size = np.bincount(group, minlength=count)
        corners = facets.mesh.corners[order]
        begin = np.cumsum(size) - size
        low = np.minimum.reduceat(corners.min(axis=1), begin)
        high = np.maximum.reduceat(corners.max(axis=1), begin)
        large = np.where(facets.whole, facets.area, 0.0)[facets.region]
        area = facets.areas
        flat = np.where(large >= FLAT_SHARE * wall_area, area, 0.0)
        return Groups(
            size,
            np.sort(high - low, axis=1),
            summed(group, area, count),
            summed(group, flat, count),
            np.maximum.reduceat(large[order], begin),
        )

    def detail(self, wall_area: float) -> Bools:
        """(g,) which of them are detail."""
        dense = self.size >= DENSE
        small = (self.box[:, 2] <= LARGEST) & (self.box[:, 0] >= COMPACT * self.box[:, 2])
        curved = self.flat <= FLAT * self.area
        curved &= self.flattest <= LARGEST_FLAT_SHARE * wall_area
        found: Bools = dense & small & curved
        return found


def recognised(facets: Facets, object_of: NDArray[np.integer], wall_area: float) -> Bools:
    """(n,) which triangles of a mesh are detail by their shape; ``object_of``: (n,) the object of
    each."""
    if not len(object_of):
        return np.zeros(0, dtype=bool)
    found = np.zeros(len(object_of), dtype=bool)
    for group in (connected_pieces(facets.mesh), np.unique(object_of, return_inverse=True)[1]):
        found |= Groups.of(group, facets, wall_area).detail(wall_area)[group]
    return found


def connected_pieces(mesh: Welded) -> Ints:
    """(n,) the piece of each triangle: those that share corners, directly or over others."""
    from ptmtools.cells.kernels import hang_together

    parent = np.arange(len(mesh.point))
    hang_together(mesh.triangle, parent)
    return np.unique(parent[mesh.triangle[:, 0]], return_inverse=True)[1].reshape(-1)
