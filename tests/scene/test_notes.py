"""Notes as lines: which are warnings, and that these are few."""

from __future__ import annotations

import re
from pathlib import Path

from ptmtools.scene.model import Note
from ptmtools.scene.notes import WARNINGS, line, lines, warnings

ROOT = Path(__file__).resolve().parents[2]


def test_a_line() -> None:
    assert line(Note("PTM-N211", "duplicate faces dropped", "", 52)) == (
        "duplicate faces dropped (52 times) [PTM-N211]"
    )
    assert line(Note("PTM-N204", "a.png: not found", "m.mtl:4"), 1) == (
        "m.mtl:4: a.png: not found, and 1 more like it [PTM-N204]"
    )


def test_warnings_are_the_gravest_first_and_one_of_each_kind() -> None:
    missing = [Note("PTM-N204", f"{n}.png: not found", f"m.mtl:{n}") for n in range(1_200)]
    given = [
        Note("PTM-N211", "duplicate faces dropped"),
        *missing,
        Note("PTM-N234", "the model lies on its side"),
        Note("PTM-N201", "unit guessed"),
    ]
    assert list(warnings(given)) == [
        "the model lies on its side [PTM-N234]",
        "m.mtl:0: 0.png: not found, and 1,199 more like it [PTM-N204]",
    ]
    assert list(warnings(given[:1])) == []


def test_the_docs_list_the_same_warnings() -> None:
    text = (ROOT / "docs/formats/codes.md").read_text("utf-8")
    table = text[text.index("| warnings | of |") : text.index("| notes | of |")]
    actual = set()
    for row in re.findall(r"^\| PTM-([^|]*)\|", table, re.MULTILINE):
        for first, _, last in re.findall(r"N(\d+)( to N(\d+))?", row):
            actual |= {f"PTM-N{n}" for n in range(int(first), int(last or first) + 1)}
    assert actual == set(WARNINGS)


def test_notes_that_differ_by_a_name_are_one_line() -> None:
    given = [Note("PTM-N215", "morph targets dropped", f"mesh {name}") for name in ("a", "b", "c")]
    given += [Note("PTM-N211", f"{name}: invisible (opacity 0)") for name in ("glass", "air")]
    given += [Note("PTM-N211", "duplicate faces dropped", "", 52)]
    assert lines(given) == [
        "mesh a: morph targets dropped, and 2 more like it [PTM-N215]",
        "glass: invisible (opacity 0), and 1 more like it [PTM-N211]",
        "duplicate faces dropped (52 times) [PTM-N211]",
    ]
