"""Hostile folders of interlaced images: the manifest, and files, many with the checksum corrected
in the manifest.

A folder that is accepted although a file was damaged, and the manifest was not brought up to date,
must give the exact image.
"""

from __future__ import annotations

import json
import os
import zlib
from pathlib import Path
from random import Random

import numpy as np

from benchmarks.fuzz.databases import commanded
from benchmarks.fuzz.mutation import NAMES, damaged, dumped, twisted
from benchmarks.fuzz.target import Case
from benchmarks.fuzz.textures import LIMITS, sealed_png, textures
from ptmtools.errors import PtmError
from ptmtools.interlace import (
    InterlaceOptions,
    deinterlace,
    interlace,
    validate_interlaced,
    write_folder,
)
from ptmtools.interlace.containers import CONTAINERS
from ptmtools.interlace.model import INDEX
from ptmtools.texture import Picture


class Interlaced:
    """The readers of interlaced images: joining, the check and the command."""

    limit = 2 * LIMITS.decoded_bytes

    def __init__(self, folder: Path, outside: Path) -> None:
        self._folder = folder / "interlaced"
        (outside / "secret.png").write_bytes(b"secret")
        os.symlink(outside, folder / "away")
        self._sets: list[dict[str, bytes]] = []
        self._exact: list[bytes] = []
        for name, container in CONTAINERS.items():
            for _, texels in textures():
                held = texels.shape[2] in container.components
                if not held or texels.dtype.name not in container.kinds:
                    continue
                made = folder / f"{len(self._sets)}"
                write_folder(made, interlace(Picture(texels), InterlaceOptions(4, name)))
                self._exact.append(deinterlace(made).tobytes())
                self._sets.append({file.name: file.read_bytes() for file in sorted(made.iterdir())})

    def make(self, rng: Random) -> Case:
        """The manifest with other values or bytes; or a file damaged, and sealed or not."""
        which = rng.randrange(len(self._sets))
        files = self._sets[which]
        name = rng.choice((INDEX, INDEX, *files))
        way = rng.randrange(8)
        sealed = False
        if name != INDEX:
            changed = damaged(rng, files[name], rng.choice(list(files.values())))
            sealed = rng.random() < 0.6
            if sealed and name.endswith("png") and rng.random() < 0.7:
                changed = sealed_png(changed)
        elif rng.random() < 0.3:
            changed = damaged(rng, files[INDEX])
        else:
            tree = twisted(rng, json.loads(files[INDEX]), (*NAMES, "1.png", "9.webp", "2.jpg"))
            changed = dumped(rng, tree)
        return Case(changed, (which, name, sealed, way))

    def read(self, case: Case) -> str:
        """Joins, checks, or asks a command."""
        which, name, sealed, way = case.told
        files = self._sets[which] | {name: case.data}
        if sealed:
            document = json.loads(files[INDEX])
            for entry in document["files"]:
                if entry["name"] == name:
                    entry |= {"bytes": len(case.data), "crc32": zlib.crc32(case.data)}
            files[INDEX] = json.dumps(document).encode()
        self._folder.mkdir(exist_ok=True)
        for old in self._folder.iterdir():
            old.unlink()
        for file, data in files.items():
            (self._folder / file).write_bytes(data)
        if way == 0:
            return f"info {commanded('info', str(self._folder))[0]}"
        report = validate_interlaced(self._folder, LIMITS)
        try:
            found = deinterlace(self._folder, limits=LIMITS)
        except PtmError:
            assert report.issues, "the check found nothing in what cannot be joined"
            raise
        if found.tobytes() == self._exact[which]:
            return "exact"
        assert sealed or name == INDEX, "a wrong image"
        assert found.nbytes <= LIMITS.decoded_bytes
        return f"another image of {np.dtype(found.dtype)}"
