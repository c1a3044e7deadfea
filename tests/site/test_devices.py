"""Gamepads and headsets, by devices that the tests put in the place of the browser's."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from browser import Visitor
from numpy.typing import NDArray

from ptmtools.site.content import Site
from tests.web import node

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


@contextmanager
def with_script(visit: Callable[..., Any], museum: Site, script: str, query: str) -> Iterator[Any]:
    options = {"width": 320, "height": 240, "reduced_motion": "reduce"}
    with visit(
        museum, query=query, prepare=lambda page: page.add_init_script(script), **options
    ) as visitor:
        visitor.complete()
        yield visitor
    assert visitor.messages == []


def press(visitor: Visitor, button: int) -> None:
    for pressed in ("true", "false"):
        visitor.page.evaluate(f"pad.buttons[{button}].pressed = {pressed}")
        visitor.frames(3)


def test_a_gamepad_walks_and_leads_to_places(visit: Callable[..., Any], museum: Site) -> None:
    with with_script(visit, museum, PAD, "?ui=gamepad,xr") as visitor:
        page = visitor.page
        assert page.locator(".vr").count() == 0, "no headset"
        page.evaluate("plug()")
        visitor.until("window.looks > 3")
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
        places = [row["position"] for row in museum.index["viewpoints"]]
        press(visitor, 5)
        assert np.allclose(page.evaluate(EYE), places[1])
        press(visitor, 4)
        press(visitor, 4)
        assert np.allclose(page.evaluate(EYE), places[-1])
        press(visitor, 9)
        page.wait_for_selector("#places:not([hidden])")
        press(visitor, 1)
        assert not page.locator("#places").is_visible()
        page.evaluate("unplug()")
        visitor.frames(2)
        looks = page.evaluate("looks")
        visitor.frames(5)
        assert page.evaluate("looks") == looks


def test_cameras_of_eyes_and_their_union() -> None:
    """The cameras of the page project as the matrices of WebXR; the union has all that eyes see."""
    actual = json.loads(node.run(HERE / "eyes.mjs", PAGE))
    assert actual["projected"] < 1e-12
    assert actual["heading"] < 1e-12
    assert actual["outside"] == 0
    assert actual["widest"] < 0.1, "no farther behind the eyes than they are apart"


def test_sessions_that_fail_and_canted_displays() -> None:
    """A session that cannot begin or draw says why, ends, and leaves the page as it was; the view of
    the policy looks where the head does, whatever the displays do."""
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
        page.click("nav .vr")
        visitor.until("ptmHeadset.frames > 3")
        left, right = halves(visitor)
        assert shift(left, right) > 0, "things are farther left for the right eye"
        page.evaluate("ptmHeadset.apart = 0")
        visitor.frames(3)
        left, right = halves(visitor)
        assert np.abs(left - right).max() < 1
        head = "ptm.walk.drawn.length && ptm.state().pose"
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
        page.evaluate("ptmHeadset.session.end()")
        visitor.frames(2)
        page.evaluate("(pose) => ptm.goTo(pose)", start)
        visitor.complete()
        assert np.array_equal(visitor.picture(), alone)
        page.set_viewport_size({"width": 300, "height": 240})
        visitor.until("ptm.canvas.width === 300", 20)
