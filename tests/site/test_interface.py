"""The interface by keyboard, mouse and touch, on a desktop and on a phone."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import pytest

from tests.site.browser import FRAMES
from tests.site.interface import own_page, visit, visit_by

DESKTOP, PHONE = (1280, 720), (390, 844)
Pose = dict[str, Any]


@pytest.fixture(scope="module")
def window(chromium: Any) -> Iterator[Any]:
    """The page of all visits by `desk`."""
    with own_page(chromium, size=DESKTOP) as page:
        yield page


@pytest.fixture
def desk(window: Any) -> Iterator[Any]:
    with visit_by(window):
        window.wait_for_function("window.fake")
        window.evaluate("fake.emit('first-picture')")
        yield window


@pytest.fixture
def phone(chromium: Any) -> Iterator[Any]:
    with visit(chromium, size=PHONE, has_touch=True, is_mobile=True) as page:
        page.wait_for_function("window.fake")
        page.evaluate("fake.emit('first-picture')")
        yield page


def pose(page: Any) -> Pose:
    actual: Pose = page.evaluate("fake.walker.pose")
    return actual


def held(page: Any, *keys: str, frames: int = 20) -> tuple[Pose, Pose]:
    """The poses before and after keys are held; the visitor stands at both times."""
    before = pose(page)
    for key in keys:
        page.keyboard.down(key)
    page.evaluate(FRAMES, frames)
    for key in reversed(keys):
        page.keyboard.up(key)
    page.evaluate(FRAMES, 2)
    page.wait_for_function("fake.walker.still")
    return before, pose(page)


def ahead(before: Pose, after: Pose) -> tuple[float, float]:
    """Metres forward and to the right, as the visitor looked before."""
    x, _, z = (b - a for a, b in zip(before["eye"], after["eye"], strict=True))
    sin, cos = math.sin(before["yaw"]), math.cos(before["yaw"])
    return -x * sin - z * cos, x * cos - z * sin


@pytest.mark.parametrize(
    ("keys", "forward", "right"),
    [
        (["w"], 1, 0),
        (["ArrowUp"], 1, 0),
        (["s"], -1, 0),
        (["ArrowDown"], -1, 0),
        (["q"], 0, -1),
        (["e"], 0, 1),
        (["Shift", "ArrowLeft"], 0, -1),
        (["Shift", "ArrowRight"], 0, 1),
    ],
)
def test_keys_walk(desk: Any, keys: list[str], forward: int, right: int) -> None:
    before, after = held(desk, *keys)
    there = ahead(before, after)
    assert [0 if abs(way) < 1e-4 else math.copysign(1, way) for way in there] == [forward, right]
    assert after["yaw"] == before["yaw"]


def test_keys_turn_and_look(desk: Any) -> None:
    for key, name, sign in [
        ("a", "yaw", 1),
        ("ArrowLeft", "yaw", 1),
        ("d", "yaw", -1),
        ("ArrowRight", "yaw", -1),
        ("PageUp", "pitch", 1),
        ("PageDown", "pitch", -1),
    ]:
        before, after = held(desk, key)
        assert (after[name] - before[name]) * sign > 0.05
        assert after["eye"] == before["eye"]


#: Metres per second, of a visitor who has walked for a while.
SPEED = """
async () => {
  const frame = () => new Promise(requestAnimationFrame);
  for (let k = 20; k--;) await frame();
  const begun = await frame(), [x, , z] = fake.walker.pose.eye;
  for (let k = 10; k--;) await frame();
  const [u, , w] = fake.walker.pose.eye;
  return Math.hypot(u - x, w - z) / ((await frame()) - begun);
}
"""


def test_running_is_faster_and_letting_go_stops(desk: Any) -> None:
    speeds = []
    for keys in (["s"], ["Shift", "w"]):
        for key in keys:
            desk.keyboard.down(key)
        speeds.append(desk.evaluate(SPEED))
        for key in keys[::-1]:
            desk.keyboard.up(key)
        desk.evaluate(FRAMES, 2)
        desk.wait_for_function("fake.walker.still")
    assert speeds[1] > 1.5 * speeds[0]
    desk.keyboard.down("w")
    desk.evaluate(FRAMES, 10)
    desk.evaluate("dispatchEvent(new Event('blur'))")
    desk.wait_for_function("fake.walker.still")
    before = pose(desk)
    desk.evaluate(FRAMES, 10)
    assert pose(desk) == before
    desk.keyboard.up("w")


def test_a_shortcut_of_the_browser_is_no_step(desk: Any) -> None:
    before, after = held(desk, "Control", "w")
    assert after == before


def test_the_picture_is_dragged(desk: Any) -> None:
    """What is under the pointer stays there: 60° are the height of the window."""
    before = pose(desk)
    desk.mouse.move(600, 300)
    desk.mouse.down()
    desk.mouse.move(700, 340, steps=5)
    desk.mouse.up()
    desk.mouse.move(200, 200)
    desk.evaluate(FRAMES, 5)
    after = pose(desk)
    assert after["yaw"] - before["yaw"] == pytest.approx(100 / 720 * math.pi / 3)
    assert after["pitch"] - before["pitch"] == pytest.approx(40 / 720 * math.pi / 3)
    assert after["eye"] == before["eye"]


class Fingers:
    """Touches of a screen."""

    def __init__(self, page: Any) -> None:
        self.session = page.context.new_cdp_session(page)

    def __call__(self, kind: str, *points: tuple[float, float]) -> None:
        touches = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        event = {"type": f"touch{kind}", "touchPoints": touches}
        self.session.send("Input.dispatchTouchEvent", event)


def test_a_thumb_walks(phone: Any) -> None:
    fingers, stick = Fingers(phone), phone.locator("#stick")
    before = pose(phone)
    fingers("Start", (200, 500))
    assert stick.is_visible()
    fingers("Move", (200, 420))
    eye = "fake.walker.pose.eye"
    phone.wait_for_function(
        f"([x, , z]) => Math.hypot({eye}[0] - x, {eye}[2] - z) > 0.4", arg=before["eye"]
    )
    fingers("End")
    forward, right = ahead(before, pose(phone))
    assert forward > 0.3
    assert right == pytest.approx(0, abs=1e-9)
    assert not stick.is_visible()

    before = pose(phone)
    fingers("Start", (200, 500))
    fingers("Move", (140, 503))
    phone.wait_for_function("(yaw) => fake.walker.pose.yaw > yaw + 0.2", arg=before["yaw"])
    fingers("End")


def test_two_fingers_look(phone: Any) -> None:
    fingers = Fingers(phone)
    before = pose(phone)
    fingers("Start", (150, 500))
    fingers("Start", (150, 500), (250, 500))
    fingers("Move", (150, 560), (250, 560))
    phone.evaluate(FRAMES, 5)
    fingers("End")
    after = pose(phone)
    assert after["pitch"] - before["pitch"] == pytest.approx(60 / 844 * math.pi / 3, rel=0.02)
    assert ahead(before, after) == pytest.approx((0, 0), abs=0.05)


FOCUS = """() => {
  const { outlineStyle, outlineWidth } = getComputedStyle(document.activeElement);
  const { tagName, labels, textContent } = document.activeElement;
  const name = tagName === "BODY" ? tagName : labels?.[0]?.textContent || textContent || "canvas";
  return { name, visible: outlineStyle !== "none" && outlineWidth !== "0px" };
}"""


def test_the_keyboard_is_enough(desk: Any) -> None:
    """Tab leads to every control, and the focus is seen on each."""
    for name in ("Places", "Map", "Details", "Help"):
        desk.get_by_role("button", name=name, exact=True).press("Enter")
    # Their script is loaded with the first of them.
    for place in ("#places ol button", "#details input", "#map canvas"):
        desk.locator(place).first.wait_for(state="visible")
    desk.locator("#view").focus()
    reached: list[str] = []
    while (focus := desk.evaluate(FOCUS))["name"] not in ["BODY", *reached]:
        assert focus["visible"], focus["name"]
        reached.append(focus["name"])
        desk.keyboard.press("Tab")
    controls = "button, input, select, canvas[tabindex], section[tabindex]"
    usable = desk.locator(controls).filter(visible=True).count()
    assert len(reached) == usable > 15
    reported = " ".join(reached)
    for name in ("canvas", "Gallery", "Data saver", "Texture memory", "Policy", "Compare"):
        assert name in reported


def test_settings(desk: Any) -> None:
    desk.keyboard.press("Backquote")
    panel = desk.locator("#details")
    assert panel.is_visible()
    panel.get_by_role("switch", name="Data saver").press("Space")
    panel.get_by_role("slider", name="Texture memory").press("ArrowRight")
    assert not panel.get_by_role("slider", name="Patience").is_visible()
    panel.get_by_role("combobox", name="Policy").select_option("paper")
    panel.get_by_role("slider", name="Patience").press("Home")
    panel.get_by_role("button", name="Freeze").press("Enter")
    assert not desk.get_by_text("full resolution").is_visible()
    panel.get_by_role("button", name="Compare").press("Space")
    assert desk.get_by_text("full resolution").is_visible()
    panel.get_by_role("button", name="Compare").press("Space")
    assert not desk.get_by_text("full resolution").is_visible()
    memory, *rest = desk.evaluate("fake.calls.filter(([name]) => name === 'setBudget')")
    assert rest == []
    assert memory[1] == pytest.approx(64 * 2**20 * math.sqrt(2))
    others = desk.evaluate("fake.calls.filter(([name]) => name !== 'setBudget')")
    assert others == [
        ["setDataSaver", True],
        ["setPolicy", "paper"],
        ["setPatience", 0.0625],
        ["freeze", True],
        ["compare", True],
        ["compare", False],
    ]
    panel.get_by_text("of 91 MiB").wait_for()
    desk.keyboard.press("Escape")
    assert not panel.is_visible()
    assert desk.evaluate("document.activeElement.textContent") == "Details"


def test_arrows_on_a_slider_do_not_walk(desk: Any) -> None:
    desk.keyboard.press("Backquote")
    desk.locator("#details").get_by_role("slider", name="Texture memory").focus()
    before, after = held(desk, "ArrowUp")
    assert after == before


def test_places(desk: Any) -> None:
    desk.get_by_role("button", name="Places").press("Enter")
    desk.get_by_role("button", name="Gallery").press("Enter")
    desk.wait_for_function("fake.walker.pose.eye.join() === '-2,1.6,-8'")
    assert desk.locator("#places img").count() == 3
    desk.wait_for_function("location.hash === '#-2,1.6,-8,22.9'")


def test_one_panel_at_a_time_on_a_phone(phone: Any) -> None:
    for name in ("Places", "Map", "Details", "Help"):
        phone.get_by_role("button", name=name, exact=True).tap()
        open_now = phone.locator("#panels section").filter(visible=True)
        assert open_now.count() == 1
        box = open_now.bounding_box()
        assert 0 <= box["x"] <= 390 - box["width"]
    for button in phone.locator("nav button").all():
        box = button.bounding_box()
        assert min(box["height"], box["width"]) >= 44
        assert 0 <= box["x"] <= 390 - box["width"]


#: Gives the page another fragment, and waits until it knows.
FOLLOWED = """
(fragment) => new Promise((done) => {
  addEventListener("hashchange", done, { once: true });
  location.hash = fragment;
})
"""


def test_a_link_leads_to_its_place(chromium: Any) -> None:
    with visit(chromium, "/#9,1.6,0.5,90,-10", size=DESKTOP) as page:
        page.wait_for_function("window.fake")
        there = pose(page)
        assert there["eye"] == [9, 1.6, 0.5]
        assert there["yaw"] == pytest.approx(math.pi / 2)
        assert there["pitch"] == pytest.approx(math.radians(-10))
        page.evaluate(FRAMES, 60)
        assert page.evaluate("location.hash") == "#9,1.6,0.5,90,-10"
        for fragment in ("#1,1.6,2,180", "#nowhere"):
            page.evaluate(FOLLOWED, fragment)
            assert pose(page)["eye"] == [1, 1.6, 2]


def test_the_address_follows_seldom(desk: Any) -> None:
    """Not while walking, and at most twice a second."""
    desk.evaluate("""() => {
      window.replaced = [];
      const replace = history.replaceState.bind(history);
      history.replaceState = (...what) => { replaced.push(performance.now()); replace(...what); };
    }""")
    for _ in range(12):
        held(desk, "a", frames=4)
    turned = "(fake.walker.pose.yaw * 180 / Math.PI) % 360 - Number(location.hash.split(',')[3])"
    desk.wait_for_function(f"Math.abs({turned}) < 0.1")
    desk.evaluate(FRAMES, 60)
    times = desk.evaluate("replaced")
    assert times
    assert len(times) <= 1 + (times[-1] - times[0]) / 450
    assert re.fullmatch(r"#0,1\.6,4,[\d.]+", desk.evaluate("location.hash"))


def test_copy_link(chromium: Any) -> None:
    """Where the clipboard may be written it is; elsewhere the link is shown, selected."""
    with visit(chromium, size=DESKTOP) as page:
        page.wait_for_function("window.fake")
        page.get_by_role("button", name="Copy link").press("Enter")
        field = page.get_by_role("textbox", name="Link to this place")
        assert field.input_value().endswith("/#0,1.6,4,22.9")
        page.evaluate("""() => Object.defineProperty(navigator, "clipboard", {
          value: { writeText: async (text) => { window.copied = text; } },
        })""")
        page.get_by_role("button", name="Copy link").press("Enter")
        page.get_by_text("is copied").wait_for()
        assert page.evaluate("copied").endswith("/#0,1.6,4,22.9")


def test_before_any_script(chromium: Any) -> None:
    """The poster, the title and a bar that moves are in the page as it comes."""
    with visit(chromium, "/bare", size=PHONE, java_script_enabled=False) as page:
        assert page.locator("#poster").is_visible()
        assert page.get_by_role("heading", name="A museum").is_visible()
        assert page.locator("noscript").is_visible()
        assert page.locator("#progress").get_attribute("value") is None


def test_loading(chromium: Any) -> None:
    with visit(chromium, size=DESKTOP) as page:
        page.wait_for_function("window.fake")
        page.evaluate("fake.emit('progress', {stage: 'The first room', loaded: 30, total: 120})")
        assert page.get_by_role("progressbar", name="The first room").evaluate("e => e.value") == 30
        page.evaluate("fake.emit('first-picture')")
        page.locator("#poster").wait_for(state="hidden")
        page.locator("#progress").wait_for(state="hidden")


def test_errors_and_notices(desk: Any) -> None:
    for _ in range(2):
        desk.evaluate("fake.emit('notice', {message: 'This host sends whole files.'})")
    notices = desk.locator("[aria-live=polite]")
    assert notices.inner_text().count("whole files") == 1
    desk.evaluate("fake.emit('error', {code: 'PTM-V103', message: 'data/c1.glb is not there.'})")
    panel = desk.get_by_role("alertdialog")
    for text in ("data/c1.glb is not there.", "publishing it again", "PTM-V103"):
        assert text in panel.inner_text()
    assert desk.evaluate("document.activeElement.textContent") == "Reload"
    desk.evaluate("fake.emit('first-picture')")
    assert not panel.is_visible()
    assert desk.evaluate("document.activeElement.id") == "view"


@pytest.mark.parametrize("motion", ["reduce", "no-preference"])
def test_calm(chromium: Any, motion: str) -> None:
    """Who prefers that nothing moves gets no fading."""
    with visit(chromium, size=DESKTOP, reduced_motion=motion) as page:
        page.wait_for_function("window.fake")
        page.get_by_role("button", name="Places").click()
        page.get_by_role("button", name="Gallery").click()
        fades = page.evaluate("document.querySelector('#view').getAnimations().length")
        assert fades == (motion == "no-preference")


def test_the_map_shows_here_and_what_may_be_seen(desk: Any) -> None:
    desk.get_by_role("button", name="Map").click()
    plan = desk.get_by_label("Plan of storey 1, you are in cell 0")
    plan.wait_for()
    box = plan.evaluate("e => [e.clientWidth, e.clientHeight]")
    scale = (box[0] - 20) / 18

    def color(x: float, z: float) -> list[int]:
        at = [round(10 + scale * (x + 6)), round(10 + scale * (z + 14))]
        actual: list[int] = plan.evaluate(
            """(plan, [x, y]) => {
              const copy = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
              copy.drawImage(plan, -x, -y);
              return [...copy.getImageData(0, 0, 1, 1).data];
            }""",
            at,
        )
        return actual

    hall, cabinet, store = color(-4, -4), color(11, 2), color(11, -13)
    assert hall[0] > hall[2] + 100
    assert cabinet[2] > cabinet[0] + 20
    assert abs(store[0] - store[2]) < 3
    desk.evaluate("fake.app.goTo(3)")
    desk.locator("#map").get_by_text("storey 2 of 2").wait_for()
