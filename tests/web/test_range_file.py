"""Reading of files by `web/three-ptm` from good and faulty servers; run by node."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.web.node import HERE, missing, run

ADAPTER = Path(__file__).resolve().parents[2] / "web" / "three-ptm"
AGAIN = "no-store"


@pytest.fixture(scope="module")
def told(require: Callable[[str, str], None]) -> dict[str, dict[str, Any]]:
    """By the server's name: what was read (lengths, of right bytes), and the requests as first
    byte, last byte and cache mode."""
    if remedy := missing():
        require("node", remedy)
    rows = [json.loads(line) for line in run(HERE / "ranges.mjs", ADAPTER).splitlines()]
    return {row["name"]: row for row in rows}


def requests(row: dict[str, Any]) -> list[tuple[int, int]]:
    return [(begin, end) for begin, end, _ in row["asked"]]


def test_each_request_goes_on_where_the_last_ended(told: dict[str, dict[str, Any]]) -> None:
    assert told["good"]["got"] == [100, 200, 250]
    assert requests(told["good"]) == [(0, 99), (100, 249)]
    assert told["at-once"]["got"] == [400, 200, 400]
    assert requests(told["at-once"]) == [(0, 399), (400, 499), (500, 999)]
    assert {mode for row in ("good", "at-once") for *_, mode in told[row]["asked"]} == {"default"}


def test_one_request_for_what_will_be_read(told: dict[str, dict[str, Any]]) -> None:
    """Its beginning is there before its end, and what was asked for is not asked for again."""
    assert (told["ahead"]["got"], requests(told["ahead"])) == ([100, 800], [(0, 899)])
    assert told["settled"]["got"] == [64, 128]
    assert requests(told["settled"]) == [(0, 899)]


def test_a_file_ends(told: dict[str, dict[str, Any]]) -> None:
    assert (told["end"]["got"], len(told["end"]["asked"])) == ([100, 1000], 1)


def test_without_ranges_the_whole_file_is_kept(told: dict[str, dict[str, Any]]) -> None:
    row = told["whole"]
    assert (row["got"], len(row["asked"])) == ([100, 500], 1)
    assert row["warned"] == ["three-ptm: whole.test ignores byte ranges: its textures come whole"]


def test_what_broke_is_asked_for_again(told: dict[str, dict[str, Any]]) -> None:
    """From where it broke, past caches, three times in all."""
    assert told["short"]["got"] == 200
    assert told["short"]["asked"] == [[0, 199, "default"], [70, 199, AGAIN]]
    assert told["broken"]["got"] == [100, 100]
    assert told["broken"]["asked"][1][0] <= told["broken"]["asked"][2][0] <= 130
    assert (told["recovers"]["got"], len(told["recovers"]["asked"])) == (200, 3)
    assert "503" in told["down"]["got"]
    assert len(told["down"]["asked"]) == 3


@pytest.mark.parametrize(
    ("server", "why"),
    [
        ("gone", "404"),
        ("elsewhere", "Content-Range bytes 1-199/1000"),
        ("silent", "expose Content-Range"),
        ("length", "Content-Length 7"),
        ("long", "more bytes"),
    ],
)
def test_wrong_answers_are_refused(told: dict[str, dict[str, Any]], server: str, why: str) -> None:
    row = told[server]
    assert why in row["got"]
    assert f"http://{server}.test/a.ptm" in row["got"]
    assert len(row["asked"]) == 1


def test_a_file_that_changed_is_refused(told: dict[str, dict[str, Any]]) -> None:
    assert "changed" in told["changed"]["got"]
    assert len(told["changed"]["asked"]) == 2


def test_forgotten_bytes_are_asked_for_again(told: dict[str, dict[str, Any]]) -> None:
    assert told["forgotten"]["got"] == ["wrong bytes", 200]
    assert told["forgotten"]["asked"] == [[0, 199, "default"], [150, 199, AGAIN]]


def test_calling_off_keeps_what_came(told: dict[str, dict[str, Any]]) -> None:
    assert told["called-off"]["got"] == ["AbortError", 900]
    assert requests(told["called-off"]) == [(0, 899), (70, 899)]
