"""A part of `python -m benchmarks.fuzz`, and that it finds what it looks for."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # processes that are started find it there too

from benchmarks.fuzz.child import generator  # noqa: E402
from benchmarks.fuzz.kinds import KINDS  # noqa: E402
from benchmarks.fuzz.planted import FAULTS, Planted  # noqa: E402
from benchmarks.fuzz.runner import run  # noqa: E402

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is measured on Linux only")

#: Inputs of a kind: as many as a few seconds of one processor allow.
COUNT = {
    "ptm": 250,
    "mesh": 250,
    "manifest": 200,
    "list": 100,
    "apo": 150,
    "staged": 60,
    "campus": 60,
    "served": 25,
}


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_but_errors_of_ours(kind: str) -> None:
    count = COUNT.get(kind, 400)
    summary = run(kind, KINDS[kind].make, seed=0, start=0, count=count)
    assert summary.tally.findings == []
    assert summary.read == count
    assert len(summary.tally.outcomes) > 1 or kind == "served"


def test_every_fault_is_found() -> None:
    numbers = range(45)
    planted = {n: generator(7, "planted", n).choice(list(FAULTS)) for n in numbers}
    assert set(planted.values()) == set(FAULTS)
    summary = run("planted", Planted, 7, 0, len(numbers), slow=0.5, hangs=5.0)
    actual: dict[int, str] = {}
    for number, what in summary.tally.findings:
        actual[number] = actual.get(number, "") + what
    late = "writes beside without Python"  # seen as soon as the folders are compared
    assert any(FAULTS[late] in what for what in actual.values())
    for number, fault in planted.items():
        if FAULTS[fault] and fault != late:
            assert FAULTS[fault] in actual[number]
        else:
            assert actual.get(number, FAULTS[late]).startswith(FAULTS[late])


def test_inputs_follow_from_seed_and_number(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    (tmp_path / "outside").mkdir()
    (tmp_path / "other").mkdir()
    first = KINDS["mtl"].make(tmp_path / "a", tmp_path / "outside")
    again = KINDS["mtl"].make(tmp_path / "b", tmp_path / "other")
    cases = [first.make(generator(1, "mtl", n)).data for n in range(50)]
    outside = str(tmp_path / "outside").encode(), str(tmp_path / "other").encode()
    others = [again.make(generator(1, "mtl", n)).data.replace(*outside[::-1]) for n in range(50)]
    assert cases == others
    assert len(set(cases)) > 40
