"""The policy `whole` in the page: textures whole or not at all, uploaded as they are drawn."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.site.content import Site, SiteOptions, site_of
from tests.web import node

HERE = Path(__file__).parent
MIB = 1 << 20
#: Counts the calls that upload texels: `window.uploads`.
COUNTING = """
window.uploads = 0;
const { texSubImage2D } = WebGL2RenderingContext.prototype;
WebGL2RenderingContext.prototype.texSubImage2D = function (...given) {
  window.uploads++;
  return texSubImage2D.apply(this, given);
};
"""


@pytest.mark.parametrize("seed", range(8))
def test_whole_textures_leave_by_their_last_drawing(seed: int) -> None:
    """A texture that is drawn and not in memory is uploaded whole at once; the least recently drawn
    ones leave, no more than must; one that is larger than all of the memory is not there."""
    random = np.random.default_rng(seed)
    sides = [1 << int(k) for k in random.integers(2, 6, 9)]
    size = [sum(4 * 4**k for k in range(side.bit_length())) for side in sides]
    draws, budget = random.integers(0, 9, 60).tolist(), int(random.integers(1000, 9000))
    reported = json.loads(
        node.run(HERE / "whole.mjs", json.dumps({"sides": sides, "draws": draws, "budget": budget}))
    )
    held: dict[int, int] = {}
    peak = 0
    for t, actual in zip(draws, reported["report"], strict=True):
        expected = [size[t] <= budget, 0, []]
        if size[t] <= budget:
            expected[1] = 0 if t in held else size[t]
            held.pop(t, None)
            while sum(held.values()) + size[t] > budget:
                first = next(iter(held))
                expected[2].append(first)
                del held[first]
            held[t] = size[t]
        peak = max(peak, sum(held.values()))
        assert actual == expected
    assert (reported["peak"], reported["bytes"]) == (peak, sum(held.values()))
    assert peak <= budget
    assert reported["left"] == 0
    # Nothing that has not come is drawn; what has come counts as held, as a drawing shows it.
    assert reported["early"] == [None] * 9
    assert (reported["lacked"], reported["came"]) == (False, True)
    assert reported["held"] == [side.bit_length() for side in sides]


def counts(page: Any) -> None:
    page.add_init_script(COUNTING)


def test_whole_textures_are_uploaded_for_each_picture(
    visit: Callable[..., Any], museum: Site
) -> None:
    """`whole` shows all texels with any memory: what does not fit is uploaded for each picture, and
    the others leave; with enough memory no more than once."""
    with visit(museum, query="?memory=64", reduced_motion="reduce") as visitor:
        visitor.until("s.exact")
        full = visitor.picture()
    for megabytes, again in ((64, False), (1, True)):
        query = f"?policy=whole&memory={megabytes}"
        with visit(museum, query=query, reduced_motion="reduce", prepare=counts) as visitor:
            visitor.until("s.exact && s.pending === 0")
            assert np.abs(visitor.picture().astype(int) - full).max() <= 2
            before = visitor.page.evaluate("window.uploads")
            visitor.page.evaluate("ptm.walk.picture.touch()")
            visitor.complete()
            assert (visitor.page.evaluate("window.uploads") > before) is again
            state = visitor.state()
            assert state["residentBytes"] <= megabytes * MIB
            assert visitor.page.evaluate("window.counted.peak") <= megabytes * MIB
            # Another policy has its own texture memory, and gives it back.
            visitor.page.evaluate("ptm.setPolicy('best')")
            visitor.until("s.policy === 'best' && s.complete")
            assert visitor.page.evaluate("window.counted.bytes") <= megabytes * MIB
            visitor.page.evaluate("ptm.setPolicy('whole')")
            visitor.until("s.policy === 'whole' && s.complete")
            assert np.abs(visitor.picture().astype(int) - full).max() <= 2
            assert visitor.messages == []


def test_a_walk_begins_behind_a_poster(
    visit: Callable[..., Any], museum_db: Path, tmp_path: Path
) -> None:
    """Nothing is drawn before the walk begins."""
    poster = tmp_path / "poster.png"
    Image.new("RGB", (64, 36)).save(poster)
    site = site_of(museum_db, SiteOptions(poster=str(poster), pictures=False, opening=False))
    with visit(site, query="?policy=whole") as visitor:
        visitor.page.wait_for_function("window.ptm?.walk.begun", timeout=30_000)
        visitor.complete()
