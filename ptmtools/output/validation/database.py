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
from ptmtools.diagnostics import Findings, ValidationReport, one_line
from ptmtools.errors import DatabaseError, InputError
from ptmtools.files import open_regular
from ptmtools.output.emitters import Emitter, all_emitters, chosen_emitters, owner_of
from ptmtools.output.model import EmitOptions
from ptmtools.output.names import HINTS, OCTREE_FOLDER, TEXTURE_FOLDER
from ptmtools.output.validation.files import FileReader, ServedDatabase, check_names, served_files
from ptmtools.output.validation.findings import CODES
from ptmtools.output.validation.textures import ReadTexture, check_ptm
from ptmtools.progress import Progress, silent
from ptmtools.quantities import count
from ptmtools.store.layout import MANIFEST, SERVED
from ptmtools.texture.model import Limits

#: Files of others that are named.
_NAMED = 3
#: The stages that write served files, and the record of one that has not run.
_TEXTURES, _EMIT = "textures", "emit"
_NEVER: dict[str, dict[str, Any]] = {"parameters": {}, "outputs": {}, "counts": {}}
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

    Raises DatabaseError: PTM-D605 if there is no such folder. All else stands in the report.
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

    Raises InputError: PTM-I602 if it cannot be read. All else stands in the report.
    """
    file, found = Path(path), Findings(CODES)
    at = found.at(os.fspath(path))
    try:
        size = os.stat(file).st_size
        if size > limits.decoded_bytes:  # a pipe has none
            at.add("PTM-D713", f"{size} bytes")
            return ValidationReport(found.issues(), 1, size)
        data = file.read_bytes()
    except OSError as fault:
        raise InputError(
            "PTM-I602",
            f"cannot be read ({fault.strerror or fault})",
            file=file,
            remedy="check the name and the permissions",
        ) from fault
    check_ptm(data, limits, at)
    return ValidationReport(found.issues(), 1, len(data))


class _Check:
    """One validation of one database."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        self.found = Findings(CODES)
        self.notes: tuple[str, ...] = ()
        self.files = 0
        self.bytes = 0
        self._folder = folder
        self._limits = limits
        self._manifest = self.found.at(MANIFEST)
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
        database = ServedDatabase(self._folder / SERVED, there, self.found, self._limits)
        ours = {path for path in there if self._is_ours(path)}
        self._note_others([path for path in there if path not in ours])
        self._strays = any(f"{SERVED}/{path}" not in self._outputs for path in ours)
        self._read_files(ours, database, progress, workers)
        if _EMIT not in self._stages and not any(e.entry in ours for e in all_emitters()):
            database.at(HINTS).add("PTM-D655", f"the stage `{_EMIT}` has not run")
            return
        listed = {path for path in ours if f"{SERVED}/{path}" in self._outputs} or ours
        present = [e for e in all_emitters() if any(map(e.is_owner, listed))]
        for emitter in {*present, *self._asked_for(present)}:
            for name in emitter.owns:
                if not (name.endswith("/") or name in ours or f"{SERVED}/{name}" in self._outputs):
                    database.at(name).add("PTM-D651", "missing")
        counts: dict[str, int] = {}
        for emitter in present:
            counts |= emitter.validate(database)
        self._check_counts(_TEXTURES, _texture_counts(self._sizes, database))
        self._check_counts(_EMIT, counts)
        for path in sorted(ours - database.named):
            if path.startswith(f"{TEXTURE_FOLDER}/"):
                database.at(path).add("PTM-D677", "no other file names it")
            elif path.startswith(f"{OCTREE_FOLDER}/"):
                database.at(path).add("PTM-D864", "no other file names it")

    def _read_manifest(self) -> None:
        """Fills in what the stages wrote."""
        try:
            with open_regular(self._folder / MANIFEST) as file:
                self._stages = schemas.read(file.read(), schemas.MANIFEST)["stages"]
        except OSError as fault:
            gone = isinstance(fault, FileNotFoundError)
            message = "missing" if gone else f"cannot be read ({fault.strerror or fault})"
            self._manifest.add("PTM-D650", message)
        except schemas.ShapeError as fault:
            self._manifest.add("PTM-D650", fault.message, fault.place)
        for stage, record in self._stages.items():
            at = self._manifest.at(f"stages.{stage}")
            for name in sorted(self._outputs.keys() & record["outputs"].keys()):
                at.add("PTM-D650", f"another stage has written {name}, too")
            self._outputs |= record["outputs"]
        for stage, record in self._stages.items():
            for name, digest in record["inputs"].items():
                if self._outputs.get(name, digest) != digest:
                    at = self._manifest.at(f"stages.{stage}")
                    at.add("PTM-D656", f"made from an earlier {name}")

    def _is_ours(self, path: str) -> bool:
        """Whether a served file is one that was written, or lies where such files do."""
        written = f"{SERVED}/{path}" in self._outputs
        folder = path.partition("/")[0]
        ours = folder in (TEXTURE_FOLDER, OCTREE_FOLDER) or owner_of(path) is not None
        return written or ours

    def _note_others(self, paths: Sequence[str]) -> None:
        """Other files that users add are theirs."""
        if paths:
            named = ", ".join([*map(one_line, paths[:_NAMED]), *(["…"] if paths[_NAMED:] else [])])
            are, were = ("is", "was") if len(paths) == 1 else ("are", "were")
            what = f"{count(len(paths), 'file')} in {SERVED}/ {are} not from ptmtools"
            self.notes = (f"{what}, and {were} not checked: {named}",)

    def _asked_for(self, present: Sequence[Emitter]) -> Sequence[Emitter]:
        """The emitters that the manifest names; if it names none, those that there are, or the
        default."""
        asked = self._stages.get(_EMIT, _NEVER)["parameters"].get("format")
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
            if reading.intact:
                self._sizes[names[i]] = reading.size
            if isinstance(reading.held, ReadTexture):
                database.textures[path] = reading.held
            elif reading.held is not None:
                database.held[path] = reading.held
        progress(len(names), len(names), "files")

    def _check_counts(self, stage: str, counts: Mapping[str, int]) -> None:
        """Holds a stage's counts in the manifest against those of its files; not if one of them is
        not as it was written or could not be read, or if there are more."""
        record = self._stages.get(stage, _NEVER)
        if self._strays or record["outputs"].keys() - self._sizes.keys():
            return
        sizes = [self._sizes[name] for name in record["outputs"]]
        for name, true in {"files": len(sizes), "bytes": sum(sizes), **counts}.items():
            if record["counts"].get(name, true) != true:
                message = f"is {record['counts'][name]!r}, but the files have {true}"
                self._manifest.at(f"stages.{stage}.counts.{name}").add("PTM-D659", message)


def _texture_counts(sizes: Mapping[str, int], database: ServedDatabase) -> dict[str, int]:
    headers = [texture.header for texture in database.textures.values()]
    finest = [(header.levels[-1], header.texel_bytes) for header in headers]
    return {
        "textures": len(headers),
        "ptm_bytes": sum(sizes.get(f"{SERVED}/{path}", 0) for path in database.textures),
        "raw_bytes": sum(level.width * level.height * texel for level, texel in finest),
    }
