"""Charts of walks through a campus."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools_lab.campus.options import CampusWalkOptions
from ptmtools_lab.campus.simulation import CampusRun, simulate_campus
from ptmtools_lab.campus_report import WINDOW, network, picture
from ptmtools_systems.campus.model import PRESETS
from tests.lab.campus.stocks import RATE, campus, stock, world
from tests.lab.campus.test_command import walk as walk  # a fixture

LOW, CACHED = PRESETS[0], PRESETS[4]
#: Objects with a texture each have 10 and 100 triangles; the second half shares the textures.
ROW = stock(campus([(0,), (1,), (2,), (0,), (1,), (2,)]))


def runs(seconds: float = 40.0, **changes: object) -> list[CampusRun]:
    way = np.linspace(-20, 120, round(seconds * RATE))
    options = CampusWalkOptions(nearest=1, **changes)  # type: ignore[arg-type]
    return [simulate_campus(world(ROW, way), quality, options) for quality in (LOW, CACHED)]


def test_windows_hold_all_bytes() -> None:
    run = runs()[0]
    at, rate = network(run)
    assert len(at) == len(rate) == np.ceil(run.time[-1] / WINDOW)
    wide = np.full(len(at), WINDOW)
    wide[-1] = run.time[-1] - WINDOW * (len(at) - 1)
    assert (rate * wide).sum() / 8 == pytest.approx(run.fetched[-1] - run.fetched[0])
    assert rate.max() <= 4e6 * 1.001
    assert not network(runs(bandwidth="inf")[1])[1].any()  # everything is cached


def test_triangles_are_those_in_view() -> None:
    """One of six objects is fine at the end, and all others coarse."""
    run = runs()[0]
    assert run.triangles[0] == 0
    assert run.triangles[-1] == 5 * 10 + 100
    way = np.full(50, 25.0)
    place = world(ROW, way)
    place.seen[:, 1:] = False
    seen = simulate_campus(place, LOW, CampusWalkOptions(nearest=6))
    assert seen.triangles[-1] == 100


def test_later_objects_reuse_textures() -> None:
    met = runs()[0].meetings
    assert [each.label for each in met] == [f"box{i}" for i in range(6)]
    assert [each.time for each in met] == sorted(each.time for each in met)
    # Every least texture is there from the beginning, of whatever object.
    assert [(each.textures, each.reused) for each in met[1:]] == [(1, 1)] * 5
    options = CampusWalkOptions(nearest=1)
    way = np.linspace(-20, 120, round(40 * RATE))
    ultra = simulate_campus(world(ROW, way), PRESETS[3], options)
    assert [each.reused for each in ultra.meetings] == [0, 0, 0, 1, 1, 1]
    assert ultra.reused == 0.5


def test_five_charts() -> None:
    text = picture(runs(), "svg").decode()
    assert text == picture(runs(), "svg").decode()
    comments = re.findall(r"<!-- (.*?) -->", text)
    titles = [line for line in comments if line.startswith("Chart ")]
    assert [title[:8] for title in titles] == [f"Chart {k}." for k in range(1, 6)]
    assert comments.count("Low") == comments.count("Ultra cached") == 3
    assert [f"box{i}" in comments for i in range(6)] == [True] * 6
    assert picture(runs()[:1]).startswith(b"\x89PNG")


def test_one_frame_and_no_textures() -> None:
    plain = stock(campus([(), ()]))
    options = CampusWalkOptions(bandwidth="56k")
    run = simulate_campus(world(plain, np.zeros(2)), LOW, options)
    assert run.begun is None
    assert picture([run]).startswith(b"\x89PNG")


def test_the_command(
    folder: Path, walk: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["walk-campus", str(folder), "--walk", walk, "--every", "0", "--preset", "low"]
    for name in ("c.png", "c.SVG"):
        assert main([*asked, "--plot", str(tmp_path / name)]) == 0
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (tmp_path / "c.SVG").read_bytes()
    capsys.readouterr()
    assert main([*asked, "--plot", str(tmp_path / "c.png")]) == 4
    assert "PTM-O001" in capsys.readouterr().err
    assert main([*asked, "--plot", str(tmp_path / "c.pdf")]) == 3
    assert "PTM-I111" in capsys.readouterr().err
