"""`benchmarks/frame_rate.py`: its arithmetic, its ways, and that it plays pages."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import frame_rate
import numpy as np
import pytest

from ptmtools.walk import Walk


def uploading(time: np.ndarray[Any, Any]) -> Any:
    """Frames that upload 2 MiB each, in 3 ms."""
    number = np.arange(len(time))
    return np.column_stack([time, number * 2 * 2**20, 3.0 * number])


def test_even_frames() -> None:
    pace = frame_rate.pace_of(uploading(np.arange(0, 10.01, 0.02)))
    assert (pace.median, pace.low) == (pytest.approx(50), pytest.approx(50))
    assert pace.stalls == 0
    assert pace.longest == pytest.approx(0.02)
    assert (pace.upload, pace.upload_time) == (pytest.approx(100), pytest.approx(0.15))


def test_slow_frames() -> None:
    """A second of 4 frames among ten of 60: the 5th percentile and the stalls show it, the median
    does not; frames of more than a second count, too."""
    time = [np.arange(0, 5, 1 / 60), 5 + np.arange(0, 1, 0.25), 6 + np.arange(0, 4.001, 1 / 60)]
    pace = frame_rate.pace_of(uploading(np.concatenate(time)))
    assert pace.median == pytest.approx(60)
    assert 4 < pace.low < 20
    assert pace.stalls == 4
    middle, each = frame_rate.rates(np.concatenate(time))
    assert each.min() == pytest.approx(4)
    assert middle[each.argmin()] == pytest.approx(5.5)
    assert np.allclose(frame_rate.rates(np.array([0.0, 2, 4]))[1], 0.5)


def test_a_way_that_looks_to_both_sides() -> None:
    """It leads where the walk leads, turns without jumps, and ends with the walk."""
    angle = np.linspace(3, 7, 81)
    direction = np.column_stack([-np.sin(angle), 0 * angle, -np.cos(angle)])
    walk = Walk(np.arange(81) / 10, np.tile([1.0, 2, 3], (81, 1)), direction, 1.0, 1.5)
    way = frame_rate.way_of(walk, 5)
    assert way[[0, -1], 0].tolist() == [0, 5]
    assert np.allclose(way[:, 1:4], [1, 2, 3])
    assert np.abs(np.diff(way[:, 4])).max() < 0.4
    swing = (way[:, 4] - angle[:51] + np.pi) % (2 * np.pi) - np.pi
    assert swing.max() > 1.7
    assert swing.min() < -1.7
    assert frame_rate.way_of(walk, 60)[-1, 0] == 8
    still = frame_rate.way_of(walk, 60, swing=0.0)
    assert np.allclose(np.exp(1j * still[:, 4]), np.exp(1j * angle))


def test_ratios_are_to_the_same_budget(tmp_path: Path) -> None:
    """A page that stalls as `whole` counts as 1; each budget has a diagram."""
    way = np.zeros((2, 6))
    pages = frame_rate.pages_of_database(way, [8, 16], ["whole", "best"])
    length = dict(zip((page.name for page in pages), (0.1, 0.02, 0.05, 0.025), strict=True))

    def play(page: Any) -> tuple[Any, str]:
        return uploading(np.arange(0, 3.01, length[page.name])), "a card"

    file = tmp_path / "plot.png"
    lines = [*frame_rate.lines_of("museum", pages, play, file)]
    ratios = [line.split(" | ")[3] for line in lines if line.startswith(("| whole", "| best"))]
    assert ratios == ["1.00, 1.00", "5.00, 5.00", "1.00, 1.00", "2.00, 2.00"]
    assert "a card" in lines[-1]
    assert file.stat().st_size > 10_000


def test_a_museum_is_played(
    require: Callable[[str, str], None],
    museum_db: Path,
    tmp_path: Path,
) -> None:
    """With less memory than its view takes: `whole` uploads much more than `best`."""
    from tests.e2e.browsers import web

    if web.chromium() is None:
        require("Chromium", "apt install chromium")
    words = [str(museum_db), "--seconds", "4", "--size", "160x120", "--budgets", "1"]
    words += ["--policies", "whole", "best", "-o", str(tmp_path)]
    # A process of its own: this one may have a browser open.
    command = [sys.executable, str(Path(frame_rate.__file__)), *words]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    rows = dict(re.findall(r"^\| (\w+), 1 MiB \|.*\| ([\d.]+) \| [\d.]+% \|$", printed, re.M))
    assert float(rows["whole"]) > 10 * float(rows["best"])
    assert "SwiftShader" in printed
    assert (tmp_path / "museum.png").is_file()
