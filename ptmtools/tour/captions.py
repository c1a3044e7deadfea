"""The text of captions (WebVTT), for visitors who read instead of listening."""

from __future__ import annotations

import re
from html import unescape

_TIMES = re.compile(r"^\s*(?:\d+:)?\d\d:\d\d\.\d{3}\s+-->")
_MARKUP = re.compile(r"<[^>]*>")


def transcript_of(captions: str) -> str:
    """The lines of all cues, without times, markup, notes and styles."""
    lines: list[str] = []
    for block in re.split(r"\n\s*\n", captions.replace("\r\n", "\n").replace("\r", "\n")):
        rows = block.split("\n")
        start = next((k for k, row in enumerate(rows) if _TIMES.match(row)), None)
        if start is not None:
            lines += (unescape(_MARKUP.sub("", row)).strip() for row in rows[start + 1 :])
    return " ".join(filter(None, lines))
