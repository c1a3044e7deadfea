"""The building that compiles all kernels of a build."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numba
import pytest

from ptmtools import jit
from ptmtools.cli.main import main
from ptmtools.light.options import LightOptions
from ptmtools.output.served import read_served
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import CELLS
from ptmtools.pipeline.validation import validate
from ptmtools.pipeline.warm_up import warm_building, warm_images, write_building
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.texture import EncodeOptions, decode, encode
from tests.texture.coding import textured


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """The kernels that are called from now on, with the types of their arguments: each signature is
    compiled by itself."""
    names: set[str] = set()
    call = jit._Kernel.__call__

    def record(self: Any, *arguments: Any) -> Any:
        types = ", ".join(str(numba.typeof(each)) for each in arguments)
        names.add(f"{self.__module__}.{self.__name__}({types})")
        return call(self, *arguments)

    monkeypatch.setattr(jit._Kernel, "__call__", record)
    return names


def test_all_kernels_are_called(shared: Path, tmp_path: Path, called: set[str]) -> None:
    """Of a build, of its check, of a view, and of an image in each profile."""
    gallery, db = shared / "scenes" / "gallery" / "gallery.obj", tmp_path / "a.db"
    build_scene(gallery, db, LightOptions(light_samples=4), workers=1)
    assert not validate(db).errors
    for lit in (False, True):
        draw_view(read_served(db), ViewOptions(width=32, height=18, lit=lit))
    for profile in ("fast", "small", "raw", "paper"):
        decode(encode(textured(40, 40, 3), EncodeOptions(profile=profile)))
    needed = set(called)
    called.clear()
    warm_building()
    warm_images()
    assert len(needed) > 25
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
    for others in ("images", "objects"):
        monkeypatch.setattr(f"ptmtools.pipeline.warm_up.warm_{others}", lambda: None)
    monkeypatch.setattr(jit, "cache_folder", lambda *_: "")
    for printed in ("compiled in", "nothing to compile"):
        assert main(["warm-up"]) == 0
        assert printed in capsys.readouterr().out
