"""Closing lines of the summary and of `ptm info`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.report import Visitor
from ptmtools.pipeline.stages import CELLS, PVS
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.manifest import Manifest, StageRecord
from ptmtools.visibility import PvsOptions
from ptmtools.visibility.model import Pvs

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"
VISIT = {
    "browser": 4_000_000,
    "first_room": 1_000_000,
    "mean_at_hand": 1_500_000,
    "most_at_hand": 2_500_000,
    "mean_volume": 0.25,
    "most_volume": 0.5,
    "mean_texels": 0.3,
    "most_texels": 1.0,
}


def test_what_is_heavier_than_the_model_is_said_to_be() -> None:
    assert Visitor(500_000, 1_500_000, VISIT).lines() == [
        "source model, for comparison: 2.0 MB (model files 500.0 kB, image files 1.5 MB)",
        "a VRML browser downloads 4.0 MB, more than the source model",
        "the first room is complete after 1.0 MB",
        "in memory on average: 25.0% of the volume and 30.0% of the texels, 1.5 MB",
        "in memory at most: 50.0% of the volume and 100.0% of the texels, 2.5 MB, more than the "
        "source model",
    ]


def test_images_inside_the_model_are_not_counted_apart() -> None:
    assert Visitor(1_500_000, 0, VISIT).lines()[0] == "source model, for comparison: 1.5 MB"


@pytest.mark.parametrize(
    ("held", "until", "word"),
    [
        (100, 90, "visible sets; visitors hold 10% of the model"),
        (900, 100, "the order of cells; 99% of the view takes 11% of what visitors hold"),
        (900, 800, "resolution; visitors hold 90% of the model"),
    ],
)
def test_what_saves_most(held: int, until: int, word: str) -> None:
    sizes = {"everything": 1000, "mean_at_hand": held, "mean_90": until // 2, "mean_99": until}
    *_, order, gain = Visitor(None, None, VISIT | sizes).lines()
    assert order.startswith(f"in order of coverage: 90% of the average view after {until // 2} B")
    assert gain.startswith(f"what saves most: {word}")


@pytest.mark.parametrize(("model", "heavier"), [(3_960_000, False), (3_700_000, True)])
def test_a_few_percent_are_not_heavier(model: int, heavier: bool) -> None:
    browser = Visitor(model, 0, VISIT).lines()[1]
    assert browser.startswith("a VRML browser downloads 4.0 MB")
    assert browser.endswith("more than the source model") is heavier


def test_what_is_not_known_is_left_out() -> None:
    bare = {**VISIT, "browser": None, "mean_texels": None, "most_texels": None}
    assert Visitor(None, None, bare).lines() == [
        "the first room is complete after 1.0 MB",
        "in memory on average: 25.0% of the volume, 1.5 MB",
        "in memory at most: 50.0% of the volume, 2.5 MB",
    ]


@pytest.mark.parametrize("value", [None, "x", [], {}, 10**400])
def test_a_damaged_manifest(value: object) -> None:
    assert isinstance(Visitor(1, 1, dict.fromkeys(VISIT, value)).lines(), list)
    assert Visitor(1, 1, {}).lines() == []
    emitted = StageRecord(1, {}, {}, {}, {"visit": value})
    actual = Visitor.of(Manifest("m.obj", {"emit": emitted}))
    assert (actual is None) == (not isinstance(value, dict))
    assert Visitor.of(Manifest("m.obj")) is None


def test_the_model_as_it_was(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its own files and its images, also after one has been painted over."""
    model = Path(shutil.copytree(TWO_ROOMS, tmp_path / "model")) / "two_rooms.obj"
    db = tmp_path / "db"
    build = ["build-scene", str(model), "-o", str(db), "--samples", "4", "--backend", "embree"]

    def sizes(*suffixes: str) -> int:
        return sum(p.stat().st_size for p in model.parent.iterdir() if p.suffix in suffixes)

    for round in range(2):
        assert main([*build, "--json"]) == 0
        report = json.loads(capsys.readouterr().out)
        assert main(["info", str(db), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["visitor"] == report["visitor"]
        assert report["visitor"]["model"] == sizes(".obj", ".mtl")
        assert report["visitor"]["images"] == sizes(".png")
        if round == 0:
            Image.effect_noise((64, 64), 90).convert("RGB").save(model.with_name("floor.png"))
    assert main(["info", str(db)]) == 0
    reported = capsys.readouterr().out
    lines = Visitor.of(DatabaseFolder.open(db).manifest).lines()  # type: ignore[union-attr]
    assert len(lines) == 7
    assert [line.removeprefix("download").strip() for line in reported.splitlines()[-7:]] == lines


@pytest.mark.parametrize(("volume", "little"), [(91.0, True), (1.0, False)])
def test_culling_gains_little_where_most_of_the_volume_is_at_hand(
    volume: float, little: bool
) -> None:
    """Nine closets that see a hall and not each other: few cells, but most of the building."""
    sees = np.eye(10, dtype=np.bool_)
    sees[0] = sees[:, 0] = True
    pvs = Pvs.from_matrix(sees, volume=np.array([volume] + [1.0] * 9))
    assert pvs.average_share < 0.3
    assert any("saves little" in note for note in PVS.notes(pvs, PvsOptions())) is little
    assert PVS.counts is not None
    printed = PVS.summarize(PVS.counts(pvs))
    share = f"{pvs.volume_at_hand[0]:.1%}"
    assert printed == f"a client keeps {share} of the volume in memory on average, 100.0% at most"


def test_only_what_is_served_means_something(tmp_path: Path) -> None:
    model = TWO_ROOMS / "two_rooms.obj"
    assert build_scene(model, tmp_path / "db", until=CELLS).visitor is None
    assert Visitor.of(DatabaseFolder.open(tmp_path / "db").manifest) is None
