"""The served folder as the checks see it: its files, the hints, and the URLs between files."""

from __future__ import annotations

import os
import posixpath
import re
import stat
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

from ptmtools.diagnostics import Findings, Issue, Place
from ptmtools.files import open_regular
from ptmtools.output.emitter import Emitter
from ptmtools.store.layout import SERVED
from ptmtools.texture.model import Limits

#: zlib's window size for a stream with the header and the checksum of gzip.
_GZIP = 16 + zlib.MAX_WBITS
#: A path as a relative reference may have it (RFC 3986); all else is percent-encoded there.
_PATH = re.compile(r"(?:[A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-Fa-f]{2})+")
_ABSOLUTE = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:|//")
_LIMITS = Limits()

#: An object of the hints that matches its schema and whose indices are in range.
Row = Mapping[str, Any]


def served_files(folder: Path, findings: Findings) -> list[str]:
    """The files below the served folder, relative to it, sorted.

    A link to a file inside the folder counts as a file. Other links and special files are reported
    and left out; links to folders are not followed.
    """
    top = os.path.realpath(folder)
    if folder.is_symlink():
        findings.place(SERVED).add("PTM-D657", f"is a link to {top}")
    files: list[str] = []
    folders = [""]
    while folders:
        below = folders.pop()
        try:
            with os.scandir(folder / below) as scanned:
                entries = sorted(scanned, key=lambda entry: entry.name)
        except FileNotFoundError:
            continue
        except OSError as fault:
            message = f"cannot be read ({fault.strerror or fault})"
            findings.place(f"{SERVED}/{below}").add("PTM-D651", message)
            continue
        for entry in entries:
            path = f"{below}{entry.name}"
            at = findings.place(f"{SERVED}/{path}")
            target = os.path.realpath(entry.path) if entry.is_symlink() else top
            if not Path(target).is_relative_to(top):
                at.add("PTM-D657", f"is a link to {os.readlink(entry.path)}")
            elif entry.is_dir(follow_symlinks=False):
                folders.append(f"{path}/")
            elif os.path.isfile(entry):
                files.append(path)
            else:
                at.add("PTM-D657", f"is {_kind(entry)}")
    return sorted(files)


def _kind(entry: os.DirEntry[str]) -> str:
    try:
        mode = entry.stat().st_mode
    except OSError:
        return "a broken link"
    if stat.S_ISDIR(mode):
        return "a link to a folder"
    return "a pipe" if stat.S_ISFIFO(mode) else "a device"


def check_names(files: Iterable[str], findings: Findings) -> None:
    """Reports names, also of folders, that are equal on file systems that ignore case."""
    known: dict[str, str] = {}
    for file in files:
        parts = file.split("/")
        for depth in range(1, len(parts) + 1):
            path = "/".join(parts[:depth])
            similar = known.setdefault(path.casefold(), path)
            if similar != path:
                known[path.casefold()] = path
                findings.place(f"{SERVED}/{path}").add("PTM-D675", f"there is {similar} too")


def check_gzip(copy: bytes, original: bytes | None, at: Place) -> None:
    """Checks a gzip copy against the original's bytes, None if that is missing. At most one byte
    more than the original is inflated."""
    if original is None:
        at.add("PTM-D676", "there is no such file without .gz")
        return
    inflater = zlib.decompressobj(_GZIP)
    try:
        plain = inflater.decompress(copy, len(original) + 1)
    except zlib.error as fault:
        at.add("PTM-D676", f"damaged ({fault})")
        return
    if plain != original:
        at.add("PTM-D676", "differs from the file without .gz")
    elif not inflater.eof:
        at.add("PTM-D676", "is truncated")
    elif inflater.unused_data:
        at.add("PTM-D676", "has bytes after its end")


@dataclass(frozen=True)
class ReadHints:
    """The usable part of the hints.

    Attributes
    ----------
    index: the object in `hints.json`.
    paths: for each cell the path of its record in the served folder, present or not.
    records: for each cell its record, or None if it is missing or invalid.
    """

    index: Row
    paths: Sequence[str]
    records: Sequence[Row | None]

    def urls(self, form: str) -> list[str] | None:
        """The URLs of the cells' geometry in a form; None if the index does not name the form."""
        template: str | None = self.index["geometry"].get(form)
        return None if template is None else self.cell_urls(template)

    def cell_urls(self, template: str) -> list[str]:
        """The URLs of the cells by a template."""
        return [template.replace("{name}", cell["name"]) for cell in self.index["cells"]]

    def usable_records(self) -> Iterator[tuple[int, Row]]:
        """The usable records with their cells' numbers."""
        return ((i, record) for i, record in enumerate(self.records) if record is not None)


class ServedDatabase:
    """All files read from a served folder. Paths are relative to that folder.

    Attributes
    ----------
    folder: the served folder.
    files: all paths.
    limits: of the check.
    contents: for each file that could be read its header if it is a `.ptm`, (width, height) of a
        served image, and the result of the form's reader of other files.
    hints: None without a readable index.
    named: the files that some URL names.
    forms: the emitters of `--format`.
    """

    def __init__(
        self,
        folder: Path,
        files: Iterable[str],
        findings: Findings,
        limits: Limits = _LIMITS,
    ) -> None:
        self.folder, self.limits = folder, limits
        self.files = set(files)
        self.contents: dict[str, Any] = {}
        self.hints: ReadHints | None = None
        self.named: set[str] = set()
        self.forms: Iterable[Emitter] = ()
        self._findings = findings
        self._folded = {file.casefold(): file for file in sorted(self.files)}
        self._known: dict[tuple[str, str], tuple[str, str]] = {}

    def take(self, path: str, issues: Iterable[Issue]) -> None:
        """Adds the issues of a folder in the served one that was checked by itself."""
        self._findings.take(replace(i, file=f"{SERVED}/{path}{i.file}") for i in issues)

    def place(self, path: str, place: str = "") -> Place:
        """A place in a served file, to report issues there."""
        return self._findings.place(f"{SERVED}/{path}", place)

    def head(self, path: str, length: int) -> bytes:
        """At most ``length`` first bytes of a served file; empty if it cannot be read."""
        try:
            with open_regular(self.folder / path) as file:
                return file.read(length)
        except OSError:
            return b""

    def resolve(self, path: str, url: str) -> str | None:
        """The served file that a URL in the file ``path`` names; None, with an issue, if there is
        none."""
        key = (posixpath.dirname(path), url)
        if key not in self._known:
            self._known[key] = self._find_file(*key)
        file, fault = self._known[key]
        if fault:
            self.place(path, url).add("PTM-D671", fault)
            return None
        self.named.add(file)
        return file

    def resolve_each(self, path: str, place: str, urls: Iterable[str]) -> list[str | None]:
        """Resolves a list in which no file may be named twice."""
        files = [self.resolve(path, url) for url in urls]
        for file, count in Counter(files).items():
            if file is not None and count > 1:
                self.place(path, place).add("PTM-D671", f"{file} is named {count} times")
        return files

    def _find_file(self, base: str, url: str) -> tuple[str, str]:
        """(path, "") or ("", fault)."""
        if _ABSOLUTE.match(url):
            return "", "is no relative URL"
        if not _PATH.fullmatch(url):
            return "", "is empty or has characters that must be percent-encoded"
        try:
            plain = unquote_to_bytes(url).decode()
        except UnicodeDecodeError:
            return "", "is not percent-encoded UTF-8"
        path = posixpath.normpath(posixpath.join(base, plain))
        if path.startswith(("../", "/")) or path in ("..", ".") or "\\" in path:
            return "", "points outside the served folder"
        if path in self.files:
            return path, ""
        similar = self._folded.get(path.casefold())
        message = f"no such file, but there is {similar}" if similar else "no such file"
        return "", message
