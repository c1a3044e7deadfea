"""Notes of the subdivision: recognised detail and doors, unreachable space, and losses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, areas, normals
from ptmtools.cells.building import Building
from ptmtools.cells.doors import DoorLeaf
from ptmtools.cells.floors import ROOFED
from ptmtools.cells.model import Cells
from ptmtools.cells.options import DoorState
from ptmtools.cells.ownership import Pieces
from ptmtools.cells.space import LEAST_PLACE, DividedSpace, Standing, UnreachedRoom
from ptmtools.cells.structure import Surroundings, spread_over
from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError
from ptmtools.quantities import count
from ptmtools.scene.model import Scene

#: Number of objects, or places, that a note names.
NAMED = 3
#: A note becomes a warning above this share of the walkable floor, left out,
MUCH = 0.1
#: and above this share of the volume, unseen.
MUCH_UNSEEN = 0.02
#: Triangles that represent those that are lost.
_LOST = 4096
#: The note on a model without walkable floor.
NO_PLACES = Warned(
    "the body of --walker fits on no floor, so visitors may be anywhere in the cells"
)


def building_notes(building: Building) -> Iterator[str]:
    """Notes on detail by shape, on volumes of rooms, on the planes of a scanned surface and on what
    hangs on walls."""
    if building.furniture:
        objects = count(len(building.furniture), "object")
        yield (
            f"{building.shaped:,} triangles of {objects} ({_list(building.furniture)}) are small, "
            "dense and round and count as detail, which neither divides nor hides; --structural "
            "NAME or --no-detail-by-shape changes that"
        )
    yield from building.volumes.notes
    if building.facets:
        yield (
            f"at least {building.facets:,} flat pieces lean in all directions, like a scan or "
            "terrain, and do not divide space; --structural NAME makes objects do so"
        )
    if building.hangings:
        surfaces = count(building.hangings, "surface")
        yield (
            f"{surfaces} before a larger wall or floor, such as pictures, do not divide space; "
            "--structural NAME makes all do so"
        )


#: The state of a door leaf that visitors pass, as a note describes it.
_OPEN: dict[DoorState, str] = {
    "pass": "passable: visitors walk through, but do not see through; --doors open changes that",
    "open": "open: drawn, but hiding nothing; --doors closed shuts all doors",
    "hidden": "open: not drawn; --doors closed shuts all doors",
}


def space_notes(building: Building, space: DividedSpace) -> list[str]:
    """Notes on doors, and on space that cannot be reached.

    Raises
    ------
    InputError: PTM-I305 if more than `MUCH` is left out under ``strict``.
    """
    notes, options = [], building.options
    if options.doors != "closed":
        notes = _door_notes(building.doors.leaves, space.doors, options.doors)
        if building.doors.unrecognised and (space.beyond.rooms or space.beyond.outside):
            notes.append(
                "named like a door but treated as a wall, because of its size or of no space on "
                f"both sides: {_list(building.doors.unrecognised)}; --door NAME makes it a door"
            )
    return notes + _unreached_notes(building, space)


def _door_notes(leaves: list[DoorLeaf], opened: Bools, doors: DoorState) -> list[str]:
    """Notes on door leaves; visitors pass those ``opened``, (d,)."""
    notes = []
    for which, state in (
        (opened, _OPEN[doors]),
        (~opened, "shut: beyond is the outside or no walkable floor; --detail NAME opens it"),
    ):
        chosen = [leaves[i] for i in np.flatnonzero(which)]
        if chosen:
            names = _list([f"{leaf.name} at {_triple(leaf.middle)}" for leaf in chosen])
            leaf = count(len(chosen), "door leaf", "door leaves")
            notes.append(f"{leaf} ({names}) {'is' if len(chosen) == 1 else 'are'} {state}")
    return notes


def way_notes(building: Building, boxes: Floats) -> list[str]:
    """The note on walkable floor to which no way leads, in leaves with these (n, 2, 3) boxes."""
    places = building.places
    near = places.find_near(boxes - [0, building.walker.middle, 0])
    area, lost = shapely.area(places.plan) * near, near & ~building.has_way
    if not area[lost].sum() >= LEAST_PLACE:
        return []
    largest = np.flatnonzero(lost)[area[lost].argmax()]
    x, z = shapely.get_coordinates(shapely.point_on_surface(places.plan[largest]))[0].tolist()
    a, b, c = places.slope[largest].tolist()
    return [
        f"{area[lost].sum():.1f} m² of walkable floor ({area[lost].sum() / area.sum():.0%}), such "
        f"as {area[largest]:.1f} m² around {_triple((x, a * x + b * z + c, z))}, is drawn, but no "
        "way leads there from a room, so visitors do not go there (--standing floors changes that)"
    ]


def viewpoint_notes(solid: Floats) -> list[str]:
    """Warnings of requested viewpoints, (n, 3), that lie inside a solid."""
    return [
        Warned(
            f"viewpoint {_triple(point)} is inside a wall or another solid, which becomes a cell"
        )
        for point in solid
    ]


def _unreached_notes(building: Building, space: DividedSpace) -> list[str]:
    """Notes on unreachable rooms, kept or left out."""
    kept, strict = building.options.reach == "all", building.options.strict
    rooms, outside, place = space.beyond.rooms, space.beyond.outside, space.place
    fate = "cannot be reached from the viewpoint and is left out"
    if kept:
        fate = "cannot be reached from the viewpoint and is kept as a room"
    notes = [
        f"{_place(room)} {fate}; use --viewpoint {_position(room)} to start there"
        for room in rooms[:NAMED]
    ]
    if rest := rooms[NAMED:]:
        area = sum(room.place for room in rest)
        fate = "kept as rooms" if kept else "left out"
        notes.append(f"{count(len(rest), 'more such area')}, {area:.1f} m² in total: {fate}")
    if rooms and kept:
        notes[0] += ", or --reach main to leave out all unreachable areas"
        every = float(Standing.from_tree(space.tree, space.reached, building).place.sum())
        if sum(room.place for room in rooms) > MUCH * every:
            notes[0] = Warned(notes[0])
    if low := space.beyond.low:
        size = sum(room.place for room in low)
        notes.append(
            f"{count(len(low), 'closed area')}, {size:.1f} m² in total, such as {_place(low[0])}: "
            "left out as plenums, or rooms lower than 2 m; --standing floors keeps them"
        )
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
    left_out = sum(ways.values())
    if left_out > MUCH * (left_out + place):
        much = f"{left_out / (left_out + place):.0%} of the walkable floor is left out"
        remedy = f"{' and '.join(ways)} {'keep' if len(ways) > 1 else 'keeps'} it"
        if strict:
            raise InputError("PTM-I305", much, remedy=f"{remedy}; or build without --strict")
        notes.append(Warned(f"{much}; {remedy}"))
    return notes


def leaf_notes(cells: Cells, reached: Bools) -> list[str]:
    """Notes on leaves in no cell; ``reached``: (n,) of all leaves of the tree."""
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


def triangle_notes(
    scene: Scene, pieces: Pieces, owner: NDArray[np.int32], building: Building
) -> list[str]:
    """Notes on the triangles of a scene that have no piece in any cell; those are a loss that
    bound a space where a body fits, neither the outside of the building nor a hollow.

    Raises
    ------
    InputError: PTM-I305 if more than `MUCH` is lost under ``strict``.
    """
    lost = np.ones(len(scene.triangles), dtype=bool)
    lost[pieces.source[np.any(owner >= 0, axis=1)]] = False
    if not lost.any():
        return []
    notes = [f"{np.count_nonzero(lost)} triangles lie outside all cells and are never visible"]
    if np.mean(lost) > MUCH:
        corners = spread_over(scene.corners[lost], _LOST)
        space = _spaces_before(corners, scene, building)
        some = np.flatnonzero(np.isfinite(space[:, 0]))
        share = np.mean(lost) * len(some) / len(corners)
        if share > MUCH:
            place = _triple(space[some[np.argmax(areas(corners[some]))]])
            much = f"{share:.0%} of the triangles bound space that visitors do not reach"
            remedy = f"use --viewpoint {place} to start there"
            if building.options.strict:
                remedy += ", or build without --strict"
                raise InputError("PTM-I305", f"{much}, as around {place}", remedy=remedy)
            notes.append(Warned(f"{much}, as around {place}; {remedy}"))
    return notes


def _spaces_before(corners: Floats, scene: Scene, building: Building) -> Floats:
    """(n, 3) the middle of the way from each of (n, 3, 3) triangles to what it faces, NaN if that
    is outside or a body does not fit there."""
    walker, roofed = building.walker, building.doors.floor.roof_share >= ROOFED
    facing, around = normals(corners), Surroundings(scene.corners, scene.tolerance)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    start = corners.mean(axis=1) + 2 * scene.tolerance.plane * facing
    way = around.first(start, facing)[0]
    some = np.flatnonzero(np.isfinite(way))
    middle = start[some] + facing[some] * way[some, None] / 2
    up, down = (around.first(middle, np.full(middle.shape, [0, y, 0.0]))[0] for y in (1.0, -1.0))
    fits = (around.free_about(middle).min(axis=1) >= walker.radius) & (up + down >= walker.height)
    fits &= around.enclose(middle, roofed)
    fits[fits] = ~around.solid_groups(middle[fits][:, None])
    result = np.full(start.shape, np.nan)
    result[some[fits]] = middle[fits]
    return result


def undecided_notes(undecided: Mapping[str, int]) -> list[str]:
    """Notes on operations on polygons that ended in a safe answer, by name (`planar`)."""
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


def _list(names: Sequence[str]) -> str:
    """The first `NAMED` names."""
    return ", ".join([*names[:NAMED], *["…"] * (len(names) > NAMED)])


def _place(room: UnreachedRoom) -> str:
    return f"{room.place:.1f} m² of floor around {_position(room)}"


def _position(room: UnreachedRoom) -> str:
    return _triple(room.eye)


def _triple(point: Iterable[float]) -> str:
    return ",".join(f"{c:.2f}" for c in point)
