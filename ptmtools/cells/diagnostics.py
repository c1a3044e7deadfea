"""What the subdivision has to say of detail and doors that it recognised, and of what it did not
reach.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.doors import DoorLeaf
from ptmtools.cells.model import Cells
from ptmtools.cells.ownership import Pieces
from ptmtools.cells.roles import called, says_door
from ptmtools.cells.unreachable import CutOff, Unreached
from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError
from ptmtools.quantities import count
from ptmtools.scene.model import Scene

#: So many objects, or places, are named.
NAMED = 3
#: A greater share of all places is much to leave out.
MUCH = 0.1
#: And of the volume, of what nobody sees.
MUCH_UNSEEN = 0.02
#: What is said where there is nothing to stand on.
NO_PLACES = Warned(
    "the body of --walker fits on no floor, so visitors may be anywhere in the cells"
)


def of_detail(scene: Scene, detail: Ints) -> list[str]:
    """What is said of triangles that were taken for detail because of their shape."""
    if not len(detail):
        return []
    owners, size = np.unique(scene.triangle_object[detail], return_counts=True)
    names = [scene.objects[i] for i in owners[np.argsort(-size, kind="stable")][:NAMED]]
    more = ", …" if len(owners) > NAMED else ""
    return [
        f"{len(detail):,} triangles of {count(len(owners), 'object')} ({', '.join(names)}{more}) "
        "are small, dense and round and count as detail, which neither divides nor hides; "
        "--structural NAME or --no-detail-by-shape changes that"
    ]


def of_doors(leaves: list[DoorLeaf], opened: Bools, hidden: bool) -> list[str]:
    """What is said of door leaves, of which those ``opened``, (d,), do not block, and are not drawn
    if they are ``hidden``."""
    notes = []
    drawn = "not drawn" if hidden else "drawn, without blocking"
    for which, fate in (
        (opened, f"open: {drawn}; --doors closed shuts all doors"),
        (
            ~opened,
            "shut: no walkable floor lies beyond; --detail NAME opens it",
        ),
    ):
        chosen = [leaves[i] for i in np.flatnonzero(which)]
        if chosen:
            named = ", ".join(f"{leaf.name} at {_triple(leaf.middle)}" for leaf in chosen[:NAMED])
            more = ", …" if len(chosen) > NAMED else ""
            leaf = count(len(chosen), "door leaf", "door leaves")
            notes.append(f"{leaf} ({named}{more}) {'is' if len(chosen) == 1 else 'are'} {fate}")
    return notes


def of_viewpoints(solid: Floats) -> list[str]:
    """What is said of viewpoints that somebody asked for, (n, 3), inside of something."""
    return [
        Warned(
            f"viewpoint {_triple(point)} is inside a wall or another solid, which becomes a cell"
        )
        for point in solid
    ]


def of_no_doors(scene: Scene, leaves: list[DoorLeaf]) -> list[str]:
    """What is said, where something cannot be reached, of objects and materials that are called
    doors, though no leaf of a door has any of their triangles."""
    so_called = called(scene, says_door)
    taken = np.concatenate([np.zeros(0, dtype=np.int64), *(leaf.triangles for leaf in leaves)])
    left = np.setdiff1d(scene.triangle_object[so_called], scene.triangle_object[taken])
    if not len(left):
        return []
    names = ", ".join(scene.objects[i] for i in left[:NAMED])
    more = ", …" if len(left) > NAMED else ""
    return [
        "named like a door but treated as a wall, because of its size or of no space on both "
        f"sides: {names}{more}; --door NAME makes it a door"
    ]


def of_unreached(unreached: Unreached, kept: bool, place: float, strict: bool) -> list[str]:
    """What is said of places that the flood did not come to, whose rooms are ``kept`` or left out,
    beside ``place`` m² that are in the cells. Under ``strict`` it is InputError PTM-I305 to leave
    out much."""
    rooms, outside = unreached.rooms, unreached.outside
    fate = "kept as rooms" if kept else "left out"
    notes = [
        f"{_place(room)} cannot be reached from the starting point; {fate}; "
        f"--viewpoint {_position(room)} starts there"
        for room in rooms[:NAMED]
    ]
    if rest := rooms[NAMED:]:
        area = sum(room.place for room in rest)
        notes.append(f"{count(len(rest), 'more such area')}, {area:.1f} m² in total; {fate}")
    if rooms and kept:
        notes[0] += "; --reach main leaves out all unreachable areas"
    if outside:
        notes.append(
            Warned(
                f"{_place(outside)}, roofed but open to the outside, is left out; "
                f"--viewpoint {_position(outside)} includes it"
            )
        )
    ways = {f"--viewpoint {_position(outside)}": outside.place} if outside else {}
    if rooms and not kept:
        ways = {"--reach all": sum(room.place for room in rooms), **ways}
    left = sum(ways.values())
    if left > MUCH * (left + place):
        much = f"{left / (left + place):.0%} of the walkable floor is left out"
        remedy = f"{' and '.join(ways)} {'keep' if len(ways) > 1 else 'keeps'} it"
        if strict:
            raise InputError("PTM-I305", much, remedy=f"{remedy}; or build without --strict")
        notes.append(Warned(f"{much}; {remedy}"))
    return notes


def of_leaves(cells: Cells, reached: Bools) -> list[str]:
    """What is said of leaves that are in no cell, of the (n,) that there were."""
    notes = []
    if dropped := int(np.count_nonzero(~reached)):
        leaves = f"{dropped} of {len(reached)} leaves (convex pieces of space)"
        notes.append(f"{leaves} cannot be reached from inside; dropped")
    unseen = cells.leaf_cell < 0
    if unseen.any():
        volume, leaves = cells.leaf_volumes(), count(int(unseen.sum()), "leaf", "leaves")
        share = volume[unseen].sum() / volume.sum()
        note = (
            f"{leaves} ({share:.1%} of the volume) cannot be seen from walkable floor; dropped "
            "(--standing anywhere keeps them)"
        )
        notes.append(Warned(note) if share > MUCH_UNSEEN else note)
    return notes


def of_triangles(scene: Scene, pieces: Pieces, owner: NDArray[np.int32]) -> list[str]:
    """What is said of triangles of which no cell has a piece."""
    nowhere = np.ones(len(scene.triangles), dtype=bool)
    nowhere[pieces.source[np.any(owner >= 0, axis=1)]] = False
    lost = int(np.count_nonzero(nowhere))
    return [f"{lost} triangles lie outside all cells and are never visible"] * (lost > 0)


def of_undecided(undecided: Mapping[str, int]) -> list[str]:
    """Operations on polygons in a plane that ended in a safe answer, by name (`planar`)."""
    dull = undecided.get("triangles", 0)
    notes = [
        f"{count(dull, 'flat surface')} could not be divided into fewer triangles, and "
        f"{'keeps its' if dull == 1 else 'keep their'} own"
    ] * (dull > 0)
    overlays = {name: n for name, n in sorted(undecided.items()) if n and name != "triangles"}
    if overlays:
        listed = ", ".join(count(n, name) for name, n in overlays.items())
        notes.append(
            f"{count(sum(overlays.values()), 'operation')} on polygons in a plane ({listed}) had "
            "no exact result; walls there may hide less than in the model, never more"
        )
    return notes


def _place(room: CutOff) -> str:
    return f"{room.place:.1f} m² of floor around {_position(room)}"


def _position(room: CutOff) -> str:
    return _triple(room.eye)


def _triple(point: Iterable[float]) -> str:
    return ",".join(f"{c:.2f}" for c in point)
