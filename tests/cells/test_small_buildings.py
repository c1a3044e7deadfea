"""Cells of small buildings against the expectations in `small_buildings`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.errors import InputError
from ptmtools.scene import ingest
from ptmtools.scene.notes import line
from ptmtools.visibility import compute_pvs
from tests.cells.buildings import write
from tests.cells.closed_doors import DOORS
from tests.cells.small_buildings import EMPTY, GAP_BEHIND_GAP, HEIGHTS, MODELS, NO_PLACES, ROOMS
from tests.scene.buildings import house, inside_out, y_up

EVERY = ROOMS | HEIGHTS | NO_PLACES | DOORS | MODELS


@pytest.mark.parametrize("name", EVERY)
def test_what_comes_of_it(name: str, tmp_path: Path) -> None:
    made = EVERY[name]
    scene = made.scene(tmp_path)
    cells = subdivide(scene, SubdivideOptions(**{"doors": "open"} | made.options))
    assert cells.closed == made.closed
    notes = [*map(line, scene.notes), *cells.notes]
    assert [word for word in made.notes if not any(word in note for note in notes)] == []
    cut_off = [note for note in notes if "of floor around" in note]
    assert len(cut_off) == made.cut_off, cut_off

    where = {eye: made.in_world(scene, [at]) for eye, at in made.eyes.items()}
    cell = {eye: int(cells.locate(at)[0]) for eye, at in where.items()}
    assert [eye for eye, at in where.items() if not stood_at(cells, at)] == []
    assert cells.standing[list(cell.values())].all()
    rooms = tuple(made.eyes) if made.rooms is None else made.rooms
    together = {room: {cell[eye] for eye in room.split()} for room in rooms}
    assert [room for room, owners in together.items() if len(owners) > 1] == []
    assert len(set().union(*together.values())) == len(rooms), cell
    if not made.more:
        assert np.flatnonzero(cells.standing).tolist() == sorted(set(cell.values()))
        if None not in made.seen.values():
            assert cells.standing.all()

    for place, eye in made.seen.items():
        at = made.in_world(scene, [place])
        assert not stood_at(cells, at), place
        assert cells.locate(at)[0] in ([cell[eye]] if eye else range(cells.cell_count)), place
    gone = [at for at in made.gone if cells.locate(made.in_world(scene, [at]))[0] >= 0]
    assert gone == []

    pvs = compute_pvs(cells).to_matrix()
    assert np.array_equal(pvs, pvs.T)
    assert pvs[cells.standing].any(axis=0).all()
    for pairs, expected in ((made.sees, True), (made.blind, False)):
        for pair in pairs:
            a, b = (cell[eye] for eye in pair.split())
            assert pvs[a, b] == expected, pair


def stood_at(cells: Cells, point: Floats) -> bool:
    """Whether a (1, 3) point is in a leaf that stands."""
    leaf = cells.locate_leaf(point)[0]
    return bool(leaf >= 0 and cells.leaf_cell[leaf] >= 0 and cells.leaf_standing[leaf])


@pytest.mark.parametrize("name", NO_PLACES)
def test_standing_anywhere(name: str, tmp_path: Path) -> None:
    """Whoever flies is in every leaf that can be reached, seen or not."""
    made = NO_PLACES[name]
    scene = made.scene(tmp_path)
    cells = subdivide(scene, SubdivideOptions(**made.options, standing="anywhere"))
    reached = made.gone if made.model is GAP_BEHIND_GAP else ()
    points = made.in_world(scene, [*made.eyes.values(), *made.seen, *reached])
    assert (cells.locate(points) >= 0).all()
    assert cells.leaf_standing.all()
    assert cells.standing.all()
    assert (cells.leaf_cell >= 0).all()


@pytest.mark.parametrize("name", [name for name, made in DOORS.items() if made.sees])
def test_leaves_hide_what_is_behind_them(name: str, tmp_path: Path) -> None:
    """The rooms are the same as with doors that are open, and neighbours as before."""
    made = DOORS[name]
    scene = made.scene(tmp_path)
    hiding, opened = (
        subdivide(scene, SubdivideOptions(**made.options | {"doors": doors}))
        for doors in ("pass", "open")
    )
    eyes = np.concatenate([made.in_world(scene, [at]) for at in made.eyes.values()])
    places = [cells.locate(eyes).tolist() for cells in (hiding, opened)]
    assert len(set(places[0])) == len(eyes)
    assert hiding.cell_count == opened.cell_count
    pvs = compute_pvs(hiding).to_matrix()
    assert np.array_equal(pvs[np.ix_(places[0], places[0])], np.eye(len(eyes), dtype=bool))
    for one, other in zip(*places, strict=True):
        near = [set(cells.adjacent()[c]) for cells, c in ((hiding, one), (opened, other))]
        assert len(near[0]) == len(near[1]) > 0


@pytest.mark.parametrize(
    ("doors", "drawn"), [("pass", True), ("open", True), ("closed", True), ("hidden", False)]
)
def test_door_leaves_are_drawn_unless_hidden(doors: str, drawn: bool, tmp_path: Path) -> None:
    scene = DOORS["two rooms and a door leaf, by its name"].scene(tmp_path)
    cells = subdivide(scene, SubdivideOptions(doors=doors))
    shown = scene.triangle_object[cells.triangle_source[cells.emitted(scene.two_sided)[0]]]
    assert (scene.objects.index("Zimmertür") in shown) == drawn


@pytest.mark.parametrize(("doors", "walks"), [("pass", True), ("open", True), ("closed", False)])
def test_one_walks_through_a_door_leaf_that_is_open(
    doors: str, walks: bool, tmp_path: Path
) -> None:
    made = DOORS["two rooms and a door leaf, by its name"]
    scene = made.scene(tmp_path)
    cells = subdivide(scene, SubdivideOptions(doors=doors))
    in_the_leaf = made.in_world(scene, [(5.075, 2.45, 1.6)])
    assert cells.eyes.contains(in_the_leaf).tolist() == [walks]


@pytest.mark.parametrize("name", EMPTY)
def test_an_empty_world_is_an_error_with_a_remedy(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--two-sided.*PTM-I304"):
        subdivide(EMPTY[name].scene(tmp_path))


@pytest.mark.parametrize(
    ("model", "code"),
    [
        pytest.param(house(), "PTM-N234", id="a lying GLB"),
        pytest.param(y_up(house()), None, id="an upright one"),
        pytest.param(inside_out(y_up(house())), "PTM-N235", id="inside out"),
    ],
)
def test_what_is_told_before_the_first_cut(model: Floats, code: str | None, tmp_path: Path) -> None:
    scene = ingest(write(tmp_path / "model.glb", [("building", model)]))
    assert [note.code for note in scene.notes] == ([code] if code else [])
