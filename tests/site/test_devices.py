"""Gamepads and headsets, by devices that the tests put in the place of the browser's."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Visitor
from numpy.typing import NDArray

from ptmtools.site.content import Site
from tests.site.interface import own_page, visit_by
from tests.site.test_tour import tour_file, toured
from tests.web import node

__all__ = ["tour_file", "toured"]

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "web" / "page"
PAD = """
window.looks = 0;
window.pad = null;
// The last one lies on the table.
const rests = { connected: true, mapping: "standard", axes: [0, 0], buttons: [{ pressed: false }] };
navigator.getGamepads = () => (window.looks++, [null, window.pad, window.pad && rests]);
window.plug = () => {
  const buttons = Array.from({ length: 17 }, () => ({ pressed: false }));
  window.pad = { connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons };
  dispatchEvent(new Event("gamepadconnected"));
};
window.unplug = () => {
  window.pad = null;
  dispatchEvent(new Event("gamepaddisconnected"));
};
"""
EYE = "ptm.state().pose.eye"
#: A button is pressed for two frames.
PRESS = """
async (button) => {
  const frame = () => new Promise(requestAnimationFrame);
  for (const pressed of [true, false]) {
    pad.buttons[button].pressed = pressed;
    await frame();
    await frame();
  }
}
"""
#: Steps of a head, each in a picture of its own.
STRIDE = """
async ([count, metres]) => {
  while (count--) {
    const { frames } = ptmHeadset;
    ptmHeadset.head[2] -= metres;
    while (ptmHeadset.frames < frames + 2) await new Promise(requestAnimationFrame);
  }
}
"""
#: Before the last control, where the D-pad has to go on.
CLOSED_DETAILS = """
document.querySelector("#help").insertAdjacentHTML(
  "beforeend", "<details><summary>more</summary><div><button>inside</button></div></details>")
"""
USE, CLOSE, TOUR, STICK, MAP, PLACES, UP, DOWN, LEFT, RIGHT = 0, 1, 3, 10, 8, 9, 12, 13, 14, 15
FOCUS = "document.activeElement"


@contextmanager
def with_script(visit: Callable[..., Any], museum: Site, script: str, query: str) -> Iterator[Any]:
    options = {"width": 320, "height": 240, "reduced_motion": "reduce"}
    with visit(
        museum, query=query, prepare=lambda page: page.add_init_script(script), **options
    ) as visitor:
        visitor.complete()
        yield visitor
    assert visitor.messages == []


def press(page: Any, *buttons: int) -> None:
    for button in buttons:
        page.evaluate(PRESS, button)


def reach(page: Any, selector: str) -> None:
    """Down to an element; presses before it scroll its panel."""
    for _ in range(12):
        press(page, DOWN)
        if page.evaluate(f"{FOCUS}.matches({selector!r})"):
            return
    raise AssertionError(f"{selector}: {page.evaluate(f'{FOCUS}.outerHTML')}")


def plug(page: Any) -> None:
    page.evaluate("plug()")
    page.wait_for_function("window.looks > 3")


def wake(page: Any, button: int) -> None:
    """Plugs the gamepad in by a press of a button, which browsers wait for."""
    page.evaluate(f"plug(); pad.buttons[{button}].pressed = true")
    page.wait_for_function("window.looks > 3")
    page.evaluate(f"pad.buttons[{button}].pressed = false")
    page.wait_for_function(f"window.looks > {page.evaluate('looks')} + 3")


def test_a_gamepad_walks_and_tours(visit: Callable[..., Any], toured: Site) -> None:
    with with_script(visit, toured, PAD, "?ui=gamepad,xr&lang=en") as visitor:
        page = visitor.page
        assert page.locator(".vr").count() == 0, "no headset"
        plug(page)
        before = np.array(page.evaluate(EYE))
        page.evaluate("pad.axes = [0.1, -0.1, 0.1, 0.05]")
        visitor.frames(5)
        assert np.array_equal(page.evaluate(EYE), before), "a worn stick rests"
        yaw = page.evaluate("ptm.state().pose.yaw")
        page.evaluate("pad.axes = [0, -1, 0, 0]")
        visitor.until(f"Math.hypot(s.pose.eye[0] - {before[0]}, s.pose.eye[2] - {before[2]}) > 0.3")
        way = np.array(page.evaluate(EYE)) - before
        ahead = -np.sin(yaw), -np.cos(yaw)
        assert np.dot(way[[0, 2]], ahead) > 0.99 * np.hypot(way[0], way[2])
        page.evaluate("pad.axes = [0, 0, 1, 0]")
        visitor.until(f"s.pose.yaw < {yaw} - 0.2")
        page.evaluate("pad.axes = [0, 0, 0, 0]")
        visitor.frames(3)
        places = [row["position"] for row in toured.index["viewpoints"]]
        press(page, 5)
        assert np.allclose(page.evaluate(EYE), places[1])
        press(page, 4, 4)
        assert np.allclose(page.evaluate(EYE), places[-1])
        use_the_tour(visitor)
        page.evaluate("unplug()")
        visitor.frames(2)
        looks = page.evaluate("looks")
        visitor.frames(5)
        assert page.evaluate("looks") == looks


def use_the_tour(visitor: Visitor) -> None:
    """List, label, language, sound, and the way back to the walk."""
    page, text = visitor.page, f"{FOCUS}.textContent"
    visitor.until("window.ptm.tour")
    press(page, TOUR)
    assert page.evaluate(f"{FOCUS}.matches('#tour select')")
    press(page, RIGHT)
    assert page.evaluate("ptm.tour.language") == "de"
    press(page, LEFT)
    assert page.evaluate("ptm.tour.language") == "en"
    reach(page, "li button")
    press(page, USE)
    assert page.evaluate(text) == "Night", "the heading of its label"
    # As with keys, sticks do not walk from a panel.
    before = page.evaluate(EYE)
    page.evaluate("pad.axes = [0, 1, 0, 0]")
    visitor.frames(5)
    assert page.evaluate(EYE) == before
    press(page, STICK)
    visitor.until(f"s.pose.eye.join() !== '{','.join(map(repr, before))}'")
    page.evaluate("pad.axes = [0, 0, 0, 0]")
    assert page.locator("#label").is_visible()
    page.evaluate(
        """() => {
          const { prototype } = HTMLMediaElement, fault = new DOMException("", "NotAllowedError");
          window.play = prototype.play;
          prototype.play = () => Promise.reject(fault);
          document.querySelector("#label h2").focus();
        }"""
    )
    reach(page, "audio")
    press(page, USE)
    page.get_by_text("The browser does not let a gamepad do this").wait_for()
    page.evaluate("void (HTMLMediaElement.prototype.play = play)")
    press(page, USE)
    page.wait_for_function("!document.querySelector('#label audio').paused")
    press(page, USE)
    assert page.evaluate(f"{FOCUS}.paused")
    reach(page, "summary")
    press(page, USE)
    assert page.locator("#label details[open]").count() == 1
    # A link, which opens another page, and the next stop.
    page.evaluate(
        """addEventListener("click", (event) => {
          event.preventDefault();
          window.left = event.target.href;
        })"""
    )
    reach(page, "a")
    press(page, USE)
    assert page.evaluate("left") == "https://example.org/night"
    reach(page, ".row button")
    press(page, RIGHT, USE)
    assert page.evaluate("ptm.tour.stop") == 1
    press(page, CLOSE)
    assert page.locator("#label").is_hidden()
    assert page.evaluate(f"{FOCUS}.id") == "view"


@pytest.fixture
def desk(chromium: Any) -> Iterator[Any]:
    """The interface without a museum, with a gamepad and open details: too low for its panels."""
    with own_page(chromium, size=(1280, 420)) as page:
        page.add_init_script(PAD)
        with visit_by(page):
            page.wait_for_function("window.fake")
            page.evaluate("fake.emit('first-picture')")
            page.keyboard.press("Backquote")
            page.wait_for_selector("#details select")
            plug(page)
            yield page


def test_a_gamepad_reaches_what_keys_do(desk: Any) -> None:
    """All controls in the order of the Tab key; texts are scrolled before the focus leaves them."""
    for name in ("Places", "Map", "Help"):
        desk.get_by_role("button", name=name, exact=True).press("Enter")
    for place in ("#places ol button", "#map canvas", "#help dl"):
        desk.locator(place).first.wait_for(state="visible")
    desk.evaluate(CLOSED_DETAILS)
    desk.evaluate("window.tabs = []; document.querySelector('#view').focus()")
    while desk.evaluate(f"!tabs.includes({FOCUS}) && {FOCUS} !== document.body"):
        desk.evaluate(f"tabs.push({FOCUS})")
        desk.keyboard.press("Tab")
    press(desk, STICK, UP)
    assert desk.evaluate(f"{FOCUS} === tabs.at(-1)")
    press(desk, STICK)
    desk.evaluate(f"window.steps = [{{ active: {FOCUS} }}]")
    # Held, the D-pad goes on by itself.
    desk.evaluate(f"pad.buttons[{DOWN}].pressed = true")
    desk.wait_for_function(
        """() => {
          const active = document.activeElement, panel = active.closest("section");
          const last = steps.at(-1);
          const { clientHeight, scrollHeight, scrollTop } = last.panel ?? {};
          if (last.panel && last.panel !== panel) {
            last.left = scrollHeight - clientHeight - scrollTop;
          }
          if (last.active !== active) steps.push({ active, panel });
          return steps.length > tabs.length;
        }""",
        polling="raf",
    )
    desk.evaluate(f"pad.buttons[{DOWN}].pressed = false")
    assert desk.evaluate("tabs.length") > 15
    assert desk.evaluate("tabs.every((one, k) => one === steps[k].active)")
    left = desk.evaluate("steps.flatMap(({ left = [] }) => left)")
    assert len(left) == 4
    assert max(left) < 1
    assert desk.evaluate("document.querySelector('#help').scrollTop") > 0


def test_a_gamepad_uses_what_it_reaches(desk: Any) -> None:
    """Fields, panels, neighbours at the sides; and an error, behind whose message all rests."""
    desk.evaluate("fake.calls.length = 0")
    for field, button in (
        ("switch", USE),
        ("slider", RIGHT),
        ("combobox", RIGHT),
        ("combobox", USE),
    ):
        desk.locator("#details").get_by_role(field).first.focus()
        press(desk, button)
    calls = desk.evaluate("fake.calls")
    assert calls == [
        ["setDataSaver", True],
        ["setBudget", pytest.approx(2**26.5)],
        ["setPolicy", "paper"],
        ["setPolicy", "whole"],
    ]
    desk.evaluate(
        """() => {
          const field = document.querySelector("#details select");
          for (const one of field.options) one.disabled = !one.selected;
          field.focus();
        }"""
    )
    press(desk, RIGHT, LEFT, USE)
    assert desk.evaluate("fake.calls") == calls, "there is nothing else to choose"
    press(desk, CLOSE)
    assert desk.locator("#details").is_hidden()
    press(desk, MAP)
    desk.wait_for_selector("#map canvas")
    assert desk.evaluate(f"{FOCUS}.id") == "view", "in the map there is nothing to use"
    press(desk, PLACES)
    desk.wait_for_function(f"{FOCUS}.closest('#places li')")
    press(desk, DOWN, USE)
    assert desk.evaluate("fake.calls.at(-1)") == ["goTo", 1]
    assert desk.evaluate(f"getComputedStyle({FOCUS}).outlineStyle") == "solid"
    press(desk, PLACES, MAP)
    assert desk.locator("#panels section:not([hidden])").count() == 0
    desk.get_by_role("button", name="Map").focus()
    press(desk, RIGHT, RIGHT, LEFT)
    assert desk.evaluate(f"{FOCUS}.id") == "link"
    desk.evaluate("fake.emit('error', { code: 'PTM-V104', message: 'No line' }); window.before = 1")
    press(desk, PLACES, STICK, DOWN)
    assert desk.locator("#places").is_hidden()
    assert desk.evaluate(f"{FOCUS}.closest('#error') !== null")
    desk.locator("#again").focus()
    with desk.expect_navigation():
        desk.evaluate(f"pad.buttons[{USE}].pressed = true")
    desk.wait_for_function("window.fake && !window.before")


def test_cameras_of_eyes_and_their_union() -> None:
    """The cameras of the page project as the matrices of WebXR; the union has all that eyes see."""
    actual = json.loads(node.run(HERE / "eyes.mjs", PAGE))
    assert actual["projected"] < 1e-12
    assert actual["heading"] < 1e-12
    assert actual["outside"] == 0
    assert actual["widest"] < 0.1, "no farther behind the eyes than they are apart"


def test_sessions_that_fail_and_canted_displays() -> None:
    """A session that cannot begin or draw says why, ends, and leaves the page as it was; the view
    of the policy looks where the head does, whatever the displays do."""
    actual = json.loads(node.run(HERE / "sessions.mjs", PAGE, seconds=30))
    for step, after in actual["failures"].items():
        assert after == {"message": step, "same": True, "ended": True}
    assert set(actual["failures"]) == {"session", "card", "layer", "space", "frame"}
    assert actual["off"] < 1e-12


def halves(visitor: Visitor) -> list[NDArray[np.float64]]:
    """The pictures of both eyes, grey."""
    grey = visitor.picture().mean(axis=2)
    half = grey.shape[1] // 2
    return [grey[:, :half], grey[:, half:]]


def shift(left: NDArray[np.float64], right: NDArray[np.float64]) -> int:
    """By how many pixels to the left things are in the second picture."""
    most, width = 24, left.shape[1]

    def off(by: int) -> float:
        low, high = max(0, by), min(width, width + by)
        return float(np.abs(left[:, low:high] - right[:, low - by : high - by]).mean())

    return min(range(-most, most + 1), key=off)


def test_a_headset_sees_two_pictures(visit: Callable[..., Any], museum: Site) -> None:
    """By parallax; the head is above the floor, sticks turn by 30° and walk, and the walk goes on
    after the session."""
    script = (HERE / "headset.js").read_text()
    with with_script(visit, museum, script, "?ui=xr") as visitor:
        page = visitor.page
        start = visitor.state()["pose"]
        alone = visitor.picture()
        page.evaluate("ptmHeadset.fails = 'it lies in its box'")
        page.click("nav .vr")
        page.get_by_text("VR does not work: it lies in its box").wait_for()
        page.evaluate("ptmHeadset.fails = ''")
        page.click("nav .vr")
        visitor.until("ptmHeadset.frames > 3")
        left, right = halves(visitor)
        assert shift(left, right) > 0, "things are farther left for the right eye"
        page.evaluate("ptmHeadset.apart = 0")
        visitor.frames(3)
        left, right = halves(visitor)
        assert np.abs(left - right).max() < 1
        head = "ptm.walk.picture.drawn.length && ptm.state().pose"
        assert page.evaluate(head)["eye"] == start["eye"]
        # A lower head sees more of the floor; the walker stays as tall.
        page.evaluate("ptmHeadset.head = [0, 0.6, 0]")
        visitor.frames(3)
        low, _ = halves(visitor)
        assert np.abs(low - left).mean() > 2
        assert page.evaluate(head)["eye"][1] == start["eye"][1]
        page.evaluate("ptmHeadset.head = [0, 1.7, 0]")
        # A step of the visitor in the room.
        page.evaluate("ptmHeadset.head[2] = -0.25")
        visitor.frames(3)
        stepped = page.evaluate(head)
        ahead = np.array([-np.sin(start["yaw"]), -np.cos(start["yaw"])])
        way = np.array(stepped["eye"])[[0, 2]] - np.array(start["eye"])[[0, 2]]
        assert np.allclose(way, 0.25 * ahead, atol=1e-6)
        push = """([handedness, ...stick]) =>
            ptmHeadset.sources.splice(0, 9, { handedness, gamepad: { axes: [0, 0, ...stick] } })"""
        page.evaluate(push, ["right", 1, 0])
        visitor.frames(6)
        turned = page.evaluate(head)["yaw"]
        assert np.isclose(turned - start["yaw"], -np.pi / 6), "once"
        page.evaluate(push, ["left", 0, -1])
        x, _, z = stepped["eye"]
        visitor.until(f"Math.hypot(s.pose.eye[0] - {x}, s.pose.eye[2] - {z}) > 0.3")
        # Nine metres ahead: walls stop the head, which slides along them into a corner.
        page.evaluate(push, ["left", 0, 0])
        x, _, z = page.evaluate(head)["eye"]
        page.evaluate(STRIDE, [12, 0.75])
        u, _, w = page.evaluate(head)["eye"]
        assert 5 < np.hypot(u - x, w - z) < 12
        page.evaluate("ptmHeadset.session.end()")
        visitor.frames(2)
        page.evaluate("(pose) => ptm.goTo(pose)", start)
        visitor.complete()
        assert np.array_equal(visitor.picture(), alone)
        page.set_viewport_size({"width": 300, "height": 240})
        visitor.until("ptm.canvas.width === 300", 20)
