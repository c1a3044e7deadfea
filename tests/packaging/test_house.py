"""`benchmarks/house.py` finds each fault that is planted in a small checkout."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from benchmarks.codebase.names import is_participle, is_preposition  # noqa: E402
from benchmarks.codebase.report import find_places, measure  # noqa: E402
from benchmarks.codebase.sources import read_packages  # noqa: E402
from benchmarks.codebase.walks import follow  # noqa: E402
from benchmarks.house import check, measure_sizes  # noqa: E402

SOURCES = {
    "ptmtools/__init__.py": "",
    "ptmtools/cells/__init__.py": "",
    "ptmtools/cells/walls.py": "class Wall:\n    left: int = 0\n",
    "ptmtools/scene/__init__.py": "",
    "ptmtools/scene/model.py": "def load(path):\n    return path\n",
    "ptmtools/cli/__init__.py": "",
    "ptmtools_lab/__init__.py": "",
    "ptmtools_lab/walks.py": "from ptmtools.cells.walls import Wall\n",
    "ptmtools_systems/__init__.py": "",
    "sample_data/ptmtools_samples/__init__.py": "",
}


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for name, text in SOURCES.items():
        write(tmp_path, name, text)
    return tmp_path


def write(root: Path, name: str, text: str) -> None:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def faults_of(root: Path, *exceptions: str, more: int = 10) -> list[str]:
    packages = read_packages(root)
    budget = {
        name: (lines + more, files + more)
        for name, (lines, files) in measure_sizes(packages).items()
    }
    faults, stale = check(packages, exceptions, budget, {})
    return faults + stale


def test_a_clean_checkout_has_no_fault(checkout: Path) -> None:
    assert faults_of(checkout) == []


@pytest.mark.parametrize(
    "text",
    [
        "import ptmtools_lab.walks\n",
        "def load():\n    from ptmtools_lab import walks\n",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from ptmtools_lab import walks\n",
        "TABLE = ('ptmtools_lab.walks:walk',)\n",
    ],
    ids=["statement", "in a function", "for types", "as text"],
)
def test_an_import_of_the_laboratory_is_found(checkout: Path, text: str) -> None:
    for package in ("ptmtools", "ptmtools_systems"):
        name = f"{package}/planted.py"
        write(checkout, name, text)
        (fault,) = faults_of(checkout)
        assert fault.startswith(f"{name} imports ptmtools_lab")
        assert faults_of(checkout, f"import {name} ptmtools_lab") == []
        (checkout / name).unlink()


def test_a_relative_import_is_resolved(checkout: Path) -> None:
    write(checkout, "ptmtools/scene/lamp.py", "from ..cells import walls\n")
    write(checkout, "ptmtools/cells/plan.py", "from ..scene.model import load\n")
    (fault,) = faults_of(checkout)
    assert fault == "folders that import each other: ptmtools.cells ptmtools.scene"


def test_an_import_of_the_command_line_is_found(checkout: Path) -> None:
    write(checkout, "ptmtools/cli/main.py", "from ptmtools.cli import main\n")
    write(checkout, "ptmtools/__main__.py", "from ptmtools.cli.main import run\n")
    assert faults_of(checkout) == []
    write(checkout, "ptmtools/scene/model.py", "from ptmtools.cli import main\n")
    (fault,) = faults_of(checkout)
    assert fault.startswith("ptmtools/scene/model.py imports ptmtools.cli.main")


def test_a_repeated_class_is_found(checkout: Path) -> None:
    write(checkout, "ptmtools_lab/plan.py", "def plan():\n    class Wall: ...\n")
    (fault,) = faults_of(checkout)
    assert "ptmtools/cells/walls.py:1, ptmtools_lab/plan.py:2" in fault
    assert faults_of(checkout, "class Wall") == []


@pytest.mark.parametrize(
    "text",
    [
        "def f():\n    own = 1\n",
        "def f(xs):\n    for each in xs: ...\n",
        "def f(xs):\n    return [_one for _one in xs]\n",
        "def f(here):\n    ...\n",
        "f = lambda far: 0\n",
        "def f(xs):\n    a, (most, *b) = xs\n",
        "def f(xs):\n    with xs as held: ...\n",
        "def f(x):\n    match x:\n        case [other]: ...\n",
        "def f(x):\n    return (of := x)\n",
        "def f(x):\n    try: ...\n    except E as left: ...\n",
    ],
)
def test_a_banned_local_is_found(checkout: Path, text: str) -> None:
    write(checkout, "ptmtools/planted.py", text)
    (fault,) = faults_of(checkout)
    assert fault.startswith("ptmtools/planted.py:")
    assert "name the quantity" in fault
    assert faults_of(checkout, "locals ptmtools/planted.py") == []


def test_a_package_that_grows_is_found(checkout: Path) -> None:
    assert faults_of(checkout, more=0) == []
    sizes = measure_sizes(read_packages(checkout))
    write(checkout, "ptmtools/cells/doors.py", "a = 1\nb = 2\n")
    faults, _ = check(read_packages(checkout), (), sizes, {})
    assert {fault.split(":")[0] for fault in faults} == {
        "ptmtools has 6 lines, 2 more than its row in BUDGET",
        "ptmtools has 7 files, 1 more than its row in BUDGET",
        "ptmtools/cells has 4 lines, 2 more than its row in BUDGET",
        "ptmtools/cells has 3 files, 1 more than its row in BUDGET",
    }
    write(checkout, "ptmtools/attic/__init__.py", "")
    faults, _ = check(read_packages(checkout), (), sizes, {})
    assert "ptmtools/attic has no row in BUDGET" in faults


def test_a_participle_more_than_allowed_is_found(checkout: Path) -> None:
    write(checkout, "ptmtools/cells/joining.py", "def _joined(): ...\ndef of(): ...\n")
    faults = faults_of(checkout)
    assert [fault.split(",")[0] for fault in faults] == [
        "ptmtools: 1 functions are named by a participle",
        "ptmtools: 1 functions are named by a preposition",
    ]


def test_participles_and_prepositions_are_told_from_verbs_and_nouns() -> None:
    assert all(map(is_participle, ("joined", "_held", "lit", "united_by", "_subdivided")))
    assert not any(map(is_participle, ("join", "need", "seed", "joined_faces", "of", "files_of")))
    assert all(map(is_preposition, ("of", "_about", "apart", "up_to")))
    assert not any(map(is_preposition, ("files_of", "offset", "upload")))


def test_an_exception_that_is_not_needed_is_named(checkout: Path) -> None:
    assert faults_of(checkout, "class Gone") == ["class Gone"]


def test_shrink_drops_what_is_not_needed(checkout: Path) -> None:
    write(checkout, "benchmarks/house_exceptions.txt", "# why\nclass Gone\n")
    script = ROOT / "benchmarks" / "house.py"
    command = [sys.executable, str(script), str(checkout)]
    done = subprocess.run([*command, "--check"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "remove it: class Gone" in done.stdout
    done = subprocess.run([*command, "--shrink"], capture_output=True, text=True)
    assert "class Gone" not in done.stdout
    assert (checkout / "benchmarks/house_exceptions.txt").read_text() == "# why\n"


def test_the_report_names_long_functions_and_many_parameters(checkout: Path) -> None:
    body = "    x = 1\n" * 60
    parameters = ", ".join("abcdefghi")
    write(
        checkout,
        "ptmtools/planted.py",
        f"def slow():\n{body}\n@kernel\ndef fast():\n{body}\ndef wide({parameters}): ...\n"
        "class C:\n    def narrow(self, a, b, c, d, e, f, g, h): ...\n",
    )
    places = find_places(read_packages(checkout))
    assert [p.split()[-1] for p in places["functions over 60 lines"]] == ["slow"]
    assert [p.split()[-1] for p in places["kernels over 60 lines"]] == ["fast"]
    assert [p.split()[-1] for p in places["functions of more than 8 parameters"]] == ["wide"]


def test_the_report_finds_circles_and_crumbs_of_files(checkout: Path) -> None:
    write(checkout, "ptmtools/cells/a.py", "import ptmtools.cells.b\n")
    write(checkout, "ptmtools/cells/b.py", "def f():\n    from ptmtools.cells import a\n")
    places = find_places(read_packages(checkout))
    assert places["circles of files, at run time"] == ["ptmtools.cells.a, ptmtools.cells.b"]
    assert set(places["files under 100 lines with one importer"]) == {
        "ptmtools.cells.a",
        "ptmtools.cells.b",
        "ptmtools.cells.walls",
    }


def test_a_parameter_is_followed(checkout: Path) -> None:
    write(
        checkout,
        "ptmtools/scene/model.py",
        "from ptmtools.cells.doors import Door, find\n"
        "def load(scene):\n"
        "    if not scene:\n        return None\n"
        "    find(1, part=scene.faces)\n"
        "    Door.of(scene)\n"
        "    unrelated(3)\n"
        "    return scene\n"
        "def unrelated(x):\n    return x\n",
    )
    write(
        checkout,
        "ptmtools/cells/doors.py",
        "def find(n, part):\n    return part\n"
        "class Door:\n    @classmethod\n    def of(cls, scene):\n        return find(2, scene)\n",
    )
    files = {f.name: f for members in read_packages(checkout).values() for f in members}
    passage = follow(files, "load", "scene")
    assert passage
    assert (len(passage.files), passage.returns) == (2, 4)
    assert follow(files, "load", "door") is None


def test_a_checkout_with_other_folders_is_measured(checkout: Path) -> None:
    (checkout / "sample_data/ptmtools_samples/__init__.py").unlink()
    write(checkout, "docs/index.md", "three short words\n")
    write(checkout, "tests/test_a.py", "def test(): ...\n")
    figures = measure(checkout)
    assert figures["words of docs"] == "3 in 1 pages"
    assert figures["tests"] == "1 / 1 / 2"
    assert "**ptmtools_samples**" not in figures
