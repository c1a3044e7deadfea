"""A site for other programs: what link previews and search engines read, and the manifest with the
icons of a site that a visitor installs.

Open Graph (https://ogp.me) and the web application manifest (https://www.w3.org/TR/appmanifest).
Programs that show links need absolute URLs, so the address of the site is an option. Nothing in a
site keeps search engines away. Last, the HTML by which another page shows a walk
(docs/formats/embedding.md).
"""

from __future__ import annotations

import io
import json
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha384
from html import escape
from typing import Any

import numpy as np

MANIFEST, MANIFEST_MEDIA = "manifest.webmanifest", "application/manifest+json"
#: Pixels of a side of the icons.
ICONS = (192, 512)
#: The colours of the page: background, wall, light; 0 to 255.
_GROUND, _WALL, _LIGHT = (22, 23, 27), (58, 61, 70), (255, 199, 102)
#: Samples of a pixel, each way.
_FINER = 2
#: Places that a description names.
_PLACES = 6
#: Stands for the address of a site that is unknown.
UNKNOWN = "https://SITE/"
#: What a page in a frame of another origin may use only with permission.
ALLOWED = "fullscreen; gamepad; xr-spatial-tracking; clipboard-write"


@dataclass(frozen=True)
class About:
    """A site for other programs.

    Attributes
    ----------
    title: of the site. description: one sentence, or "".
    picture: URL of a picture relative to the page, or "".
    address: URL of the folder of the site, or "" if it is unknown.
    """

    title: str
    description: str = ""
    picture: str = ""
    address: str = ""

    def lines(self) -> Iterator[str]:
        """The elements in the head of the page."""
        base = folder_of(self.address)
        if base:
            yield f'<link rel="canonical" href="{escape(base)}">'
            yield _property("url", base)
        yield from self.texts()
        if self.picture:
            yield _property("image", base + self.picture)
        yield f'<link rel="manifest" href="{MANIFEST}">'

    def texts(self) -> Iterator[str]:
        """Those of title and description."""
        yield _property("title", self.title)
        if self.description:
            both = 'name="description" property="og:description"'
            yield f"<meta {both} {_content(self.description)}>"


def folder_of(address: str) -> str:
    """An address with a slash at its end; "" stays."""
    return f"{address.rstrip('/')}/" if address else ""


def description_of(
    viewpoints: Sequence[Mapping[str, Any]], rename: Callable[[str], str] = lambda name: name
) -> str:
    """The places of a building as a description; ``rename``: their names in the model → those that
    visitors see."""
    names = dict.fromkeys(rename(row["description"]) for row in viewpoints if row["description"])
    return ", ".join([*names][:_PLACES])


def manifest_of(title: str, icons: Mapping[int, str]) -> bytes:
    """The manifest of a site; ``icons``: pixels of a side → URL."""
    color = "#{:02x}{:02x}{:02x}".format(*_GROUND)
    document = {
        "name": title,
        "start_url": ".",
        "scope": ".",
        "display": "standalone",
        "theme_color": color,
        "background_color": color,
        "icons": [
            {"src": url, "sizes": f"{size}x{size}", "type": "image/png", "purpose": "any maskable"}
            for size, url in icons.items()
        ],
    }
    return json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode()


@cache
def icon(size: int) -> bytes:
    """A PNG of ``size`` pixels a side: a lit doorway with an arch, and its light on the floor. It
    lies in the middle 80 %, so that a system may cut the icon to any form."""
    from PIL import Image

    side = size * _FINER
    place = (np.arange(side) + 0.5) / side
    x, y = np.abs(place[None, :] - 0.5), place[:, None]
    floor, spring, half = 0.66, 0.40, 0.15
    wall = (x < 0.34) & (y > 0.17) & (y < floor)
    arch = (np.hypot(x, y - spring) < half) | ((x < half) & (y > spring) & (y < floor))
    glow = (y >= floor) & (y < 0.84) & (x < half + (y - floor) * 0.9)
    pixels = np.empty((side, side, 3), np.uint8)
    pixels[:] = _GROUND
    pixels[np.broadcast_to(wall, (side, side))] = _WALL
    pixels[glow] = np.add(_GROUND, np.subtract(_LIGHT, _GROUND) * 0.45).astype(np.uint8)
    pixels[arch] = _LIGHT
    out = io.BytesIO()
    image = Image.fromarray(pixels).resize((size, size), Image.Resampling.BOX)
    image.save(out, "PNG", optimize=True)
    return out.getvalue()


def _property(name: str, text: str) -> str:
    return f'<meta property="og:{name}" {_content(text)}>'


def _content(text: str) -> str:
    return f'content="{escape(text)}"'


def frame_tag(title: str, address: str = "") -> str:
    """A frame that shows a site, of a page's ``title``. ``address``: of its folder, with a slash at
    the end."""
    return (
        f'<iframe src="{escape(address or UNKNOWN)}" title="{escape(title)}" '
        f'allow="{ALLOWED}" loading="lazy" width="960" height="540"></iframe>'
    )


def element_tags(title: str, script: str, data: bytes, address: str = "") -> str:
    """The element ``<ptm-walk>`` and its script, of this name and contents. Browsers do not run a
    script with other contents (W3C Subresource Integrity)."""
    site = escape(address or UNKNOWN)
    digest = b64encode(sha384(data).digest()).decode()
    return (
        f'<script type="module" src="{site}{script}" integrity="sha384-{digest}" '
        f'crossorigin="anonymous"></script> '
        f'<ptm-walk src="{site}" title="{escape(title)}"></ptm-walk>'
    )
