"""The check of a database on disk, or of one `.ptm`: everything that a client may rely on.

Each file is read once, held against the hash in the manifest, and then against the others. The
VRML files and the GLBs are read by `vrml.reader` and `gltf.reader`, which know nothing but what
`emit` writes, JSON by the published schemas; what is found is told with a code of the table in
`findings`. A finding never ends the check: what cannot be read is left out of the comparisons that
need it.

Files are read by several threads, since decoding textures and hashing, most of the work, leave the
interpreter free. Their findings are gathered in the order of the files.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools import schemas
from ptmtools.database.model import ValidationReport
from ptmtools.database.names import CELL_FOLDER, HINTS, ROOT
from ptmtools.database.validation.cells import ReadCell, check_cell, read_cell
from ptmtools.database.validation.counts import check_counts
from ptmtools.database.validation.files import check_names, served_files
from ptmtools.database.validation.findings import Findings
from ptmtools.database.validation.gltf import GltfCheck
from ptmtools.database.validation.hints import (
    Images,
    ReadHints,
    check_against_cells,
    check_hints,
)
from ptmtools.database.validation.lists import check_graph
from ptmtools.database.validation.reading import SERVED, FileReader
from ptmtools.database.validation.root import ReadRoot, check_root, check_viewpoints, read_root
from ptmtools.database.validation.textures import ReadTexture, check_ptm, check_record
from ptmtools.database.validation.urls import Urls
from ptmtools.database.vrml import Document
from ptmtools.errors import DatabaseError, InputError
from ptmtools.files import open_regular
from ptmtools.progress import Progress, silent
from ptmtools.texture.model import Limits
from ptmtools.tolerance import Tolerance

MANIFEST = "manifest.json"
TEXTURE_FOLDER = "textures"
_LIMITS = Limits()


def validate_database(
    db: str | os.PathLike[str],
    progress: Progress = silent,
    *,
    limits: Limits = _LIMITS,
    workers: int = 0,
) -> ValidationReport:
    """Checks a database.

    Parameters
    ----------
    limits: files and textures that take more memory are not looked into (PTM-D713).
    workers: threads; 0 is one for each processor. The report is the same.

    Raises
    ------
    DatabaseError: PTM-D605 if there is no such folder. All else is told in the report.
    """
    folder = Path(db)
    if not folder.is_dir():
        raise DatabaseError(
            "PTM-D605", "no such folder", file=folder, remedy="give a database or a .ptm file"
        )
    check = _Check(folder, limits)
    # Damaged numbers may be anything; what comes of them is compared, not trusted.
    with np.errstate(all="ignore"):
        check.run(progress, workers or os.cpu_count() or 1)
    return ValidationReport(check.found.issues(), check.files, check.bytes)


def validate_ptm(path: str | os.PathLike[str], *, limits: Limits = _LIMITS) -> ValidationReport:
    """Checks a single `.ptm`.

    Raises
    ------
    InputError: PTM-I602 if it cannot be read. All else is told in the report.
    """
    file = Path(path)
    found = Findings()
    try:
        size = os.stat(file).st_size
        if size > limits.decoded_bytes:  # a pipe has none
            found.add("PTM-D713", os.fspath(path), "", f"{size} bytes")
            return ValidationReport(found.issues(), 1, size)
        data = file.read_bytes()
    except OSError as fault:
        raise InputError(
            "PTM-I602",
            f"cannot be read ({fault.strerror or fault})",
            file=file,
            remedy="check the name and the rights",
        ) from fault
    check_ptm(data, os.fspath(path), limits, found)
    return ValidationReport(found.issues(), 1, len(data))


class _Check:
    """One validation of one database."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        self.found = Findings()
        self.files = 0
        self.bytes = 0
        self._folder = folder
        self._limits = limits
        self._outputs: dict[str, str] = {}
        self._stages: dict[str, dict[str, Any]] = {}
        self._sizes: dict[str, int] = {}
        self._served: set[str] = set()
        self._urls = Urls(SERVED, (), self.found)
        self._documents: dict[str, Document] = {}
        self._textures: dict[str, ReadTexture] = {}
        self._cells: dict[str, ReadCell] = {}
        self._hints: ReadHints | None = None
        self._gltf = GltfCheck(SERVED, self.found)

    def run(self, progress: Progress, workers: int) -> None:
        finished = self._read_manifest()
        served = served_files(self._folder / SERVED, SERVED, self.found)
        check_names(served, SERVED, self.found)
        self._served = set(served)
        self._urls = Urls(SERVED, served, self.found)
        self._read_files(progress, workers)
        if not finished and ROOT not in self._served:
            self.found.add("PTM-D655", f"{SERVED}/{ROOT}", "", "the stage `emit` has not run")
            return
        for name in (ROOT, HINTS):
            if name not in self._served and f"{SERVED}/{name}" not in self._outputs:
                self.found.add("PTM-D651", f"{SERVED}/{name}", "", "missing")
        self._check_cells()
        root = self._check_root()
        self._check_hints(root)
        check_counts(self._stages, self._sizes, self._textures, self._documents, self.found)
        self._gltf.compare(self._served, self._documents, self._urls.resolve)
        for name in sorted(self._served - self._urls.named):
            if name.startswith(f"{TEXTURE_FOLDER}/"):
                self.found.add("PTM-D677", f"{SERVED}/{name}", "", "no other file names it")

    def _read_manifest(self) -> bool:
        """Fills in what the stages wrote; whether `emit` was among them."""
        try:
            with open_regular(self._folder / MANIFEST) as file:
                stages = schemas.read(file.read(), schemas.MANIFEST)["stages"]
        except FileNotFoundError:
            self.found.add("PTM-D650", MANIFEST, "", "missing")
            return False
        except OSError as fault:
            self.found.add("PTM-D650", MANIFEST, "", f"cannot be read ({fault.strerror or fault})")
            return False
        except schemas.ShapeError as fault:
            self.found.add("PTM-D650", MANIFEST, fault.place, fault.message)
            return False
        for stage, record in stages.items():
            for name in sorted(self._outputs.keys() & record["outputs"].keys()):
                told = f"another stage has written {name}, too"
                self.found.add("PTM-D650", MANIFEST, f"stages.{stage}", told)
            self._outputs |= record["outputs"]
            self._stages[stage] = record
        for stage, record in stages.items():
            for name, digest in record["inputs"].items():
                if self._outputs.get(name, digest) != digest:
                    told = f"made from an earlier {name}; run build-scene, or the later stages"
                    self.found.add("PTM-D656", MANIFEST, f"stages.{stage}", told)
        return "emit" in stages

    def _read_files(self, progress: Progress, workers: int) -> None:
        from ptmtools.texture.parallel import ordered

        reader = FileReader(self._folder, self._outputs, self._served, self._limits)
        names = sorted(set(self._outputs) | {f"{SERVED}/{name}" for name in self._served})
        for i, reading in enumerate(ordered(reader.read, names, workers)):
            progress(i, len(names), "files")
            name = names[i]
            self.found.take(reading.found.issues())
            if reading.size is None:
                continue
            self.files += 1
            self.bytes += reading.size
            if reading.intact:
                self._sizes[name] = reading.size
            if reading.document is not None:
                self._documents[name] = reading.document
            if reading.texture is not None:
                self._textures[name] = reading.texture
            if reading.hints is not None:
                self._hints = reading.hints
            if reading.kept is not None:
                self._gltf.read(name, reading.kept)
        progress(len(names), len(names), "files")

    def _check_cells(self) -> None:
        folder = f"{SERVED}/{CELL_FOLDER}/"
        for name, document in self._documents.items():
            if name.startswith(folder):
                cell = read_cell(document, name, self.found)
                if cell is not None:
                    self._cells[name.removeprefix(folder)] = cell
        hulls = [c.hull for c in self._cells.values() if len(c.hull)]
        points = np.concatenate(hulls) if hulls else np.zeros((1, 3))
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        tolerance = Tolerance.for_points(points)
        for own, cell in self._cells.items():
            name = f"{folder}{own}"
            check_cell(self._documents[name], cell, name, box, tolerance, self.found)
            for url in (*cell.adjacent, *cell.visible):
                self._urls.resolve(name, url)
        check_graph(
            {own: cell.adjacent for own, cell in self._cells.items()},
            {own: cell.visible for own, cell in self._cells.items()},
            lambda own: (f"{folder}{own}", ""),
            self.found,
        )

    def _check_root(self) -> ReadRoot | None:
        name = f"{SERVED}/{ROOT}"
        if name not in self._documents:
            return None
        root = read_root(self._documents[name], name, self.found)
        for url in (*root.inlines, *root.viewpoints.values()):
            self._urls.resolve(name, url)
        boxes = {f"{CELL_FOLDER}/{own}": cell.box for own, cell in self._cells.items()}
        check_root(root, boxes, name, self.found)
        return root

    def _check_hints(self, root: ReadRoot | None) -> None:
        name, hints, urls = f"{SERVED}/{HINTS}", self._hints, self._urls
        cell_images = {
            own: {
                tuple(urls.resolve_each(f"{SERVED}/{CELL_FOLDER}/{own}", "url", u))
                for u in cell.textures
            }
            for own, cell in self._cells.items()
        }
        if hints is None:
            return
        check_hints(hints, name, self.found)
        urls.resolve_each(name, "cells", [row["url"] for row in hints.cells])
        known = [row["url"].removeprefix(f"{CELL_FOLDER}/") for row in hints.cells]
        files = urls.resolve_each(name, "textures", [row["file"] for row in hints.textures])
        images: list[Images] = []
        for i, (record, path) in enumerate(zip(hints.textures, files, strict=True)):
            twin = record["fallback"]
            images.append((path,) if twin is None else (urls.resolve(name, twin), path))
            texture = None if path is None else self._textures.get(f"{SERVED}/{path}")
            if texture is not None:
                check_record(record, texture, name, f"textures[{i}]", self.found)
        check_against_cells(hints, known, images, self._cells, cell_images, name, self.found)
        if root is not None:
            views = hints.viewpoints
            check_viewpoints(
                root, views, [hints.cells[v["cell"]]["url"] for v in views], name, self.found
            )
