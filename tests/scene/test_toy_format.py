"""The input format of CONTRIBUTING.md is read, listed and checked like those of the table."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

from ptmtools import plugins
from ptmtools.cli.main import main
from ptmtools.lazy import Lazy
from ptmtools.scene import ingest
from ptmtools.scene.formats import FORMATS, ModelFormat

CONTRIBUTING = Path(__file__).parents[2] / "CONTRIBUTING.md"
WALL = "0 0 0 4 0 0 4 0 3\n0 0 0 4 0 3 0 0 3\n"


@pytest.fixture(params=["row", "plug-in"])
def toy(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ModelFormat:
    section = CONTRIBUTING.read_text().split("### An input format\n")[1].split("\n### ")[0]
    code, row = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    module = ModuleType("ptmtools.scene.triangles")
    exec(code, vars(module))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    declared = eval(row, {"ModelFormat": ModelFormat, "Lazy": Lazy})
    assert isinstance(declared, ModelFormat)
    if request.param == "row":
        monkeypatch.setitem(FORMATS, declared.name, declared)
    else:
        others, rows = plugins.declarations, {declared.name: declared}
        monkeypatch.setattr(
            plugins,
            "declarations",
            lambda kind, cls: rows if kind == "formats" else others(kind, cls),
        )
    return declared


def test_a_toy_format_is_read_and_listed(
    toy: ModelFormat, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wall = tmp_path / "wall.TRI"
    wall.write_text(WALL)
    scene = ingest(wall)
    assert (scene.space.metres, scene.space.up, scene.objects) == (1.0, "z", ("wall",))
    assert scene.points.max(axis=0).tolist() == [2, 3, 0]  # Y up
    assert not scene.space.unit_guessed
    assert main(["info", str(wall)]) == 0
    assert capsys.readouterr().out.startswith(f"{wall}: triangles as text, ")
    assert main(["build-scene", "--help"]) == 0
    assert "triangles as text (.tri)" in " ".join(capsys.readouterr().out.split())


def test_damage_is_an_error_with_the_file(
    toy: ModelFormat, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wall = tmp_path / "wall.tri"
    wall.write_text("0 0 0 4 0 0 4 0\n")
    assert main(["info", str(wall)]) == 3
    error = capsys.readouterr().err
    assert error.startswith(f"ptm: {wall}: damaged (")
    assert "[PTM-I254]" in error


def test_the_help_lists_all_formats(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build-scene", "--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "Wavefront OBJ (.obj), glTF binary (.glb), glTF (.gltf), PLY (.ply)" in shown
    assert all(suffix in shown for row in FORMATS.values() for suffix in row.suffixes)
