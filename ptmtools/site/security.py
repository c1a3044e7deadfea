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


def secured(page: str) -> str:
    """A page with its policy, at the beginning of its head."""
    begin, charset, rest = page.partition(_CHARSET)
    policy = f'<meta http-equiv="Content-Security-Policy" content="{policy_of(page)}">\n'
    return begin + charset + policy + rest


def policy_of(page: str) -> str:
    """The policy of a page. One without scripts of its own runs none."""
    scripts, styles = (
        [f"'sha256-{_digest(text)}'" for text in kind.findall(page)] for kind in (_SCRIPT, _STYLE)
    )
    rules = {"default-src": ["'none'"]}
    if '<script type="module"' in page:
        rules["script-src"] = ["'self'", "'wasm-unsafe-eval'", *scripts]
        rules["worker-src"] = rules["connect-src"] = ["'self'"]
    rules["style-src"] = styles
    rules["img-src"] = ["'self'", "data:", "blob:"]
    rules["media-src"] = ["'self'"]
    if '<link rel="manifest"' in page:
        rules["manifest-src"] = ["'self'"]
    rules["base-uri"] = rules["form-action"] = ["'none'"]
    return "; ".join(f"{name} {' '.join(values)}" for name, values in rules.items() if values)


def _digest(text: str) -> str:
    return b64encode(sha256(text.encode()).digest()).decode()
