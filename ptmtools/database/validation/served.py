"""What has been read of a database's served files, for the emitters' checks, and the URLs that
these files name each other by."""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote_to_bytes

from ptmtools.database.names import CELL_FOLDER
from ptmtools.database.validation.textures import ReadTexture
from ptmtools.files import open_regular
from ptmtools.findings import Findings, Issue, Place
from ptmtools.store.layout import SERVED
from ptmtools.texture.model import Limits

if TYPE_CHECKING:
    from ptmtools.database.validation.hints import ReadHints

#: A path as a relative reference may have it (RFC 3986); all else is percent-encoded there.
_PATH = re.compile(r"(?:[A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-Fa-f]{2})+")
_LIMITS = Limits()
_ELSEWHERE = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:|//")


class ServedDatabase:
    """Files are named relative to the served folder.

    Attributes
    ----------
    folder: of the files.
    files: all that is served.
    limits: of the check.
    held: what the emitters' readers gave of each of their files; none that gave None.
    textures: of each `.ptm` that could be read.
    named: the files that some URL names.
    """

    def __init__(
        self, folder: Path, files: Iterable[str], found: Findings, limits: Limits = _LIMITS
    ) -> None:
        self.folder, self.limits = folder, limits
        self.files = set(files)
        self.held: dict[str, Any] = {}
        self.textures: dict[str, ReadTexture] = {}
        self.named: set[str] = set()
        self._found = found
        self._folded = {file.casefold(): file for file in sorted(self.files)}
        self._known: dict[tuple[str, str], tuple[str, str, str]] = {}

    @cached_property
    def hints(self) -> ReadHints | None:
        """What the hints say; None if there is no index that can be read. To be asked for when all
        is held."""
        from ptmtools.database.validation.hints import gather

        return gather(self)

    def take(self, path: str, issues: Iterable[Issue]) -> None:
        """What the check of a folder in the served one found, by files of that."""
        self._found.take(replace(i, file=f"{SERVED}/{path}{i.file}") for i in issues)

    def at(self, path: str, place: str = "") -> Place:
        """Who adds what is found in a served file."""
        return self._found.at(f"{SERVED}/{path}", place)

    def head(self, path: str, length: int) -> bytes:
        """So many first bytes of a served file, or all that can be read."""
        try:
            with open_regular(self.folder / path) as file:
                return file.read(length)
        except OSError:
            return b""

    def resolve(self, path: str, url: str) -> str | None:
        """The file that a URL in the file ``path`` names; None, and a finding, if there is none."""
        key = (posixpath.dirname(path), url)
        if key not in self._known:
            self._known[key] = self._find(*key)
        file, code, message = self._known[key]
        if code:
            self.at(path, url).add(code, message)
            return None
        self.named.add(file)
        return file

    def resolve_each(self, path: str, place: str, urls: Iterable[str]) -> list[str | None]:
        """The same for a list in which no file is to be named twice."""
        files = [self.resolve(path, url) for url in urls]
        for file, count in Counter(files).items():
            if file is not None and count > 1:
                self.at(path, place).add("PTM-D674", f"{file} is named {count} times")
        return files

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
