"""X_ITE in headless Chromium: the pictures of a file's viewpoints, as a web page shows them.

The page binds one viewpoint after the other, as a script in the scene would, and, once nothing is
loading any more and two pictures in a row are equal, hands over the canvas as PNG. So nothing
waits for a guessed time: Chromium's virtual time and its own ``--screenshot`` fire before WebGL
has drawn.

X_ITE's own TextureQuality, MEDIUM, picks single texels of a pyramid's levels, which sparkle; the
page asks for HIGH, which blends them as view3dscene does. X_ITE makes a texture of its own for
every ImageTexture node, so each cell of the sample museum has its own, 179 in all: 1 GB at 1024².
Fallback images of ``--fallback-size 256`` are for such browsers.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from benchmarks.npm import X_ITE
from browsers import web

#: The viewpoint after the bound one, as by Page Down.
NEXT = ">"
ROOT = Path(__file__).resolve().parents[3]

PAGE = """\
<style>x3d-canvas {{ display: block; width: {width}px; height: {height}px }}</style>
<x3d-canvas preserveDrawingBuffer="true" splashScreen="false" notifications="false"
            contextMenu="false" contentScale="1" antialiased="{smooth}"></x3d-canvas>
<!-- After the element: X_ITE reads preserveDrawingBuffer once, when the element is made. -->
<script src="/x_ite/x_ite.min.js"></script>
<script>
// To the next viewpoint X_ITE flies for a second.
const FLIGHT = 1500;
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
(async () => {{
  const canvas = document.querySelector("x3d-canvas");
  while (!canvas.browser) await pause(20);
  const browser = canvas.browser, pictures = [];
  let menu = [];
  const steady = async () => {{
    let last = "", picture = "";
    do {{
      last = picture;
      for (let k = 0; k < 3; ++k) await browser.nextFrame();
      await pause(150);
      picture = canvas.toDataURL("image/png");
    }} while (picture !== last);
    return picture;
  }};
  try {{
    browser.setBrowserOption("TextureQuality", "HIGH");
    await browser.loadURL(new X3D.MFString({url}));
    menu = browser.getActiveLayer().getUserViewpoints().map(
      (viewpoint) => viewpoint.getDescriptions().join(" "));
    for (const name of {names}) {{
      if (name === ">") {{
        browser.nextViewpoint();
        await pause(FLIGHT);
      }} else if (name !== null) browser.currentScene.getNamedNode(name).set_bind = true;
      pictures.push(await steady());
    }}
  }} catch (fault) {{
    await post("/say", `error: ${{fault}}`);
  }}
  await post("/done", JSON.stringify({{ pictures, menu }}));
}})();
</script>
"""


@dataclass(frozen=True)
class Shots:
    """What a page showed.

    Attributes
    ----------
    pictures: one PNG file's bytes for each viewpoint asked for; fewer if something failed.
    menu: the descriptions of the viewpoints that X_ITE offers, in its order.
    messages: the lines of the console.
    """

    pictures: tuple[bytes, ...]
    menu: tuple[str, ...]
    messages: tuple[str, ...]


def missing() -> str | None:
    """What to install first, or None."""
    lacking = [] if web.chromium() else ["apt install chromium"]
    lacking += [remedy] if (remedy := X_ITE.remedy()) else []
    return "; ".join(lacking) or None


def show(
    path: Path,
    viewpoints: Sequence[str | None] = (None,),
    *,
    width: int = 640,
    height: int = 480,
    smooth: bool = True,
    seconds: float = 300,
) -> Shots:
    """Shows a file, whose folder is served with all that is below it.

    A picture is taken of each of the ``viewpoints``: DEF names, `NEXT`, or None for what shows;
    ``smooth`` is X_ITE's antialiasing, on unless a page turns it off.
    Raises FileNotFoundError without Chromium or X_ITE, TimeoutError if no pictures come.
    """
    if remedy := missing():
        raise FileNotFoundError(remedy)
    page = web.REPORTING + PAGE.format(
        width=width,
        height=height,
        smooth=json.dumps(smooth),
        url=json.dumps(f"/db/{quote(path.name)}"),
        names=json.dumps(list(viewpoints)),
    )
    folders = {"x_ite": X_ITE.folder / "dist", "db": path.parent}
    seen = web.visit(page, folders, width=width, height=height, seconds=seconds)
    answer = json.loads(seen.body)
    return Shots(
        pictures=tuple(base64.b64decode(p.partition(",")[2]) for p in answer["pictures"]),
        menu=tuple(answer["menu"]),
        messages=tuple(seen.messages),
    )
