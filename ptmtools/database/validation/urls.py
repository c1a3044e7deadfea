"""The URLs that served files name each other by."""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Iterable
from urllib.parse import unquote_to_bytes

from ptmtools.database.names import CELL_FOLDER
from ptmtools.database.validation.findings import Findings
from ptmtools.store.layout import SERVED

#: A path as a relative reference may have it (RFC 3986); all else is percent-encoded there.
_PATH = re.compile(r"(?:[A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-Fa-f]{2})+")
_ELSEWHERE = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:|//")


class Urls:
    """Finds the files that URLs name.

    Parameters
    ----------
    files: all that is served, relative to the served folder.
    """

    def __init__(self, files: Iterable[str], found: Findings) -> None:
        self._found = found
        self.files = set(files)
        self._folded = {file.casefold(): file for file in sorted(self.files)}
        self._known: dict[tuple[str, str], tuple[str, str, str]] = {}
        #: The files that some URL names.
        self.named: set[str] = set()

    def resolve(self, file: str, url: str) -> str | None:
        """The file that a URL names, relative to the served folder; None, and a finding, if
        there is none. ``file`` has the URL in it and is named relative to the database."""
        base = file.removeprefix(f"{SERVED}/").rpartition("/")[0]
        key = (base, url)
        if key not in self._known:
            self._known[key] = self._find(base, url)
        path, code, message = self._known[key]
        if code:
            self._found.add(code, file, url, message)
            return None
        self.named.add(path)
        return path

    def resolve_each(self, file: str, place: str, urls: Iterable[str]) -> list[str | None]:
        """The same for a list in which no file is to be named twice."""
        paths = [self.resolve(file, url) for url in urls]
        for path, count in Counter(paths).items():
            if path is not None and count > 1:
                self._found.add("PTM-D674", file, place, f"{path} is named {count} times")
        return paths

    def _find(self, base: str, url: str) -> tuple[str, str, str]:
        """(path, code, message): a path, or what is wrong."""
        if _ELSEWHERE.match(url):
            return "", "PTM-D670", "leads elsewhere"
        if not _PATH.fullmatch(url):
            return "", "PTM-D673", "is empty or has characters that belong percent-encoded"
        try:
            plain = unquote_to_bytes(url).decode()
        except UnicodeDecodeError:
            return "", "PTM-D673", "is not UTF-8 behind its percent signs"
        path = posixpath.normpath(posixpath.join(base, plain))
        if path.startswith(("../", "/")) or path in ("..", ".") or "\\" in path:
            return "", "PTM-D670", "leads out of the served folder"
        if path in self.files:
            return path, "", ""
        code = "PTM-D672" if path.startswith(f"{CELL_FOLDER}/") else "PTM-D671"
        other = self._folded.get(path.casefold())
        return "", code, f"no such file, but there is {other}" if other else "no such file"
