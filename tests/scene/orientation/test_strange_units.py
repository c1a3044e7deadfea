"""Models like those that people have, by their sizes, with the unit and the axis that their files
state, and what a person would say of these."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.orientation.space import DeclaredSpace, settle
from ptmtools.scene.orientation.up_axis import NamedFaces
from tests.cells.buildings import carved, room
from tests.cells.stranger_parts import noisy
from tests.scene.buildings import box, sheet, welded, y_up
from tests.scene.districts import boulder, city, flat, museum, office

GLTF = DeclaredSpace(1.0, "y", prescribed=True)
USD, IFC = DeclaredSpace(1.0, "y"), DeclaredSpace(1.0, "z")


def gallery(width: float, depth: float, height: float) -> Floats:
    """A hall with two partitions, pictures and benches."""
    w, d, h = width, depth, height
    solids = [
        ((x * w, y * d, 0), (x * w + 0.2, (y + 0.4) * d, 0.8 * h))
        for x, y in ((0.3, 0.3), (0.6, 0.2))
    ]
    parts = [carved([room(0, 0, w, d, 0, h)], [], solids)]
    for k in range(5):
        y = d * (0.1 + 0.15 * k)
        parts.append(box((0.02, y, 1.2), (0.06, y + 0.7, 2.0)))
        parts.append(box((0.45 * w, y, 0), (0.45 * w + 0.5, y + 1, 0.45)))
    return np.concatenate(parts)


def chamber(*, closed: bool, height: float = 3.0) -> Floats:
    """A bedroom of 4 × 3.2 m; one that is not closed has two of its walls and no ceiling."""
    w, d, h = 4.0, 3.2, height
    parts = [
        box((0, 0, -0.1), (w, d, 0)),
        box((-0.1, 0, 0), (0, d, h)),
        box((0, d, 0), (w, d + 0.1, h)),
    ]
    if closed:
        parts += [box((w, 0, 0), (w + 0.1, d, h)), box((0, 0, h), (w, d, h + 0.1))]
    parts += [
        box((0.3, 0.8, 0), (2.3, 2.6, 0.5)),
        box((3.2, 0.3, 0), (3.9, 1.5, 2.0)),
        box((2.6, 2.7, 0.7), (3.9, 3.2, 0.75)),
    ]
    return np.concatenate(parts)


def castle(width: float = 40.0) -> Floats:
    """Three storeys of halls, 6.2 m high, around a court."""
    at = np.arange(1.0, width - 8, 9.0).tolist()
    halls = [
        room(x, y, x + 8, y + 8, z, z + 6.2)
        for z in (0.1, 6.9, 13.7)
        for x in at
        for y in at
        if not (9 < x < width - 18 and 9 < y < width - 18)
    ]
    court = room(10.5, 10.5, width - 11.5, width - 11.5, 0.05, 22)
    w = width + 1
    return np.concatenate(
        [sheet((-1, -1, 0), (w, -1, 0), (w, w, 0), (-1, w, 0)), carved(halls, [court], wall=0.8)]
    )


def crawlspaces() -> Floats:
    """A house of seven rooms, 2.5 m high, over and under spaces of 1 m, four of each."""
    rooms = [room(4.2 * k, 0, 4.2 * k + 4, 4, 0, 2.5) for k in range(7)]
    low = [room(0, 0, 29.2, 4, z, z + 1) for z in (-5.2, -3.9, -2.6, -1.3, 2.8, 4.1, 5.4, 6.7)]
    return carved([*rooms, *low])


def kitchen() -> tuple[Floats, Floats]:
    """A flat, and its refrigerator."""
    return flat(), box((5.2, 5.6, 0), (5.8, 6.2, 1.8))


class Case(NamedTuple):
    """What a file states of a model, Z up in metres; metres in a unit of the file; the outcome, and
    what the message on it has to say."""

    model: Floats
    stated: DeclaredSpace
    metres: float
    outcome: str
    words: str = ""


CASES = {
    "gallery 390 in wide": Case(gallery(9.5, 9.5, 3.3), GLTF, 0.0254, "taken", "assuming in"),
    "lower gallery": Case(gallery(9.5, 6, 2.5), GLTF, 0.0254, "taken", "assuming in"),
    "scanned library": Case(noisy((0, 0, 0), (14.4, 8.7, 6), 0.3), GLTF, 10, "asked", "--unit 4"),
    "castle": Case(castle(), GLTF, 5, "asked", "--unit 4 "),
    "castle in metres": Case(castle(), GLTF, 1, "silent"),
    "hotel room": Case(chamber(closed=True, height=2.12), GLTF, 0.001, "taken", "assuming mm"),
    "house of 7 spaces": Case(crawlspaces(), replace(IFC, rooms=(2.5,) * 7), 1, "silent"),
    "small city": Case(city(420, tallest=120), GLTF, 1, "silent"),
    "city without a ground": Case(city(300, ground=False, tallest=150), GLTF, 1, "silent"),
    "bedroom": Case(chamber(closed=True), GLTF, 1, "silent"),
    "open bedroom": Case(chamber(closed=False), GLTF, 1, "silent"),
    "monolith": Case(box((0, 0, 0), (1.4, 2.0, 3.5)), IFC, 1, "silent"),
    "museum 2 km wide": Case(museum(), GLTF, 0.0254, "asked", "--unit in"),
    "concrete gallery": Case(gallery(19, 46.6, 5.5), GLTF, 0.3048, "warned", "ft is more likely"),
    "office diorama": Case(office(), GLTF, 24, "asked", "--unit 23"),
    "statue": Case(boulder(0.3), GLTF, 1, "warned", "lower than a visitor"),
    "hangar": Case(carved([room(0, 0, 200, 80, 0, 30)], wall=0.5), GLTF, 1, "silent"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_what_a_file_states_is_judged(name: str) -> None:
    case = CASES[name]
    check(case, [case.model])


@pytest.mark.parametrize(("metres", "outcome"), [(0.4, "warned"), (1.0, "silent")])
def test_the_height_of_a_refrigerator_tells_the_unit(metres: float, outcome: str) -> None:
    words = "0.47 is more likely" if outcome == "warned" else ""
    check(Case(flat(), USD, metres, outcome, words), [*kitchen()])


def check(case: Case, parts: list[Floats]) -> None:
    """The last of several parts is a refrigerator."""
    every = np.concatenate(parts)
    points, faces = welded((every if case.stated.up == "z" else y_up(every)) / case.metres)
    number = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    names = ["model", "Refrigerator"][: len(parts)], number
    named = NamedFaces.from_names(names, ([""], np.zeros(len(faces), dtype=int)))
    notes = IngestNotes(Path("model"))
    if case.outcome == "asked":
        with pytest.raises(InputError, match="PTM-I236") as caught:
            settle(points, faces, named, DeclaredSpace(), case.stated, notes)
        assert case.words in str(caught.value.remedy)
        return
    space = settle(points, faces, named, DeclaredSpace(), case.stated, notes)
    assert space.up == case.stated.up
    assert space.metres == (case.metres if case.outcome == "taken" else 1.0)
    messages = [note.message for note in notes.entries]
    assert bool(messages) == (case.outcome != "silent"), messages
    assert any(re.search(case.words, message) for message in messages) or not case.words
