"""The building that makes all be compiled."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ptmtools import compiled, machine_code
from ptmtools.ahead import compile_now
from ptmtools.cli.main import main
from ptmtools.errors import InputError
from ptmtools.pipeline.build import WARM_UP, build_scene, warm_up
from ptmtools.pipeline.stages import CELLS
from ptmtools.pipeline.warm_up import write_building
from ptmtools.portal_flow import line_kernels


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """The kernels that are called from now on."""
    names: set[str] = set()
    call = compiled._Kernel.__call__

    def record(self: Any, *arguments: Any) -> Any:
        names.add(f"{self.__module__}.{self.__name__}")
        return call(self, *arguments)

    monkeypatch.setattr(compiled._Kernel, "__call__", record)
    return names


def test_all_kernels_of_a_build_are_called(shared: Path, tmp_path: Path, called: set[str]) -> None:
    gallery = shared / "scenes" / "gallery" / "gallery.obj"
    build_scene(gallery, tmp_path / "a.db", workers=1)
    needed = set(called)
    called.clear()
    warm_up()
    assert len(needed) > 15
    assert needed <= called


def test_the_building(tmp_path: Path) -> None:
    db = tmp_path / "a.db"
    report = build_scene(write_building(tmp_path), db, until=CELLS)
    cells = report.stages[-1].counts
    assert cells["cells"] == 4  # a block divides the first room
    assert cells["closed"]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where nothing has been compiled; what would be, is not."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "place"))
    monkeypatch.setattr("ptmtools.pipeline.build.warm_up", lambda: None)
    return tmp_path / "place"


def test_the_command(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder that was merely begun does not count."""
    (place / machine_code._digest(Path(line_kernels.__file__))).mkdir(parents=True)
    for printed in ("compiled in", "nothing to compile"):
        assert main(["warm-up"]) == 0
        assert printed in capsys.readouterr().out


def test_what_is_compiled_depends_on_all_sources(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert compile_now(WARM_UP)
    assert not compile_now(WARM_UP)
    source = machine_code._source
    monkeypatch.setattr(machine_code, "_source", lambda file: source(file) + b"#")
    assert compile_now(WARM_UP)


def test_a_first_build_begins_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not if it may use one processor only, nor if there is nothing to do."""
    begun = []
    monkeypatch.setattr("ptmtools.pipeline.build.compile_ahead", begun.append)
    db = tmp_path / "a.db"
    with pytest.raises(InputError):
        build_scene(tmp_path / "none.obj", db, workers=2)
    model = write_building(tmp_path)
    build_scene(model, db, until=CELLS, workers=2)
    assert not begun
    build_scene(model, db, workers=2)
    assert set(begun) == {WARM_UP}
    begun.clear()
    build_scene(model, db, workers=2)
    build_scene(model, db, workers=1, rebuild=True)
    assert not begun
