"""`benchmarks/mutants.py`: which changes it makes, and that it tells what a test notices."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from benchmarks.mutants import draw_mutants, find_mutants, is_valid, lives  # noqa: E402

SOURCE = '"""Doc 7."""\n\nWIDE = 2  # °\n\ndef f(x):\n    return x - 1 if x > WIDE else 0.5\n'
TEST = (
    "from ptmtools.cells.walls import f\n\n"
    "def test_f():\n    assert f(5) == 4 and f(0) == 0.5\n    assert f(2) == 0.5\n"
)


def test_constants_comparisons_and_signs_change() -> None:
    path = Path("ptmtools/cells/walls.py")
    changed = [mutant.apply(SOURCE) for mutant in find_mutants(path, SOURCE)]
    assert len(changed) == 5
    for old, new in (
        ("WIDE = 2", "WIDE = 3"),
        ("x - 1 if", "x + 1 if"),
        ("x - 1 if", "x - 2 if"),
        ("x > WIDE", "x >= WIDE"),
        ("else 0.5", "else 0.85"),
    ):
        assert SOURCE.replace(old, new) in changed


def test_parentheses_stay() -> None:
    source = "y = (1 + 2) - (3)\n"
    mutants = list(find_mutants(Path("ptmtools/a.py"), source))
    assert all(is_valid(mutant, source) for mutant in mutants)
    assert "y = (1 + 2) + (3)\n" in [mutant.apply(source) for mutant in mutants]


def test_tests_notice_what_they_guard(tmp_path: Path) -> None:
    for name, text in {
        "ptmtools/__init__.py": "",
        "ptmtools/cells/__init__.py": "",
        "ptmtools/cells/walls.py": SOURCE,
        "ptmtools/light/lamps.py": "LAMP = 1\n",
        "tests/cells/test_walls.py": TEST,
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    mutants = draw_mutants(tmp_path, [], 9, 1)
    assert len(mutants) == 5, "the folder without tests has none"
    by_text = {mutant.apply(SOURCE): mutant for mutant in mutants}
    unnoticed = by_text[SOURCE.replace("WIDE = 2", "WIDE = 3")]
    assert lives(unnoticed, tmp_path, 60)
    assert not lives(by_text[SOURCE.replace("x > WIDE", "x >= WIDE")], tmp_path, 60)
    assert (tmp_path / "ptmtools/cells/walls.py").read_text() == SOURCE
