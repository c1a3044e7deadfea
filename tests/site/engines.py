"""Firefox and WebKitGTK, driven by WebDriver under Xvfb: headless, neither of them has WebGL 2.

Firefox takes the commands of WebDriver over Marionette, a protocol of its own that needs no driver;
WebKitGTK has a driver, which takes them over HTTP.
"""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from browser import COUNTING, HIDING, Visitor, image_of
from numpy.typing import NDArray

from ptmtools.site.entry import SiteEntry
from ptmtools.site.serving import serving
from ptmtools.site.throttle import Throttle, Visits

#: Debian's package of each engine, and a program of it.
PACKAGES = {
    "firefox": ("firefox-esr", "firefox-esr"),
    "webkit": ("webkit2gtk-driver", "WebKitWebDriver"),
}
#: Nothing but the page is fetched, and nothing is asked at the first start.
PREFERENCES = {
    "marionette.port": 0,
    "app.normandy.enabled": False,
    "app.update.disabledForTesting": True,
    "browser.aboutwelcome.enabled": False,
    "browser.newtabpage.enabled": False,
    "browser.safebrowsing.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.page": 0,
    "datareporting.policy.dataSubmissionEnabled": False,
    "extensions.systemAddon.update.enabled": False,
    "extensions.update.enabled": False,
    "focusmanager.testmode": True,  # no window manager gives it the keyboard
    "media.gmp-manager.updateEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "services.settings.server": "data:,",
    "toolkit.telemetry.reportingpolicy.firstRun": False,
    "ui.prefersReducedMotion": 1,
}
#: A value, what a promise gives, or what a function makes of the argument.
SCRIPT = """
const [given, done] = arguments, made = async () => {
  const value = (%s);
  return typeof value === "function" ? value(given) : value;
};
made().then((value) => done(JSON.stringify([value ?? null])), (error) => done(String(error)));
"""
#: Of keys without a character.
KEYS = {
    "Tab": "\ue004", "Enter": "\ue007", "Shift": "\ue008", "Escape": "\ue00c",
    "ArrowLeft": "\ue012", "ArrowUp": "\ue013", "ArrowRight": "\ue014", "ArrowDown": "\ue015",
}  # fmt: skip
#: Keeps what the console says: `window.said`.
SAYING = """
window.said = [];
for (const kind of ["warn", "error"]) {
  const say = console[kind];
  console[kind] = (...what) => { said.push(`${kind}: ${what.join(" ")}`); say(...what); };
}
addEventListener("error", ({ message }) => said.push(`error: ${message}`));
addEventListener("unhandledrejection", ({ reason }) => said.push(`error: ${reason}`));
"""
#: Tells a page that no graphics card draws, as Firefox does. Of a campus with smooth edges, a visit
#: takes WebKitGTK four times as long.
WITHOUT_CARD = """
{
  const of = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return options?.failIfMajorPerformanceCaveat ? null : of.call(this, kind, options);
  };
}
"""
#: Seconds in which a program starts.
START = 60
#: Path and method of each command over HTTP, under its name in Marionette.
PATHS = {
    "WebDriver:Navigate": ("POST", "url"),
    "WebDriver:ExecuteAsyncScript": ("POST", "execute/async"),
    "WebDriver:PerformActions": ("POST", "actions"),
    "WebDriver:ReleaseActions": ("DELETE", "actions"),
    "WebDriver:TakeScreenshot": ("GET", "screenshot"),
    "WebDriver:SetWindowRect": ("POST", "window/rect"),
    "WebDriver:SetTimeouts": ("POST", "timeouts"),
    "WebDriver:DeleteSession": ("DELETE", ""),
}
#: Fingers without a driver, whose pointers no element can capture.
TOUCHING = """
async (fingers) => {
  const view = document.querySelector("#view");
  view.setPointerCapture = () => {};
  const send = (kind, step) => fingers.forEach((places, number) => {
    const [clientX, clientY] = places[Math.min(step, places.length - 1)];
    const more = { bubbles: true, pointerId: 100 + number, pointerType: "touch" };
    view.dispatchEvent(new PointerEvent(`pointer${kind}`, { clientX, clientY, ...more }));
  });
  send("down", 0);
  for (let step = 1; step < Math.max(...fingers.map((places) => places.length)); step++) {
    await new Promise(requestAnimationFrame);
    send("move", step);
  }
  send("up", Infinity);
}
"""
Command = Callable[[str, dict[str, Any]], Any]


def missing(engine: str) -> str | None:
    """What must be installed first for an engine, or None."""
    package, program = PACKAGES[engine]
    needs = {program: package, "Xvfb": "xvfb"}
    lacking = [name for needed, name in needs.items() if shutil.which(needed) is None]
    return " ".join(lacking) or None


class WebDriverError(Exception):
    """A command that failed."""


class Engine:
    """A browser with one window, in which nothing moves that need not, used as playwright's pages.

    Attributes
    ----------
    name: of the engine. version: as the browser states it.
    """

    def __init__(self, name: str, version: str, command: Command) -> None:
        self.name, self.version, self._command = name, version, command
        command("WebDriver:SetTimeouts", {"script": 120_000, "pageLoad": 60_000})

    def goto(self, url: str) -> None:
        """Opens a page, also one that differs from the present in its fragment alone."""
        self._command("WebDriver:Navigate", {"url": "about:blank"})
        self._command("WebDriver:Navigate", {"url": url})

    def evaluate(self, script: str, argument: Any = None) -> Any:
        """The value of an expression, of its promise, or of its function of the argument."""
        words = {"script": SCRIPT % script, "args": [argument], "sandbox": None}
        reported = self._command("WebDriver:ExecuteAsyncScript", words)
        if not reported.startswith("["):
            raise WebDriverError(reported)
        return json.loads(reported)[0]

    def press(self, *keys: str) -> None:
        """Presses keys one after the other and lets go of them."""
        for key in keys:
            self.hold(key)
            self.release(key)

    def hold(self, key: str) -> None:
        self._key("keyDown", key)

    def release(self, key: str) -> None:
        self._key("keyUp", key)

    def touch(self, *fingers: Sequence[tuple[int, int]]) -> None:
        """Fingers that go down at the first of their places, pixels, move to the others and go up,
        all at the same time. The driver of WebKitGTK has no fingers: the page gets the events that
        they would cause."""
        if self.name == "webkit":
            self.evaluate(TOUCHING, [[list(place) for place in finger] for finger in fingers])
            return
        sources = []
        for number, (start, *rest) in enumerate(fingers):
            moves = [_moved(place, 50) for place in rest]
            down, up = ({"type": f"pointer{way}", "button": 0} for way in ("Down", "Up"))
            actions = [_moved(start, 0), down, *moves, up]
            words = {"type": "pointer", "id": f"finger{number}", "actions": actions}
            sources.append({**words, "parameters": {"pointerType": "touch"}})
        self._command("WebDriver:PerformActions", {"actions": sources})

    def release_all(self) -> None:
        """Lets go of the keys that are still held."""
        self._command("WebDriver:ReleaseActions", {})

    def _key(self, kind: str, key: str) -> None:
        actions = [{"type": kind, "value": KEYS.get(key, key)}]
        source = {"type": "key", "id": "keyboard", "actions": actions}
        self._command("WebDriver:PerformActions", {"actions": [source]})

    def resize(self, width: int, height: int) -> None:
        """Makes the window so large that the page has this size in pixels."""
        inner = "[outerWidth - innerWidth, outerHeight - innerHeight]"
        late = time.monotonic() + START
        while self.evaluate("[innerWidth, innerHeight]") != [width, height]:
            if time.monotonic() > late:
                raise TimeoutError(f"the window never has {width} × {height} pixels")
            x, y = self.evaluate(inner)
            rect = {"x": 0, "y": 0, "width": width + x, "height": height + y}
            self._command("WebDriver:SetWindowRect", rect)
            time.sleep(0.1)

    def screenshot(self) -> bytes:
        """A PNG of the page as it is seen."""
        return base64.b64decode(self._command("WebDriver:TakeScreenshot", {"full": False}))


def _moved(place: tuple[int, int], milliseconds: int) -> dict[str, Any]:
    x, y = place
    return {"type": "pointerMove", "x": x, "y": y, "duration": milliseconds}


@contextmanager
def launched(engine: str) -> Iterator[Engine]:
    """Starts a browser on a screen of its own.

    Raises FileNotFoundError without it, WebDriverError or TimeoutError if it does not start.
    """
    with ExitStack() as stack:
        folder = stack.enter_context(
            tempfile.TemporaryDirectory(prefix=f"{engine}-", ignore_cleanup_errors=True)
        )
        environment = {**os.environ, "HOME": folder, "DISPLAY": stack.enter_context(_screen())}
        start = _firefox if engine == "firefox" else _webkit
        version, command = stack.enter_context(start(Path(folder), environment))
        yield Engine(engine, version, command)


@contextmanager
def _running(command: list[str], **options: Any) -> Iterator[subprocess.Popen[bytes]]:
    """A program that is ended with all that it starts."""
    quiet: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    process = subprocess.Popen(command, start_new_session=True, **{**quiet, **options})
    try:
        yield process
    finally:
        # Profile and screen are its own: nothing is lost.
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@contextmanager
def _screen() -> Iterator[str]:
    """The name of a display that no other has."""
    reading, writing = os.pipe()
    options = ["-displayfd", str(writing), "-screen", "0", "1600x1200x24", "-nolisten", "tcp"]
    with os.fdopen(reading) as numbers, _running(["Xvfb", *options], pass_fds=[writing]):
        os.close(writing)
        number = numbers.readline().strip()
        if not number:
            raise WebDriverError("Xvfb does not start")
        yield f":{number}"


def _until(ready: Callable[[], Any], what: str) -> Any:
    """The first answer that is not None."""
    late = time.monotonic() + START
    while (answer := ready()) is None:
        if time.monotonic() > late:
            raise TimeoutError(f"{what} does not start")
        time.sleep(0.05)
    return answer


@contextmanager
def _firefox(folder: Path, environment: dict[str, str]) -> Iterator[tuple[str, Command]]:
    """Its version, and how it takes commands."""
    profile = folder / "profile"
    profile.mkdir()
    lines = [f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in PREFERENCES.items()]
    (profile / "user.js").write_text("\n".join(lines))
    command = ["firefox-esr", "--marionette", "--no-remote", "--profile", str(profile)]

    def port() -> int | None:
        file = profile / "MarionetteActivePort"
        text = file.read_text() if file.exists() else ""
        return int(text) if text else None

    with _running(command, env=environment):
        address = "127.0.0.1", _until(port, "Firefox")
        with socket.create_connection(address, timeout=150) as connection:
            marionette = _Marionette(connection)
            session = marionette("WebDriver:NewSession", {})
            yield session["capabilities"]["browserVersion"], marionette


class _Marionette:
    """Messages: a length, :, and JSON of [0, number, name, words] or [1, number, error, result]."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection, self._stream, self._number = connection, connection.makefile("rb"), 0
        self._receive()  # what the browser is

    def _receive(self) -> Any:
        digits = b""
        while (digit := self._stream.read(1)) != b":":
            if not digit:
                raise WebDriverError("Firefox has ended")
            digits += digit
        return json.loads(self._stream.read(int(digits)))

    def __call__(self, name: str, words: dict[str, Any]) -> Any:
        self._number += 1
        message = json.dumps([0, self._number, name, words]).encode()
        self._connection.sendall(b"%d:%b" % (len(message), message))
        _, _, error, result = self._receive()
        if error:
            raise WebDriverError(f"{name}: {error['message']}")
        return result.get("value", result)


@contextmanager
def _webkit(folder: Path, environment: dict[str, str]) -> Iterator[tuple[str, Command]]:
    """Its version, and how it takes commands."""
    settings = folder / ".config/gtk-3.0/settings.ini"
    settings.parent.mkdir(parents=True)
    settings.write_text("[Settings]\ngtk-enable-animations = false\n")
    (browser,) = Path("/usr/lib").glob("*/webkit2gtk-4.1/MiniBrowser")
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    options = {"binary": str(browser), "args": ["--automation"]}
    wanted = {"alwaysMatch": {"webkitgtk:browserOptions": options}}

    def started() -> Any:
        try:
            return _posted(f"http://127.0.0.1:{port}/session", {"capabilities": wanted})
        except urllib.error.URLError as error:
            if isinstance(error, urllib.error.HTTPError):
                raise WebDriverError(error.read().decode()) from error
            return None

    with _running(["WebKitWebDriver", f"--port={port}"], env=environment):
        session = _until(started, "WebKitWebDriver")
        base = f"http://127.0.0.1:{port}/session/{session['sessionId']}"

        def command(name: str, words: dict[str, Any]) -> Any:
            method, path = PATHS[name]
            try:
                return _posted(f"{base}/{path}".rstrip("/"), words, method)
            except urllib.error.HTTPError as error:
                raise WebDriverError(f"{name}: {error.read().decode()}") from error

        try:
            yield session["capabilities"]["browserVersion"], command
        finally:
            command("WebDriver:DeleteSession", {})


def _posted(url: str, words: dict[str, Any], method: str = "POST") -> Any:
    data = json.dumps(words).encode() if method == "POST" else None
    request = urllib.request.Request(url, data, method=method)
    with urllib.request.urlopen(request, timeout=150) as response:
        return json.load(response)["value"]


class EngineVisitor(Visitor):
    """One whose page is an `Engine`."""

    def picture(self) -> NDArray[np.uint8]:
        style = "document.head.append(Object.assign(document.createElement('style'), "
        self.page.evaluate(f"{style}{{ id: 'hiding', textContent: {json.dumps(HIDING)} }}))")
        shown = image_of(self.page.screenshot())
        self.page.evaluate("document.querySelector('#hiding').remove()")
        return shown


@contextmanager
def visiting_by(
    engine: Engine,
    entries: Mapping[str, SiteEntry],
    *,
    query: str = "",
    width: int = 640,
    height: int = 480,
    throttle: Throttle | None = None,
    prepare: str = "",
    smooth: bool = False,
) -> Iterator[EngineVisitor]:
    """Opens a site, as `browser.visiting`; ``prepare`` is a script that runs before the page's,
    ``smooth`` whether edges may be smooth without a graphics card."""
    visits, page = Visits(), entries["index.html"]
    card = "" if smooth else WITHOUT_CARD
    script = f"<head><script>{COUNTING}{SAYING}{card}{prepare}</script>"
    # The policy of the page refuses the scripts and styles of the tests.
    text = re.sub(r"<meta http-equiv[^>]*>", "", page.read().decode())
    text = text.replace("<head>", script, 1)
    prepared = {**entries, "index.html": replace(page, source=text.encode(), state=None, digest="")}
    with serving(prepared, throttle=throttle, visits=visits) as url:
        visitor = EngineVisitor(engine, url, visits)
        engine.goto(url + query)
        engine.resize(width, height)
        try:
            yield visitor
        finally:
            engine.release_all()
            visitor.messages += engine.evaluate("window.said")
            # The browser stays open, and a page would draw on.
            engine.goto("about:blank")
