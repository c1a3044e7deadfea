"""The Content-Security-Policy of a page, written into it: static hosts send no such header.

A page runs the scripts of its own site and those whose digests are listed, and nothing else, even
if a text of the site were markup. It connects to its own site only.
"""

from __future__ import annotations

import re
from base64 import b64encode
from hashlib import sha256

#: Scripts and styles in the page; data blocks have a type and do not run.
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_STYLE = re.compile(r"<style>(.*?)</style>", re.DOTALL)
_CHARSET = '<meta charset="utf-8">\n'


def secured(page: str, *, framed: bool = False) -> str:
    """A page with its policy, at the beginning of its head. ``framed``: it shows documents of
    others in frames, which inherit the policy; their styles, fonts and sounds are in them."""
    begin, charset, rest = page.partition(_CHARSET)
    policy = policy_of(page, framed=framed)
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
    return begin + charset + meta + rest


def policy_of(page: str, *, framed: bool = False) -> str:
    """The policy of a page. One without scripts of its own runs none."""
    scripts, styles = (
        [f"'sha256-{_digest(text)}'" for text in kind.findall(page)] for kind in (_SCRIPT, _STYLE)
    )
    rules = {"default-src": ["'none'"]}
    if '<script type="module"' in page:
        rules["script-src"] = ["'self'", "'wasm-unsafe-eval'", *scripts]
        rules["worker-src"] = rules["connect-src"] = ["'self'"]
    rules["style-src"] = ["'unsafe-inline'"] if framed else styles
    rules["img-src"] = ["'self'", "data:", "blob:"]
    rules["media-src"] = ["'self'", "data:"] if framed else ["'self'"]
    if framed:
        rules["font-src"] = ["data:"]
    if '<link rel="manifest"' in page:
        rules["manifest-src"] = ["'self'"]
    rules["base-uri"] = rules["form-action"] = ["'none'"]
    return "; ".join(f"{name} {' '.join(values)}" for name, values in rules.items() if values)


def _digest(text: str) -> str:
    return b64encode(sha256(text.encode()).digest()).decode()
