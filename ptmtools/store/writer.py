"""The right to write in a database folder, and the folders that a build accepts."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Lock

from ptmtools.errors import DatabaseError, InputError, OutputError
from ptmtools.files import writing
from ptmtools.store.folder import DatabaseFolder, read_manifest
from ptmtools.store.layout import LOCK, MANIFEST, STAGING
from ptmtools.store.lock import acquire
from ptmtools.store.manifest import Manifest
from ptmtools.store.transaction import Transaction, discard, recover, remove_former


class DatabaseWriter(DatabaseFolder):
    """A database that only this process writes; a context manager.

    At a normal end it removes `.ptm-new/`; at another end, finished tasks stay there for the next
    run. If nothing was committed or finished, it removes the folders that it has created.
    """

    def __init__(
        self,
        path: Path,
        manifest: Callable[[], Manifest],
        created: list[Path],
        *,
        thoroughly: bool = False,
    ) -> None:
        """``manifest`` is called with the lock held; ``created`` are the folders created for the
        database, outermost first; ``thoroughly`` is for `without_lost`."""
        self._release, self._created, self._turn = acquire(path), created, Lock()
        #: Whether the database has only what a model that cannot be built must not leave behind.
        self.provisional = False
        try:
            recover(path)
            super().__init__(path, manifest())
            self.manifest = self.without_lost(thoroughly=thoroughly)
        except BaseException:
            self._release()
            raise

    @staticmethod
    def open_for_stage(path: str | os.PathLike[str]) -> DatabaseWriter:
        """An existing database, to run one of its stages; raises as `DatabaseFolder.open`, and
        PTM-D007 if another process is writing it."""
        DatabaseFolder.open(path)
        return DatabaseWriter(Path(path), lambda: DatabaseFolder.open(path).manifest, [])

    @staticmethod
    def open_for_model(
        path: str | os.PathLike[str], model: str, *, force: bool = False
    ) -> DatabaseWriter:
        """A new database, or one of the same model to resume or update.

        ``model`` is the model's file name. ``force`` allows a foreign folder, whose files stay, and
        a database of another model.

        Raises
        ------
        OutputError: PTM-O001 if the path is a file; PTM-O010 if the folder is not empty and no
            database, or holds another model; PTM-O002 if it cannot be written.
        DatabaseError: PTM-D002, PTM-D003 (without ``force``), PTM-D007.
        """
        folder = Path(path)
        if folder.exists() and not folder.is_dir():
            raise OutputError(
                "PTM-O001",
                "exists and is not a folder",
                file=folder,
                remedy="specify another folder with -o",
            )
        created = [p for p in (*reversed(folder.parents), folder) if not p.exists()]
        try:
            with writing(folder):
                folder.mkdir(parents=True, exist_ok=True)
            manifest = partial(starting_manifest, folder, model, force=force)
            return DatabaseWriter(folder, manifest, created, thoroughly=force)
        except BaseException as fault:
            _remove_empty(created)
            if isinstance(fault, OutputError) and fault.code == "PTM-O002":
                fault.remedy = "specify a folder that you may write to with -o"
            raise

    def __enter__(self) -> DatabaseWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        # A model that cannot be built leaves nothing behind.
        hopeless = kind is not None and issubclass(kind, InputError)
        with suppress(OSError):
            if hopeless and self.provisional and (self.path / MANIFEST).exists():
                remove_former(self.path, self.manifest, Manifest(self.manifest.model))
                (self.path / MANIFEST).unlink()
        committed = (self.path / MANIFEST).exists()
        with suppress(OSError):
            discard(self.path, also_finished=kind is None or (not committed and hopeless))
        self.digests.save()
        self._release()
        if not committed:
            _remove_empty(self._created)

    def begin(self, name: str) -> Transaction:
        """A transaction; concurrent ones have different names."""
        return Transaction(self, name, self._turn)


def starting_manifest(folder: Path, model: str, *, force: bool) -> Manifest:
    """The manifest that a build of ``model`` starts from (design, "Overwriting"): an empty one for
    a new folder.

    Raises as `DatabaseWriter.open_for_model`.
    """
    try:
        manifest = read_manifest(folder)
    except DatabaseError:
        if not force:
            raise
        return Manifest(model)
    if manifest and manifest.model == model:
        return manifest
    if manifest and not force:
        raise OutputError(
            "PTM-O010",
            f"holds the database of another model, {manifest.model}",
            file=folder,
            remedy="specify another folder with -o, or use --force to replace it",
        )
    if not force and _has_foreign_files(folder):
        raise OutputError(
            "PTM-O010",
            "the folder is neither empty nor a ptmtools database",
            file=folder,
            remedy="specify another folder with -o, or use --force to write into it",
        )
    return Manifest(model)


def _has_foreign_files(folder: Path) -> bool:
    with writing(folder):
        return folder.is_dir() and bool({e.name for e in folder.iterdir()} - {STAGING, LOCK})


def _remove_empty(created: list[Path]) -> None:
    with suppress(OSError):
        for folder in reversed(created):
            folder.rmdir()
