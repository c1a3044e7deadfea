"""One file of a database at a time: compared with its hash, and read as what its name says."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ptmtools.database.emitters import GZIP, owner_of
from ptmtools.database.validation.files import check_gzip
from ptmtools.database.validation.findings import Findings
from ptmtools.database.validation.textures import ReadTexture, read_png, read_texture
from ptmtools.files import open_regular
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
    intact: whether its hash is the one in the manifest.
    texture: of a `.ptm` that could be read.
    held: of an emitter's file what its check needs, if that could be read.
    unreadable: whether it is of a kind that is read, and was not.
    """

    found: Findings = field(default_factory=Findings)
    size: int | None = None
    intact: bool = False
    texture: ReadTexture | None = None
    held: object | None = None
    unreadable: bool = False


class FileReader:
    """Reads the files of a database; from several threads, if need be.

    Parameters
    ----------
    outputs: what the stages wrote, relative to the database, with the hashes.
    served: what is served, relative to the served folder.
    """

    def __init__(
        self, folder: Path, outputs: Mapping[str, str], served: Collection[str], limits: Limits
    ) -> None:
        self._folder = folder
        self._outputs = outputs
        self._served = served
        self._limits = limits

    def read(self, name: str) -> FileReading:
        """A file, named relative to the database."""
        reading = FileReading()
        served = name.startswith(f"{SERVED}/")
        if served and name.removeprefix(f"{SERVED}/") not in self._served:
            # What is there and is no file has been found already.
            if not os.path.lexists(self._folder / name):
                reading.found.add("PTM-D651", name, "", "missing")
            return reading
        try:
            size, data, digest = self._content(name)
        except FileNotFoundError:
            reading.found.add("PTM-D651", name, "", "missing")
            return reading
        except OSError as fault:
            reading.found.add("PTM-D654", name, "", f"cannot be read ({fault.strerror or fault})")
            return reading
        reading.size = size
        reading.intact = self._outputs.get(name) == digest
        if self._outputs and name not in self._outputs:
            reading.found.add("PTM-D653", name, "", "lies among our files, but no stage wrote it")
        elif self._outputs.get(name, digest) != digest:
            reading.found.add("PTM-D652", name, "", "not what its stage wrote: the hash differs")
        if data is None:
            reading.unreadable = True
            reading.found.add("PTM-D713", name, "", f"{size} bytes")
        elif served:
            with np.errstate(all="ignore"):
                self._look_into(reading, name, data, digest)
        return reading

    def _content(self, name: str) -> tuple[int, bytes | None, str]:
        """Size, bytes if that is no more than the limit, and SHA-256 of a file."""
        with open_regular(self._folder / name) as file:
            size = os.fstat(file.fileno()).st_size
            if size <= self._limits.decoded_bytes:
                data = file.read(size)
                return len(data), data, hashlib.sha256(data).hexdigest()
            digest = hashlib.sha256()
            while piece := file.read(_PIECE):
                digest.update(piece)
            return size, None, digest.hexdigest()

    def _look_into(self, reading: FileReading, name: str, data: bytes, digest: str) -> None:
        found, (stem, suffix) = reading.found, os.path.splitext(name)
        emitter = owner_of(name.removeprefix(f"{SERVED}/"))
        if suffix == GZIP:
            check_gzip(data, self._neighbour(stem), name, found)
        elif suffix == ".ptm":
            fallback = self._neighbour(f"{stem}.png")
            reading.texture = read_texture(data, digest, fallback, name, self._limits, found)
            reading.unreadable = reading.texture is None
        elif suffix == ".png" and not self._is_served(f"{stem}.ptm"):
            read_png(data, name, self._limits, found)
        elif emitter is not None:
            reading.held = emitter.read(name, data, found)
            reading.unreadable = reading.held is None

    def _is_served(self, name: str) -> bool:
        return name.removeprefix(f"{SERVED}/") in self._served

    def _neighbour(self, name: str) -> bytes | None:
        """The bytes of another served file, if it can be had."""
        try:
            return self._content(name)[1] if self._is_served(name) else None
        except OSError:
            return None
