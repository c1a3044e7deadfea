"""The building that makes all be compiled."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ptmtools import compiled
from ptmtools.cli.main import main
from ptmtools.cli.warm_up import WARM_UP
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import CELLS
from ptmtools.pipeline.warm_up import warm_up, write_building


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


def test_the_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    done = []
    monkeypatch.setattr("ptmtools.pipeline.warm_up.warm_up", lambda: done.append(True))
    for kept, printed in ((False, "compiled in"), (True, "nothing to compile")):
        monkeypatch.setattr("ptmtools.cli.warm_up.is_kept", lambda _, kept=kept: kept)
        assert main(["warm-up"]) == 0
        assert printed in capsys.readouterr().out
    assert done == [True]


def test_a_first_build_begins_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not if it may use one processor only."""
    begun = []
    monkeypatch.setattr("ptmtools.cli.stages.compile_ahead", lambda *task: begun.append(task))
    for workers, tasks in (("1", []), ("2", [WARM_UP])):
        arguments = ["build-scene", str(tmp_path / "none.obj"), "-o", str(tmp_path / "a.db")]
        assert main([*arguments, "-j", workers]) == 3
        assert begun == tasks
