"""Where machine code is kept: a folder for every state of all kernels together."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import ptmtools
from ptmtools import compiled

PROGRAM = """
from ptmtools.progress import listen
from pkg.one.kernels import outer
listen(print)
print(outer(1))
"""
OUTER = """
from ptmtools.compiled import kernel
from pkg.two.kernels import inner

@kernel
def outer(x):
    return inner(x) + 1
"""
INNER = """
from ptmtools.compiled import kernel

@kernel
def inner(x):
    return x * {}
"""


def test_a_changed_kernel_changes_those_that_call_it(tmp_path: Path) -> None:
    """Numba alone would run the machine code of yesterday's inner kernel."""
    package = tmp_path / "pkg"
    for name in ("one", "two"):
        (package / name).mkdir(parents=True)
        (package / name / "__init__.py").touch()
    (package / "__init__.py").touch()
    (package / "one" / "kernels.py").write_text(OUTER)
    # A copy of the module that looks at the kernels of this package.
    (tmp_path / "ptmtools").mkdir()
    (tmp_path / "ptmtools" / "__init__.py").touch()
    source = Path(compiled.__file__).read_text()
    changed = source.replace(
        "_PACKAGE = Path(__file__).parent", f"_PACKAGE = Path({str(package)!r})"
    )
    assert changed != source
    (tmp_path / "ptmtools" / "compiled.py").write_text(changed)
    shutil.copy(Path(ptmtools.__file__).parent / "progress.py", tmp_path / "ptmtools")
    for factor in (10, 20):
        (package / "two" / "kernels.py").write_text(INNER.format(factor))
        for first in (True, False):
            told = subprocess.run(
                [sys.executable, "-c", PROGRAM], cwd=tmp_path, check=True, capture_output=True
            )
            *announced, result = told.stdout.decode().splitlines()
            assert int(result) == factor + 1
            assert [line.startswith("compiling") for line in announced] == [True] * first
    folders = list((package / "__pycache__").glob("kernels-*"))
    assert len(folders) == 2
    shutil.rmtree(package)


def test_without_a_place_to_keep_it_code_still_runs(tmp_path: Path) -> None:
    """As a user without a home, of a package that is not theirs."""
    environment = {k: v for k, v in os.environ.items() if k not in ("HOME", "NUMBA_CACHE_DIR")}
    (tmp_path / "file").touch()
    environment["XDG_CACHE_HOME"] = str(tmp_path / "file")
    program = (
        "from pathlib import Path; from ptmtools import compiled; "
        f"compiled._PACKAGE = Path({str(tmp_path / 'file')!r}); "
        "assert compiled._folder() == ''; "
        "print(compiled.kernel(lambda x: x + 1)(41))"
    )
    told = subprocess.run(
        [sys.executable, "-c", program], env=environment, check=True, capture_output=True
    )
    assert int(told.stdout) == 42


def test_all_kernels_are_found() -> None:
    root = Path(ptmtools.__file__).parent
    assert compiled._kernel_files() == sorted(root.rglob("kernels.py"))
