"""The check of a database on disk, or of one `.ptm`: what can be damaged or hurt a client.

Each file is read once, compared with its hash in the manifest, and checked by itself; then the
checks of the forms (`Emitter.check`) follow the references between the files. That different forms
of one cell agree is a matter of the emitters and their tests. No issue ends the check: unreadable
files are left out.

Several threads read files, since decoding textures and hashing, most of the work, release the
interpreter lock. Their issues are gathered in the order of the files.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools import schemas
from ptmtools.diagnostics import CODES, Findings, Place, ValidationReport, one_line
from ptmtools.errors import DatabaseError, InputError
from ptmtools.files import open_regular
from ptmtools.output.emitter import GZIP, Emitter
from ptmtools.output.emitters import EMITTERS, all_emitters, chosen_emitters, owner_of
from ptmtools.output.model import FileError
from ptmtools.output.names import HINTS, TEXTURE_FOLDER
from ptmtools.output.options import EmitOptions
from ptmtools.output.representation import representations
from ptmtools.output.validation.files import ServedDatabase, check_gzip, check_names, served_files
from ptmtools.output.validation.hints import gather
from ptmtools.output.validation.textures import IMAGES, read_picture, read_ptm
from ptmtools.progress import Progress, silent
from ptmtools.quantities import count
from ptmtools.store.folder import lists_in
from ptmtools.store.layout import MANIFEST, SERVED, WRITTEN
from ptmtools.store.lists import list_file
from ptmtools.store.manifest import all_outputs
from ptmtools.texture.model import Limits

#: Foreign files listed by name in a note.
_LISTED = 3
#: Bytes hashed at a time, of a file beyond the limit.
_PIECE = 1 << 20
#: The stage that writes the forms.
_EMIT = "emit"
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
    limits: of files and textures that take more memory only the hash is checked (PTM-D713).
    workers: threads; 0 is one for each processor. The report is the same.

    Raises DatabaseError: PTM-D001 if there is no such folder. All other faults are in the report.
    """
    folder = Path(db)
    if not folder.is_dir():
        raise DatabaseError(
            "PTM-D001", "no such folder", file=folder, remedy="use a database or a .ptm file"
        )
    check = _DatabaseCheck(folder, limits)
    # Damaged files may hold any number; overflows only make comparisons fail.
    with np.errstate(all="ignore"):
        check.run(progress, workers or os.cpu_count() or 1)
    return ValidationReport(check.findings.issues(), check.files, check.bytes, check.notes)


def validate_ptm(path: str | os.PathLike[str], *, limits: Limits = _LIMITS) -> ValidationReport:
    """Checks a single `.ptm`.

    Raises InputError: PTM-I122 if it cannot be read. All other faults are in the report.
    """
    file, findings = Path(path), Findings(CODES)
    at = findings.place(os.fspath(path))
    try:
        size = os.stat(file).st_size
        if size > limits.decoded_bytes:  # 0 for a pipe
            at.add("PTM-D713", f"{size} bytes")
            return ValidationReport(findings.issues(), 1, size)
        data = file.read_bytes()
    except OSError as fault:
        raise InputError(
            "PTM-I122",
            f"cannot be read ({fault.strerror or fault})",
            file=file,
            remedy="check the name and the permissions",
        ) from fault
    read_ptm(data, limits, at)
    return ValidationReport(findings.issues(), 1, len(data))


@dataclass
class _Reading:
    """The result of reading one file.

    Attributes
    ----------
    findings: faults of the file by itself.
    size: bytes; None if it could not be read.
    content: as in `ServedDatabase.contents`.
    """

    findings: Findings
    size: int | None = None
    content: object | None = None


class _DatabaseCheck:
    """One validation of one database."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        self.findings = Findings(CODES)
        self.notes: tuple[str, ...] = ()
        self.files = 0
        self.bytes = 0
        self._folder = folder
        self._limits = limits
        self._manifest = self.findings.place(MANIFEST)
        self._stages: dict[str, dict[str, Any]] = {}
        #: Name relative to the database → hash in the manifest.
        self._outputs: dict[str, str] = {}
        #: Whether all lists of the manifest could be read.
        self._complete = True
        #: The served files that are checked, relative to the served folder.
        self._ours: set[str] = set()

    def run(self, progress: Progress, workers: int) -> None:
        self._read_manifest()
        served = served_files(self._folder / SERVED, self.findings)
        check_names(served, self.findings)
        database = ServedDatabase(self._folder / SERVED, served, self.findings, self._limits)
        database.forms = EMITTERS.values()
        ours = self._ours = {path for path in served if self._is_ours(path)}
        self._note_foreign([path for path in served if path not in ours])
        self._read_files(database, progress, workers)
        if _EMIT not in self._stages and not any(e.entry in ours for e in all_emitters()):
            database.place(HINTS).add("PTM-D655", f"the stage `{_EMIT}` has not run")
            return
        listed = {path for path in ours if f"{SERVED}/{path}" in self._outputs} or ours
        present = [e for e in all_emitters() if any(map(e.is_owner, listed))]
        for emitter in {*present, *self._emitters_to_expect(present)}:
            for name in emitter.owns:
                if not (name.endswith("/") or name in ours or f"{SERVED}/{name}" in self._outputs):
                    database.place(name).add("PTM-D651", "missing")
        database.hints = gather(database)
        for emitter in present:
            if emitter.check:
                emitter.check.load()(database)
        for path in sorted(ours - database.named):
            if path.partition("/")[0] in _stage_folders():
                database.place(path).add("PTM-D677", "no other file names it")

    def _read_manifest(self) -> None:
        try:
            with open_regular(self._folder / MANIFEST) as file:
                document = schemas.parse(file.read())
            schemas.check(document, schemas.MANIFEST)
            self._stages = document["stages"]
        except FileNotFoundError:
            self._manifest.add("PTM-D650", "missing")
        except OSError as fault:
            self._manifest.add("PTM-D650", f"cannot be read ({fault.strerror or fault})")
        except schemas.ShapeError as fault:
            self._manifest.add("PTM-D650", fault.message, fault.place)
        for record in self._stages.values():
            for field in ("inputs", "outputs"):
                record[field] = self._listed_files(record[field], field == "outputs")
        for stage, record in self._stages.items():
            at = self._manifest.with_place(f"stages.{stage}")
            for name in sorted(self._outputs.keys() & record["outputs"].keys()):
                at.add("PTM-D650", f"another stage lists {name}, too")
            self._outputs |= record["outputs"]
        for stage, record in self._stages.items():
            at = self._manifest.with_place(f"stages.{stage}")
            for name, digest in record["inputs"].items():
                if self._outputs.get(name, digest) != digest:
                    at.add("PTM-D656", f"computed from an earlier {name}")
                elif stage == _EMIT and name not in self._outputs and name.split("/")[0] in WRITTEN:
                    at.add("PTM-D656", f"computed from {name}, which no stage has written")

    def _listed_files(self, files: dict[str, str] | list[str], outputs: bool) -> dict[str, str]:
        """Inputs or outputs of a stage, of the manifest or of lists."""
        if isinstance(files, dict):
            return files
        self._outputs |= {list_file(digest): digest for digest in files}
        listed: dict[str, str] = {}
        for digest in files:
            fault = ""
            try:
                content = lists_in(self._folder)(digest)
                if outputs and not all_outputs(content):
                    content, fault = {}, "is no list of outputs"
                listed |= content
            except DatabaseError as error:  # a file that is missing or another is reported as such
                self._complete = False
                fault = error.message if error.code == "PTM-D006" else ""
            if fault:
                self._complete = False
                self.findings.place(list_file(digest)).add("PTM-D650", fault)
        return listed

    def _is_ours(self, path: str) -> bool:
        """Whether a stage wrote a served file, or it lies in a folder of such files."""
        in_folder = path.partition("/")[0] in _stage_folders()
        return f"{SERVED}/{path}" in self._outputs or in_folder or owner_of(path) is not None

    def _note_foreign(self, paths: Sequence[str]) -> None:
        """Notes the files that users have added."""
        if paths:
            listed = ", ".join(
                [*map(one_line, paths[:_LISTED]), *(["…"] if paths[_LISTED:] else [])]
            )
            are, were = ("is", "was") if len(paths) == 1 else ("are", "were")
            subject = f"{count(len(paths), 'file')} in {SERVED}/ {are} not from ptmtools"
            self.notes = (f"{subject} and {were} not checked: {listed}",)

    def _emitters_to_expect(self, present: Sequence[Emitter]) -> Sequence[Emitter]:
        """The emitters that the manifest names; if it names none, those present or the default."""
        try:
            return chosen_emitters(str(self._stages[_EMIT]["parameters"]["format"]))
        except (KeyError, ValueError):
            return present or chosen_emitters(EmitOptions().format)

    def _read_files(self, database: ServedDatabase, progress: Progress, workers: int) -> None:
        from ptmtools.parallel import map_in_order

        names = sorted({*self._outputs, *(f"{SERVED}/{path}" for path in self._ours)})
        for i, reading in enumerate(map_in_order(self._read, names, workers)):
            progress(i, len(names), "files")
            self.findings.take(reading.findings.issues())
            if reading.size is None:
                continue
            self.files += 1
            self.bytes += reading.size
            if reading.content is not None:
                database.contents[names[i].removeprefix(f"{SERVED}/")] = reading.content
        progress(len(names), len(names), "files")

    def _read(self, name: str) -> _Reading:
        """Reads a file, named relative to the database; called from several threads."""
        findings = Findings(CODES)
        reading, at = _Reading(findings), findings.place(name)
        if name.startswith(f"{SERVED}/") and not self._is_served(name):
            # `served_files` has reported what exists and is no file.
            if not os.path.lexists(self._folder / name):
                at.add("PTM-D651", "missing")
            return reading
        try:
            size, data, digest = self._content(name)
        except FileNotFoundError:
            at.add("PTM-D651", "missing")
            return reading
        except OSError as fault:
            at.add("PTM-D651", f"cannot be read ({fault.strerror or fault})")
            return reading
        reading.size = size
        if self._outputs and self._complete and name not in self._outputs:
            at.add("PTM-D653", "no stage wrote this file")
        elif self._outputs.get(name, digest) != digest:
            at.add("PTM-D652", "the hash differs from the manifest's")
        if data is None:
            at.add("PTM-D713", f"{size} bytes")
        elif name.startswith(f"{SERVED}/"):
            with np.errstate(all="ignore"):  # which each thread has of its own
                reading.content = self._parse(name, data, at)
        return reading

    def _content(self, name: str) -> tuple[int, bytes | None, str]:
        """(size, bytes, SHA-256) of a file; no bytes beyond the limit."""
        with open_regular(self._folder / name) as file:
            size = os.fstat(file.fileno()).st_size
            if size <= self._limits.decoded_bytes:
                data = file.read(size)
                return len(data), data, hashlib.sha256(data).hexdigest()
            digest = hashlib.sha256()
            while piece := file.read(_PIECE):
                digest.update(piece)
            return size, None, digest.hexdigest()

    def _parse(self, name: str, data: bytes, at: Place) -> object | None:
        stem, suffix = os.path.splitext(name)
        path = name.removeprefix(f"{SERVED}/")
        emitter = owner_of(path)
        if suffix == GZIP:
            check_gzip(data, self._neighbour(stem), at)
        elif suffix in IMAGES and emitter is None:
            return read_picture(data, IMAGES[suffix], self._limits, at)
        elif suffix == ".ptm":
            return read_ptm(data, self._limits, at)
        elif emitter and emitter.reader:
            try:
                return emitter.reader.load()(path, data)
            except FileError as fault:
                at.add(fault.code, fault.message, fault.place)
        return None

    def _is_served(self, name: str) -> bool:
        return name.removeprefix(f"{SERVED}/") in self._ours

    def _neighbour(self, name: str) -> bytes | None:
        """The bytes of another served file, if it exists and can be read."""
        try:
            return self._content(name)[1] if self._is_served(name) else None
        except OSError:
            return None


def _stage_folders() -> tuple[str, ...]:
    """The folders of served files that stages before the emission write."""
    return TEXTURE_FOLDER, *(kind.folder for kind in representations())
