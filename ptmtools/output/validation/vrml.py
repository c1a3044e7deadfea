"""The check of the VRML files: text that a browser can parse to its end, and the URLs in it.

All else in them, such as indices, colours and hulls, is a matter of the emitter and its tests.
"""

from __future__ import annotations

import re

from ptmtools.output.model import FileError
from ptmtools.output.names import HINTS, VRML
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.vrml import HEADER

_STRING = r'"(?:[^"\\]|\\.)*+"'
#: What brackets and URLs stand between: strings, comments, and quotation marks without a pair.
_TOKEN = re.compile(rf'{_STRING}|#[^\r\n]*+|[][{{}}"]', re.DOTALL)
_URLS = re.compile(rf"\b(?:url|cellUrl|adjacentUrl|visibleUrl)\s++\[((?:{_STRING}|[\s,])*+)", re.S)
_OPENED = {"]": "[", "}": "{"}


def read_file(path: str, data: bytes) -> tuple[str, ...] | None:
    """The URLs in a VRML file, in order, each once; None of other files.

    Raises FileError PTM-D661: not UTF-8, not VRML97, or brackets and strings that do not end.
    """
    if not path.endswith(".wrl"):
        return None
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as fault:
        raise FileError("PTM-D661", f"byte {fault.start}", "not UTF-8") from fault
    if not text.startswith(HEADER):
        raise FileError("PTM-D661", "line 1", f"the first line is not {HEADER.strip()!r}")
    opened: list[str] = []
    for token in _TOKEN.finditer(text):
        sign = token.group()
        if sign in ("[", "{"):
            opened.append(sign)
        elif sign == '"' or (sign in _OPENED and opened[-1:] != [_OPENED[sign]]):
            line = 1 + text.count("\n", 0, token.start())
            raise FileError("PTM-D661", f"line {line}", f"{sign!r} without its pair")
        elif sign in _OPENED:
            opened.pop()
    if opened:
        raise FileError("PTM-D661", "", f"ends inside of {opened[-1]!r}")
    lists = (match.group(1) for match in _URLS.finditer(text))
    return tuple(dict.fromkeys(s[1:-1] for urls in lists for s in re.findall(_STRING, urls)))


def check_files(database: ServedDatabase) -> None:
    """Checks the URLs, and that the hints name the cells."""
    for path, urls in database.contents.items():
        if path.endswith(".wrl"):
            for url in urls:
                database.resolve(path, url)
    if database.hints:
        database.resolve_each(HINTS, "cells", database.hints.urls(VRML) or [])
