"""How a database passes from one state to the next, and what is left of a run that was killed.

A transaction. The outputs of a stage gather in a folder of their own below `.ptm-new/`; once all
are there, the new manifest is put beside them, and that is the commit: from then on they are moved
to their places, what they replace is removed, and the manifest goes last. Killed before the commit,
the database is what it was; killed after it, the next run finishes the move. (Tried: renaming every
output as it is written. A build killed half-way through an update then leaves files that no
manifest describes.)

A stage of many tasks notes each finished one in a journal beside its outputs: the next run takes
them over instead of doing them again. The rest of an interrupted run goes.

Nothing is removed but what a manifest of ours lists, and `.ptm-new/` itself. No link is followed.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from ptmtools.errors import DatabaseError, OutputError
from ptmtools.files import real_file, real_folder, write_bytes, writing
from ptmtools.store.folder import DatabaseFolder, read_manifest
from ptmtools.store.layout import MANIFEST, STAGING, arrays_of, sha256
from ptmtools.store.manifest import Manifest, StageRecord, listed_before

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_JOURNAL = "journal"


class Transaction:
    """The outputs of one stage or more on their way into the database.

    Parameters
    ----------
    db: the database; its manifest is replaced at the commit.
    name: of the folder below `.ptm-new/`, the same in every run.
    turn: held while the database passes from one state to the next.
    """

    def __init__(self, db: DatabaseFolder, name: str, turn: Lock) -> None:
        self._db = db
        self._turn = turn
        self._relative = f"{STAGING}/{name}"
        self._pending: dict[str, str] = {}
        self._standing = db.manifest.outputs()
        self._done = _read_journal(self.folder)

    @property
    def folder(self) -> Path:
        """Where outputs wait for their commit, each under its name in the database."""
        return self._db.path / self._relative

    def put(self, name: str, data: bytes) -> None:
        """Stages one output, unless it stands in the database already.

        Raises
        ------
        OutputError: PTM-O002, PTM-O003, PTM-O005.
        """
        digest = sha256(data)
        if not self.keep({name: digest}):
            write_bytes(self._place(name), data, force=True)
        self._pending[name] = digest

    def put_arrays(self, stage: str, arrays: Mapping[str, NDArray[np.generic]]) -> None:
        """Stages the arrays of a stage; raises as `put`."""
        from ptmtools.store.archive import pack_arrays

        self.put(arrays_of(stage), pack_arrays(arrays))

    def take(self, name: str, file: Path, digest: str = "") -> None:
        """Stages a file that another wrote into a `subfolder`, unless it stands in the database;
        moves it, or removes it. Its ``digest`` is taken where it is not given; raises as `put`."""
        with writing(file):
            digest = digest or sha256(file.read_bytes())
            if self.keep({name: digest}):
                file.unlink()
            else:
                file.replace(self._place(name))
        self._pending[name] = digest

    def subfolder(self, name: str = "") -> Path:
        """A folder below `folder`, made where it is absent. It goes with the transaction.

        Raises OutputError PTM-O002, PTM-O003, PTM-O005.
        """
        return real_folder(self._db.path, f"{self._relative}/{name}".rstrip("/"))

    def keep(self, outputs: Mapping[str, str]) -> bool:
        """Takes outputs that stand in the database as they are; False if one does not."""
        same = all(self._standing.get(name) == digest for name, digest in outputs.items())
        if not same or self._db.damaged(outputs):
            return False
        self._pending.update(outputs)
        return True

    def resume(self, task: str) -> bool:
        """Takes over the outputs of a task that an interrupted run has finished; False if there
        are none. ``task`` is a digest of all that they depend on."""
        outputs = self._done.get(task)
        if outputs is None:
            return False
        for name, digest in outputs.items():
            if not self._staged(name, digest) and not self.keep({name: digest}):
                return False
        self._pending.update(outputs)
        return True

    def finish(self, task: str, names: Iterable[str]) -> None:
        """Notes in the journal that a task is done, whose outputs were put."""
        line = json.dumps({"task": task, "outputs": {name: self._pending[name] for name in names}})
        folder = self.subfolder()
        with writing(folder), open(folder / _JOURNAL, "a", encoding="utf-8") as journal:
            journal.write(line + "\n")

    def _staged(self, name: str, digest: str) -> bool:
        with suppress(OSError, OutputError):
            file = real_file(self.folder, name)
            return file is not None and sha256(file.read_bytes()) == digest
        return False

    def pending(self) -> dict[str, str]:
        """What was put: name → SHA-256."""
        return dict(self._pending)

    def commit(self, records: Mapping[str, StageRecord]) -> None:
        """Makes what was put the outputs of these stages, and records them."""
        with self._turn:
            manifest = self._db.manifest.with_stages(records)
            write_bytes(self.subfolder() / MANIFEST, manifest.to_bytes(), force=True)
            _complete(self._db.path, self._relative)
            self._db.manifest = manifest
        for name, digest in self._pending.items():
            self._db.digests.note(self._db.path / name, digest)
        self._pending, self._done = {}, {}
        self._standing = manifest.outputs()

    def _place(self, name: str) -> Path:
        """Where an output waits, in a folder that is there."""
        folder, _, base = name.rpartition("/")
        return self.subfolder(folder) / base


def recover(folder: Path) -> None:
    """Completes a commit that was interrupted; of what was not committed, finished tasks stay."""
    staging = real_folder(folder, STAGING, make=False)
    if not staging.is_dir():
        return
    with writing(staging):
        for entry in sorted(staging.iterdir()):
            if entry.is_symlink() or not entry.is_dir():
                entry.unlink()
            elif real_file(entry, MANIFEST):
                _complete(folder, f"{STAGING}/{entry.name}")
    discard(folder, also_finished=False)


def finished_tasks(folder: Path) -> int:
    """How many tasks of an interrupted run wait to be taken over."""
    with suppress(OSError):
        return sum(len(_read_journal(entry)) for entry in (folder / STAGING).iterdir())
    return 0


def discard(folder: Path, *, also_finished: bool) -> None:
    """Removes what was staged; with ``also_finished`` False not if there are finished tasks."""
    staging = folder / STAGING
    if staging.is_symlink() or not staging.is_dir():
        return
    for entry in staging.iterdir():
        if also_finished or not _read_journal(entry):
            shutil.rmtree(entry, ignore_errors=True)
    with suppress(OSError):
        staging.rmdir()


def _read_journal(folder: Path) -> dict[str, dict[str, str]]:
    """Task → its outputs; what a killed process wrote by halves is left out."""
    found: dict[str, dict[str, str]] = {}
    try:
        file = real_file(folder, _JOURNAL) if folder.is_dir() and not folder.is_symlink() else None
        lines = file.read_bytes().splitlines() if file else []
    except OSError:
        return found
    for line in lines:
        with suppress(ValueError, KeyError, TypeError, AttributeError, RecursionError):
            entry = json.loads(line)
            found[str(entry["task"])] = {str(n): str(d) for n, d in entry["outputs"].items()}
    return found


def _complete(folder: Path, relative: str) -> None:
    """Moves committed outputs to their places, removes what they replace, the manifest last."""
    staging = folder / relative
    with writing(folder):
        data = (staging / MANIFEST).read_bytes()
        after = Manifest.from_bytes(data, file=staging / MANIFEST).outputs()
        before = _listed(folder)
        for name in after:
            parent, _, base = name.rpartition("/")
            if source := real_file(staging, name):
                source.replace(real_folder(folder, parent) / base)
        for name in before:
            if name not in after:
                _remove(folder, name)
        (staging / MANIFEST).replace(folder / MANIFEST)
        shutil.rmtree(staging)  # not its parent, in which another transaction may just be beginning


def _listed(folder: Path) -> Iterable[str]:
    """The files that the manifest of a database lists, or one of an earlier schema; none of a
    damaged one, which is replaced."""
    try:
        manifest = read_manifest(folder)
    except DatabaseError:
        with suppress(OSError):
            earlier = listed_before((folder / MANIFEST).read_bytes())
            return sorted(earlier.outputs) if earlier else ()
        return ()
    return manifest.outputs() if manifest else ()


def _remove(folder: Path, name: str) -> None:
    """Removes an output that no stage has any more, and the folders that this empties."""
    file = real_file(folder, name)
    if file is None:
        return
    file.unlink(missing_ok=True)
    with suppress(OSError):
        while (file := file.parent) != folder:
            file.rmdir()
