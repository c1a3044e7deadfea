"""A part of `python -m benchmarks.fuzz.geometry`, and that it finds what it looks for."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # processes that are started find it there too

from benchmarks.fuzz.bases import BASES  # noqa: E402
from benchmarks.fuzz.building import EXPECTED, FAULTS, Building  # noqa: E402
from benchmarks.fuzz.child import generator  # noqa: E402
from benchmarks.fuzz.distortion import DISTORTIONS  # noqa: E402
from benchmarks.fuzz.geometry import fuzz, row_of  # noqa: E402

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is measured on Linux only")


def test_damaged_buildings_become_sound_databases() -> None:
    summary = fuzz("rooms", seed=0, start=0, count=6)
    assert summary.tally.findings == []
    row = row_of(summary, seed=0)
    assert row.counts["inputs"] == 6
    assert row.counts["built"] >= 3


@pytest.mark.parametrize(("base", "number"), [("heights", 125), ("models", 49)])
def test_leaves_that_are_thin_for_kilometres(base: str, number: int) -> None:
    """float32 bends a leaf of the first; every face of one of the second is narrower than the
    on-plane distance."""
    assert fuzz(base, seed=94, start=number, count=1, light=False).tally.findings == []


def test_a_door_leaf_that_is_open_above() -> None:
    """An eye inside of it belongs to the cells on both sides."""
    assert fuzz("doors", seed=95, start=631, count=1, light=False).tally.findings == []


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_is_found(fault: str) -> None:
    summary = fuzz("two_rooms", seed=0, start=0, count=6, fault=fault, light=False)
    findings = [what for _, what in summary.tally.findings]
    assert findings
    assert [what for what in findings if EXPECTED[fault] not in what] == []


def test_inputs_follow_from_seed_and_number(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    first, again = (Building(tmp_path / name, tmp_path, base="doors") for name in "ab")
    cases = [first.make(generator(1, "doors", n)) for n in range(20)]
    assert cases == [again.make(generator(1, "doors", n)) for n in range(20)]
    assert len({case.data for case in cases}) == 20


@pytest.mark.parametrize("name", DISTORTIONS)
def test_a_distortion_changes_the_model(name: str) -> None:
    soup = BASES["two_rooms"](np.random.default_rng(1))
    changed = [DISTORTIONS[name](soup, np.random.default_rng(n)) for n in range(30)]
    assert any(each.obj() != soup.obj() for each in changed)
