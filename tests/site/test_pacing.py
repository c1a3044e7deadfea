"""The page draws and fetches no more than its screen and its graphics card can use."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.web import node

HERE = Path(__file__).parent


def test_a_fence_tells_how_long_a_picture_took() -> None:
    """Once; of two marks the last one counts, and a page that was hidden learns nothing of it."""
    actual = json.loads(node.run(HERE / "fence.mjs"))
    assert actual["reports"] == [
        [False, False, 0],
        [False, True, 0],
        [True, False, 100],
        [False, False, 100],
        [True, False, 20],
        [True, False, 500],
    ]
    assert actual["left"] == 0


@pytest.mark.parametrize(
    ("lines", "previews", "finest"),
    [
        (1080, [0, 3, 1, 2], (3, 3)),
        (700, [0, 1, 2], (3, None)),
        (600, [0, 1], (2, None)),
        (300, [0], (1, None)),
    ],
)
def test_small_screens_request_no_previews_that_are_too_fine(
    lines: int, previews: list[int], finest: tuple[int | None, ...]
) -> None:
    """Parts of the opening come anyway. A texture is expected as fine as its previews are."""
    actual = json.loads(node.run(HERE / "following.mjs", lines))
    assert [number for _, number, _ in actual["asked"]] == previews
    priorities = [priority for *_, priority in actual["asked"]]
    assert priorities == sorted(priorities, reverse=True)
    first, second = actual["present"][:5], actual["present"][5:]
    for columns, level in zip((first, second), finest, strict=True):
        assert [share > 0 for share in columns] == [
            level is not None and 1 <= column <= level + 1 for column in range(5)
        ]


def test_a_visitor_elsewhere_takes_the_parts_alone() -> None:
    """Neither does the page request what the view of the opening needs next, nor expect it."""
    actual = json.loads(node.run(HERE / "following.mjs", 1080, "elsewhere"))
    assert [number for _, number, _ in actual["asked"]] == [0]
    assert actual["present"] is None
