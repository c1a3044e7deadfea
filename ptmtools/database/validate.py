"""The check of a database on disk, or of one `.ptm`: everything that a client may rely on.

Each file is read once, held against the hash in the manifest, and then against the others. The
VRML files are read by `wrl`, which knows nothing but the emission pattern; what is found is told
with a code of the table in `findings`. A finding never ends the check: what cannot be read is
left out of the comparisons that need it.
"""

from __future__ import annotations

import hashlib
import json
import os
import posixpath
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

import numpy as np

from ptmtools.database.cellcheck import ReadCell, check_cell, read_cell
from ptmtools.database.findings import Findings
from ptmtools.database.gltf.check import GltfCheck
from ptmtools.database.hintscheck import (
    ReadHints,
    check_against_cells,
    check_hints,
    read_hints,
)
from ptmtools.database.model import ValidationReport
from ptmtools.database.names import CELL_FOLDER, HINTS, ROOT
from ptmtools.database.rootcheck import ReadRoot, check_root, read_root
from ptmtools.database.texturecheck import check_ptm, check_record, check_twin
from ptmtools.database.wrl import Document, WrlError, parse
from ptmtools.errors import DatabaseError, InputError
from ptmtools.progress import Progress, silent
from ptmtools.tolerance import Tolerance

MANIFEST = "manifest.json"
SERVED = "www"
_FAULTS = {"encoding": "PTM-D660", "syntax": "PTM-D661", "finite": "PTM-D662"}


def validate_database(db: str | os.PathLike[str], progress: Progress = silent) -> ValidationReport:
    """Checks a database.

    Raises
    ------
    DatabaseError: PTM-D605 if there is no such folder. All else is told in the report.
    """
    folder = Path(db)
    if not folder.is_dir():
        raise DatabaseError(
            "PTM-D605", "no such folder", file=folder, remedy="give a database or a .ptm file"
        )
    check = _Check(folder)
    check.run(progress)
    return ValidationReport(check.found.issues(), check.files, check.bytes)


def validate_ptm(path: str | os.PathLike[str]) -> ValidationReport:
    """Checks a single `.ptm`.

    Raises
    ------
    InputError: PTM-I602 if it cannot be read. All else is told in the report.
    """
    file = Path(path)
    try:
        data = file.read_bytes()
    except OSError as fault:
        raise InputError(
            "PTM-I602",
            f"cannot be read ({fault.strerror or fault})",
            file=file,
            remedy="check the name and the rights",
        ) from fault
    found = Findings()
    check_ptm(data, os.fspath(path), found)
    return ValidationReport(found.issues(), 1, len(data))


class _Check:
    """One validation of one database."""

    def __init__(self, folder: Path) -> None:
        self.found = Findings()
        self.files = 0
        self.bytes = 0
        self._folder = folder
        self._outputs: dict[str, str] = {}
        self._served: set[str] = set()
        self._documents: dict[str, Document] = {}
        self._cells: dict[str, ReadCell] = {}
        self._hints: ReadHints | None = None
        self._gltf = GltfCheck(SERVED, self.found)
        self._digests: dict[str, tuple[str, int]] = {}

    def run(self, progress: Progress) -> None:
        finished = self._read_manifest()
        served = self._folder / SERVED
        self._served = {
            p.relative_to(served).as_posix() for p in sorted(served.rglob("*")) if p.is_file()
        }
        names = sorted(set(self._outputs) | {f"{SERVED}/{name}" for name in self._served})
        for i, name in enumerate(names):
            progress(i, len(names), "files")
            self._read(name)
        progress(len(names), len(names), "files")
        if not finished and ROOT not in self._served:
            self.found.add("PTM-D655", f"{SERVED}/{ROOT}", "", "the stage `emit` has not run")
            return
        for name in (ROOT, HINTS):
            path = f"{SERVED}/{name}"
            if name not in self._served and not self.found.has("PTM-D651", path):
                self.found.add("PTM-D651", path, "", "missing")
        self._check_cells()
        root = self._check_root()
        self._check_hints(root)
        self._gltf.compare(self._served, self._documents, self._resolve)

    def _read_manifest(self) -> bool:
        """Fills in what the stages wrote; whether `emit` was among them."""
        try:
            document = json.loads((self._folder / MANIFEST).read_bytes())
            stages = document["stages"]
            for stage in stages.values():
                for name, digest in stage["outputs"].items():
                    if posixpath.normpath(name).startswith(("..", "/")) or "\\" in name:
                        raise ValueError(f"the output {name!r} lies outside of the database")
                    self._outputs[str(name)] = str(digest)
            for stage, record in stages.items():
                for name, digest in record.get("inputs", {}).items():
                    if self._outputs.get(name, digest) != digest:
                        told = f"made from an earlier {name}; run build-scene, or the later stages"
                        self.found.add("PTM-D656", MANIFEST, str(stage), told)
            return "emit" in stages
        except FileNotFoundError:
            self.found.add("PTM-D650", MANIFEST, "", "missing")
        except (OSError, ValueError, RecursionError) as fault:
            self.found.add("PTM-D650", MANIFEST, "", f"damaged: {fault}")
        except (KeyError, TypeError, AttributeError):
            self.found.add("PTM-D650", MANIFEST, "", "damaged: no stages with outputs")
        return False

    def _read(self, name: str) -> None:
        path = self._folder / name
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            self.found.add("PTM-D651", name, "", "missing")
            return
        except OSError as fault:
            self.found.add("PTM-D654", name, "", f"cannot be read ({fault.strerror or fault})")
            return
        self.files += 1
        self.bytes += len(data)
        digest = hashlib.sha256(data).hexdigest()
        self._digests[name] = (digest, len(data))
        if name not in self._outputs and self._outputs:
            self.found.add("PTM-D653", name, "", "served, but no stage wrote it")
        elif self._outputs.get(name, digest) != digest:
            self.found.add("PTM-D652", name, "", "not what its stage wrote: the hash differs")
        if not name.startswith(f"{SERVED}/"):
            return
        self._gltf.read(name, data)
        if name.endswith(".wrl"):
            try:
                self._documents[name] = parse(data)
            except WrlError as fault:
                self.found.add(_FAULTS[fault.kind], name, fault.place, fault.message)
        elif name == f"{SERVED}/{HINTS}":
            self._hints = read_hints(data, name, self.found)
        elif name.endswith(".ptm"):
            check_ptm(data, name, self.found)
            twin = path.with_suffix(".png")
            if twin.is_file():
                check_twin(data, twin, name, f"{name[:-4]}.png", self.found)

    def _check_cells(self) -> None:
        names = [n for n in self._documents if n.startswith(f"{SERVED}/{CELL_FOLDER}/")]
        for name in names:
            cell = read_cell(self._documents[name], name, self.found)
            if cell is not None:
                self._cells[name.rpartition("/")[2]] = cell
        hulls = [c.hull for c in self._cells.values() if len(c.hull)]
        points = np.concatenate(hulls) if hulls else np.zeros((1, 3))
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        tolerance = Tolerance.for_points(points)
        for own, cell in self._cells.items():
            name = f"{SERVED}/{CELL_FOLDER}/{own}"
            check_cell(self._documents[name], cell, name, box, tolerance, self.found)
            for url in (
                *cell.adjacent,
                *cell.visible,
                *(u for urls in cell.textures for u in urls),
            ):
                self._resolve(name, url)
            for code, field, urls, what in (
                ("PTM-D694", "adjacent", cell.adjacent, "names it as adjacent"),
                ("PTM-D695", "visible", cell.visible, "sees it"),
            ):
                for url in urls:
                    other = self._cells.get(url)
                    if other is not None and own not in getattr(other, field):
                        self.found.add(
                            code, f"{SERVED}/{CELL_FOLDER}/{url}", field, f"{own} {what}"
                        )

    def _resolve(self, name: str, url: str) -> str | None:
        """What a URL in a file names, relative to the served folder; None, and told, if that is
        no file there."""
        base = posixpath.dirname(name[len(SERVED) + 1 :])
        parts = urlsplit(url)
        path = posixpath.normpath(posixpath.join(base, unquote(url)))
        outside = path.startswith(("../", "/")) or path in ("..", ".") or "\\" in path
        if parts.scheme or parts.netloc or outside:
            self.found.add("PTM-D670", name, url, "leads out of the served folder")
            return None
        if path not in self._served:
            code = "PTM-D672" if path.startswith(f"{CELL_FOLDER}/") else "PTM-D671"
            self.found.add(code, name, url, "there is no such file")
            return None
        return path

    def _check_root(self) -> ReadRoot | None:
        name = f"{SERVED}/{ROOT}"
        if name not in self._documents:
            return None
        root = read_root(self._documents[name], name, self.found)
        for url in (*root.inlines, *root.viewpoints.values()):
            self._resolve(name, url)
        hulls = {f"{CELL_FOLDER}/{own}": cell.hull for own, cell in self._cells.items()}
        check_root(root, hulls, name, self.found)
        return root

    def _check_hints(self, root: ReadRoot | None) -> None:
        name, hints = f"{SERVED}/{HINTS}", self._hints
        if hints is None:
            return
        check_hints(hints, name, self.found)
        for row in hints.cells:
            self._resolve(name, row["url"])
        check_against_cells(hints, self._cells, dict(self._textures()), name, self.found)
        for i, record in enumerate(hints.textures):
            path = self._resolve(name, record["file"])
            if record["fallback"] is not None:
                self._resolve(name, record["fallback"])
            if path is not None:
                digest, size = self._digests[f"{SERVED}/{path}"]
                check_record(record, digest, size, name, f"texture {i}", self.found)
        if root is not None:
            wanted = {v["name"]: hints.cells[v["cell"]]["url"] for v in hints.viewpoints}
            if wanted != root.viewpoints:
                self.found.add("PTM-D706", name, "viewpoints", "not those of the root file")

    def _textures(self) -> Iterator[tuple[str, list[str]]]:
        """For every cell the `.ptm` files that its shapes name, relative to the served folder."""
        for own, cell in self._cells.items():
            urls = {u for urls in cell.textures for u in urls if u.endswith(".ptm")}
            yield own, sorted(posixpath.normpath(posixpath.join(CELL_FOLDER, u)) for u in urls)
