"""The committed page is what `web/page/build.py` makes of its sources."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.npm import ESBUILD
from ptmtools.errors import InputError
from ptmtools.site import program
from ptmtools.site.program import FORM_SCRIPTS, PAGE, PROGRAM, program_files

BUILD = Path(__file__).parents[2] / "web" / "page" / "build.py"


def test_the_sources_give_the_page(require: Callable[[str, str], None], tmp_path: Path) -> None:
    """Byte for byte, with the pinned esbuild."""
    if remedy := ESBUILD.remedy():
        require("esbuild", remedy)
    subprocess.run([sys.executable, BUILD, tmp_path], check=True)
    built = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    committed = {file.name: file.read_bytes() for file in PAGE.iterdir()}
    assert built.keys() == committed.keys()
    changed = [name for name in built if built[name] != committed[name]]
    assert changed == [], "run: python web/page/build.py"


def test_scripts_import_nothing_at_once() -> None:
    """Each is one request: no other script is found only after it."""
    for name in (*PROGRAM, *FORM_SCRIPTS):
        if not name.endswith(".js"):
            continue
        script = (PAGE / name).read_text()
        assert not re.search(r"""\bimport\s*["{*\w]""", script)
        assert not re.search(r"/\*\*|\n\s*//", script)


def test_an_incomplete_installation(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(program, "PAGE", tmp_path)
    with pytest.raises(InputError, match="install ptmtools again") as raised:
        program_files()
    assert raised.value.code == "PTM-I122"
