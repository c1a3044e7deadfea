"""The HTML by which another page shows a walk (docs/formats/embedding.md)."""

from __future__ import annotations

import html
from base64 import b64encode
from hashlib import sha384

#: Stands for the address of a site that is unknown.
UNKNOWN = "https://SITE/"
#: What a page in a frame of another origin may use only with permission.
ALLOWED = "fullscreen; gamepad; xr-spatial-tracking; clipboard-write"


def frame_tag(title: str, address: str = "") -> str:
    """A frame that shows a site, of a page's ``title``. ``address``: of its folder, with a slash at
    the end."""
    return (
        f'<iframe src="{html.escape(address or UNKNOWN)}" title="{html.escape(title)}" '
        f'allow="{ALLOWED}" loading="lazy" width="960" height="540"></iframe>'
    )


def element_tags(title: str, script: str, data: bytes, address: str = "") -> str:
    """The element ``<ptm-walk>`` and its script, of this name and contents. Browsers do not run a
    script with other contents (W3C Subresource Integrity)."""
    site = html.escape(address or UNKNOWN)
    digest = b64encode(sha384(data).digest()).decode()
    return (
        f'<script type="module" src="{site}{script}" integrity="sha384-{digest}" '
        f'crossorigin="anonymous"></script> '
        f'<ptm-walk src="{site}" title="{html.escape(title)}"></ptm-walk>'
    )
