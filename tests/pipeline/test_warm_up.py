"""The building that compiles all kernels of a build."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ptmtools import jit
from ptmtools.cli.main import main
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import CELLS
from ptmtools.pipeline.warm_up import warm_building, write_building


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """The kernels that are called from now on."""
    names: set[str] = set()
    call = jit._Kernel.__call__

    def record(self: Any, *arguments: Any) -> Any:
        names.add(f"{self.__module__}.{self.__name__}")
        return call(self, *arguments)

    monkeypatch.setattr(jit._Kernel, "__call__", record)
    return names


def test_all_kernels_of_a_build_are_called(shared: Path, tmp_path: Path, called: set[str]) -> None:
    gallery = shared / "scenes" / "gallery" / "gallery.obj"
    build_scene(gallery, tmp_path / "a.db", workers=1)
    needed = set(called)
    called.clear()
    warm_building()
    assert len(needed) > 15
    assert needed <= called


def test_the_building(tmp_path: Path) -> None:
    db = tmp_path / "a.db"
    report = build_scene(write_building(tmp_path), db, until=CELLS)
    cells = report.stages[-1].counts
    assert cells["cells"] == 4  # a block divides the first room
    assert cells["closed"]


def test_the_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    added = jit.kernel(lambda x: x + 1)
    monkeypatch.setattr("ptmtools.pipeline.warm_up.warm_building", lambda: added(1))
    monkeypatch.setattr("ptmtools.pipeline.warm_up.warm_statue", lambda: None)
    monkeypatch.setattr(jit, "cache_folder", lambda _: "")
    for printed in ("compiled in", "nothing to compile"):
        assert main(["warm-up"]) == 0
        assert printed in capsys.readouterr().out
