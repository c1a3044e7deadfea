"""The check of a database on disk, or of one `.ptm`: everything that a client may rely on.

Each file is read once, compared with the hash in the manifest, and then against the others, by the
checks of the emitters that wrote them. A finding never ends the check: what cannot be read is left
out of the comparisons that need it.

Files are read by several threads, since decoding textures and hashing, most of the work, leave the
interpreter free. Their findings are gathered in the order of the files.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools import schemas
from ptmtools.database.emitters import EMITTERS, Emitter, chosen_emitters, owner_of
from ptmtools.database.model import EmitOptions, ValidationReport
from ptmtools.database.names import TEXTURE_FOLDER
from ptmtools.database.validation.files import check_names, served_files
from ptmtools.database.validation.findings import Findings, one_line
from ptmtools.database.validation.reading import FileReader
from ptmtools.database.validation.served import ServedDatabase
from ptmtools.database.validation.textures import check_ptm
from ptmtools.database.validation.urls import Urls
from ptmtools.errors import DatabaseError, InputError
from ptmtools.files import open_regular
from ptmtools.progress import Progress, silent
from ptmtools.store.layout import MANIFEST, SERVED
from ptmtools.texture.model import Limits

#: Files of others that are named.
_NAMED = 3
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
    DatabaseError: PTM-D605 if there is no such folder. All else stands in the report.
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
    return ValidationReport(check.found.issues(), check.files, check.bytes, check.notes)


def validate_ptm(path: str | os.PathLike[str], *, limits: Limits = _LIMITS) -> ValidationReport:
    """Checks a single `.ptm`.

    Raises
    ------
    InputError: PTM-I602 if it cannot be read. All else stands in the report.
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
            remedy="check the name and the permissions",
        ) from fault
    check_ptm(data, os.fspath(path), limits, found)
    return ValidationReport(found.issues(), 1, len(data))


class _Check:
    """One validation of one database."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        self.found = Findings()
        self.notes: tuple[str, ...] = ()
        self.files = 0
        self.bytes = 0
        self._folder = folder
        self._limits = limits
        self._stages: dict[str, dict[str, Any]] = {}
        #: Name relative to the database → hash in the manifest.
        self._outputs: dict[str, str] = {}
        #: Bytes of the files that are as they were written, and could be read.
        self._sizes: dict[str, int] = {}
        self._strays = False

    def run(self, progress: Progress, workers: int) -> None:
        self._read_manifest()
        there = served_files(self._folder / SERVED, self.found)
        check_names(there, self.found)
        database = ServedDatabase(self.found, Urls(there, self.found))
        ours = {path for path in there if self._is_ours(path)}
        self._note_others([path for path in there if path not in ours])
        self._strays = any(f"{SERVED}/{path}" not in self._outputs for path in ours)
        self._read_files(ours, database, progress, workers)
        first, *_ = EMITTERS.values()
        if "emit" not in self._stages and not any(e.entry in ours for e in EMITTERS.values()):
            database.add("PTM-D655", first.entry, "", "the stage `emit` has not run")
            return
        listed = {path for path in ours if f"{SERVED}/{path}" in self._outputs} or ours
        present = [e for e in EMITTERS.values() if any(map(e.is_owner, listed))]
        for emitter in {*present, *self._asked_for(present)}:
            for name in emitter.owns:
                if not (name.endswith("/") or name in ours or f"{SERVED}/{name}" in self._outputs):
                    database.add("PTM-D651", name, "", "missing")
        counts: dict[str, int] = {}
        for emitter in present:
            counts |= emitter.validate(database)
        self._check_counts("textures", _texture_counts(self._sizes, database))
        self._check_counts("emit", counts)
        for path in sorted(ours - database.urls.named):
            if path.startswith(f"{TEXTURE_FOLDER}/"):
                database.add("PTM-D677", path, "", "no other file names it")

    def _read_manifest(self) -> None:
        """Fills in what the stages wrote."""
        try:
            with open_regular(self._folder / MANIFEST) as file:
                self._stages = schemas.read(file.read(), schemas.MANIFEST)["stages"]
        except OSError as fault:
            gone = isinstance(fault, FileNotFoundError)
            message = "missing" if gone else f"cannot be read ({fault.strerror or fault})"
            self.found.add("PTM-D650", MANIFEST, "", message)
        except schemas.ShapeError as fault:
            self.found.add("PTM-D650", MANIFEST, fault.place, fault.message)
        for stage, record in self._stages.items():
            for name in sorted(self._outputs.keys() & record["outputs"].keys()):
                message = f"another stage has written {name}, too"
                self.found.add("PTM-D650", MANIFEST, f"stages.{stage}", message)
            self._outputs |= record["outputs"]
        for stage, record in self._stages.items():
            for name, digest in record["inputs"].items():
                if self._outputs.get(name, digest) != digest:
                    message = f"made from an earlier {name}"
                    self.found.add("PTM-D656", MANIFEST, f"stages.{stage}", message)

    def _is_ours(self, path: str) -> bool:
        """Whether a served file is one that was written, or lies where such files do."""
        written = f"{SERVED}/{path}" in self._outputs
        return written or path.startswith(f"{TEXTURE_FOLDER}/") or owner_of(path) is not None

    def _note_others(self, paths: Sequence[str]) -> None:
        """Other files that users add are theirs."""
        if paths:
            named = ", ".join([*map(one_line, paths[:_NAMED]), *(["…"] if paths[_NAMED:] else [])])
            what, was = (
                ("1 file in www/ is", "was")
                if len(paths) == 1
                else (f"{len(paths):,} files in www/ are", "were")
            )
            self.notes = (f"{what} not from ptmtools, and {was} not checked: {named}",)

    def _asked_for(self, present: Sequence[Emitter]) -> Sequence[Emitter]:
        """The emitters that the manifest names; if it names none, those that there are, or the
        default."""
        asked = self._stages.get("emit", {"parameters": {}})["parameters"].get("format")
        try:
            return chosen_emitters(str(asked))
        except ValueError:
            return present or chosen_emitters(EmitOptions().format)

    def _read_files(
        self, ours: Collection[str], database: ServedDatabase, progress: Progress, workers: int
    ) -> None:
        from ptmtools.texture.parallel import ordered

        reader = FileReader(self._folder, self._outputs, ours, self._limits)
        names = sorted({*self._outputs, *(f"{SERVED}/{path}" for path in ours)})
        for i, reading in enumerate(ordered(reader.read, names, workers)):
            progress(i, len(names), "files")
            self.found.take(reading.found.issues())
            if reading.size is None:
                continue
            self.files += 1
            self.bytes += reading.size
            path = names[i].removeprefix(f"{SERVED}/")
            if reading.intact and not reading.unreadable:
                self._sizes[names[i]] = reading.size
            if reading.texture is not None:
                database.textures[path] = reading.texture
            if reading.held is not None:
                database.held[path] = reading.held
        progress(len(names), len(names), "files")

    def _check_counts(self, stage: str, counts: Mapping[str, int]) -> None:
        """Holds a stage's counts in the manifest against those of its files; not if one of them is
        not as it was written or could not be read, or if there are more."""
        record = self._stages.get(stage, {"outputs": {}, "counts": {}})
        if self._strays or record["outputs"].keys() - self._sizes.keys():
            return
        sizes = [self._sizes[name] for name in record["outputs"]]
        for name, true in {"files": len(sizes), "bytes": sum(sizes), **counts}.items():
            if name in record["counts"] and record["counts"][name] != true:
                message = f"is {record['counts'][name]!r}, but the files have {true}"
                self.found.add("PTM-D659", MANIFEST, f"stages.{stage}.counts.{name}", message)


def _texture_counts(sizes: Mapping[str, int], database: ServedDatabase) -> dict[str, int]:
    headers = [texture.header for texture in database.textures.values()]
    finest = [(header.levels[-1], header.texel_bytes) for header in headers]
    return {
        "textures": len(headers),
        "ptm_bytes": sum(sizes.get(f"{SERVED}/{path}", 0) for path in database.textures),
        "raw_bytes": sum(level.width * level.height * texel for level, texel in finest),
    }
