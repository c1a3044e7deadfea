"""Records pictures of a page and the bytes sent, over a link and with an empty cache."""

from __future__ import annotations

import base64
import math
import sys
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.npm import ROOT
from benchmarks.web_rivals.entrants import Entrant
from benchmarks.web_rivals.link import Traffic, shaped
from benchmarks.web_rivals.nginx import Certificate, nginx
from ptmtools.site.throttle import Throttle
from ptmtools_lab.measures import flip

sys.path[:0] = [str(ROOT / "tests" / "e2e")]
from browsers import web  # noqa: E402

#: Pixels of the window.
WIDTH, HEIGHT = 320, 240
#: s for which a page is looked at after it says that it is complete: levels fade in.
SETTLED = 1.0
#: What Chromium remarks of the recorder itself.
RECORDING = "GPU stall due to ReadPixels"

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Timeline:
    """
    Attributes
    ----------
    time: (n,) s since the navigation began, of pictures that differ from those before them.
    sent: (n,) bytes that had arrived by then, heads and TLS included.
    pictures: n of (height, width, 3).
    done, everything: s and bytes until the page was complete, or, with infinite s, until it was
        given up.
    requests, connections: how many.
    messages: what the console complained about.
    """

    time: Floats
    sent: Floats
    pictures: tuple[Picture, ...]
    done: float
    everything: float
    requests: int
    connections: int
    messages: tuple[str, ...]

    @property
    def full(self) -> Picture:
        """The last picture."""
        return self.pictures[-1]

    @property
    def begins(self) -> float:
        """s until something is shown: the first picture is of the empty canvas."""
        return float(self.time[1]) if len(self.time) > 1 else self.done

    def over(self, link: Throttle, other: Throttle) -> Timeline:
        """What it would be over another link than its own, for a page that asks for the same in
        the same order: all bytes take as much longer as the link is thinner."""
        if link.latency != other.latency or not link.bandwidth or not other.bandwidth:
            raise ValueError("links of the same latency, both with a bandwidth")
        longer = 8 / other.bandwidth - 8 / link.bandwidth
        return replace(
            self, time=self.time + longer * self.sent, done=self.done + longer * self.everything
        )

    def continued(self, other: Timeline) -> Timeline:
        """This one, given up, and what comes later in another over the same link."""
        later = other.sent > self.everything
        pictures = (picture for picture, kept in zip(other.pictures, later, strict=True) if kept)
        return replace(
            other,
            time=np.concatenate([self.time, other.time[later]]),
            sent=np.concatenate([self.sent, other.sent[later]]),
            pictures=(*self.pictures, *pictures),
            messages=(*self.messages, *other.messages),
        )

    def until(self, most: float, full: Picture) -> tuple[float, float] | None:
        """Seconds and bytes until the FLIP of all that is shown is ``most`` at most, against the
        full picture; None if the last picture's is more."""
        reached = None
        for k in reversed(range(len(self.pictures))):
            if difference(full, self.pictures[k]) > most:
                break
            reached = float(self.time[k]), float(self.sent[k])
        return reached


def difference(full: Picture, shown: Picture) -> float:
    """FLIP, 0 to 1; 1 for a picture of another size."""
    if full.shape != shown.shape:
        return 1.0
    return flip(full.astype(np.float64), shown.astype(np.float64))


@contextmanager
def chromium(own: Certificate) -> Iterator[Any]:
    """A headless browser that accepts a certificate of our own."""
    from playwright.sync_api import sync_playwright

    flags = [*web.FLAGS[1:], "--hide-scrollbars", own.flag]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=web.chromium(), args=flags)
        try:
            yield browser
        finally:
            browser.close()


def watch(
    browser: Any,
    entrant: Entrant,
    link: Throttle,
    own: Certificate,
    *,
    http: str = "1.1",
    seconds: float = 600,
) -> Timeline:
    """Opens the page of an entrant, waits until it is complete, or so long, and takes what it has
    shown. ``link.latency``: s of a round trip."""
    from playwright.sync_api import TimeoutError as TooLong

    traffic = Traffic()
    script = Path(__file__).with_name("recorder.js").read_text()
    scheme = "https" if http == "2" else "http"
    with nginx(entrant.files, http, own) as server, shaped(server.port, link, traffic) as port:
        context = browser.new_context(viewport={"width": WIDTH, "height": HEIGHT}, bypass_csp=True)
        try:
            context.add_init_script(script.replace("COMPLETE", entrant.complete))
            page, messages = context.new_page(), []
            page.on("console", lambda message: messages.append(f"{message.type}: {message.text}"))
            page.on("pageerror", lambda error: messages.append(f"error: {error}"))
            page.goto(f"{scheme}://127.0.0.1:{port}/", wait_until="commit")
            with suppress(TooLong):
                page.wait_for_function(
                    "window.recorder?.done !== undefined", timeout=1000 * seconds, polling=100
                )
                page.wait_for_timeout(1000 * SETTLED)
            origin, now, done, count = page.evaluate(
                "[performance.timeOrigin, performance.now(), recorder.done ?? null, recorder.count]"
            )
            taken = [page.evaluate("(k) => recorder.packed(k)", k) for k in range(count)]
            requests = server.requests()
        finally:
            context.close()
    stamps = np.array([1e-3 * one["time"] for one in taken])
    clock = 1e-3 * origin - (time.time() - time.monotonic())
    # What was complete may be seen a moment later.
    last = np.array([1e-3 * (done or now), *stamps]).max()
    return Timeline(
        time=stamps,
        sent=traffic.at(clock + stamps),
        pictures=tuple(_unpacked(one) for one in taken),
        done=math.inf if done is None else 1e-3 * done,
        everything=float(traffic.at(np.array([clock + last]))[0]),
        requests=len(requests),
        connections=traffic.connections,
        messages=tuple(text for text in messages if RECORDING not in text),
    )


def _unpacked(packed: dict[str, Any]) -> Picture:
    data = zlib.decompress(base64.b64decode(packed["data"]))
    shape = (packed["height"], packed["width"], 4)
    return np.ascontiguousarray(np.frombuffer(data, np.uint8).reshape(shape)[::-1, :, :3])
