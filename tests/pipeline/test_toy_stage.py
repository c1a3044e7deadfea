"""A stage that is added to the table by one line is built, planned, checked and has a command."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cells.model import Cells
from ptmtools.cli.main import main
from ptmtools.lazy import Lazy
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import CELLS, STAGES
from ptmtools.store.folder import DatabaseFolder

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data/two_rooms/two_rooms.obj"


@dataclass(frozen=True)
class ToyOptions:
    """How volumes are measured.

    Attributes
    ----------
    toy_factor: what they are multiplied with.
    """

    toy_factor: float = 1.0


@dataclass(frozen=True)
class Volumes:
    """The volume of each leaf, m³."""

    volume: np.ndarray

    def to_arrays(self) -> dict[str, np.ndarray]:
        return {"volume": self.volume}

    @staticmethod
    def from_arrays(arrays: Mapping[str, np.ndarray]) -> Volumes:
        return Volumes(arrays["volume"])


class ToyStage(Stage[Volumes]):
    name = "toy"
    about = "Measure the leaves."
    recipe = 1
    options = ToyOptions
    reads = (CELLS,)
    artifact = Lazy(f"{__name__}:Volumes")

    def compute(self, cells: Cells, options: ToyOptions, *_: object) -> Volumes:
        return Volumes(options.toy_factor * cells.leaf_volumes())

    def counts(self, volumes: Volumes) -> dict[str, float]:
        return {"volume": float(volumes.volume.sum())}

    def notes(self, volumes: Volumes, options: ToyOptions) -> list[str]:
        return [f"multiplied by {options.toy_factor:g}"]

    def summary(self, counts: Mapping[str, Any]) -> str:
        return f"{counts['volume']:.1f} m³"

    def misfit(self, volumes: Volumes, source: Stage[Any], contents: Any) -> str:
        foreign = source is CELLS and len(volumes.volume) != contents.leaf_count
        return "of other leaves" if foreign else ""


TOY = ToyStage()


@pytest.fixture(autouse=True)
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STAGES, TOY.name, TOY)


def said(capsys: pytest.CaptureFixture[str], *arguments: Any, status: int = 0) -> str:
    assert main([str(argument) for argument in arguments]) == status
    return capsys.readouterr().out


def test_a_toy_stage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    db = tmp_path / "db"
    build = ("build-scene", TWO_ROOMS, "-o", db, "--samples", 8, "--backend", "embree")
    assert "multiplied by 1" in said(capsys, *build, "-v")
    volume = Artifacts(DatabaseFolder.open(db))[TOY].volume
    plan = json.loads(said(capsys, *build, "--toy-factor", 2, "--dry-run", "--json"))["stages"]
    assert [p["stage"] for p in plan if p["plan"] != "current"] == ["toy"]
    said(capsys, "toy", db, "--toy-factor", 2)
    assert np.array_equal(Artifacts(DatabaseFolder.open(db))[TOY].volume, 2 * volume)
    for command in ("status", "info"):
        assert f"{2 * volume.sum():.1f} m³" in said(capsys, command, db)
    assert "--toy-factor 2" in said(capsys, "info", db)
    assert "Measure the leaves." in said(capsys, "--help")
    assert "0 errors" in said(capsys, "validate", db)
    manifest = db / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"volume": ', '"volume": 1'))
    assert "stages.toy.counts.volume" in said(capsys, "validate", db, status=8)
