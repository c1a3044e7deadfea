"""Network faults: the page recovers from some, and reports the others."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from browser import FRAMES

from ptmtools.site.content import Site
from ptmtools.site.throttle import Throttle

TEXTURES = re.compile(r"\.ptm$")


def spoiled(page: Any, spoil: Callable[[Any, int], bool]) -> list[int]:
    """Spoils answers to requests for textures: ``spoil(route, number)`` says whether it did."""
    count = [0]

    def handle(route: Any) -> None:
        count[0] += 1
        if not spoil(route, count[0]):
            route.continue_()

    page.route(TEXTURES, handle)
    return count


def fetched(route: Any) -> tuple[Any, bytes]:
    answer = route.fetch()
    return answer, answer.body()


def test_a_lost_connection(visit: Callable[..., Any], museum: Site) -> None:
    def lose(route: Any, number: int) -> bool:
        if number % 4 == 1:
            route.abort("connectionreset")
        return number % 4 == 1

    with visit(museum, prepare=lambda page: spoiled(page, lose)) as visitor:
        visitor.complete()
    assert all("ERR_CONNECTION_RESET" in printed for printed in visitor.messages)
    assert visitor.messages


def test_a_short_body(visit: Callable[..., Any], museum: Site) -> None:
    """Is asked for again, past the cache."""
    asked: list[str] = []

    def cut(route: Any, number: int) -> bool:
        asked.append(route.request.headers.get("range", ""))
        if number != 2:
            return False
        answer, body = fetched(route)
        headers = {k: v for k, v in answer.headers.items() if k.lower() != "content-length"}
        route.fulfill(status=206, headers=headers, body=body[: len(body) // 2])
        return True

    with visit(museum, prepare=lambda page: spoiled(page, cut)) as visitor:
        visitor.complete()
    assert visitor.messages == []
    assert asked.count(asked[1]) >= 2


def test_a_host_that_ignores_ranges(visit: Callable[..., Any], museum: Site) -> None:
    """Files come whole, each once, and the visitor is told once."""
    asked: list[str] = []

    def whole(route: Any, number: int) -> bool:
        asked.append(route.request.url)
        headers = {k: v for k, v in route.request.headers.items() if k != "range"}
        answer = route.fetch(headers=headers)
        assert answer.status == 200
        route.fulfill(response=answer)
        return True

    with visit(museum, prepare=lambda page: spoiled(page, whole)) as visitor:
        visitor.complete()
    assert len(asked) == len(set(asked))
    assert len([printed for printed in visitor.messages if "ignores byte ranges" in printed]) == 1
    assert len(visitor.messages) == 1


def test_a_flipped_byte(visit: Callable[..., Any], museum: Site) -> None:
    """A level with a wrong checksum is reported and asked for once more."""
    asked: list[str] = []

    def flip(route: Any, number: int) -> bool:
        asked.append(route.request.url + route.request.headers.get("range", ""))
        if number != 1:
            return False
        answer, body = fetched(route)
        body = body[:-1] + bytes([body[-1] ^ 1])
        route.fulfill(response=answer, body=body)
        return True

    with visit(museum, prepare=lambda page: spoiled(page, flip)) as visitor:
        visitor.complete()
        errors = visitor.page.evaluate("window.ptm.errors.map(({ code }) => code)")
    assert errors == ["PTM-V105"]


def test_a_missing_file(visit: Callable[..., Any], museum: Site) -> None:
    """The walk goes on without it, and says which it is."""
    row = museum.index["textures"][0]
    entries = {name: e for name, e in museum.entries.items() if not name.endswith(row["file"])}
    with visit(Site(entries, museum.index)) as visitor:
        visitor.until("window.ptm.errors.length > 0")
        code, message = visitor.page.evaluate(
            "[window.ptm.errors[0].code, window.ptm.errors[0].message]"
        )
        visitor.until("s.held.some((held) => held > 3)")
        assert visitor.page.locator("#error").is_hidden()
    assert code == "PTM-V103"
    assert row["file"] in message


def test_no_textures_at_all(visit: Callable[..., Any], museum: Site) -> None:
    """There is a walk all the same, and a tab that is hidden, or a data saver, can rest."""
    textures = (".ptm", ".webp")
    entries = {name: e for name, e in museum.entries.items() if not name.endswith(textures)}
    with visit(Site(entries, museum.index)) as visitor:
        visitor.page.evaluate("window.ptm.setDataSaver(true)")
        visitor.until("window.ptm.walk.begun && s.complete")
        assert visitor.page.locator("body.begun").count() == 1
        assert set(visitor.state()["held"]) == {0}


@pytest.mark.parametrize("kind", ["record", "geometry"])
def test_cells_that_are_not_as_they_should_be(
    visit: Callable[..., Any], museum: Site, kind: str
) -> None:
    """Of all cells but the first: they are reported, and the walk is where it was."""
    first = museum.index["viewpoints"][0]["cell"]
    entries = dict(museum.entries)
    for cell, row in enumerate(museum.index["cells"]):
        name = f"data/{row[kind]}"
        if cell == first:
            continue
        if kind == "record":
            data = json.dumps({"cell": cell}).encode()
        else:
            data = entries[name].read().replace(b'"POSITION"', b'"POSITIOM"')
        entries[name] = replace(entries[name], source=data)
    with visit(Site(entries, museum.index)) as visitor:
        visitor.until("window.ptm.errors.length > 0 && s.held.some((held) => held > 5)")
        assert {error["code"] for error in visitor.page.evaluate("window.ptm.errors")} == {
            "PTM-V105"
        }
        assert visitor.page.locator("#error").is_hidden()


def test_a_frozen_walk(visit: Callable[..., Any], museum: Site) -> None:
    """Texture memory stays as it is, whatever becomes of the budget or of the context."""
    with visit(museum, reduced_motion="reduce") as visitor:
        held = visitor.complete()["held"]
        visitor.page.evaluate("window.ptm.freeze(true)")
        requests = visitor.state()["requests"]
        visitor.page.evaluate("window.ptm.goTo(1)")
        visitor.lose_context()
        visitor.restore_context()
        visitor.until(f"JSON.stringify(s.held) === '{json.dumps(held, separators=(',', ':'))}'")
        visitor.frames(30)
        assert visitor.state()["held"] == held
        assert visitor.state()["requests"] - requests <= 6
        visitor.page.evaluate("window.ptm.freeze(false)")
        visitor.complete()


def test_a_lost_context(visit: Callable[..., Any], museum: Site) -> None:
    """All comes back, from bytes that are here: nothing is asked for again."""
    with visit(museum, reduced_motion="reduce") as visitor:
        visitor.complete()
        visitor.until("s.pending === 0")
        before, requests = visitor.picture(), visitor.state()["requests"]
        visitor.lose_context()
        visitor.restore_context()
        visitor.complete()
        assert visitor.state()["requests"] == requests
        np.testing.assert_array_equal(visitor.picture(), before)
        counted, resident = visitor.page.evaluate(
            "[window.counted.bytes, window.ptm.state().residentBytes]"
        )
    assert counted >= resident


def test_a_resized_window(visit: Callable[..., Any], museum: Site) -> None:
    with visit(museum, reduced_motion="reduce") as visitor:
        visitor.complete()
        before = visitor.picture()
        visitor.page.set_viewport_size({"width": 390, "height": 844})
        visitor.complete()
        upright = visitor.picture()
        assert upright.shape[:2] == (844, 390)
        assert len(np.unique(upright.reshape(-1, 3), axis=0)) > 100
        visitor.page.set_viewport_size({"width": 640, "height": 480})
        visitor.complete()
        np.testing.assert_array_equal(visitor.picture(), before)
    assert visitor.messages == []


def test_a_frozen_tab(visit: Callable[..., Any], museum: Site) -> None:
    """Goes on where it was, and has not walked meanwhile."""
    with visit(museum, throttle=Throttle(2e6, 0.05)) as visitor:
        visitor.until("s.cell >= 0")
        pose = visitor.state()["pose"]
        session = visitor.page.context.new_cdp_session(visitor.page)
        session.send("Page.setWebLifecycleState", {"state": "frozen"})
        other = visitor.page.context.new_page()
        other.evaluate(FRAMES, 90)
        other.close()
        session.send("Page.setWebLifecycleState", {"state": "active"})
        visitor.complete()
        assert visitor.state()["pose"] == pose
    assert visitor.messages == []


def test_no_webgl(visit: Callable[..., Any], museum: Site) -> None:
    def without(page: Any) -> None:
        page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")

    with visit(museum, prepare=without) as visitor:
        visitor.page.get_by_text("WebGL 2").first.wait_for()
    assert all("pageerror" not in printed for printed in visitor.messages)


def test_no_simd(visit: Callable[..., Any], museum: Site) -> None:
    def without(page: Any) -> None:
        page.add_init_script("WebAssembly.validate = () => false")

    with visit(museum, prepare=without) as visitor:
        visitor.page.get_by_text("Safari 16.4").first.wait_for()
        assert visitor.page.locator("#error-code").inner_text() == "PTM-V102"


def test_a_missing_decoder(visit: Callable[..., Any], museum: Site) -> None:
    """Cells are compressed, too: there is no walk, and that is said."""
    entries = {name: e for name, e in museum.entries.items() if not name.endswith(".wasm")}
    with visit(Site(entries, museum.index)) as visitor:
        visitor.page.locator("#error").wait_for()
        assert visitor.page.locator("#error-code").inner_text() == "PTM-V106"


def test_a_worker_that_does_not_start(visit: Callable[..., Any], museum: Site) -> None:
    """Without a decoder there is no walk, and that is said."""
    entries = {name: e for name, e in museum.entries.items() if not name.endswith("worker.js")}
    with visit(Site(entries, museum.index)) as visitor:
        visitor.page.locator("#error").wait_for()
        assert visitor.page.locator("#error-code").inner_text() == "PTM-V106"


def test_a_page_in_place_of_geometry(visit: Callable[..., Any], museum: Site) -> None:
    """As captive portals answer: asked for once more, past the cache."""
    count = [0]

    def portal(page: Any) -> None:
        def handle(route: Any) -> None:
            count[0] += 1
            if count[0] == 1:
                route.fulfill(status=200, content_type="text/html", body="<p>Log in first")
            else:
                route.continue_()

        page.route(re.compile(r"\.glb$"), handle)

    with visit(museum, prepare=portal) as visitor:
        visitor.complete()
        assert visitor.page.evaluate("window.ptm.errors") == []
    assert count[0] > 1


def test_a_context_lost_while_comparing(visit: Callable[..., Any], museum: Site) -> None:
    with visit(museum, reduced_motion="reduce") as visitor:
        visitor.complete()
        visitor.page.evaluate("window.ptm.compare(true)")
        visitor.page.wait_for_function("window.ptm.walk.comparison?.settle()", polling=200)
        visitor.lose_context()
        visitor.restore_context()
        visitor.page.wait_for_function("window.ptm.walk.comparison?.settle()", polling=200)
        visitor.page.evaluate("window.ptm.compare(false)")
        visitor.complete()
        reported, counted = visitor.page.evaluate(
            "[window.ptm.state().residentBytes, window.ptm.walk.memory.bytes]"
        )
        assert reported == counted
    assert not any("does not belong" in printed for printed in visitor.messages)


def test_links_and_questions_that_mean_nothing(visit: Callable[..., Any], museum: Site) -> None:
    """Lead to the first viewpoint, by the policy and with the memory that there are."""
    with visit(museum, query="?policy=constructor&memory=Infinity#1e300,1e300,1e300,0") as visitor:
        state = visitor.complete()
        visitor.page.get_by_text("outside of the building").wait_for()
    assert state["policy"] == "best"
    assert state["cell"] == museum.index["viewpoints"][0]["cell"]
    assert state["budgetBytes"] == 4096 << 20
    assert visitor.messages == []


ATTACK = """() => {
  document.body.insertAdjacentHTML("beforeend", "<img src=x onerror='window.broken = 1'>");
  const script = document.createElement("script");
  script.textContent = "window.broken = 2";
  document.body.append(script);
}"""


def test_the_policy_of_the_page(visit: Callable[..., Any], museum: Site) -> None:
    """The page needs nothing that its policy refuses, and the policy refuses foreign scripts."""
    with visit(museum, bypass_csp=False) as visitor:
        visitor.complete()
        visitor.page.get_by_role("button", name="Details").click()
        visitor.page.get_by_role("button", name="Map").click()
        visitor.page.locator("#map canvas").wait_for()
        assert visitor.messages == []
        visitor.page.evaluate(ATTACK)
        visitor.frames(10)
        assert visitor.page.evaluate("window.broken") is None
    assert any("Content Security Policy" in message for message in visitor.messages)


def test_a_missing_first_room(visit: Callable[..., Any], museum: Site) -> None:
    """Is said, and stays said, whatever else comes."""
    first = museum.index["cells"][museum.index["viewpoints"][0]["cell"]]["geometry"]
    entries = {name: e for name, e in museum.entries.items() if not name.endswith(first)}
    with visit(Site(entries, museum.index)) as visitor:
        visitor.page.locator("#error").wait_for()
        visitor.until("s.pending === 0")
        visitor.frames(60)
        assert visitor.page.locator("#error-code").inner_text() == "PTM-V103"
        assert visitor.page.locator("#error").is_visible()


def test_a_graphics_card_that_holds_small_textures_alone(
    visit: Callable[..., Any], museum: Site
) -> None:
    """The levels beyond are left out, also where records tell of them."""

    def small(page: Any) -> None:
        page.add_init_script(
            "const { getParameter } = WebGL2RenderingContext.prototype;"
            "WebGL2RenderingContext.prototype.getParameter = function (name) {"
            "  return name === this.MAX_TEXTURE_SIZE ? 64 : getParameter.call(this, name);"
            "};"
        )

    with visit(museum, prepare=small) as visitor:
        state = visitor.complete()
        assert max(state["held"]) == 7
        assert visitor.page.evaluate("window.ptm.errors") == []
    assert visitor.messages == []
