"""A changed tour in the text of the old one."""

from __future__ import annotations

import difflib
import json
from copy import deepcopy
from typing import Any

import pytest
from hypothesis import given, strategies as st

from ptmtools.tour.writing import format_json, rewrite

#: As a person writes it: several members in a line, points in one, and an escape.
TEXT = """{
  "format": "ptmtools tour", "schema": 1,
  "languages": ["en", "de"],
  "labels": [
    {"id": "night", "object": "painting_01",
     "title": {"en": "Night", "de": "Nacht \\u00e4"}},
    {"id": "day", "at": [1.0, 2.50, -3e0],
     "title": {"en": "Day"}}
  ],
  "stops": [
    {"label": "night", "view": {"position": [1, 2, 3], "direction": [0, 0, 1]}},
    {"label": "day", "view": {"position": [4, 2, 3], "direction": [0, 0, 1]}}
  ]
}
"""


def changed(document: Any, text: str = TEXT) -> tuple[list[str], list[str]]:
    """The lines that a change removes, and those that it adds."""
    after = rewrite(text, document)
    assert json.loads(after) == document
    old, new = text.splitlines(), after.splitlines()
    steps = difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes()
    moves = [step for step in steps if step[0] != "equal"]
    return (
        [line for _, i, j, _, _ in moves for line in old[i:j]],
        [line for _, _, _, i, j in moves for line in new[i:j]],
    )


@pytest.fixture
def tour() -> Any:
    return json.loads(TEXT)


def test_nothing_changes_without_a_change(tour: Any) -> None:
    assert rewrite(TEXT, tour) == TEXT


def test_a_change_of_a_text_is_a_change_of_its_line(tour: Any) -> None:
    tour["labels"][1]["title"]["en"] = "Noon"
    before, after = changed(tour)
    assert before == ['     "title": {"en": "Day"}}']
    assert after == ['     "title": {"en": "Noon"}}']


def test_a_moved_stop_keeps_its_text(tour: Any) -> None:
    first, second = TEXT.splitlines()[10:12]
    tour["stops"].reverse()
    assert f"{second},\n{first[:-1]}\n" in rewrite(TEXT, tour)
    assert max(map(len, changed(tour))) <= 2


def test_new_members_look_like_their_neighbours(tour: Any) -> None:
    tour["labels"][0]["maker"] = "A. Painter"
    tour["stops"].append({"view": {"position": [0, 0, 0], "direction": [1, 0, 0]}})
    assert changed(tour)[1] == [
        '     "title": {"en": "Night", "de": "Nacht \\u00e4"},',
        '     "maker": "A. Painter"},',
        '    {"label": "day", "view": {"position": [4, 2, 3], "direction": [0, 0, 1]}},',
        '    {"view": {"position": [0, 0, 0], "direction": [1, 0, 0]}}',
    ]


def test_a_new_label_in_a_tour_of_init(tour: Any) -> None:
    text = format_json(tour) + "\n"
    more = deepcopy(tour)
    more["labels"].insert(1, {"id": "new", "at": [1, 2, 3], "title": {"en": "New"}})
    before, after = changed(more, text)
    assert before == []
    assert len(after) == 7
    assert '   "at": [1, 2, 3],' in after
    assert rewrite(rewrite(text, more), tour) == text


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | st.floats(-9, 9) | st.text(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["id", "label", "a", 'b"']), inner, max_size=4)
    ),
    max_leaves=12,
)


@given(VALUES, VALUES, st.sampled_from([None, 1, "\t"]))
def test_any_value_takes_the_place_of_any_other(one: Any, other: Any, indent: Any) -> None:
    text = " " + json.dumps(one, indent=indent) + "\n"
    assert rewrite(text, one) == text
    after = rewrite(text, other)
    assert json.loads(after) == other
    assert rewrite(after, other) == after
