"""What comes of small buildings, as `made_buildings` has it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.errors import InputError
from ptmtools.scene import ingest
from ptmtools.scene.notes import line
from ptmtools.visibility import compute_pvs
from tests.cells.buildings import write
from tests.cells.made_buildings import DOORS, EMPTY, EVERY, GAP_BEHIND_GAP, NO_PLACES
from tests.scene.made import house, inside_out, y_up


@pytest.mark.parametrize("name", EVERY)
def test_what_comes_of_it(name: str, tmp_path: Path) -> None:
    made = EVERY[name]
    scene = made.scene(tmp_path)
    cells = subdivide(scene, SubdivideOptions(**made.options))
    assert cells.closed == made.closed
    notes = [*map(line, scene.notes), *cells.notes]
    assert [word for word in made.said if not any(word in note for note in notes)] == []
    assert sum("to stand on around" in note for note in notes) == made.cut_off

    eyes = made.in_world(scene, made.eyes.values())
    cell = dict(zip(made.eyes, cells.locate(eyes).tolist(), strict=True))
    leaf = dict(zip(made.eyes, cells.locate_leaf(eyes).tolist(), strict=True))
    lost = [eye for eye in made.eyes if leaf[eye] < 0 or not cells.leaf_standing[leaf[eye]]]
    assert lost == []
    assert cells.standing[list(cell.values())].all()
    rooms = [{cell[eye] for eye in room.split()} for room in made.rooms or ()]
    rooms = [{each} for each in cell.values()] if made.rooms is None else rooms
    assert [len(each) for each in rooms] == [1] * len(rooms)
    assert len(set.union(set(), *rooms)) == len(rooms)
    if not made.more:
        assert np.count_nonzero(cells.standing) == len(rooms)
        if None not in made.seen.values():
            assert cells.cell_count == len(rooms)

    assert cells.locate(made.in_world(scene, made.gone)).tolist() == [-1] * len(made.gone)
    there = made.in_world(scene, made.seen)
    assert not cells.leaf_standing[cells.locate_leaf(there)].any()
    for at, eye in zip(cells.locate(there).tolist(), made.seen.values(), strict=True):
        assert at >= 0
        assert eye is None or at == cell[eye]

    pvs = compute_pvs(cells).to_matrix()
    assert np.array_equal(pvs, pvs.T)
    assert pvs[cells.standing].any(axis=0).all()
    for pairs, seen in ((made.sees, True), (made.blind, False)):
        ends = [[cell[eye] for eye in pair.split()] for pair in pairs]
        assert [bool(pvs[a, b]) for a, b in ends] == [seen] * len(pairs)


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


@pytest.mark.parametrize(("doors", "drawn"), [("open", True), ("closed", True), ("hidden", False)])
def test_door_leaves_are_drawn_unless_hidden(doors: str, drawn: bool, tmp_path: Path) -> None:
    scene = DOORS["two rooms and a door leaf, by its name"].scene(tmp_path)
    cells = subdivide(scene, SubdivideOptions(doors=doors))
    shown = scene.triangle_object[cells.triangle_source[cells.emitted(scene.two_sided)[0]]]
    assert (scene.objects.index("Zimmertür") in shown) == drawn


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
