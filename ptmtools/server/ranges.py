"""Byte ranges and conditions of a request (RFC 9110, sections 8.8.3, 12.5.3, 13 and 14)."""

from __future__ import annotations

import re
from dataclasses import dataclass

_RANGE = re.compile(r"bytes[ \t]*=[ \t,]*(\d*)-(\d*)[ \t,]*", re.ASCII | re.IGNORECASE)
_TAG = re.compile(r'(?:W/)?("[^"]*")')
_CODING = re.compile(r"([^\s;,]+)\s*(?:;\s*q\s*=\s*([\d.]+))?", re.ASCII | re.IGNORECASE)
#: More digits than any file's size has.
_DIGITS = 18


@dataclass(frozen=True)
class Part:
    """The bytes [begin, end) of a file of ``whole`` bytes; empty if what was asked for is not in
    it."""

    begin: int
    end: int
    whole: int

    def __len__(self) -> int:
        return self.end - self.begin

    @property
    def content_range(self) -> str:
        """As the header says it."""
        if not self:
            return f"bytes */{self.whole}"
        return f"bytes {self.begin}-{self.end - 1}/{self.whole}"


def asked_part(header: str | None, whole: int) -> Part | None:
    """What ``Range`` asks for of a file of ``whole`` bytes; None for all of it.

    Several ranges, other units and what is malformed count as if there were no such header, which
    RFC 9110 leaves to the server.
    """
    found = _RANGE.fullmatch((header or "").strip())
    if not found or max(map(len, found.groups())) > _DIGITS:
        return None
    first, last = found.groups()
    if not first:
        return Part(max(0, whole - int(last)), whole, whole) if last else None
    if last and int(last) < int(first):
        return None
    begin = min(int(first), whole)
    return Part(begin, min(int(last) + 1, whole) if last else whole, whole)


def still_valid(if_range: str | None, tag: str) -> bool:
    """Whether ``If-Range`` allows to send a part: there is none, or it is this very tag."""
    return if_range is None or if_range.strip() == tag


def has_already(if_none_match: str, tag: str) -> bool:
    """Whether ``If-None-Match`` names the tag, or any."""
    return if_none_match.strip() == "*" or tag in _TAG.findall(if_none_match)


def takes_gzip(accept_encoding: str | None) -> bool:
    """Whether ``Accept-Encoding`` allows gzip."""
    quality = {name.lower(): q or "1" for name, q in _CODING.findall(accept_encoding or "")}
    chosen = quality.get("gzip", quality.get("x-gzip", quality.get("*", "0")))
    return chosen.strip("0.") != ""
