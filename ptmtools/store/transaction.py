"""Passes a database from one state to the next, and recovers an interrupted run.

A transaction gathers the outputs of a stage in a folder below `.ptm-new/`. Writing the new manifest
beside them is the commit. Then the outputs are moved to their places, replaced outputs are removed,
and the manifest is moved last. Killed before the commit, the database is in its old state; killed
after it, the next run completes the move. (Tried: renaming every output as it is written. A build
killed during an update then leaves files that no manifest lists.)

A stage of many tasks appends each finished task to a journal beside its outputs; the next run takes
these over, and removes the other files of an interrupted run.

Only files that a manifest lists and `.ptm-new/` are removed. No link is followed.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from ptmtools.errors import DatabaseError, OutputError
from ptmtools.files import real_file, real_folder, real_place, write_bytes, writing
from ptmtools.store.folder import DatabaseFolder, last_manifest, lists_in
from ptmtools.store.layout import MANIFEST, STAGING, arrays_of, sha256
from ptmtools.store.manifest import Manifest, StageRecord

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_JOURNAL = "journal"


class Transaction:
    """The outputs of one or more stages before their commit.

    Parameters
    ----------
    db: the database; its manifest is replaced at the commit.
    name: of the folder below `.ptm-new/`, the same in every run.
    turn: held during the commit.
    """

    def __init__(self, db: DatabaseFolder, name: str, turn: Lock) -> None:
        self._db = db
        self._turn = turn
        self._relative = f"{STAGING}/{name}"
        self._pending: dict[str, str] = {}
        #: Those of them whose files are in `folder`.
        self._staged: set[str] = set()
        self._committed = db.manifest.outputs()
        self._finished = _read_journal(self.folder)

    @property
    def folder(self) -> Path:
        """The folder of the outputs, each under its name in the database."""
        return self._db.path / self._relative

    def put(self, name: str, data: bytes, digest: str = "") -> None:
        """Stages one output, unless the database already has it. Computes the ``digest`` if it is
        not given. May be called from several threads.

        Raises
        ------
        OutputError: PTM-O002, PTM-O003, PTM-O005.
        """
        digest = digest or sha256(data)
        if not self.keep({name: digest}):
            write_bytes(real_place(self.subfolder(), name), data, force=True)
            self._staged.add(name)
        self._pending[name] = digest

    def put_arrays(self, stage: str, arrays: Mapping[str, NDArray[np.generic]]) -> None:
        """Stages the arrays of a stage; raises as `put`."""
        from ptmtools.store.archive import pack_arrays

        self.put(arrays_of(stage), pack_arrays(arrays))

    def take(self, name: str, file: Path, digest: str = "") -> None:
        """Stages a file that was written into a `subfolder`: moves it, or removes it if the
        database already has it. Computes the ``digest`` if it is not given. Raises as `put`."""
        with writing(file):
            digest = digest or sha256(file.read_bytes())
            if self.keep({name: digest}):
                file.unlink()
            else:
                file.replace(real_place(self.subfolder(), name))
                self._staged.add(name)
        self._pending[name] = digest

    def leave(self, name: str, digest: str) -> None:
        """Stages an output that is elsewhere (`DatabaseFolder.elsewhere`)."""
        self._staged.discard(name)
        self._pending[name] = digest

    def source(self, name: str) -> Path | Callable[[int, int], bytes]:
        """A staged output, see `DatabaseFolder.source`."""
        if name in self._staged:
            return self.folder / name
        return self._db.source(name, self._pending[name])

    def read(self, name: str) -> bytes:
        """The bytes of a staged output; raises as `DatabaseFolder.read`."""
        if name in self._staged:
            return (self.folder / name).read_bytes()
        return self._db.read(name, self._pending[name])

    def subfolder(self, name: str = "") -> Path:
        """A folder below `folder`, created where it is absent, removed with the transaction.

        Raises OutputError PTM-O002, PTM-O003, PTM-O005.
        """
        return real_folder(self._db.path, f"{self._relative}/{name}".rstrip("/"))

    def keep(self, outputs: Mapping[str, str]) -> bool:
        """Keeps committed outputs; False if one is missing or different."""
        # The names of many files are in lists, so they are looked up last.
        if self._db.first_damage(outputs):
            return False
        if any(self._committed.get(name) != digest for name, digest in outputs.items()):
            return False
        self._staged.difference_update(outputs)
        self._pending.update(outputs)
        return True

    def resume(self, task: str) -> bool:
        """Takes over the outputs of a task that an interrupted run has finished; False if there
        are none. ``task`` is a digest of everything that they depend on."""
        outputs = self._finished.get(task)
        if outputs is None:
            return False
        elsewhere, staged = self._db.elsewhere, set()
        for name, digest in outputs.items():
            if self._is_staged(name, digest):
                staged.add(name)
            elif elsewhere and elsewhere.size(digest) is not None:
                continue
            elif not self.keep({name: digest}):
                return False
        self._staged = (self._staged - outputs.keys()) | staged
        self._pending.update(outputs)
        return True

    def finish(self, task: str, names: Iterable[str]) -> None:
        """Appends a task, whose outputs were put, to the journal."""
        line = json.dumps({"task": task, "outputs": {name: self._pending[name] for name in names}})
        folder = self.subfolder()
        with writing(folder), open(folder / _JOURNAL, "a", encoding="utf-8") as journal:
            journal.write(line + "\n")

    def _is_staged(self, name: str, digest: str) -> bool:
        with suppress(OSError, OutputError):
            file = real_file(self.folder, name)
            return file is not None and sha256(file.read_bytes()) == digest
        return False

    def pending(self) -> dict[str, str]:
        """The outputs so far: name → SHA-256."""
        return dict(self._pending)

    def commit(self, records: Mapping[str, StageRecord]) -> None:
        """Commits the outputs with the records of their stages."""
        with self._turn:
            read = lists_in(self._db.path)
            stages = {**self._db.manifest.stages, **records}
            manifest = self._db.manifest.with_stages(
                {name: stages[name].with_lists(read, self._put_list) for name in stages}
            )
            self._remove_others()
            write_bytes(self.subfolder() / MANIFEST, manifest.to_bytes(), force=True)
            _complete(self._db.path, self._relative)
            self._db.manifest = manifest
        for name in self._staged:
            if name in self._pending:
                self._db.digests.note(self._db.path / name, self._pending[name])
        self._pending, self._staged, self._finished = {}, set(), {}
        self._committed = manifest.outputs()

    def _put_list(self, name: str, data: bytes) -> None:
        if not self._db.has(name, sha256(data)):
            write_bytes(real_place(self.subfolder(), name), data, force=True)
            self._staged.add(name)

    def _remove_others(self) -> None:
        """Removes what an interrupted run has staged and this one has not taken over."""
        folder = self.subfolder()
        for name in _files_below(folder) - self._staged:
            if file := real_file(folder, name):
                file.unlink()


def recover(folder: Path) -> None:
    """Completes an interrupted commit; of uncommitted outputs, those of finished tasks stay."""
    staging = real_folder(folder, STAGING, make=False)
    if not staging.is_dir():
        return
    with writing(staging):
        for entry in sorted(staging.iterdir()):
            if entry.is_symlink() or not entry.is_dir():
                entry.unlink()
            elif real_file(entry, MANIFEST):
                try:
                    _complete(folder, f"{STAGING}/{entry.name}")
                except DatabaseError as fault:
                    if fault.code not in ("PTM-D005", "PTM-D006"):
                        raise
                    shutil.rmtree(entry)  # a list is lost, and with it the commit
    discard(folder, also_finished=False)


def finished_tasks(folder: Path) -> int:
    """Number of tasks of an interrupted run that the next takes over."""
    with suppress(OSError):
        return sum(len(_read_journal(entry)) for entry in (folder / STAGING).iterdir())
    return 0


def discard(folder: Path, *, also_finished: bool) -> None:
    """Removes staged outputs; without ``also_finished``, those of finished tasks stay."""
    staging = folder / STAGING
    if staging.is_symlink() or not staging.is_dir():
        return
    for entry in staging.iterdir():
        if also_finished or not _read_journal(entry):
            shutil.rmtree(entry, ignore_errors=True)
    with suppress(OSError):
        staging.rmdir()


def _read_journal(folder: Path) -> dict[str, dict[str, str]]:
    """Task → its outputs; incomplete lines of a killed process are ignored."""
    tasks: dict[str, dict[str, str]] = {}
    try:
        file = real_file(folder, _JOURNAL) if folder.is_dir() and not folder.is_symlink() else None
        lines = file.read_bytes().splitlines() if file else []
    except OSError:
        return tasks
    for line in lines:
        with suppress(ValueError, KeyError, TypeError, AttributeError, RecursionError):
            entry = json.loads(line)
            tasks[str(entry["task"])] = {str(n): str(d) for n, d in entry["outputs"].items()}
    return tasks


def _complete(folder: Path, relative: str) -> None:
    """Moves committed outputs to their places, removes replaced ones, moves the manifest last."""
    staging = folder / relative
    with writing(folder):
        data = (staging / MANIFEST).read_bytes()
        after = Manifest.from_bytes(data, file=staging / MANIFEST, lists=lists_in(folder))
        before = last_manifest(folder)
        staged = _files_below(staging)
        for name in sorted(after.lists().keys() & staged):  # the outputs are read from them
            _move(staging, name, folder)
        for name in sorted(after.outputs_beyond(before).keys() & staged):
            _move(staging, name, folder)
        if before:
            remove_former(folder, before, after)
        (staging / MANIFEST).replace(folder / MANIFEST)
        shutil.rmtree(staging)  # not its parent, where another transaction may begin


def _files_below(folder: Path) -> set[str]:
    """The files below a folder, without those behind links, relative to it."""
    files: set[str] = set()
    for place, _, names in os.walk(folder):
        relative = Path(place).relative_to(folder).as_posix()
        files.update(names if relative == "." else (f"{relative}/{name}" for name in names))
    return files


def _move(staging: Path, name: str, folder: Path) -> None:
    if source := real_file(staging, name):
        source.replace(real_place(folder, name))


def remove_former(folder: Path, before: Manifest, after: Manifest) -> None:
    """Removes the files that a former manifest alone lists, its lists last: an interrupted call
    needs them. Files stay that only a lost list names."""
    with suppress(DatabaseError):  # a list of the later manifest is lost
        kept = after.outputs_beyond(before)
        for name in before.outputs_beyond(after, readable=True).keys() - kept.keys():
            remove_output(folder, name)
    for name in before.lists().keys() - after.lists().keys():
        remove_output(folder, name)


def remove_output(folder: Path, name: str) -> None:
    """Removes an obsolete output, and the folders that this empties."""
    file = real_file(folder, name)
    if file is None:
        return
    file.unlink(missing_ok=True)
    with suppress(OSError):
        while (file := file.parent) != folder:
            file.rmdir()
