"""The table of clients, `benchmarks/walk_table.py`, from rows made by hand; the file of rows."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))
import walk_table
from walk_table import Case, made, tables


def row(policy: str, walk: int, e: float, **more: Any) -> dict[str, Any]:
    return {
        "scene": "museum",
        "walk": walk,
        "policy": policy,
        "bandwidth": "4M",
        "memory": "10%",
        "seconds": 1.0,
        "preparation": 10.0 * walk,
        "e": {"mean": e, "p95": 2 * e},
        "waste": 0.25,
        "overruns": 0,
        "final": [0.1, None, None],
        **more,
    }


def cells(table: str, name: str) -> dict[str, str]:
    """The row of a table, by the heads of its columns."""
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()]
    return next(dict(zip(lines[0], line, strict=True)) for line in lines if line[0] == name)


def test_means_ratios_and_their_spread_over_walks() -> None:
    rows = [row("oracle", 1, 1.0), row("oracle", 2, 2.0), row("ach", 1, 2.0), row("ach", 2, 12.0)]
    whole, ratios, by_scene, preparation, beside, count = tables(rows)
    ach = cells(whole, "ach")
    assert (ach["4M 10%"], ach["p95"], ach["waste"]) == ("7.00", "14.00", "0.25")
    # Twice and six times the oracle's: 4 on average, 2 from it.
    assert (ach["/ oracle"], ach["± walks"], ach["p95 / ach"]) == ("4.00", "2.00", "1.00")
    assert ach["90 %, s"] == "60.00"
    assert cells(whole, "oracle")["p95 / ach"] == "0.21"
    assert cells(ratios, "ach")["4M 10%"] == "4.00"
    assert cells(by_scene, "ach")["museum / oracle"] == "4.00"
    assert cells(preparation, "museum")["mean"] == "15.0"
    assert cells(beside, "oracle")["museum"] == "3.75"
    assert count == "4 runs; frames above the budget: 0"


def test_previews_beside_none() -> None:
    rows = [row("best-exact", 1, 4.0), row("best", 1, 3.0), row("oracle", 1, 2.0)]
    _, _, gains, by_scene, *_ = tables(rows)
    assert cells(gains, "best")["4M 10%"] == "0.75"
    assert cells(by_scene, "best")["museum 4M 10%"] == "0.75"


def test_scenes_and_conditions_are_apart() -> None:
    rows = [
        row("oracle", 1, 1.0),
        row("oracle", 1, 4.0, memory="4MiB"),
        row("oracle", 1, 7.0, scene="hospital"),
    ]
    whole, _, by_scene, *_ = tables(rows)
    assert cells(whole, "oracle")["4M 10%"] == "4.00"
    assert cells(whole, "oracle")["4M 4MiB"] == "4.00"
    assert cells(by_scene, "oracle")["hospital e"] == "7.00"
    assert cells(by_scene, "oracle")["museum e"] == "2.50"


def test_a_run_that_is_there_is_not_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(walk_table, "_world", lambda scene, walk: (scene, str(walk)))
    case = Case("museum", 1, "ach", "4M", "10%")
    other = Case("museum", 1, "ach", "4M", "30%")
    assert case.key != other.key
    file = tmp_path / "runs.jsonl"
    kept = [{"key": other.key, "n": 2}, {"key": case.key, "n": 1}]
    file.write_text("".join(json.dumps(r) + "\n" for r in kept) + '{"key": "cut')
    assert [r["n"] for r in made([case, other], file, 1)] == [1, 2]
