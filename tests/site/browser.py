"""A visitor of a site: the page in Chromium, and what the server was asked for."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ptmtools.site.entry import SiteEntry
from ptmtools.site.serving import serving
from ptmtools.site.throttle import Throttle, Visits

#: Said by SwiftShader now and then, even of a page that reads a cleared buffer once.
OF_RENDERER = "GPU stall due to ReadPixels"
#: Counts, by the calls themselves, what textures take: `window.counted`.
COUNTING = """
(() => {
  const prototype = WebGL2RenderingContext.prototype, sizes = new Map();
  const texel = { 0x8229: 1, 0x822B: 2, 0x8058: 4 };
  const counted = (window.counted = { bytes: 0, peak: 0, stripe: 0, others: [] });
  const bound = (gl) => gl.getParameter(gl.TEXTURE_BINDING_2D);
  const wrap = (name, before) => {
    const call = prototype[name];
    prototype[name] = function (...given) {
      before(this, ...given);
      return call.apply(this, given);
    };
  };
  wrap("texStorage2D", (gl, target, levels, format, width, height) => {
    let bytes = 0;
    for (let k = 0; k < levels; k++) {
      bytes += Math.max(1, width >> k) * Math.max(1, height >> k) * texel[format];
    }
    sizes.set(bound(gl), bytes);
    counted.bytes += bytes;
    counted.peak = Math.max(counted.peak, counted.bytes);
  });
  wrap("deleteTexture", (gl, texture) => {
    counted.bytes -= sizes.get(texture) ?? 0;
    sizes.delete(texture);
  });
  wrap("texSubImage2D", (gl, ...given) => {
    counted.stripe = Math.max(counted.stripe, given[8]?.byteLength ?? 0);
  });
  for (const name of ["texImage2D", "texImage3D", "texStorage3D", "generateMipmap"]) {
    wrap(name, () => counted.others.push(name));
  }
})();
"""
#: Pauses between requests, and the patience with a host, are a tenth.
HURRY = """
{
  const wait = window.setTimeout;
  window.setTimeout = (call, ms, ...more) => wait(call, ms >= 500 ? ms / 10 : ms, ...more);
}
"""
FRAMES = """
async (count) => { while (count--) await new Promise(requestAnimationFrame); }
"""
#: Of all but the canvas, and the outline that it has with the focus.
HIDING = """
body > *:not(canvas) { visibility: hidden !important }
canvas { outline: none !important }
"""


@dataclass
class Visitor:
    """A page that is open.

    Attributes
    ----------
    page: playwright's.
    url: of the site.
    visits: what the server was asked for.
    messages: what the console said.
    """

    page: Any
    url: str
    visits: Visits
    messages: list[str] = field(default_factory=list)

    def hear(self, message: str) -> None:
        """What the console says, but for what the software renderer says of itself."""
        if OF_RENDERER not in message:
            self.messages.append(message)

    def state(self) -> dict[str, Any]:
        """`window.ptm.state()`."""
        actual: dict[str, Any] = self.page.evaluate("window.ptm?.state() ?? {}")
        return actual

    def until(self, condition: str, seconds: float = 120) -> dict[str, Any]:
        """Waits for a condition, an expression of ``s``, the state; TimeoutError if it never is."""
        late, pause = time.monotonic() + seconds, 0.01
        while True:
            state = "window.ptm?.state() ?? {}"
            # Before the page has begun there is no `ptm`.
            tried = f"try {{ return Boolean({condition}) }}"
            failed = "catch (fault) { if (window.ptm) throw fault }"
            holds = self.page.evaluate(f"((s) => {{ {tried} {failed} }})({state})")
            if holds:
                return self.state()
            if time.monotonic() > late:
                raise TimeoutError(f"never {condition}: {self.state()}; {self.messages}")
            time.sleep(pause)
            pause = min(0.1, 1.5 * pause)

    def complete(self) -> dict[str, Any]:
        """Waits until nothing is missing for the present view."""
        # What was asked for a moment ago is not complete because of the moment before.
        self.frames(2)
        return self.until("s.complete")

    def frames(self, count: int) -> None:
        """Waits for ``count`` frames of the page."""
        self.page.evaluate(FRAMES, count)

    def walk_to_a_wall(self) -> None:
        """Waits until keys that are held lead no further."""
        eye = "window.ptm.state().pose.eye"
        before, after = [], self.page.evaluate(eye)
        while not np.allclose(before or np.inf, after, rtol=0, atol=1e-3):
            self.frames(10)
            before, after = after, self.page.evaluate(eye)

    def go(self, viewpoint: int) -> dict[str, Any]:
        """To a viewpoint; the state once everything is there."""
        self.until("s.complete !== undefined")  # the index is there
        self.page.evaluate("(place) => window.ptm.goTo(place)", viewpoint)
        return self.complete()

    def lose_context(self) -> None:
        """The graphics context goes, as when a driver is restarted."""
        self.page.evaluate(
            "(window.lost = window.ptm.walk.gl.getExtension('WEBGL_lose_context')).loseContext()"
        )
        self.until("s.residentBytes === 0")

    def restore_context(self) -> None:
        """It comes back; textures are on their way."""
        self.page.evaluate("window.lost.restoreContext()")
        self.until("s.residentBytes > 0")

    def picture_of(
        self, shows: Callable[[NDArray[np.uint8]], bool], seconds: float = 60
    ) -> NDArray[np.uint8]:
        """The first picture that shows something; the last one, if none does in time."""
        late = time.monotonic() + seconds
        while not shows(picture := self.picture()) and time.monotonic() < late:
            self.frames(2)
        return picture

    def picture(self) -> NDArray[np.uint8]:
        """(height, width, 3) of the canvas alone, as it is drawn next."""
        return image_of(self.page.locator("canvas").first.screenshot(style=HIDING))


def image_of(png: bytes) -> NDArray[np.uint8]:
    """(height, width, 3)."""
    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGB"))


def hurried(page: Any) -> None:
    """For `visiting`: a page whose files fail gives up soon."""
    page.add_init_script(HURRY)


@contextmanager
def visiting(
    browser: Any,
    entries: Mapping[str, SiteEntry],
    *,
    query: str = "",
    width: int = 640,
    height: int = 480,
    throttle: Throttle | None = None,
    prepare: Any = None,
    **context: Any,
) -> Iterator[Visitor]:
    """Opens a site with an empty cache.

    Parameters
    ----------
    query: behind the URL. width, height: of the window.
    prepare: called with the page before it is opened.
    context: options of playwright's context.
    """
    page = new_page(browser, width, height, prepare, **context)
    with _visiting(page, entries, query, throttle, page.context.close) as visitor:
        yield visitor


def new_page(
    browser: Any, width: int = 640, height: int = 480, prepare: Any = None, **context: Any
) -> Any:
    """A page with a context of its own, for `visiting_in`; the rest as for `visiting`."""
    # Conditions of playwright are texts, which a page with a policy does not run.
    options = {"viewport": {"width": width, "height": height}, "bypass_csp": True, **context}
    page = browser.new_context(**options).new_page()
    page.add_init_script(COUNTING)
    if prepare:
        prepare(page)
    return page


def visiting_in(
    page: Any,
    entries: Mapping[str, SiteEntry],
    *,
    query: str = "",
    throttle: Throttle | None = None,
) -> AbstractContextManager[Visitor]:
    """Leads a page to a site, and away from it in the end: a page takes longer to start than a
    small site to come. Each site has another origin, so that nothing of the one before is left."""
    return _visiting(page, entries, query, throttle, lambda: page.goto("about:blank"))


@contextmanager
def _visiting(
    page: Any,
    entries: Mapping[str, SiteEntry],
    query: str,
    throttle: Throttle | None,
    leave: Callable[[], object],
) -> Iterator[Visitor]:
    visits = Visits()
    with serving(entries, throttle=throttle, visits=visits) as url:
        visitor = Visitor(page, url, visits)

        def hear(said: Any) -> None:
            visitor.hear(f"{said.type}: {said.text}")

        def fail(fault: Any) -> None:
            visitor.messages.append(f"error: {fault}")

        page.on("console", hear)
        page.on("pageerror", fail)
        try:
            page.goto(url + query)
            yield visitor
        finally:
            leave()
            if not page.is_closed():
                page.remove_listener("console", hear)
                page.remove_listener("pageerror", fail)
