"""Units and axes: names, numbers, and guesses."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.scene.model import Space
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.orientation.space import UNITS, DeclaredSpace, parse_unit, rotate, settle
from ptmtools.scene.orientation.up_axis import NamedFaces
from tests.scene.buildings import atrium, box, corridor, house, site_plan, tower, welded, y_up
from tests.scene.districts import boulder, city, flat, hills, museum, serpentine, square, table


@pytest.mark.parametrize(
    ("given", "metres"),
    [("m", 1), ("CM", 0.01), ("mm", 0.001), ("in", 0.0254), (" ft ", 0.3048), ("0.5", 0.5), (2, 2)],
)
def test_units(given: str | float, metres: float) -> None:
    assert parse_unit(given) == metres


@pytest.mark.parametrize("given", ["parsec", "", "0", "-1", "nan", "inf", 0.0])
def test_units_that_are_none(given: str | float) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        parse_unit(given)


def test_turning_is_a_rotation() -> None:
    axes = rotate(np.eye(3), "z")
    assert axes.tolist() == [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    assert np.linalg.det(axes) == 1
    assert not np.signbit(axes[0]).any()
    assert rotate(np.eye(3), "y").tolist() == np.eye(3).tolist()


def test_each_unit_can_be_guessed_or_given() -> None:
    assert list(UNITS) == ["m", "cm", "mm", "in", "ft"]


NOTHING, OBJ = DeclaredSpace(), DeclaredSpace(usual_up="y")


def settled(
    triangles: Floats,
    by_user: DeclaredSpace = NOTHING,
    by_format: DeclaredSpace = OBJ,
) -> tuple[Space, dict]:
    """The space of triangles, and the notes on it by code."""
    points, faces = welded(triangles)
    findings = IngestNotes(Path("house.obj"))
    named = NamedFaces(*np.zeros((2, len(faces)), dtype=bool))
    space = settle(points, faces, named, by_user, by_format, findings)
    return space, {note.code: note.message for note in findings.entries}


def test_guesses_are_noted() -> None:
    space, notes = settled(house() / 0.0254)
    assert (space.metres, space.up, space.unit_guessed, space.up_guessed) == (0.0254, "z", 1, 1)
    assert list(notes) == ["PTM-N202", "PTM-N238", "PTM-N201"]
    assert notes["PTM-N202"].startswith(
        "up axis guessed: Z, 19.2 m wide and 3.5 m high, clear height"
    )
    assert "rooms wider than high" in notes["PTM-N202"]
    assert notes["PTM-N201"].startswith("unit guessed: in (19.2 m wide")
    assert notes["PTM-N238"].startswith(
        "second-best guess: Y as the up axis, unit cm, 7.56 m wide and 4.57 m high"
    )
    assert notes["PTM-N238"].endswith("use --up y to select it")


def test_a_runner_up_far_behind_is_not_noted() -> None:
    """Two storeys of rooms, Y up as an OBJ file should have it."""
    _, notes = settled(y_up(house(storeys=2)))
    assert list(notes) == ["PTM-N202", "PTM-N201"]
    _, notes = settled(house(storeys=2))
    assert list(notes) == ["PTM-N202", "PTM-N238", "PTM-N201"]


def test_an_uncertain_courtyard_is_noted_although_a_convention_decides() -> None:
    space, notes = settled(y_up(atrium()) * 100)
    assert (space.up, space.metres) == ("y", 0.01)
    assert "assuming Y, 37.2 m wide and 15.6 m high" in notes["PTM-N232"]
    assert "Z is nearly as likely, 37.2 m wide and 22.9 m high" in notes["PTM-N232"]


def test_what_is_uncertain_is_noted_with_the_runner_up() -> None:
    space, notes = settled(box((0, 0, 0), (300, 300, 300)))
    assert space.metres == 0.01
    assert list(notes) == ["PTM-N232", "PTM-N201"]
    assert space.up == "y"
    assert notes["PTM-N232"].endswith("use --up y or --up z")
    _, notes = settled(house() / 0.3048)
    assert list(notes) == ["PTM-N202", "PTM-N238", "PTM-N233"]
    assert "assuming m" in notes["PTM-N233"]
    assert "ft is nearly as likely (19.2 m wide" in notes["PTM-N233"]
    assert notes["PTM-N233"].endswith("use --unit m or --unit ft")


def test_what_is_given_is_not_judged() -> None:
    space, notes = settled(house(), DeclaredSpace(0.3048, "y"))
    assert (space.metres, space.up, space.unit_guessed, space.up_guessed) == (0.3048, "y", 0, 0)
    assert not notes
    space, notes = settled(y_up(house()), DeclaredSpace(up="y"))
    assert (space.up, space.up_guessed, list(notes)) == ("y", False, ["PTM-N201"])
    space, notes = settled(house(), DeclaredSpace(metres=1.0))
    assert (space.up, space.unit_guessed, list(notes)) == ("z", False, ["PTM-N202", "PTM-N238"])


def test_a_format_is_believed_and_doubted() -> None:
    """glTF has metres and Y up: what lies on its side is not rotated unless asked."""
    gltf = DeclaredSpace(1.0, "y")
    assert settled(y_up(house()), by_format=gltf)[1] == {}
    space, notes = settled(house(), by_format=gltf)
    assert (space.up, space.up_guessed, list(notes)) == ("y", False, ["PTM-N234"])
    assert "with Y up it is 19.2 m wide and 11.6 m high" in notes["PTM-N234"]
    assert "with Z up 19.2 m wide and 3.5 m high" in notes["PTM-N234"]
    assert notes["PTM-N234"].endswith("use --up z to rotate it")
    space, notes = settled(house(), DeclaredSpace(up="z"), gltf)
    assert (space.up, notes) == ("z", {})
    space, notes = settled(y_up(house()) * 100, by_format=gltf)
    assert (space.metres, list(notes)) == (1.0, ["PTM-N227"])
    assert "cm is more likely" in notes["PTM-N227"]


def test_a_format_is_doubted_where_the_other_axis_is_somewhat_likelier() -> None:
    """As of a tower that lies on its side, and may be a hall of many bays; but not of a cube or a
    corridor, of which little can be told."""
    gltf = DeclaredSpace(1.0, "y")
    space, notes = settled(tower(), by_format=gltf)
    assert (space.up, space.up_guessed, list(notes)) == ("y", False, ["PTM-N232"])
    assert "the format prescribes Y, 64.2 m wide and 8 m high" in notes["PTM-N232"]
    assert "Z is more likely, 8 m wide and 64.2 m high" in notes["PTM-N232"]
    assert notes["PTM-N232"].endswith("use --up y or --up z")
    assert settled(y_up(tower()), by_format=gltf)[1] == {}
    assert settled(tower(), DeclaredSpace(up="y"), gltf)[1] == {}
    for plain in (box((0, 0, 0), (3, 3, 3)), corridor(40, 2, 3, rooms=False)):
        assert settled(y_up(plain), by_format=gltf)[1] == {}


def test_a_plan_does_not_lie_on_its_side() -> None:
    """A sheet standing upright in a glTF file may be a picture or a wall."""
    sheet = site_plan()[:2]
    assert settled(sheet, by_format=DeclaredSpace(1.0, "y"))[1] == {}


GLTF = DeclaredSpace(1.0, "y", prescribed=True)
BUILDINGS = {
    "house": house(),
    "museum": museum(),
    "serpentine": serpentine(),
    "flat": flat(),
    "square": square(),
    "city": city(),
}


def of_extent(triangles: Floats, extent: float) -> Floats:
    return triangles * (extent / np.ptp(triangles, axis=(0, 1)).max())


@pytest.mark.parametrize("name", BUILDINGS)
@pytest.mark.parametrize("by_format", [OBJ, GLTF], ids=["obj", "gltf"])
def test_the_unit_of_a_model_of_extent_3_is_asked(name: str, by_format: DeclaredSpace) -> None:
    """Each of the three units is an option, in the first of which the rooms are 2 to 6 m high."""
    small = y_up(of_extent(BUILDINGS[name], 2.9))
    with pytest.raises(InputError, match="PTM-I236") as caught:
        settled(small, by_format=by_format)
    assert caught.value.exit_status == 3
    remedy = str(caught.value.remedy)
    offers = re.findall(r"--unit (\S+) \((\S+) m wide and \S+ m high, clear height of most", remedy)
    rooms = [float(height) for height in re.findall(r"most rooms (\S+) m", remedy)]
    assert len(offers) == len(rooms) == 3
    assert 2 < rooms[0] < 6
    assert "m" in [unit for unit, _ in offers]
    for unit, width in offers:
        assert float(width) == pytest.approx(_width(small) * parse_unit(unit), rel=0.01)
        space, notes = settled(small, DeclaredSpace(parse_unit(unit)), by_format)
        assert space.metres == parse_unit(unit)
        assert not {"PTM-N227", "PTM-N233", "PTM-N236"} & notes.keys()


def _width(triangles: Floats) -> float:
    return float(np.ptp(triangles, axis=(0, 1))[[0, 2]].max())


def test_without_asking_an_impossible_unit_is_noted() -> None:
    points, faces = welded(y_up(of_extent(house(), 1)))
    for by_format in (OBJ, GLTF):
        findings = IngestNotes(Path("house.obj"))
        named = NamedFaces(*np.zeros((2, len(faces)), dtype=bool))
        space = settle(points, faces, named, NOTHING, by_format, findings, ask=False)
        assert (space.metres, space.up) == (1.0, "y")
        assert {n.code for n in findings.entries} - {"PTM-N202", "PTM-N238"} == {"PTM-N236"}


@pytest.mark.parametrize("name", BUILDINGS)
def test_gltf_in_metres_is_not_questioned(name: str) -> None:
    space, notes = settled(y_up(BUILDINGS[name]), by_format=GLTF)
    assert (space.metres, space.up) == (1.0, "y")
    assert not {"PTM-N227", "PTM-N236"} & notes.keys()


@pytest.mark.parametrize("name", ["house", "serpentine", "flat"])
def test_gltf_with_rooms_of_270_metres_is_questioned(name: str) -> None:
    """They may be 2.7 m high, in centimetres, or 6.9 m, in inches."""
    large = y_up(BUILDINGS[name]) / UNITS["cm"]
    with pytest.raises(InputError, match="PTM-I236") as caught:
        settled(large, by_format=GLTF)
    offers = re.findall(r"--unit (\S+) \(", str(caught.value.remedy))
    assert offers[:2] == ["cm", "in"]
    assert "m" in offers
    assert settled(large, DeclaredSpace(1.0), GLTF)[0].metres == 1.0


@pytest.mark.parametrize(
    ("name", "unit"),
    [("museum", "cm"), *((name, "mm") for name in ("house", "museum", "serpentine", "flat"))],
)
def test_gltf_in_an_obvious_unit_is_taken_with_a_warning(name: str, unit: str) -> None:
    """In no other are the rooms 1.7 to 10 m high."""
    large = y_up(BUILDINGS[name]) / UNITS[unit]
    space, notes = settled(large, by_format=GLTF)
    assert (space.metres, list(notes)) == (UNITS[unit], ["PTM-N227"])
    assert f"can hardly be ({_width(large):.3g} m wide" in notes["PTM-N227"]
    assert f"assuming {unit} ({_width(large) * UNITS[unit]:.3g} m wide" in notes["PTM-N227"]
    assert notes["PTM-N227"].endswith("use --unit to override")
    assert settled(large, DeclaredSpace(1.0), GLTF)[0].metres == 1.0


def test_a_recorded_unit_is_doubted_but_kept() -> None:
    """As in USD and IFC files: the program wrote the unit of this file."""
    space, notes = settled(house(), by_format=DeclaredSpace(0.01, "z"))
    assert (space.metres, list(notes)) == (0.01, ["PTM-N227"])
    assert "too small for a visitor 1.7 m tall" in notes["PTM-N227"]
    space, notes = settled(house() / 0.7, by_format=DeclaredSpace(0.7, "z"))
    assert (space.metres, list(notes)) == (0.7, [])
    space, notes = settled(house() / 0.7, by_format=DeclaredSpace(0.07, "z"))
    assert (space.metres, list(notes)) == (0.07, ["PTM-N227"])


@pytest.mark.parametrize(
    "triangles", [boulder(), boulder(0.01), hills(1), table(), house(floor=False, roof=False) / 10]
)
def test_what_has_no_rooms_is_not_refused(triangles: Floats) -> None:
    """Its unit cannot be judged: metres, with a warning if it is lower than a visitor."""
    space, notes = settled(y_up(triangles))
    assert space.metres == 1.0
    high = np.ptp(y_up(triangles), axis=(0, 1))[1 if space.up == "y" else 2]
    assert ("lower than a visitor" in notes.get("PTM-N233", "")) == (high < 1.7)
    assert "PTM-I236" not in notes
    assert settled(y_up(triangles), by_format=GLTF)[0].metres == 1.0
