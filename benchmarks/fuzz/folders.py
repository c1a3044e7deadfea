"""Hostile folders of octree textures, campuses and interlaced images.

The index is changed, or a file, often with its checksum corrected in the index. A folder in which
the check finds no issue must be readable. A folder of interlaced images that is accepted although a
file was damaged and the index was not corrected must give the exact image.
"""

from __future__ import annotations

import json
import os
import shutil
import zlib
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.fuzz.databases import MODEL, commanded
from benchmarks.fuzz.mutation import NAMES, Case, damaged, dumped, twisted
from benchmarks.fuzz.textures import LIMITS as TEXTURE_LIMITS, sealed_png, textures
from ptmtools.errors import PtmError
from ptmtools.texture import Picture
from ptmtools.texture.model import Limits
from ptmtools_lab.campus.stock import read_stock, read_surfaces, read_textures
from ptmtools_systems.apo import read_mesh, read_octree
from ptmtools_systems.apo.checking import check_folder
from ptmtools_systems.apo.files import INDEX as APO_INDEX
from ptmtools_systems.apo.traversal import look_up
from ptmtools_systems.campus.model import INDEX as CAMPUS_INDEX, SIZES
from ptmtools_systems.campus.validation import check_campus
from ptmtools_systems.interlace import (
    InterlaceOptions,
    deinterlace,
    interlace,
    validate_interlaced,
    write_folder,
)
from ptmtools_systems.interlace.containers import CONTAINERS
from ptmtools_systems.interlace.model import INDEX as INTERLACE_INDEX

LIMITS = Limits(1 << 26)


class Folder:
    """What both have in common; ``index`` is the name of theirs."""

    index = ""
    limit = 4 * LIMITS.decoded_bytes

    def __init__(self, folder: Path, outside: Path) -> None:
        (outside / "secret.glb").write_bytes(b"secret")
        self._folder = folder / "hostile"
        made = self.built(folder)
        self._files = {
            file.relative_to(made).as_posix(): file.read_bytes()
            for file in sorted(made.rglob("*"))
            if file.is_file()
        }
        os.symlink(outside, folder / "away")

    def built(self, folder: Path) -> Path:
        """A sound one."""
        raise NotImplementedError

    def sealed(self, document: Any, name: str, data: bytes) -> None:
        """Writes bytes and checksum of a file to the index."""
        raise NotImplementedError

    def check(self) -> bool:
        """Whether the check of the folder finds nothing."""
        raise NotImplementedError

    def use(self) -> str:
        """Reads all of it as clients do."""
        raise NotImplementedError

    def make(self, rng: Random) -> Case:
        """The index with other values or bytes; or a file damaged, and sealed or not."""
        name = rng.choice((self.index, self.index, *self._files))
        way, sealed = rng.randrange(8), rng.random() < 0.6
        if name != self.index:
            other = rng.choice(list(self._files.values()))
            return Case(damaged(rng, self._files[name], other), (name, sealed, way))
        if rng.random() < 0.3:
            changed = damaged(rng, self._files[name])
        else:
            tree = twisted(rng, json.loads(self._files[name]), (*NAMES, *self._files))
            changed = dumped(rng, tree)
        return Case(changed, (name, False, way))

    def read(self, case: Case) -> str:
        """Checks and reads, or asks a command."""
        name, sealed, way = case.facts
        files = self._files | {name: case.data}
        if sealed:
            document = json.loads(files[self.index])
            self.sealed(document, name, case.data)
            files[self.index] = json.dumps(document).encode()
        shutil.rmtree(self._folder, ignore_errors=True)
        for file, data in files.items():
            path = self._folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        if way == 0:
            return f"info {commanded('info', str(self._folder))[0]}"
        sound = self.check()
        try:
            return self.use()
        except PtmError:
            assert not sound, "the check found nothing in what cannot be read"
            raise


class ApoFolder(Folder):
    """The readers of octree textures."""

    index = APO_INDEX

    def built(self, folder: Path) -> Path:
        """See `Folder.built`."""
        side = 24
        x, z = (k.ravel() for k in np.mgrid[:side, :side] / side)
        y = 0.1 * np.sin(9 * x) * np.cos(7 * z)
        at = np.arange(side * side).reshape(side, side) + 1
        a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
        faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
        rows = [f"v {p:.6f} {q:.6f} {r:.6f}" for p, q, r in zip(x, y, z, strict=True)]
        rows += [f"f {i} {j} {k}" for i, j, k in faces.tolist()]
        (folder / "mesh.obj").write_text("\n".join(rows))
        words = ["--faces", "100", "--depth", "6", "--unit", "m", "--up", "y", "-q", "-j", "1"]
        call = ["apo", str(folder / "mesh.obj"), "-o", str(folder / "apo"), *words]
        assert commanded(*call)[0] == 0
        return folder / "apo"

    def sealed(self, document: Any, name: str, data: bytes) -> None:
        """See `Folder.sealed`: of the mesh; levels have checksums of what is in them."""
        if name == document["mesh"]["file"]:
            document["mesh"] |= {"bytes": len(data), "crc32": zlib.crc32(data)}

    def check(self) -> bool:
        """See `Folder.check`."""
        return not check_folder(self._folder, LIMITS).issues

    def use(self) -> str:
        """See `Folder.use`."""
        octree, mesh = read_octree(self._folder), read_mesh(self._folder)
        actual = look_up(octree, (mesh.points - octree.low) / octree.side)
        assert np.isfinite(actual.normals).all()
        return f"{octree.levels} levels"


class CampusFolder(Folder):
    """The readers of campuses."""

    index = CAMPUS_INDEX

    def built(self, folder: Path) -> Path:
        """See `Folder.built`."""
        model = Path(shutil.copytree(MODEL, folder / "model"))
        words = ["--lightmaps", "none", "--unit", "m", "--up", "y", "-q", "-j", "1"]
        call = ["campus", str(model / "two_rooms.obj"), "-o", str(folder / "campus"), *words]
        assert commanded(*call)[0] == 0
        return folder / "campus"

    def sealed(self, document: Any, name: str, data: bytes) -> None:
        """See `Folder.sealed`."""
        meshes = [mesh for each in document["objects"] for mesh in each["meshes"]]
        for row in (*meshes, *document["textures"]):
            if row["file"] == name:
                row |= {"bytes": len(data), "crc32": zlib.crc32(data)}

    def check(self) -> bool:
        """See `Folder.check`."""
        return not check_campus(self._folder, LIMITS).issues

    def use(self) -> str:
        """See `Folder.use`."""
        stock = read_stock(self._folder)
        faces = [len(read_surfaces(self._folder, stock, level).corner) for level in (0, -1)]
        read_textures(self._folder, stock, SIZES[0])
        return f"{len(faces)} levels"


class Interlaced:
    """The readers of interlaced images: joining, the check and the command."""

    limit = 2 * TEXTURE_LIMITS.decoded_bytes

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
        name = rng.choice((INTERLACE_INDEX, INTERLACE_INDEX, *files))
        way = rng.randrange(8)
        sealed = False
        if name != INTERLACE_INDEX:
            changed = damaged(rng, files[name], rng.choice(list(files.values())))
            sealed = rng.random() < 0.6
            if sealed and name.endswith("png") and rng.random() < 0.7:
                changed = sealed_png(changed)
        elif rng.random() < 0.3:
            changed = damaged(rng, files[INTERLACE_INDEX])
        else:
            others = (*NAMES, "1.png", "9.webp", "2.jpg")
            tree = twisted(rng, json.loads(files[INTERLACE_INDEX]), others)
            changed = dumped(rng, tree)
        return Case(changed, (which, name, sealed, way))

    def read(self, case: Case) -> str:
        """Joins, checks, or asks a command."""
        which, name, sealed, way = case.facts
        files = self._sets[which] | {name: case.data}
        if sealed:
            document = json.loads(files[INTERLACE_INDEX])
            for entry in document["files"]:
                if entry["name"] == name:
                    entry |= {"bytes": len(case.data), "crc32": zlib.crc32(case.data)}
            files[INTERLACE_INDEX] = json.dumps(document).encode()
        self._folder.mkdir(exist_ok=True)
        for old in self._folder.iterdir():
            old.unlink()
        for file, data in files.items():
            (self._folder / file).write_bytes(data)
        if way == 0:
            return f"info {commanded('info', str(self._folder))[0]}"
        report = validate_interlaced(self._folder, TEXTURE_LIMITS)
        try:
            actual = deinterlace(self._folder, limits=TEXTURE_LIMITS)
        except PtmError:
            assert report.issues, "the check found nothing in what cannot be joined"
            raise
        if actual.tobytes() == self._exact[which]:
            return "exact"
        assert sealed or name == INTERLACE_INDEX, "a wrong image"
        assert actual.nbytes <= TEXTURE_LIMITS.decoded_bytes
        return f"another image of {np.dtype(actual.dtype)}"
