"""One file of a database at a time: held against its hash, and read as what its name says."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ptmtools.database.gltf.names import GLTF_FOLDER
from ptmtools.database.names import HINTS
from ptmtools.database.validation.files import TWIN, check_twin
from ptmtools.database.validation.findings import Findings
from ptmtools.database.validation.hints import ReadHints, read_hints
from ptmtools.database.validation.textures import ReadTexture, read_png, read_texture
from ptmtools.database.vrml import Document, WrlError, parse
from ptmtools.files import open_regular
from ptmtools.texture.model import Limits

SERVED = "www"
_WRL_FAULTS = {"encoding": "PTM-D660", "syntax": "PTM-D661", "finite": "PTM-D662"}
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
    document, hints, texture: what it holds, if it is such a file and could be read.
    kept: its bytes, if the check of the glTF files asks for them.
    """

    found: Findings = field(default_factory=Findings)
    size: int | None = None
    intact: bool = False
    document: Document | None = None
    hints: ReadHints | None = None
    texture: ReadTexture | None = None
    kept: bytes | None = None


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
            # What is there and is no file has been told.
            if not os.path.lexists(self._folder / name):
                reading.found.add("PTM-D651", name, "", "missing")
            return reading
        try:
            size, data, digest = self._content(name)
        except FileNotFoundError:
            reading.found.add("PTM-D651", name, "", "missing")
            return reading
        except OSError as fault:
            told = f"cannot be read ({fault.strerror or fault})"
            reading.found.add("PTM-D654", name, "", told)
            return reading
        reading.size = size
        reading.intact = self._outputs.get(name) == digest
        if self._outputs and name not in self._outputs:
            reading.found.add("PTM-D653", name, "", "served, but no stage wrote it")
        elif self._outputs.get(name, digest) != digest:
            reading.found.add("PTM-D652", name, "", "not what its stage wrote: the hash differs")
        if data is None:
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
        found = reading.found
        stem, suffix = os.path.splitext(name)
        if suffix == ".wrl":
            try:
                reading.document = parse(data)
            except WrlError as fault:
                found.add(_WRL_FAULTS[fault.kind], name, fault.place, fault.message)
        elif suffix == ".ptm":
            twin = self._neighbour(f"{stem}.png")
            reading.texture = read_texture(data, digest, twin, name, self._limits, found)
        elif suffix == ".png" and not self._is_served(f"{stem}.ptm"):
            read_png(data, name, self._limits, found)
        elif suffix == TWIN:
            check_twin(data, self._neighbour(stem), name, found)
        elif name == f"{SERVED}/{HINTS}":
            reading.hints = read_hints(data, name, found)
        if name == f"{SERVED}/{HINTS}" or name.startswith(f"{SERVED}/{GLTF_FOLDER}/"):
            reading.kept = data

    def _is_served(self, name: str) -> bool:
        return name.removeprefix(f"{SERVED}/") in self._served

    def _neighbour(self, name: str) -> bytes | None:
        """The bytes of another served file, if it can be had."""
        try:
            return self._content(name)[1] if self._is_served(name) else None
        except OSError:
            return None
