"""What a browser keeps of a site for visits without a network: files that come in ranges; run by
node. `tests/site/test_offline.py` has it in a browser."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.web.node import HERE, missing, run

PAGE = Path(__file__).resolve().parents[2] / "web" / "page"


@pytest.fixture(scope="module")
def rows(require: Callable[[str, str], None]) -> dict[str, dict[str, Any]]:
    """By the name of a case: the ranges that the host was asked for, the answers to the page, and
    what is kept in the end."""
    if remedy := missing():
        require("node", remedy)
    lines = run(HERE / "store.mjs", PAGE).splitlines()
    return {row["name"]: row for row in map(json.loads, lines)}


def test_a_range_is_asked_for_once(rows: dict[str, dict[str, Any]]) -> None:
    row = rows["twice"]
    assert row["asked"] == [[0, 100]]
    expected = {"status": 206, "range": "bytes 0-99/1000", "length": 100, "right": True}
    assert row["answers"] == [expected, expected]


@pytest.mark.parametrize(
    ("case", "asked", "kept"),
    [
        ("within", [[0, 100], [100, 300]], ["bytes=0-99/1000", "bytes=100-299/1000"]),
        ("longer", [[0, 100], [100, 300]], ["bytes=0-99/1000", "bytes=100-299/1000"]),
        ("between", [[0, 100], [200, 300], [100, 200]], None),
    ],
)
def test_of_ranges_only_what_is_missing(
    rows: dict[str, dict[str, Any]], case: str, asked: list[list[int]], kept: list[str] | None
) -> None:
    row = rows[case]
    assert row["asked"] == asked
    assert all(answer["right"] and answer["status"] == 206 for answer in row["answers"])
    assert kept is None or row["kept"] == kept


def test_a_host_that_ignores_ranges_sends_a_file_once(rows: dict[str, dict[str, Any]]) -> None:
    row = rows["whole"]
    assert [(answer["status"], answer["length"]) for answer in row["answers"]] == [
        (200, 1000),
        (206, 100),
    ]
    assert (len(row["asked"]), row["kept"]) == (1, ["bytes=0-999/1000"])


def test_without_room_or_a_host_the_page_gets_its_answer(
    rows: dict[str, dict[str, Any]],
) -> None:
    full = rows["full"]
    assert all(answer["right"] and answer["status"] == 206 for answer in full["answers"])
    assert full["kept"] == ["bytes=0-99/1000"]
    assert [answer["status"] for answer in rows["down"]["answers"]] == [503]
    assert rows["down"]["kept"] == []


def test_damaged_bytes_are_replaced(rows: dict[str, dict[str, Any]]) -> None:
    row = rows["damaged"]
    assert [answer["right"] for answer in row["answers"]] == [False, True, True]
    assert (row["asked"], row["kept"]) == ([[100, 200]], 1)


def test_what_the_browser_removed_is_asked_for_again(rows: dict[str, dict[str, Any]]) -> None:
    assert all(answer["right"] for answer in rows["emptied"]["answers"])
    assert rows["emptied"]["asked"] == [[0, 100], [0, 100]]


def test_storage_that_fails_does_not_stop_the_walk(rows: dict[str, dict[str, Any]]) -> None:
    row = rows["broken"]
    assert all(answer["right"] and answer["status"] == 206 for answer in row["answers"])
    assert row["whole"] == 206, "the host's answer, of this one for any request"


def test_a_page_in_place_of_a_file_is_not_kept(rows: dict[str, dict[str, Any]]) -> None:
    assert rows["page"]["kept"] == 0


def test_a_text_in_place_of_a_script_is_not_kept(rows: dict[str, dict[str, Any]]) -> None:
    assert rows["texts"]["kept"] == ["true", "true"]


def test_a_host_may_redirect_the_rest_of_a_range(rows: dict[str, dict[str, Any]]) -> None:
    """To another origin, as it may redirect a whole range."""
    assert rows["longer"]["modes"] == ["cors", "cors"]


def test_the_last_of_two_versions_stays(rows: dict[str, dict[str, Any]]) -> None:
    """Though its files come first, and with all of them; documents that it does not name go."""
    mark = "abcdefabcd"
    files = [f"data/index-{mark}.json", "manifest.webmanifest", f"viewer-{mark}/register.js"]
    catalogues = ["catalogue-de.html", "catalogue.html"]
    assert rows["overlap"]["before"] == 6
    assert rows["overlap"]["kept"] == ["", *files]
    assert rows["overlap catalogue.html"]["kept"] == ["", *catalogues, *files]


def test_only_a_page_with_the_service_worker_creates_storage(
    rows: dict[str, dict[str, Any]],
) -> None:
    """Entries, and requests for what a page has received: as the browser removed the storage, the
    host published without `--offline`, it has a fault, and it published with it once more."""
    assert rows["storage"] == {
        "name": "storage",
        "kept": {"first": [5, 2], "browser": [5, 2], "plain": [None, 0], "fault": [None, 0]}
        | {"again": [5, 2]},
        "sound": 1,
    }


def test_a_version_that_does_not_fit_leaves_the_former(rows: dict[str, dict[str, Any]]) -> None:
    """The version of the page, and whether its index is kept: without and with room."""
    former, new = rows["versions"]["kept"].values()
    assert (former, new) == (["0123456789", True], ["abcdefabcd", True])


def test_without_a_network(rows: dict[str, dict[str, Any]]) -> None:
    """The page learns what is not here as it does otherwise."""
    assert [answer["right"] for answer in rows["lost"]["answers"]] == [True]
    assert rows["lost"]["beyond"] == "TypeError: no network"


def test_a_sound_that_was_played(rows: dict[str, dict[str, Any]]) -> None:
    """Players ask for ranges without an end, or for a few bytes first. A long sound is not kept."""
    row = rows["played"]
    assert row["asked"] == [[0, 1000]]
    assert all(answer["right"] and answer["status"] == 206 for answer in row["answers"])
    assert [answer["range"] for answer in row["answers"]][1:] == [
        "bytes 0-999/1000",
        "bytes 700-999/1000",
        "bytes 0-1/1000",
    ]
    assert rows["type"]["type"] == "audio/wav"
    player = rows["player"]
    assert player["asked"] == [[0, 2], [0, 500], [0, 1000]], "a player does not wait for a part"
    assert all(answer["right"] for answer in player["answers"])
    long = 9 * 2**20
    assert rows["long"]["asked"] == [[0, long], [0, 2], [0, long]]
    assert rows["long"]["kept"] == rows["long whole"]["kept"] == []
    assert rows["long whole"]["answers"][0]["length"] == long


SITE = '<p id="site">viewer-0123456789/register.js '
CATALOGUE = '<meta name="generator" content="ptmtools">'
NONE = "TypeError: no network"


@pytest.mark.parametrize(
    ("case", "texts", "kept"),
    [
        ("fault", [SITE + "1"] * 7, {"": SITE + "1"}),
        ("unknown", ["fault", NONE], {}),
        ("removed", [CATALOGUE + "1"] * 3 + [NONE], {"catalogue.html": CATALOGUE + "1"}),
        ("stays", None, {"": SITE + "1", "catalogue.html": CATALOGUE + "1"}),
        ("gone", [CATALOGUE + "1", "gone"], {}),
        (
            "login",
            [CATALOGUE + "1", "login", "login", "login", CATALOGUE + "1", "login"],
            {"catalogue.html": CATALOGUE + "1"},
        ),
        ("others", [None] * 5, {}),
    ],
)
def test_documents(
    rows: dict[str, dict[str, Any]], case: str, texts: list[str] | None, kept: dict[str, str]
) -> None:
    """What visitors get, and what is kept: while the host has a fault or there is no network; of a
    host that removes `.html` from addresses; after pages of others at addresses of ours; and of
    documents that are not ours."""
    row = rows[f"document {case}"]
    assert texts is None or row["texts"] == texts
    assert row["kept"] == kept


def test_a_page_starts_without_openings_and_pictures_of_link_previews(
    rows: dict[str, dict[str, Any]],
) -> None:
    viewer = "viewer-0123456789"
    expected = ["data/poster-0123456789.jpg", f"{viewer}/viewer.js", f"{viewer}/later.js"]
    assert rows["needed"]["names"] == expected


def test_any_ranges_in_any_order(rows: dict[str, dict[str, Any]]) -> None:
    row = rows["random"]
    assert (row["wrong"], row["needless"]) == (0, 0)
    assert 20 < row["requests"] < 200
