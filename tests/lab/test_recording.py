"""Walks that were recorded in a browser, and their replay."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from ptmtools.errors import InputError
from ptmtools.link import Conditions
from ptmtools.walk import Waits, Walk, parse_walk
from ptmtools_lab.client import Client, FileKind
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.simulation import simulate
from ptmtools_lab.track import Track
from ptmtools_lab.world import World, prepare
from tests.lab.test_previews import watched
from tests.lab.worlds import SEEDS, any_world

#: Seconds from navigation to the first frame.
BEGUN = 1.5


def document(walk: Walk | Track, cells: int, **changes: Any) -> dict[str, Any]:
    """A walk as a page records it: of each frame that which the one before had drawn."""
    time = (walk.time - walk.time[0]).tolist()
    rows = np.column_stack([time, walk.eye, walk.direction]).tolist()
    browser = {
        "begun": BEGUN,
        "lines": 240,
        "budget": 1 << 28,
        "policy": "best",
        "recordBytes": [400] * cells,
        "geometryBytes": [3000] * cells,
        "files": [[0.01, "page", 0, 3000], [0.3, "index", 0, 2000], [0.3, "record", 0, 500]],
        "frames": [[-1, -1, 0], *([-1, b - a, 0.01] for a, b in pairwise(time))],
        "sent": [[1.6, 1.65]],
        "taken": [[0.5, 1.6], [1.7, 1.8]],
    }
    head = {"format": "ptmtools walk", "schema": 1, "fieldOfView": 1.0, "aspect": 4 / 3}
    return {**head, "samples": rows, "browser": {**browser, **changes}}


def parsed(given: dict[str, Any]) -> Walk:
    return parse_walk(json.dumps(given).encode())


def test_what_waits() -> None:
    waits = Waits(np.array([[1.0, 2.0], [1.5, 3.0], [1.6, 1.7]]), np.array([[2.5, 3.5]]))
    moments = [0.5, 1.0, 1.65, 1.8, 2.1, 3.2, 3.5, 9.0]
    assert [waits.wait_end(m) for m in moments] == [0.5, 1.7, 1.7, 2.0, 3.0, 3.5, 3.5, 9.0]
    assert Waits(np.zeros((0, 2))).wait_end(1.0) == 1.0


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"lines": 0}, "PTM-I801"),
        ({"begun": -1}, "PTM-I801"),
        ({"files": [[0, "page", 0]]}, "PTM-I801"),
        ({"files": [["0", "page", 0, 1]]}, "PTM-I801"),
        ({"files": [[0, "page", 0, -1]]}, "PTM-I801"),
        ({"frames": []}, "PTM-I801"),
        ({"files": [[0, "poster", 0, 1]]}, "PTM-I801"),
        ({"files": [[0, "record", 2, 1]]}, "PTM-I801"),
        ({"geometryBytes": [1]}, "PTM-I801"),
        ({"frames": [[2, -1, 0]] * 3}, "PTM-I801"),
    ],
)
def test_what_is_refused(changes: dict[str, Any], code: str) -> None:
    eye, direction = np.zeros((3, 3)), np.tile([0.0, 0, 1], (3, 1))
    walk = Walk(np.array([0.0, 0.1, 0.3]), eye, direction, 1.0, 1.0)
    assert parsed(document(walk, 2)).browser
    with pytest.raises(InputError) as fault:
        parsed(document(walk, 2, **changes))
    assert fault.value.code == code


def test_a_walk_is_walked_at_its_own_pace(world: World) -> None:
    """As fine as the screen was, with the sizes that the site had, from navigation on."""
    walk = parsed(document(world.track, world.catalogue.cell_count))
    replayed = prepare(world.served, walk, world.pyramids)
    np.testing.assert_allclose(replayed.track.time, world.track.time + BEGUN)
    assert replayed.camera.lines == 240
    assert (replayed.camera.width // 2, replayed.camera.height // 2) == (69, 52)
    assert set(replayed.catalogue.record_bytes.tolist()) == {400}
    assert replayed.track.drawn is not None
    assert replayed.track.drawn.tolist() == [-1, *range(1, world.frames)]
    run = simulate(replayed, POLICIES["best"], Conditions(512e3), 1 << 20)
    assert run.requests > 5
    assert run.overruns == 0
    assert run.fetched[0] >= 2500  # the index and the record came before
    again = simulate(replayed, POLICIES["best"], Conditions(512e3), 1 << 20)
    np.testing.assert_array_equal(run.column, again.column)
    for policy in ("paper", "lru", "ach", "oracle"):
        assert simulate(replayed, POLICIES[policy], Conditions(512e3), 1 << 20).requests > 5


def test_previews_that_a_page_preloads(world: World) -> None:
    """They are there without a request of the client; their numbers are those of the index."""
    files = [[0.01, "page", 0, 3000], [0.3, "index", 0, 2000], [0.3, "preview", 0, 700]]
    count = len(world.catalogue.previews.texture)
    assert count
    walk = parsed(document(world.track, world.catalogue.cell_count, files=files))
    replayed = prepare(world.served, walk, world.pyramids)
    for policy in ("best", "best-exact"):
        client, _ = watched(replayed, policy, Conditions(5e4), 1 << 20)
        whole, size = client.previews.whole, client.previews.size
        assert whole[:1].tolist() == size[:1].astype(bool).tolist() == [True] * (policy == "best")
        assert size[:1].tolist() == [700] * (policy == "best")
    assert replayed.catalogue.previews.bytes[0] != 700
    files[2][2] = count
    walk = parsed(document(world.track, world.catalogue.cell_count, files=files))
    with pytest.raises(InputError, match="PTM-I700"):
        prepare(world.served, walk, world.pyramids)


def test_another_database_is_refused(world: World) -> None:
    walk = parsed(document(world.track, world.catalogue.cell_count + 1))
    with pytest.raises(InputError, match="PTM-I700"):
        prepare(world.served, walk, world.pyramids)


@given(SEEDS)
def test_one_range_of_a_file_at_a_time(seed: int) -> None:
    """And no more is the matter: in the end the same is there."""
    most: Counter[bool] = Counter()

    def watched(apart: bool) -> int:
        def client(*given: Any) -> Client:
            made = POLICIES["best"].client(*given)
            ask = made.ask

            def asked(kind: FileKind, number: int, end: int, priority: float) -> None:
                ask(kind, number, end, priority)
                tags: Any = [request.tag for request in made.waiting]
                count = Counter(tag.number for tag in tags if tag.kind == FileKind.TEXTURE)
                most[apart] = max(most[apart], *count.values(), 0)

            vars(made).update(ask=asked)
            return made

        world = replace(any_world(seed), one_range=apart)
        policy = replace(POLICIES["best"], client=client)
        run = simulate(world, policy, Conditions(1e7, 0.02), 1 << 30)
        return int(run.column[-1].sum())

    assert watched(False) == watched(True)
    assert most[True] <= 1
