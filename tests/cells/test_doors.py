"""Door leaves: what is one, which of them open, and what follows. What is expected follows from the
definitions in docs/design/cells.md; it was written before the first run.

Rooms are 4 m high and lie along x; A ends at x = 4, B begins at x = 4.2, and the doorway between
them is 1 m wide and 2.1 m high unless a test says otherwise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, structural_triangles, subdivide
from ptmtools.cells.open_doors import Doors
from ptmtools.cells.options import DoorState
from ptmtools.cells.roles import is_door_name
from ptmtools.cells.search import connected
from ptmtools.cells.structure import Opaque, Structure
from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError
from ptmtools.scene.model import Material, Scene
from ptmtools.visibility import check_conservative, compute_pvs
from tests.cells.conftest import box, panel
from tests.conftest import scene_of, subdivided

Faces = list[list[list[float]]]
Hole = tuple[float, float, float, float]

HOLE: Hole = (0, 2.1, -0.5, 0.5)
OPEN = SubdivideOptions(doors="open")
A, B, OUT = (1.0, 1.0, 1.2), (7.0, 1.0, 1.2), (-3.0, 1.0, 1.2)


def solid(low: tuple[float, ...], high: tuple[float, ...]) -> Faces:
    """The faces of a box seen from outside."""
    return [face[::-1] for face in box(low, high)]


def reveals(x0: float, x1: float, hole: Hole) -> Faces:
    """The sides, top and floor of a doorway through a wall across x."""
    y0, y1, z0, z1 = hole
    upright = [[[x0, y0, z], [x0, y1, z], [x1, y1, z], [x1, y0, z]] for z in (z0, z1)]
    return upright + [[[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]] for y in (y0, y1)]


def wall(x0: float, x1: float, hole: Hole | None) -> Faces:
    """A wall across x, with a doorway."""
    return panel(x0, hole) + panel(x1, hole) + (reveals(x0, x1, hole) if hole else [])


def leaf(x: float, hole: Hole = HOLE, thickness: float = 0.04, gap: float = 0.0) -> Faces:
    """A door leaf that fills a doorway but for a gap, from x on."""
    y0, y1, z0, z1 = hole
    return solid((x, y0 + gap, z0 + gap), (x + thickness, y1 - gap, z1 - gap))


def sheet(x: float, hole: Hole = HOLE) -> Faces:
    """A leaf without thickness."""
    y0, y1, z0, z1 = hole
    return [[[x, y0, z0], [x, y1, z0], [x, y1, z1], [x, y0, z1]]]


def rooms(hole: Hole | None = HOLE, entrance: Hole | None = None) -> Faces:
    """Rooms A and B and the wall between them; with an entrance through A's other wall, or none."""
    a, b = box((0, 0, -2), (4, 4, 2), "-x +x"), box((4.2, 0, -2), (8.2, 4, 2), "-x")
    front = wall(-0.2, 0, entrance) if entrance else panel(0, None)
    return a + b + front + wall(4, 4.2, hole)


def scene(*things: Faces, **called: Faces) -> Scene:
    """A scene of things, the named ones called so; ``_`` in a name is kept."""
    every = [("masonry", things_of) for things_of in things] + list(called.items())
    faces = [face for _, thing in every for face in thing]
    objects = [name for name, thing in every for _ in thing]
    made = scene_of(faces, objects)
    # One object for each name, not for each face.
    names = tuple(dict.fromkeys(objects))
    place = np.array([names.index(name) for name in made.objects], dtype=np.int32)
    return replace(made, objects=names, triangle_object=place[made.triangle_object])


def together(cells: Cells, *points: tuple[float, float, float]) -> bool:
    """Whether all points are in cells that hang together through portals."""
    at = cells.locate_leaf(np.array(points))
    ends = cells.portal_leaf.astype(np.int64)
    group = connected(cells.leaf_count, ends)
    return bool((at >= 0).all() and len(set(group[at])) == 1)


def see(cells: Cells, one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    pvs = compute_pvs(cells)
    a, b = cells.locate(np.array([one, other]))
    return bool(b in pvs.cell[pvs.start[a] : pvs.start[a + 1]])


def found(scene: Scene, **options: object) -> list[str]:
    """The names of the door leaves of a scene."""
    chosen = SubdivideOptions(**options)  # type: ignore[arg-type]
    tolerance = scene.tolerance.for_walls(chosen.wall_thickness)
    opaque = Opaque.of(scene, chosen)
    doors, _ = Doors.recognise(scene, opaque, Structure.of(opaque, tolerance), chosen)
    return [door.name for door in doors.leaves]


def said(cells: Cells) -> list[str]:
    return [note for note in cells.notes if "door lea" in note]


@pytest.mark.parametrize(
    "name",
    "door_leaf_03 Door01 IfcDoor DOORS frontdoor SlidingDoor Haustür Innentuer_2 Türblatt "  # noqa: SIM905
    "Voordeur innerdörr drzwi_2 Дверь porte-01 puerta.001 M_Door_Oak".split(),
)
def test_what_is_called_door(name: str) -> None:
    assert is_door_name(name)


@pytest.mark.parametrize(
    "name",
    "outdoor indoors outdoor_wall IndoorWall doorway doorway_room1 door_frame doorframe "  # noqa: SIM905
    "doorhandle doormat wall_with_door Türrahmen matador support porter importer tuermatte".split(),
)
def test_what_is_not_called_door(name: str) -> None:
    assert not is_door_name(name)


PAIR: Faces = leaf(4.05, (0, 2.1, -0.9, -0.002)) + leaf(4.05, (0, 2.1, 0.002, 0.9))
WIDE: Hole = (0, 2.1, -0.9, 0.9)
PANELS: Faces = [
    face
    for x in (4.09, 4.04)
    for y in (0.2, 1.1)
    for face in solid((x, y, -0.4), (x + 0.01, y + 0.8, 0.4))
]


@pytest.mark.parametrize("name", ["Door_1", "thing"])
@pytest.mark.parametrize(
    ("hole", "door", "leaves"),
    [
        pytest.param(HOLE, leaf(4.05), 1, id="a leaf"),
        pytest.param(HOLE, leaf(4.0), 1, id="flush with one face of the wall"),
        pytest.param(HOLE, leaf(4.05, gap=0.003), 1, id="with a gap around it"),
        pytest.param(HOLE, sheet(4.1), 1, id="a sheet"),
        pytest.param(HOLE, leaf(4.05) + PANELS, 1, id="with panels"),
        pytest.param(WIDE, PAIR, 2, id="a pair of leaves"),
        pytest.param(WIDE, leaf(4.05, WIDE), 1, id="a pair in one piece"),
        pytest.param((0, 3.0, -1.2, 1.2), leaf(4.05, (0, 3.0, -1.2, 1.2)), 1, id="the largest"),
        pytest.param((0, 1.8, -0.3, 0.3), leaf(4.05, (0, 1.8, -0.3, 0.3)), 1, id="the smallest"),
    ],
)
def test_a_door_parts_no_building(name: str, hole: Hole, door: Faces, leaves: int) -> None:
    made = scene(rooms(hole), **{name: door})
    assert found(made) == [name] * leaves
    cells = subdivide(made, OPEN)
    assert cells.closed
    assert together(cells, A, B)
    assert see(cells, A, B)
    assert not any("cannot be reached from the viewpoint" in note for note in cells.notes)
    assert len(said(cells)) == 1
    assert set(cells.triangle_source[cells.emitted(made.two_sided)[0]]) >= set(cells.opened)
    shut = subdivide(made, SubdivideOptions(doors="closed"))
    assert not len(shut.opened)
    assert not said(shut)
    assert shut.locate(np.array([A, B])).min() >= 0
    # What blocks is the same for the check of a database.
    structural = structural_triangles(made, OPEN, cells.opened)
    assert not structural[cells.opened].any()
    assert (structural | np.isin(np.arange(len(structural)), cells.opened)).all()
    report = check_conservative(made.corners[structural], cells, compute_pvs(cells), 20_000)
    assert report.missed == ()


def test_the_check_sees_through_doors_that_are_open() -> None:
    made = scene(rooms(), Door=leaf(4.05))
    opened = subdivide(made, OPEN).opened
    shut = subdivide(made, SubdivideOptions(doors="closed"))
    structural = structural_triangles(made, OPEN, opened)
    report = check_conservative(made.corners[structural], shut, compute_pvs(shut), 20_000)
    assert report.missed


@pytest.mark.parametrize("door", [leaf(4.05), sheet(4.1), leaf(4.05, WIDE)])
def test_doors_that_are_closed_part_rooms(door: Faces) -> None:
    made = scene(rooms(WIDE if door == leaf(4.05, WIDE) else HOLE), Door=door)
    cells = subdivide(made, SubdivideOptions(doors="closed"))
    assert not together(cells, A, B)
    assert not see(cells, A, B)


def test_hidden_doors_are_not_drawn() -> None:
    entrance = leaf(-0.1)
    made = scene(rooms(entrance=HOLE), Door=leaf(4.05) + PANELS, Entrance_door=entrance)
    cells = {state: subdivide(made, SubdivideOptions(doors=state)) for state in ("open", "hidden")}
    drawn = {
        state: set(each.triangle_source[each.emitted(made.two_sided)[0]].tolist())
        for state, each in cells.items()
    }
    inner = set(np.flatnonzero(made.triangle_object == made.objects.index("Door")).tolist())
    assert drawn["open"] - drawn["hidden"] == inner
    assert drawn["open"] >= inner
    assert drawn["hidden"] & set(np.flatnonzero(made.triangle_object == 2).tolist())
    np.testing.assert_array_equal(cells["open"].opened, cells["hidden"].opened)
    opened, hidden = (said(cells[state]) for state in ("open", "hidden"))
    assert "open: drawn" in opened[0]
    assert "open: not drawn" in hidden[0]
    assert opened[1:] == hidden[1:]


@pytest.mark.parametrize("name", ["Door_front", "thing"])
@pytest.mark.parametrize("thickness", [0.04, 0.0])
def test_an_entrance_stays_shut(name: str, thickness: float) -> None:
    front = leaf(-0.1, thickness=thickness) if thickness else sheet(-0.1)
    made = scene(rooms(entrance=HOLE), inner_door=leaf(4.05), **{name: front})
    ground = [[[-30, -0.1, -30], [30, -0.1, -30], [30, -0.1, 30], [-30, -0.1, 30]]]
    for all_of_it in (
        made,
        scene(rooms(entrance=HOLE), ground, inner_door=leaf(4.05), front=front),
    ):
        cells = subdivide(all_of_it)
        assert cells.closed
        assert together(cells, A, B)
        assert cells.locate(np.array([OUT])) == [-1]
        opened, shut = said(cells)
        assert "inner_door" in opened
        assert "shut:" in shut
        assert all_of_it.objects[-1] in shut


def test_an_entrance_of_an_open_building_stays_shut() -> None:
    # B has a window; eaves and the walls of a porch stand before the entrance.
    window = (1.0, 2.0, -1.0, 1.0)
    back = box((0, 0, -2), (4, 4, 2), "-x +x") + box((4.2, 0, -2), (8.2, 4, 2), "-x +x")
    shell = back + wall(-0.2, 0, HOLE) + wall(4, 4.2, HOLE) + wall(8.2, 8.4, window)
    porch = solid((-1.2, 2.5, -2), (-0.2, 2.6, 2)) + solid((-8, -0.3, -8), (14, -0.1, 8))
    fence = solid((-8, -0.1, -8), (-7.9, 2.0, 8))
    made = scene(shell, porch, fence, Door=leaf(4.05), Door_front=leaf(-0.1))
    cells = subdivide(made)
    assert not cells.closed
    assert together(cells, A, B)
    inner = np.flatnonzero(made.triangle_object == made.objects.index("Door"))
    np.testing.assert_array_equal(cells.opened, inner)


WINDOW: Hole = (1.0, 2.0, -1.0, 1.0)
SLIT: Hole = (0.2, 0.4, -0.2, 0.2)


def hall(far: Faces) -> Faces:
    """A room A without windows, larger than the room B behind its door, whose far wall is given."""
    a, b = box((-3, 0, -2), (4, 4, 2), "+x"), box((4.2, 0, -2), (8.2, 4, 2), "-x +x")
    return a + b + wall(4, 4.2, HOLE) + far


@pytest.mark.parametrize("name", ["Door", "thing"])
@pytest.mark.parametrize(
    "far",
    [
        pytest.param(wall(8.2, 8.4, WINDOW), id="a window"),
        pytest.param(wall(8.2, 8.4, HOLE), id="an entrance without a leaf"),
        pytest.param(wall(8.2, 8.4, HOLE) + leaf(8.25, gap=0.01), id="an entrance with a gap"),
        pytest.param(wall(8.2, 8.4, SLIT), id="a hole"),
    ],
)
@pytest.mark.parametrize("ground", [False, True])
def test_a_room_behind_a_door_is_kept_wherever_the_flood_starts(
    far: Faces, name: str, ground: bool
) -> None:
    # A by itself is closed; B may be reached from outside, and is a room all the same.
    around = solid((-30, -0.3, -30), (30, -0.1, 30)) if ground else []
    made = scene(hall(far), around, **{name: leaf(4.05)})
    for viewpoints in ((), (A,), (B,)):
        cells = subdivide(made, SubdivideOptions(viewpoints=viewpoints))
        assert together(cells, A, B)
        assert not cells.closed
        assert not len(cells.left_out)


def test_a_facade_of_glass_is_a_wall_of_the_room_behind_it() -> None:
    a, b = box((-3, 0, -2), (4, 4, 2), "+x"), box((4.2, 0, -2), (8.2, 4, 2), "-x +x -z")
    glass = box((4.2, 0, -2), (8.2, 4, 2), "-x -y +y +z")
    made = scene(a + b + wall(4, 4.2, HOLE), panes=glass, Door=leaf(4.05))
    panes = np.flatnonzero(made.triangle_object == made.objects.index("panes"))
    material = Material("glass", opacity=0.4, transparent=True)
    of = made.triangle_material.copy()
    of[panes] = len(made.materials)
    made = replace(made, materials=(*made.materials, material), triangle_material=of)
    cells = subdivide(made)
    assert together(cells, A, B)
    main = subdivide(made, SubdivideOptions(doors="closed"))
    assert main.locate(np.array([B])) == [-1]
    (reported,) = [note for note in main.notes if "open to the outside" in note]
    assert isinstance(reported, Warned)


def test_an_entrance_that_is_detail_is_no_door() -> None:
    made = scene(rooms(entrance=HOLE), inner_door=leaf(4.05), front_door=leaf(-0.1))
    cells = subdivide(made, SubdivideOptions(detail=("front*",)))
    assert not cells.closed
    assert together(cells, A, B)
    assert not any("front_door" in note for note in said(cells))
    # Asked for as a door, it is one.
    asked = subdivide(made, SubdivideOptions(detail=("front*",), door=("front*",)))
    assert any("front_door" in note for note in said(asked))


@pytest.mark.parametrize(("low", "told"), [(1.7, True), (2.1, False)])
def test_what_is_called_door_and_is_none_is_told_if_something_cannot_be_reached(
    low: float, told: bool
) -> None:
    hole: Hole = (0, low, -0.5, 0.5)
    cells = subdivide(scene(rooms(hole), hobbit_door=leaf(4.05, hole)))
    notes = [note for note in cells.notes if note.startswith("named like a door")]
    assert ["hobbit_door; --door NAME" in note for note in notes] == [True] * told
    assert together(cells, A, B) != told


def test_a_viewpoint_that_is_no_number_is_outside() -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        subdivide(scene(rooms()), SubdivideOptions(viewpoints=((float("nan"), 1.0, 1.0),)))


def test_a_viewpoint_inside_a_wall_is_told() -> None:
    made = scene(rooms(), solid((2, 0, 0.5), (2.6, 3, 1.1)), inner_door=leaf(4.05))
    for point, reported in (((2.3, 1.5, 0.8), True), (A, False)):
        cells = subdivide(made, SubdivideOptions(viewpoints=(point,)))
        notes = [note for note in cells.notes if note.endswith("which becomes a cell")]
        assert [isinstance(note, Warned) for note in notes] == [True] * reported


@pytest.mark.parametrize("slab", [0.1, 0.3])
def test_a_thick_floor_is_no_roof(slab: float) -> None:
    faces = [f for f in rooms() if not all(y == 4 for _, y, _ in f)]
    made = scene(faces, solid((-0.2, -slab, -2.2), (8.4, -0.001, 2.2)), Door=leaf(4.05))
    cells = subdivide(made)
    assert any("open at the top" in note for note in cells.notes)
    assert together(cells, A, B)


def test_without_ceilings_walls_tell_what_is_inside() -> None:
    faces = [f for f in rooms() if not all(y == 4 for _, y, _ in f)]
    made = scene(faces, Door=leaf(4.05))
    cells = subdivide(made)
    assert not cells.closed
    assert together(cells, A, B)
    assert len(cells.opened) == 12


@pytest.mark.parametrize(
    ("hole", "things"),
    [
        pytest.param(None, {"cupboard_front": leaf(3.95)}, id="on a wall"),
        pytest.param(
            (0, 3.9, -1.9, 1.9),
            {"infill": leaf(4.0, (0, 3.9, -1.9, 1.9), thickness=0.2)},
            id="too large",
        ),
        pytest.param(
            (0.9, 2.9, -0.45, 0.45),
            {"shutter": leaf(4.05, (0.9, 2.9, -0.45, 0.45))},
            id="a window's",
        ),
        pytest.param(
            (0, 2.1, -0.5, 0.5), {"infill": leaf(4.0, thickness=0.2)}, id="as thick as the wall"
        ),
    ],
)
def test_what_is_no_door_by_its_shape(hole: Hole | None, things: dict[str, Faces]) -> None:
    made = scene(rooms(hole), **things)
    assert found(made) == []
    cells = subdivide(made)
    assert not len(cells.opened)
    assert not together(cells, A, B)


@pytest.mark.parametrize(
    ("hole", "things"),
    [
        pytest.param((0, 4, -2, 2), {"door_side": leaf(4.05, (0, 4, -2, 2))}, id="a wall of 4 m"),
        pytest.param(HOLE, {"door_box": leaf(4.0, thickness=0.2)}, id="20 cm thick"),
        pytest.param(HOLE, {"wall_with_door": leaf(4.0, thickness=0.2)}, id="about a wall"),
        pytest.param(
            (0, 1.0, -0.5, 0.5), {"cat_door": leaf(4.05, (0, 1.0, -0.5, 0.5))}, id="1 m high"
        ),
        pytest.param((0, 4, -2, 2), {"outdoor_wall": leaf(4.05, (0, 4, -2, 2))}, id="outdoor"),
    ],
)
def test_a_name_alone_makes_no_door(hole: Hole, things: dict[str, Faces]) -> None:
    made = scene(rooms(hole), **things)
    assert found(made) == []
    assert not together(subdivide(made), A, B)


def test_a_hatch_in_the_floor_is_no_door_unless_asked_for() -> None:
    # Two rooms over one another, and a hatch between them.
    below, above = box((0, -3, -2), (4, -0.2, 2), "+y"), box((0, 0, -2), (4, 3, 2), "-y")
    ring = [(0, 4, -2, -1), (0, 4, 1, 2), (0, 1, -1, 1), (2, 4, -1, 1)]
    slab = [
        [[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]]
        for y in (-0.2, 0)
        for x0, x1, z0, z1 in ring
    ]
    sides = [[[x, -0.2, -1], [x, 0, -1], [x, 0, 1], [x, -0.2, 1]] for x in (1, 2)]
    sides += [[[1, -0.2, z], [1, 0, z], [2, 0, z], [2, -0.2, z]] for z in (-1, 1)]
    hatch = solid((1, -0.05, -1), (2, 0, 1))
    made = scene(below, above, slab, sides, hatch_door=hatch)
    up, down = (3.0, 1.0, 0.0), (3.0, -2.0, 0.0)
    assert found(made) == []
    assert not together(subdivide(made), up, down)
    assert together(subdivide(made, SubdivideOptions(door=("hatch*",))), up, down)


def test_the_user_says_what_is_a_door() -> None:
    hole = (0, 3.6, -1.8, 1.8)
    made = scene(rooms(hole, entrance=HOLE), gate=leaf(4.05, hole), barn_gate=leaf(-0.1))
    asked = SubdivideOptions(door=("gate", "*_gate"))
    cells = subdivide(made, asked)
    assert cells.closed  # whatever the user calls a door
    assert together(cells, A, B)
    kept = SubdivideOptions(door=("gate",), structural=("gate",))
    assert not together(subdivide(made, kept), A, B)
    with pytest.raises(InputError, match="'portcullis'"):
        subdivide(made, SubdivideOptions(door=("portcullis",)))


def test_a_frame_stays_when_its_leaf_opens() -> None:
    # Leaf, handle and frame are one object; the frame fills a wider opening in a hollow wall.
    hole = (0, 2.2, -0.6, 0.6)
    frame = [
        *solid((4.02, 0, -0.6), (4.18, 2.2, -0.5)),
        *solid((4.02, 0, 0.5), (4.18, 2.2, 0.6)),
        *solid((4.02, 2.1, -0.5), (4.18, 2.2, 0.5)),
    ]
    handle = solid((4.0, 1.0, 0.35), (4.14, 1.03, 0.45))
    made = scene(rooms(hole), Door01=leaf(4.05) + frame + handle)
    cells = subdivide(made)
    assert together(cells, A, B)
    frame_only = np.isin(np.arange(len(made.triangles)), cells.opened)
    corners = made.corners[frame_only]
    assert np.abs(corners[:, :, 2]).max() <= 0.5 + 1e-9
    assert corners[:, :, 1].max() <= 2.1 + 1e-9


def test_a_door_that_is_ajar_opens() -> None:
    turn = np.array([[np.cos(0.5), 0, np.sin(0.5)], [0, 1, 0], [-np.sin(0.5), 0, np.cos(0.5)]])
    hinge = np.array([4.05, 0, -0.5])
    ajar = ((np.array(leaf(4.05)) - hinge) @ turn.T + hinge).tolist()
    made = scene(rooms(), Door=ajar)
    cells = subdivide(made)
    assert len(cells.opened) == 12
    assert together(cells, A, B)


def test_a_closet_in_which_nobody_can_stand_stays_shut() -> None:
    shelves = [
        [[4.2, y, -0.5], [4.2, y, 0.5], [4.9, y, 0.5], [4.9, y, -0.5]] for y in (0.9, 1.8, 2.7, 3.6)
    ]
    closet = box((4.2, 0, -0.5), (4.9, 4, 0.5), "-x")
    room = box((0, 0, -2), (4, 4, 2), "+x")
    made = scene(room, wall(4, 4.2, HOLE), closet, shelves, Door=leaf(4.05))
    assert found(made) == ["Door"]
    cells = subdivide(made)
    assert cells.closed
    assert not len(cells.opened)
    assert ["shut:" in note for note in said(cells)] == [True]
    without = scene(room, wall(4, 4.2, HOLE), closet, Door=leaf(4.05))
    assert len(subdivide(without).opened) == 12


def test_a_door_on_a_wall_or_open_against_it_is_none() -> None:
    against, on_it = leaf(4.205, (0, 2.1, 0.6, 1.6)), leaf(3.955, (0, 2, -1.6, -0.7))
    made = scene(rooms(), Door=against, Cupboard_door=on_it)
    assert found(made) == []
    assert together(subdivide(made), A, B)


@pytest.mark.parametrize("times", [1, 6])
def test_walls_of_many_triangles_have_the_same_doors(times: int) -> None:
    made = scene(rooms(entrance=HOLE), Door=leaf(4.05), front_door=leaf(-0.1))
    cells = subdivide(subdivided(made, times))
    assert cells.closed
    assert together(cells, A, B)
    assert len(cells.opened) == 12 * times**2


def test_a_leaf_that_shares_its_corners_with_the_wall_and_lies_in_its_plane() -> None:
    made = subdivided(scene(rooms(), Door=sheet(4.0)), 6)
    cells = subdivide(made)
    assert together(cells, A, B)
    assert len(cells.opened) == 2 * 36


def test_jambs_of_many_triangles_stay_beside_a_leaf_of_the_same_object() -> None:
    # Of the strips of the jambs some are no wider than the leaf is thick.
    made = subdivided(scene(rooms() + leaf(4.043, thickness=0.047)), 12)
    cells = subdivide(made)
    assert cells.closed
    assert together(cells, A, B)
    assert len(cells.opened) == 12 * 12**2


@pytest.mark.parametrize("first", ["leaf", "wall"])
def test_a_leaf_as_thick_as_its_wall_leaves_the_jambs(first: str) -> None:
    door = leaf(4.0, thickness=0.1)
    edges = [face for face in door if len({x for x, _, _ in face}) > 1]
    thin = panel(4.1, HOLE) + panel(4.0, HOLE) + edges
    a, b = box((0, 0, -2), (4, 4, 2), "+x"), box((4.1, 0, -2), (8.2, 4, 2), "-x")
    things = {"Door": door, "masonry": a + b + thin}
    made = scene(**(things if first == "leaf" else dict(reversed(things.items()))))
    cells = subdivide(made)
    assert together(cells, A, B)
    assert {made.objects[i] for i in made.triangle_object[cells.opened]} == {"Door"}
    # The hollow of the wall is still nobody's.
    assert cells.locate(np.array([[4.05, 1.0, 1.5]])) == [-1]


def test_twice_the_same_leaf_opens_twice() -> None:
    once = leaf(4.05)
    made = scene(rooms(), Door=once + [face[::-1] for face in once])
    cells = subdivide(made)
    assert together(cells, A, B)
    assert len(cells.opened) == 24


def test_a_door_of_glass_is_hidden_too() -> None:
    faces = rooms() + leaf(4.05)
    glass = Material("glass", opacity=0.4, transparent=True)
    count = len(rooms())
    made = scene_of(
        faces,
        ["wall"] * count + ["glass_door"] * 6,
        (Material("plain"), glass),
        [0] * count + [1] * 6,
    )
    made = replace(
        made,
        objects=("wall", "glass_door"),
        triangle_object=np.repeat([0, 1], [2 * count, 12]).astype(np.int32),
    )
    hidden = subdivide(made, SubdivideOptions(doors="hidden"))
    assert together(hidden, A, B)
    assert not set(hidden.triangle_source.tolist()) & set(range(2 * count, 2 * count + 12))


def test_rooms_behind_rooms_open_in_one_go() -> None:
    third = box((8.4, 0, -2), (12.4, 4, 2), "-x")
    a, b = box((0, 0, -2), (4, 4, 2), "+x"), box((4.2, 0, -2), (8.2, 4, 2), "-x +x")
    made = scene(a, b, third, wall(4, 4.2, HOLE), wall(8.2, 8.4, HOLE), door=leaf(4.1) + leaf(8.3))
    cells = subdivide(made, SubdivideOptions(reach="main"))
    assert together(cells, A, B, (11.0, 1.0, 1.0))
    assert "2 door leaves" in said(cells)[0]


def test_a_door_whose_frame_would_let_the_outside_in_stays_shut() -> None:
    # The frame, or the leaf, is the only jamb of a hollow wall that is open at its ends.
    hole = (0, 2.2, -0.6, 0.6)
    walls = box((0, 0, -2), (4, 4, 2), "+x") + box((4.2, 0, -2), (8.2, 4, 2), "-x")
    walls += panel(4, hole) + panel(4.2, hole) + reveals(4, 4.2, hole)[-2:-1]
    frame = [
        *solid((4.0, 0, -0.6), (4.2, 2.2, -0.5)),
        *solid((4.0, 0, 0.5), (4.2, 2.2, 0.6)),
        *solid((4.0, 2.1, -0.5), (4.2, 2.2, 0.5)),
    ]
    made = scene(walls, Gate=leaf(4.05) + frame)
    asked = SubdivideOptions(door=("Gate",))
    cells = subdivide(made, asked)
    assert cells.closed
    assert together(cells, A, B)
    assert np.abs(made.corners[cells.opened][:, :, 2]).max() == pytest.approx(0.5)  # the leaf
    assert ["shut:" in note for note in said(cells)] == [False, True]
    stopper = leaf(4.0, hole, thickness=0.2)
    elsewhere = box((-30, 0, -6), (-6, 4, 6))  # the start, from which nothing leads here
    for more in ([], elsewhere):
        cells = subdivide(scene(walls, more, Gate=stopper), asked)
        assert cells.closed
        assert not together(cells, A, B)
        assert not len(cells.opened)
        assert cells.locate(np.array([[4.1, 1.0, 3.0]])) == [-1]  # the outside


def test_nothing_but_doors() -> None:
    made = scene(Door=leaf(4.05))
    assert subdivide(made).cell_count == 1
    glass = replace(made, materials=(Material("glass", opacity=0.4, transparent=True),))
    assert subdivide(glass).cell_count == 1


def test_another_building_is_one_too() -> None:
    far = [[[x + 40, y, z] for x, y, z in face] for face in rooms() + leaf(4.05)]
    hall = box((-30, 0, -6), (-6, 4, 6))
    made = scene(hall, far[:-6], Door=far[-6:])
    cells = subdivide(made)
    assert cells.closed
    assert together(cells, (41.0, 1.0, 1.2), (47.0, 1.0, 1.2))
    (reported,) = [note for note in cells.notes if "cannot be reached from the viewpoint" in note]
    assert float(reported.split(" ")[0]) == pytest.approx(2 * 3.5 * 3.5, abs=0.5)
    # The hall, the two rooms, the rest of the doorway, and the inside of the leaf.
    assert cells.leaf_count == 1 + 4


@pytest.mark.parametrize("state", ["ajar", ""])
def test_doors_are_open_closed_or_hidden(state: DoorState) -> None:
    with pytest.raises(InputError, match="open, closed or hidden"):
        SubdivideOptions(doors=state)
