"""A build that ends while cells are cut: what it leaves, and what the next build does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ptmtools.cells import SubdivideOptions
from ptmtools.errors import InputError
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import CELLS
from ptmtools.scene import IngestOptions
from ptmtools.store.layout import MANIFEST
from tests.conftest import ROOT, files_below

TWO_ROOMS = ROOT / "sample_data/two_rooms/two_rooms.obj"


def fail(monkeypatch: pytest.MonkeyPatch, fault: BaseException) -> None:
    def subdivide(*_: Any) -> None:
        raise fault

    monkeypatch.setattr("ptmtools.cells.subdivision.subdivide", subdivide)
    monkeypatch.setattr("ptmtools.cells.subdivide", subdivide, raising=False)


def until_cells(db: Path, *options: Any) -> dict[str, bool]:
    """Builds up to the cells; whether each stage ran."""
    report = build_scene(TWO_ROOMS, db, *options, until=CELLS)
    return {stage.stage: stage.ran for stage in report.stages}


def test_the_scene_stays_after_an_interrupt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, db = tmp_path / "whole", tmp_path / "db"
    until_cells(whole)
    with monkeypatch.context() as patch:
        fail(patch, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            until_cells(db)
    assert (db / "stages/scene.npz").exists()
    assert until_cells(db) == {"scene": False, "cells": True}
    names = ["stages/scene.npz", "stages/cells.npz", MANIFEST]
    assert [(db / n).read_bytes() for n in names] == [(whole / n).read_bytes() for n in names]


def test_a_model_that_cannot_be_cut_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db = tmp_path / "db"
    with monkeypatch.context() as patch:
        fail(patch, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            until_cells(db)
        fail(patch, InputError("PTM-I300", "cannot be cut"))
        with pytest.raises(InputError):
            until_cells(db)
        assert files_below(db) == {}, "what the interrupted build had left, too"
        with pytest.raises(InputError):
            until_cells(tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_it_changes_no_finished_database(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    db = tmp_path / "db"
    until_cells(db)
    before = files_below(db)
    fail(monkeypatch, InputError("PTM-I300", "cannot be cut"))
    with pytest.raises(InputError):
        until_cells(db, IngestOptions(unit="cm"), SubdivideOptions(gain=0.0))
    assert files_below(db) == before
