"""A walk that is recorded in the page, and walked again by the simulator."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from ptmtools.cli.main import main
from ptmtools.link import Conditions
from ptmtools.output.served import read_served
from ptmtools.site.content import Site
from ptmtools.site.throttle import Throttle
from ptmtools.walk import read_walk
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.simulation import simulate
from ptmtools_lab.world import prepare

LINK = Throttle(2e6, 0.05)
#: Recording begins as soon as there is something to record.
AT_ONCE = """
let app = null;
Object.defineProperty(window, "ptm", { get: () => app, set: (made) => (app = made).record() });
"""


def test_a_recording_replays(
    visit: Callable[..., Any],
    museum: Site,
    museum_db: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The same files from the same first requests on, and about as many; timing is not judged."""
    with visit(
        museum,
        width=320,
        height=240,
        throttle=LINK,
        prepare=lambda page: page.add_init_script(AT_ONCE),
    ) as visitor:
        visitor.until("s.complete")
        visitor.go(1)
        recording = visitor.page.evaluate("window.ptm.recording")
        asked = [v for v in visitor.visits if unquote(v.path).startswith("/data/")]
    assert visitor.messages == []
    file = tmp_path / "recording.json"
    file.write_text(json.dumps(recording))
    walk = read_walk(file)
    browser = walk.browser
    assert browser
    assert (browser.lines, browser.policy, walk.aspect) == (240, "best", pytest.approx(320 / 240))
    assert browser.record_bytes.tolist() == [row["recordBytes"] for row in museum.index["cells"]]
    kinds = [given.kind for given in browser.files]
    assert kinds.count("index") == 1
    assert "page" in kinds
    # Item buffers are read back one frame later, and none is older than the picture.
    assert (browser.age > 0).any()

    world = prepare(read_served(museum_db), walk)
    run = simulate(
        world, POLICIES["best"], Conditions(LINK.bandwidth, LINK.latency), browser.budget
    )
    assert run.requests == pytest.approx(len(asked), rel=0.4)
    assert run.body == pytest.approx(sum(v.bytes for v in asked), rel=0.4)
    assert run.error[-1] < 0.2 * run.error[0]
    words = ["simulate", museum_db, "--walk", file, "--policy", "best,paper", "--memory", "10%"]
    assert main([str(word) for word in words]) == 0
    assert "best" in capsys.readouterr().out


def test_nothing_was_recorded(visit: Callable[..., Any], museum: Site) -> None:
    with visit(museum) as visitor:
        visitor.complete()
        assert visitor.page.evaluate("window.ptm.recording") is None
