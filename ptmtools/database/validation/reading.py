"""One file of a database at a time: compared with its hash, and read as what its name says."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ptmtools.database.emitters import GZIP, owner_of
from ptmtools.database.fault import FileError
from ptmtools.database.validation.files import check_gzip
from ptmtools.database.validation.findings import CODES
from ptmtools.database.validation.textures import read_png, read_texture
from ptmtools.files import open_regular
from ptmtools.findings import Findings, Place
from ptmtools.store.layout import SERVED
from ptmtools.texture.model import Limits

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
