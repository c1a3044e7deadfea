"""Where machine code is kept: a folder for every state of what compiled code can see."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import ptmtools
from ptmtools import compiled, machine_code

ROOT = Path(ptmtools.__file__).parent
PROGRAM = """
from ptmtools.progress import listen
from ptmtools.one import outer
listen(print)
print(outer(1))
"""
#: A package of two kernels and a table, of which the program calls the one that uses all.
SOURCES = {
    "__init__": "",
    "one": """
from ptmtools.compiled import kernel
from ptmtools.two import (  # what it calls
    inner as called,
)

@kernel
def outer(x):
    return called(x) + 1
""",
    "two": """
from ptmtools import tables
from ptmtools.compiled import kernel

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
        env={**os.environ, "PYTHONPATH": str(folder), **environment},
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
    for name in ("ahead", "compiled", "errors", "lazy", "machine_code", "progress"):
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
        *announced, found = run(PROGRAM, package.parent, NUMBA_CACHE_DIR=chosen)
        assert int(found) == result
        assert len(announced) == fresh


def test_one_of_two_processes_compiles(package: Path) -> None:
    """The other waits for it, and loads what it made."""
    with ThreadPoolExecutor(2) as pool:
        printed = list(pool.map(lambda _: run(PROGRAM, package.parent, NUMBA_CACHE_DIR=""), "ab"))
    assert [lines[-1] for lines in printed] == ["12", "12"]
    assert sorted(len(lines) for lines in printed) == [1, 2]


@pytest.mark.parametrize(
    ("ending", "sign", "again"), [("raise ValueError", "begun", True), ("", "*/*/*.done", False)]
)
def test_another_process_compiles_ahead(package: Path, ending: str, sign: str, again: bool) -> None:
    """Unless that was done before; one that fails is not noticed, and tried again."""
    (package / "task.py").write_text(
        "from pathlib import Path; from ptmtools.two import inner\n"
        f"def begin():\n    inner(1.0)\n    Path('ptmtools/begun').touch()\n    {ending}"
    )
    program = f"""
import time
from pathlib import Path
from ptmtools.ahead import compile_ahead
from ptmtools.lazy import Lazy
from ptmtools.progress import listen
listen(print)
compile_ahead(Lazy("ptmtools.task:begin"))
while not list(Path("ptmtools").glob("{sign}")):
    time.sleep(0.01)
from ptmtools.two import inner
print(inner(1.0))
"""
    announced = "compiling for this machine (first run only, up to a minute)"
    for first in (True, False):
        lines = [announced, "11.0"] if first or again else ["11.0"]
        assert run(program, package.parent, NUMBA_CACHE_DIR="") == lines


def test_what_is_over_soon_waits_until_something_is_compiled(package: Path) -> None:
    (package / "task.py").write_text(
        "from pathlib import Path\ndef begin():\n    Path('ptmtools/begun').touch()"
    )
    program = """
import time
from pathlib import Path
from ptmtools.ahead import compile_ahead_if_needed
from ptmtools.lazy import Lazy
from ptmtools.progress import listen
said = []
listen(said.append)
compile_ahead_if_needed(Lazy("ptmtools.task:begin"))
from ptmtools.two import inner
inner(1)
while said and not Path("ptmtools/begun").exists():
    time.sleep(0.01)
print(len(said))
"""
    assert run(program, package.parent, NUMBA_CACHE_DIR="") == ["1"]
    for done in package.glob("*/*/*.done"):
        done.unlink()
    (package / "begun").unlink()
    assert run(program, package.parent, NUMBA_CACHE_DIR="") == ["0"]
    assert not (package / "begun").exists()


def test_literals_are_not_types_of_their_own(package: Path) -> None:
    """Numba alone would compile inner kernels anew for every literal."""
    (package / "one.py").write_text(
        SOURCES["one"].replace("called(x)", "called(x) + called(2) + called(3)")
    )
    program = f"{PROGRAM}\nfrom ptmtools.two import inner\nprint(len(inner._part.signatures))"
    lines = run(program, package.parent, NUMBA_CACHE_DIR="")
    assert lines[1:] == [str(11 + 21 + 31 + 1), "1"]


def test_a_numba_that_loads_machine_code_in_another_way(tmp_path: Path) -> None:
    class Other:
        load_overload = list
        cache_path = "somewhere"

        def save_overload(self, *_: object) -> None:
            raise OSError("full")

    kept = compiled._Kept(Other(), tmp_path / "lock", allocates=False)
    assert kept.load_overload("ab") == ["a", "b"]
    assert kept.cache_path == "somewhere"
    with pytest.raises(OSError, match="full"):
        kept.save_overload()


def test_what_allocates_is_loaded_as_numba_does(tmp_path: Path) -> None:
    """Only numba's way sets up the allocator: a second run ended with a segmentation fault."""

    class Numbas:
        def load_overload(self) -> str:
            return "set up"

        def _load_overload(self) -> str:
            return "at once"

    for allocates, way in ((True, "set up"), (False, "at once")):
        kept = compiled._Kept(Numbas(), tmp_path / "lock", allocates=allocates)
        assert kept.load_overload() == way
    for decorated, allocates in ((compiled.kernel, True), (compiled.plain_kernel, False)):
        assert decorated(len)._options.get("_nrt", True) is allocates


def test_a_constant_of_this_package(tmp_path: Path) -> None:
    shutil.copytree(
        ROOT, tmp_path / "ptmtools", ignore=shutil.ignore_patterns("__pycache__", "schemas")
    )
    program = (
        "import numpy; from ptmtools.texture.coders.mixing_decisions import counted; "
        "print(counted(numpy.uint32(1 << 31), 1, 9))"
    )
    before = run(program, tmp_path)
    tables = tmp_path / "ptmtools" / "texture" / "coders" / "mixing" / "tables.py"
    source = tables.read_text()
    assert source.count("655360") == 1
    tables.write_text(source.replace("655360", "327680"))
    after = run(program, tmp_path)
    assert before != after
    tables.write_text(source)
    assert run(program, tmp_path) == before


def test_without_a_place_to_keep_it_code_still_runs(tmp_path: Path) -> None:
    """As a user without a home, of a package that is not theirs."""
    (tmp_path / "file").touch()
    program = (
        "import os; os.environ.pop('HOME', None)\n"
        "from pathlib import Path; from ptmtools import compiled, machine_code\n"
        f"machine_code._PACKAGE = Path({str(tmp_path / 'file')!r})\n"
        "assert machine_code._place() == ''\n"
        "print(compiled.kernel(lambda x: x + 1)(41))"
    )
    place = str(tmp_path / "file")
    assert run(program, ROOT.parent, XDG_CACHE_HOME=place, NUMBA_CACHE_DIR="") == ["42"]


def test_no_import_is_overlooked() -> None:
    for file in ROOT.rglob("*.py"):
        found = set()
        for node in ast.walk(ast.parse(file.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [name.name for name in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert not node.level
                names = [f"{node.module}.{name.name}" for name in node.names]
            for name in names:
                if name.split(".")[0] == ROOT.name:
                    own = machine_code._module(name)
                    found.add(own or machine_code._module(name.rpartition(".")[0]))
        assert found <= machine_code._imports(file), file
