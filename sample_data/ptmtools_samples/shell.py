"""The surface of a plan: walls, floors and ceilings with their openings, facing the air.

Each side of a box of air is a rectangle less its contacts with other boxes. The remainder is cut
into few rectangles: vertical strips between the edges of openings, merged where adjacent strips
have the same free intervals. Edges of adjacent rectangles lie on exactly the same lines, so the
surface is closed although it has T-junctions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from ptmtools_samples.mesh import Face, Point, Thing, block, tile_face
from ptmtools_samples.plan import Plan, PlanBox

#: Metres per repetition of the image of a surface.
TILE = {
    "plaster_cream": 3.0,
    "plaster_red": 2.0,
    "plaster_green": 2.0,
    "plaster_blue": 2.0,
    "ceiling": 3.0,
    "parquet": 2.0,
    "carpet": 2.0,
    "stone": 2.0,
    "wood": 1.5,
    "facade": 4.0,
    "roof": 4.0,
    "marble": 1.0,
}

Rectangle = tuple[int, int, int, int]  # low u, low v, high u, high v


@dataclass(frozen=True)
class Panel:
    """A rectangle of a room's wall for pictures, mm.

    The wall lies at ``position`` on ``axis`` and faces the air towards ``side`` (+1 or -1); the
    rectangle spans ``low`` to ``high`` on the other horizontal axis and the given height.
    """

    room: str
    axis: int
    side: int
    position: int
    low: int
    high: int
    bottom: int
    top: int


def rectangles(whole: Rectangle, holes: list[Rectangle]) -> list[Rectangle]:
    """Returns ``whole`` less ``holes`` as few upright rectangles."""
    u0, v0, u1, v1 = whole
    cuts = sorted({u0, u1, *(u for h in holes for u in (h[0], h[2]) if u0 < u < u1)})
    strips: list[tuple[int, int, list[tuple[int, int]]]] = []
    for a, b in pairwise(cuts):
        free, bottom = [], v0
        for h in sorted((h for h in holes if h[0] < b and h[2] > a), key=lambda h: h[1]):
            if h[1] > bottom:
                free.append((bottom, h[1]))
            bottom = max(bottom, h[3])
        if bottom < v1:
            free.append((bottom, v1))
        if strips and strips[-1][2] == free:
            strips[-1] = (strips[-1][0], b, free)
        else:
            strips.append((a, b, free))
    return [(a, bottom, b, top) for a, b, free in strips for bottom, top in free]


def _contact(box: PlanBox, axis: int, high: bool, neighbour: PlanBox) -> Rectangle | None:
    """Returns the contact of ``neighbour`` with a side of ``box``."""
    position = box.high[axis] if high else box.low[axis]
    opposite = neighbour.low[axis] if high else neighbour.high[axis]
    if position != opposite:
        return None
    u, v = _axes(axis)
    low = max(box.low[u], neighbour.low[u]), max(box.low[v], neighbour.low[v])
    top = min(box.high[u], neighbour.high[u]), min(box.high[v], neighbour.high[v])
    return (*low, *top) if low[0] < top[0] and low[1] < top[1] else None


def _axes(axis: int) -> tuple[int, int]:
    """Returns the axes (u, v) of a side; v is up on walls, so strips are upright."""
    return ((2, 1), (0, 2), (0, 1))[axis]


def _side(axis: int, position: int, facing: int, r: Rectangle) -> tuple[Point, ...]:
    """Returns the corners of a rectangle, counter-clockwise seen from its front; metres."""
    u, v = _axes(axis)
    corners = [(r[0], r[1]), (r[2], r[1]), (r[2], r[3]), (r[0], r[3])]
    points = []
    for a, b in corners:
        p = [0, 0, 0]
        p[axis], p[u], p[v] = position, a, b
        points.append((p[0] / 1000, p[1] / 1000, p[2] / 1000))
    # e_u × e_v is +e_axis for the z axis only.
    return tuple(points) if facing * (1 if axis == 2 else -1) > 0 else tuple(reversed(points))


SIDES = [
    (1, False, "floor"),
    (1, True, "ceiling"),
    (2, False, "wall_north"),
    (2, True, "wall_south"),
    (0, False, "wall_west"),
    (0, True, "wall_east"),
]


def _open_sides(plan: Plan, box: PlanBox) -> Iterator[tuple[int, bool, str, list[Rectangle]]]:
    """Yields axis, whether the side is the high one, name and remaining rectangles of each side of
    a box."""
    for axis, high, name in SIDES:
        u, v = _axes(axis)
        whole = (box.low[u], box.low[v], box.high[u], box.high[v])
        holes = [
            _contact(box, axis, high, neighbour) for neighbour in plan.boxes if neighbour is not box
        ]
        actual = [h for h in holes if h]
        if box.kind == "window":  # the outer side of a window is open
            outside = plan.high[axis] if high else plan.low[axis]
            if (box.high[axis] if high else box.low[axis]) == outside:
                actual = [whole]
        yield axis, high, name, rectangles(whole, actual)


def make_shell(plan: Plan) -> tuple[list[Thing], list[Panel]]:
    """Returns the objects of the shell, and the wall panels of rooms and corridors."""
    things, panels = [], []
    for box in plan.boxes:
        whole = Thing(box.name)
        for axis, high, name, pieces in _open_sides(plan, box):
            material = box.floor if name == "floor" else box.ceiling
            if name.startswith("wall"):
                material = box.wall
            position = box.high[axis] if high else box.low[axis]
            faces = [
                tile_face(material, _side(axis, position, -1 if high else 1, r), TILE[material])
                for r in pieces
            ]
            if box.kind in ("door", "window"):
                whole.faces += faces
            elif faces:
                things.append(Thing(f"{box.name}_{name}", faces))
            if box.kind in ("room", "corridor") and axis != 1:
                panels += [
                    Panel(box.name, axis, -1 if high else 1, position, r[0], r[2], r[1], r[3])
                    for r in pieces
                ]
        if whole.faces:
            things.append(whole)
        if box.kind == "window":
            things += _pane(box)
    things += _outer_walls(plan)
    return things, panels


def _pane(box: PlanBox) -> list[Thing]:
    """The glass in the middle of a window, and its glazing bars."""
    axis = 0 if box.high[0] - box.low[0] < box.high[2] - box.low[2] else 2
    u, v = _axes(axis)
    middle = (box.low[axis] + box.high[axis]) // 2
    r = (box.low[u], box.low[v], box.high[u], box.high[v])
    centre, transom = (r[0] + r[2]) // 2, r[3] - (r[3] - r[1]) // 3
    bars: list[Face] = []
    for a, bottom, b, top, ends in (
        (centre - 25, r[1], centre + 25, r[3], {"-y", "+y"}),
        (r[0], transom - 25, centre - 25, transom + 25, {"-x", "+x", "-z", "+z"}),
        (centre + 25, transom - 25, r[2], transom + 25, {"-x", "+x", "-z", "+z"}),
    ):
        low, high = [0, bottom, 0], [0, top, 0]
        low[u], high[u] = a, b
        low[axis], high[axis] = middle - 25, middle + 25
        hidden = ends & {"-y", "+y", f"-{'xyz'[u]}", f"+{'xyz'[u]}"}
        p, q = ((c[0] / 1000, c[1] / 1000, c[2] / 1000) for c in (low, high))
        bars += block("wood", p, q, TILE["wood"], without=frozenset(hidden))
    return [
        Thing(f"{box.name}_glass", [tile_face("glass", _side(axis, middle, 1, r), 1.0)]),
        Thing(f"{box.name}_bars", bars),
    ]


def _outer_walls(plan: Plan) -> list[Thing]:
    """The outside of the block with its window openings."""
    names = {"floor": "ground_slab", "ceiling": "roof"}
    things = []
    for axis, high, name in SIDES:
        u, v = _axes(axis)
        whole = (plan.low[u], plan.low[v], plan.high[u], plan.high[v])
        position = plan.high[axis] if high else plan.low[axis]
        holes = [
            (b.low[u], b.low[v], b.high[u], b.high[v])
            for b in plan.of_kind("window")
            if (b.high[axis] if high else b.low[axis]) == position
        ]
        material = "roof" if axis == 1 else "facade"
        faces = [
            tile_face(material, _side(axis, position, 1 if high else -1, r), TILE[material])
            for r in rectangles(whole, holes)
        ]
        things.append(Thing(names.get(name, name.replace("wall", "facade")), faces))
    return things
