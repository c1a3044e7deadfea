"""`?memory=auto`: the largest budget of texture memory that keeps 30 pictures a second."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.site.content import Site
from tests.web import node

HERE = Path(__file__).parent
MIB = 1 << 20
#: Pictures of the walk take 1 ms; drawing from textures takes a second for each MiB beyond ROOM.
CARD = """
let skipped = 0, drawn = 0;
const now = performance.now.bind(performance);
performance.now = () => now() + skipped;
const prototype = WebGL2RenderingContext.prototype, { drawArrays, readPixels } = prototype;
prototype.drawArrays = function (...given) {
  drawn += this.canvas.width === 32;
  return drawArrays.apply(this, given);
};
prototype.readPixels = function (...given) {
  if (this.canvas.width === 32) skipped += 1000 * Math.max(0, 4 * drawn - ROOM);
  drawn = 0;
  return readPixels.apply(this, given);
};
Object.defineProperty(window, "ptm", { configurable: true, set(app) {
  Object.defineProperty(window, "ptm", { value: app });
  const fence = { took: 0.001, busy: false, mark() {}, reached: () => false, pause: () => 0 };
  Object.defineProperty(app.walk.picture, "fence", { get: () => fence, set() {} });
} });
"""


def test_the_search() -> None:
    """On cards whose pictures take much longer from some size on: within a factor of √√2 of it, and
    never twice as much; all or nothing where that is right."""
    random = np.random.default_rng(1)
    cases, expected = [], []
    for _ in range(300):
        least, most = (int(2**k) for k in np.sort(random.uniform(20, 32, 2)))
        room, limit = int(2 ** random.uniform(18, 34)), float(random.uniform(0, 1 / 30))
        base, slow = limit / (2 * most) * float(random.integers(0, 2)), 1e-6
        cases.append(
            {"least": least, "most": most, "limit": limit, "base": base, "room": room, "slow": slow}
        )
        # base · b + slow · (b − room) = limit
        expected.append(min((limit + slow * room) / (base + slow), most))
    reported = json.loads(node.run(HERE / "budget.mjs", json.dumps(cases)))
    nothing, everything = 0, 0
    for case, right, (bytes_, tried) in zip(cases, expected, reported, strict=True):
        assert len(tried) == len(set(tried)) <= 16
        assert max(tried) <= max(2 * right, case["least"]) * (1 + 1e-9)
        if bytes_ == 0:
            nothing += 1
            assert right < case["least"]
            assert tried == [case["least"]]
        else:
            everything += bytes_ == case["most"]
            assert right / 2**0.25 * (1 - 1e-9) <= bytes_ <= right * (1 + 1e-9)
    assert nothing > 20
    assert everything > 20
    assert nothing + everything < 250


@pytest.mark.parametrize("room", [40, 3])
def test_a_budget_is_measured(visit: Callable[..., Any], museum: Site, room: int) -> None:
    """At most what the site can use; the panel names it, and a recording has it. A card that is too
    slow for the least one keeps the default, with a notice."""
    card = CARD.replace("ROOM", str(room))
    with visit(
        museum, query="?memory=auto", prepare=lambda page: page.add_init_script(card)
    ) as visitor:
        page = visitor.page
        page.wait_for_function("window.ptm?.measured")
        measured, notices = page.evaluate("ptm.measured"), page.text_content("#notices")
        state = visitor.complete()
        assert measured["picture"] == 0.001
        assert measured["tried"][0][0] == 4 * MIB
        page.keyboard.press("Backquote")
        page.wait_for_function("document.querySelector('#memory')?.textContent")
        shown = page.text_content("#memory")
        if room == 40:
            rows = museum.index["textures"]
            levels = [(max(row["width"], row["height"])).bit_length() for row in rows]
            sizes = [sum(4 * 4**k for k in range(n)) for n in levels]
            assert measured["bytes"] == sum(sizes) + max(sizes)
            assert state["budgetBytes"] == measured["bytes"]
            assert shown.endswith("measured")
            assert "memory" not in notices
        else:
            assert measured["bytes"] == 0
            assert state["budgetBytes"] == 256 * MIB
            assert not shown.endswith("measured")
            assert "the default stays" in notices
        page.evaluate("ptm.record()")
        recorded = page.evaluate("ptm.recording.browser.budget")
        assert recorded == round(state["budgetBytes"])
    assert visitor.messages == []
