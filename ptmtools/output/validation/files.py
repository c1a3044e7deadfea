"""What lies in the folder of a database: which files, of which kind, and their gzip copies.

One file of a database at a time: compared with its hash, and read as what its name says.

What has been read of a database's served files, for the emitters' checks, and the URLs that
these files name each other by."""

from __future__ import annotations

import hashlib
import os
import posixpath
import re
import stat
import zlib
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote_to_bytes

import numpy as np

from ptmtools.diagnostics import Findings, Issue, Place
from ptmtools.files import open_regular
from ptmtools.output.emitters import GZIP, owner_of
from ptmtools.output.model import FileError
from ptmtools.output.names import CELL_FOLDER
from ptmtools.output.validation.findings import CODES
from ptmtools.output.validation.textures import ReadTexture, read_png, read_texture
from ptmtools.store.layout import SERVED
from ptmtools.texture.model import Limits

if TYPE_CHECKING:
    from ptmtools.output.validation.hints import ReadHints


#: What zlib calls a stream with the header and the checksum of gzip.
_GZIP = 16 + zlib.MAX_WBITS


def served_files(folder: Path, found: Findings) -> list[str]:
    """The files below the served folder, relative to it, in order.

    A link to a file of the folder counts as a file. All else that is neither a file nor a folder
    is a finding and left out, and no link to a folder is followed.
    """
    top = os.path.realpath(folder)
    if folder.is_symlink():
        found.at(SERVED).add("PTM-D657", f"is a link to {top}")
    files: list[str] = []
    folders = [""]
    while folders:
        below = folders.pop()
        try:
            with os.scandir(folder / below) as entries:
                there = sorted(entries, key=lambda entry: entry.name)
        except FileNotFoundError:
            continue
        except OSError as fault:
            message = f"cannot be read ({fault.strerror or fault})"
            found.at(f"{SERVED}/{below}").add("PTM-D654", message)
            continue
        for entry in there:
            path = f"{below}{entry.name}"
            target = os.path.realpath(entry.path) if entry.is_symlink() else top
            if not Path(target).is_relative_to(top):
                found.at(f"{SERVED}/{path}").add(
                    "PTM-D657", f"is a link to {os.readlink(entry.path)}"
                )
            elif entry.is_dir(follow_symlinks=False):
                folders.append(f"{path}/")
            elif os.path.isfile(entry):
                files.append(path)
            else:
                found.at(f"{SERVED}/{path}").add("PTM-D658", f"is {_kind(entry)}")
    return sorted(files)


def check_names(files: Iterable[str], found: Findings) -> None:
    """Names, folders included, that a file system without regard to case takes for one."""
    known: dict[str, str] = {}
    for file in files:
        parts = file.split("/")
        for depth in range(1, len(parts) + 1):
            path = "/".join(parts[:depth])
            other = known.setdefault(path.casefold(), path)
            if other != path:
                known[path.casefold()] = path
                found.at(f"{SERVED}/{path}").add("PTM-D675", f"there is {other} too")


def check_gzip(copy: bytes, original: bytes | None, at: Place) -> None:
    """A gzip copy beside the bytes of what it is the copy of, None if that is not there. It is
    inflated to one byte more than those at most."""
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
        at.add("PTM-D676", "does not hold what the file without .gz holds")
    elif not inflater.eof:
        at.add("PTM-D676", "is cut short")
    elif inflater.unused_data:
        at.add("PTM-D676", "goes on behind its end")


def _kind(entry: os.DirEntry[str]) -> str:
    try:
        mode = entry.stat().st_mode
    except OSError:
        return "a link to nothing"
    kinds = ((stat.S_ISDIR, "a link to a folder"), (stat.S_ISFIFO, "a pipe"))
    return next((kind for holds, kind in kinds if holds(mode)), "a device")


#: Bytes hashed at a time, of a file that is not held whole.
_PIECE = 1 << 20


@dataclass
class FileReading:
    """What became of a file.

    Attributes
    ----------
    found: what is wrong with it by itself.
    size: bytes; None if it could not be read.
    intact: whether its hash is the one in the manifest, and it could be read as what it is.
    held: of a `.ptm` a `ReadTexture`, of an emitter's file what its check needs, if that could be
        had.
    """

    found: Findings
    size: int | None = None
    intact: bool = False
    held: object | None = None


@dataclass(frozen=True)
class FileReader:
    """Reads the files of a database; from several threads, if need be.

    Attributes
    ----------
    folder: of the database.
    outputs: what the stages wrote, relative to the database, with the hashes.
    served: what is served, relative to the served folder.
    limits: larger files are only hashed.
    """

    folder: Path
    outputs: Mapping[str, str]
    served: Collection[str]
    limits: Limits

    def read(self, name: str) -> FileReading:
        """A file, named relative to the database."""
        found = Findings(CODES)
        reading, at = FileReading(found), found.at(name)
        served = name.startswith(f"{SERVED}/")
        if served and not self._is_served(name):
            # What is there and is no file has been found already.
            if not os.path.lexists(self.folder / name):
                at.add("PTM-D651", "missing")
            return reading
        try:
            size, data, digest = self._content(name)
        except FileNotFoundError:
            at.add("PTM-D651", "missing")
            return reading
        except OSError as fault:
            at.add("PTM-D654", f"cannot be read ({fault.strerror or fault})")
            return reading
        reading.size = size
        reading.intact = self.outputs.get(name) == digest
        if self.outputs and name not in self.outputs:
            at.add("PTM-D653", "lies among our files, but no stage wrote it")
        elif self.outputs.get(name, digest) != digest:
            at.add("PTM-D652", "not what its stage wrote: the hash differs")
        if data is None:
            reading.intact = False
            at.add("PTM-D713", f"{size} bytes")
        elif served:
            with np.errstate(all="ignore"):
                self._look_into(reading, name, data, digest, at)
        return reading

    def _content(self, name: str) -> tuple[int, bytes | None, str]:
        """Size, bytes if that is no more than the limit, and SHA-256 of a file."""
        with open_regular(self.folder / name) as file:
            size = os.fstat(file.fileno()).st_size
            if size <= self.limits.decoded_bytes:
                data = file.read(size)
                return len(data), data, hashlib.sha256(data).hexdigest()
            digest = hashlib.sha256()
            while piece := file.read(_PIECE):
                digest.update(piece)
            return size, None, digest.hexdigest()

    def _look_into(
        self, reading: FileReading, name: str, data: bytes, digest: str, at: Place
    ) -> None:
        stem, suffix = os.path.splitext(name)
        path = name.removeprefix(f"{SERVED}/")
        if suffix == GZIP:
            check_gzip(data, self._neighbour(stem), at)
        elif suffix == ".png" and owner_of(path) is None and not self._is_served(f"{stem}.ptm"):
            read_png(data, self.limits, at)
        elif suffix == ".ptm":
            fallback = self._neighbour(f"{stem}.png")
            reading.held = read_texture(data, digest, fallback, self.limits, at)
            reading.intact &= reading.held is not None
        elif emitter := owner_of(path):
            try:
                reading.held = emitter.read(path, data)
            except FileError as fault:
                at.add(fault.code, fault.message, fault.place)
            reading.intact &= reading.held is not None

    def _is_served(self, name: str) -> bool:
        return name.removeprefix(f"{SERVED}/") in self.served

    def _neighbour(self, name: str) -> bytes | None:
        """The bytes of another served file, if it can be had."""
        try:
            return self._content(name)[1] if self._is_served(name) else None
        except OSError:
            return None


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
        from ptmtools.output.validation.hints import gather

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
