"""Cache folders of machine code: one for each state of the sources that it depends on."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import ptmtools
from ptmtools import jit
from ptmtools.sources import module_file

ROOT = Path(ptmtools.__file__).parent
PROGRAM = """
from ptmtools.progress import listen
from ptmtools.one import outer
listen(print)
print(outer(1))
"""
#: A package of two kernels and a table, of which the program calls the one that uses all.
SOURCES = {
    "__init__": "from ptmtools.sources import watch\nwatch()\n",
    "one": """
from ptmtools.jit import kernel
from ptmtools.two import (  # what it calls
    inner as called,
)

@kernel
def outer(x):
    return called(x) + 1
""",
    "two": """
from ptmtools import tables
from ptmtools.jit import kernel

FACTOR = tables.FACTOR

@kernel
def inner(x):
    return x * FACTOR + 1
""",
    "tables": "FACTOR = 10\n",
    "apart": "NOTHING = 0\n",
}


def run(program: str, folder: Path, **environment: str) -> list[str]:
    """What a program prints that imports the package in ``folder``, line by line."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=folder,
        # Files that keep their size change within a second here, which bytecode does not notice.
        env={
            **os.environ,
            "PYTHONPATH": str(folder),
            "PYTHONDONTWRITEBYTECODE": "1",
            **environment,
        },
        check=True,
        capture_output=True,
    )
    return done.stdout.decode().splitlines()


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of this name, of `SOURCES`."""
    package = tmp_path / "ptmtools"
    package.mkdir()
    for name, source in SOURCES.items():
        (package / f"{name}.py").write_text(source)
    for name in ("errors", "jit", "progress", "sources"):
        shutil.copy(ROOT / f"{name}.py", package)
    return package


@pytest.mark.parametrize("chosen", ["", "chosen"])
def test_what_a_kernel_sees_decides_about_its_machine_code(package: Path, chosen: str) -> None:
    """Numba alone would run yesterday's inner kernel, with yesterday's table."""
    for edited, old, new, result, fresh in (
        ("one", "", "", 12, True),
        ("tables", "10", "20", 22, True),
        ("two", "+ 1", "+ 2", 23, True),
        ("apart", "0", "1", 23, False),
        ("tables", "20", "10", 13, True),
        ("two", "+ 2", "+ 1", 12, False),
    ):
        file = package / f"{edited}.py"
        file.write_text(file.read_text().replace(old, new))
        *announced, actual = run(PROGRAM, package.parent, NUMBA_CACHE_DIR=chosen)
        assert int(actual) == result
        assert len(announced) == fresh


def test_sources_that_change_under_a_process(package: Path) -> None:
    """It computes with what it has imported, and leaves machine code of that."""
    tables = package / "tables.py"
    upgraded = package / "upgraded.py"
    upgraded.write_text("FACTOR = 20\n")
    # As files that `rsync -a` or a wheel brings.
    os.utime(upgraded, (0, 0))
    meanwhile = f"import os\nos.replace({str(upgraded)!r}, {str(tables)!r})\n"
    for program, result, fresh in (
        (f"import ptmtools.tables\n{meanwhile}{PROGRAM}", 12, True),
        (PROGRAM, 22, True),
        (PROGRAM, 22, False),
    ):
        *announced, actual = run(program, package.parent, NUMBA_CACHE_DIR="")
        assert int(actual) == result
        assert len(announced) == fresh
    tables.write_text(SOURCES["tables"])
    assert run(PROGRAM, package.parent, NUMBA_CACHE_DIR="") == ["12"]


@pytest.mark.parametrize(
    "before",
    [
        "import importlib\nfrom ptmtools import one, two, tables\n{}"
        "for module in (tables, two, one): importlib.reload(module)\n",
        "from importlib.util import find_spec\nfind_spec('ptmtools.tables')\n{}",
    ],
    ids=["reload", "find_spec"],
)
def test_a_module_that_is_imported_again(package: Path, before: str) -> None:
    """Or only looked for, and imported after an edit: other processes compile for themselves."""
    tables = package / "tables.py"
    program = before.format(f"open({str(tables)!r}, 'w').write('FACTOR = 20')\n") + PROGRAM
    assert run(program, package.parent, NUMBA_CACHE_DIR="")[-1] == "22"
    tables.write_text(SOURCES["tables"])
    assert run(PROGRAM, package.parent, NUMBA_CACHE_DIR="")[-1] == "12"
    assert run(program, package.parent, NUMBA_CACHE_DIR="")[-1] == "22"


def test_a_source_that_cannot_be_read(package: Path) -> None:
    """Python needs none beside its bytecode."""
    program = f"""
from pathlib import Path
read = Path.read_bytes
def read_others(file):
    if file.name == "tables.py":
        raise PermissionError
    return read(file)
Path.read_bytes = read_others
{PROGRAM}"""
    for _ in range(2):
        announced, actual = run(program, package.parent, NUMBA_CACHE_DIR="")
        assert announced
        assert actual == "12"


def test_the_class_of_an_argument(package: Path) -> None:
    """A kernel reads the fields of a named tuple by number, and need not import its class. Other
    classes that it is called with, before or not, decide nothing."""
    (package / "one.py").write_text(SOURCES["one"].replace("called(x) + 1", "x.a - x.b"))
    source = "from typing import NamedTuple\nclass {}(NamedTuple):\n    {}: int\n    {}: int\n"
    (package / "first.py").write_text(source.format("First", "a", "b"))
    pair = PROGRAM.replace("outer(1)", "outer(Pair(a=3, b=1))")
    pair = f"from ptmtools.pair import Pair\n{pair}"
    both = "from ptmtools.first import First\nfrom ptmtools.one import outer\n"
    both += f"outer(First(0, 0))\n{pair}"
    for fields in (("a", "b"), ("b", "a")):
        (package / "pair.py").write_text(source.format("Pair", *fields))
        assert run(both, package.parent, NUMBA_CACHE_DIR="")[-1] == "2"
        assert run(pair, package.parent, NUMBA_CACHE_DIR="") == ["2"], "compiled again"


def test_two_processes_that_start_together(package: Path) -> None:
    """Both may compile; what they leave is whole."""
    with ThreadPoolExecutor(2) as pool:
        printed = list(pool.map(lambda _: run(PROGRAM, package.parent, NUMBA_CACHE_DIR=""), "ab"))
    assert [lines[-1] for lines in printed] == ["12", "12"]
    assert run(PROGRAM, package.parent, NUMBA_CACHE_DIR="") == ["12"]


def test_two_threads_make_one_dispatcher() -> None:
    """Each saw that there is none, and one had to wait."""
    added: Any = jit.kernel(lambda x: x + 1)
    added._make_entry()
    first = added._entry
    added._make_entry()
    assert added._entry is first


def test_literals_are_not_types_of_their_own(package: Path) -> None:
    """Dispatchers that call each other compile the callee for every literal."""
    (package / "one.py").write_text(
        SOURCES["one"].replace("called(x)", "called(x) + called(2) + called(3)")
    )
    program = f"{PROGRAM}\nfrom ptmtools.jit import compilations\nprint(compilations())"
    lines = run(program, package.parent, NUMBA_CACHE_DIR="")
    assert lines[1:] == [str(11 + 21 + 31 + 1), "2"]


def test_both_forms_of_a_kernel(package: Path) -> None:
    """Called from Python it is cached by itself, whether or not it is a part of another."""
    program = f"{PROGRAM}\nfrom ptmtools.two import inner\nprint(inner(1))"
    assert run(program, package.parent, NUMBA_CACHE_DIR="")[1:] == ["12", "11"]
    assert run(program, package.parent, NUMBA_CACHE_DIR="") == ["12", "11"]


def test_a_constant_of_this_package(tmp_path: Path) -> None:
    shutil.copytree(
        ROOT, tmp_path / "ptmtools", ignore=shutil.ignore_patterns("__pycache__", "schemas")
    )
    program = (
        "import numpy; from ptmtools.texture.coders.mixing_decisions import update_counter; "
        "print(update_counter(numpy.uint32(1 << 31), 1, 9))"
    )
    before = run(program, tmp_path)
    tables = tmp_path / "ptmtools" / "texture/coders/mixing_tables.py"
    source = tables.read_text()
    assert source.count("655360") == 1
    tables.write_text(source.replace("655360", "327680"))
    after = run(program, tmp_path)
    assert before != after
    tables.write_text(source)
    assert run(program, tmp_path) == before


@pytest.mark.parametrize("closed", ["variable", "subfolder", "all"])
def test_without_a_place_to_keep_it_code_still_runs(package: Path, closed: str) -> None:
    """Never where numba keeps it by itself: that folder is the same for all sources."""
    file, chosen = package.parent / "file", package.parent / "chosen"
    file.touch()
    own = package / "__pycache__" / "kernels"
    places = {"NUMBA_CACHE_DIR": str(file), "XDG_CACHE_HOME": str(file), "HOME": str(file)}
    if closed == "all":
        own.parent.mkdir()
        own.touch()
    elif closed == "subfolder":
        places["NUMBA_CACHE_DIR"] = str(chosen)
        run(PROGRAM, package.parent, **places)
        for folder in chosen.glob("*/*"):
            shutil.rmtree(folder)
            folder.touch()
    announced = [len(run(PROGRAM, package.parent, **places)) - 1 for _ in range(2)]
    assert announced == [1, closed != "variable"]
    assert run(PROGRAM, package.parent, **places)[-1] == "12"
    assert not list(own.parent.glob("*.nbi"))


def test_no_import_is_overlooked() -> None:
    for file in ROOT.rglob("*.py"):
        actual = set()
        for node in ast.walk(ast.parse(file.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [name.name for name in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert not node.level
                names = [f"{node.module}.{name.name}" for name in node.names]
            for name in names:
                if name.split(".")[0] == ROOT.name:
                    own = module_file(name)
                    actual.add(own or module_file(name.rpartition(".")[0]))
        assert actual <= jit._imports(file.read_bytes()), file
