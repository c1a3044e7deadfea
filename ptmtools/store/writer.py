"""Who may write in a database folder, and what becomes of it afterwards."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Lock as Turn

from ptmtools.errors import DatabaseError, InputError, OutputError
from ptmtools.files import writing
from ptmtools.store.folder import DatabaseFolder, read_manifest
from ptmtools.store.layout import LOCK, MANIFEST, STAGING
from ptmtools.store.lock import acquire
from ptmtools.store.manifest import Manifest, listed_before
from ptmtools.store.transaction import Transaction, discard, recover


class DatabaseWriter(DatabaseFolder):
    """A database that this process, and no other, writes; a context manager.

    When it ends in order, nothing is left of `.ptm-new/`; when it does not, tasks that were
    finished wait there for the next run. A folder that was made for it goes again if nothing was
    committed or finished.
    """

    def __init__(self, path: Path, manifest: Callable[[], Manifest], made: list[Path]) -> None:
        """``manifest`` is asked once nobody else writes; ``made`` are the folders that were made
        for it, outermost first."""
        self._lock, self._made, self._turn = acquire(path), made, Turn()
        try:
            recover(path)
            super().__init__(path, manifest())
        except BaseException:
            self._lock.release()
            raise

    @staticmethod
    def open_for_stage(path: str | os.PathLike[str]) -> DatabaseWriter:
        """An existing database, to run one of its stages; raises as `DatabaseFolder.open` does,
        and PTM-D007 if another process is writing it."""
        DatabaseFolder.open(path)
        return DatabaseWriter(Path(path), lambda: DatabaseFolder.open(path).manifest, [])

    @staticmethod
    def open_for_model(
        path: str | os.PathLike[str], model: str, *, force: bool = False
    ) -> DatabaseWriter:
        """A new database, or one of the same model to resume or update.

        ``model`` is the model's file name. ``force`` allows a folder that is not ours and a
        database of another model; foreign files in it stay.

        Raises
        ------
        OutputError: PTM-O001 if a file is in the way; PTM-O010 if the folder is not empty and not
            ours, or holds another model; PTM-O002 if it cannot be written.
        DatabaseError: PTM-D002, PTM-D003 (without ``force``), PTM-D007.
        """
        folder = Path(path)
        if folder.exists() and not folder.is_dir():
            raise OutputError(
                "PTM-O001",
                "exists and is not a folder",
                file=folder,
                remedy="name another folder with -o",
            )
        made = [p for p in (*reversed(folder.parents), folder) if not p.exists()]
        try:
            with writing(folder):
                folder.mkdir(parents=True, exist_ok=True)
            return DatabaseWriter(folder, lambda: admitted(folder, model, force=force), made)
        except BaseException as fault:
            _unmake(made)
            if isinstance(fault, OutputError) and fault.code == "PTM-O002":
                fault.remedy = "name a folder that you may write to with -o"
            raise

    def __enter__(self) -> DatabaseWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        begun = (self.path / MANIFEST).exists()
        # A model of which nothing can be made leaves nothing behind.
        hopeless = kind is not None and issubclass(kind, InputError)
        with suppress(OSError):
            discard(self.path, also_finished=kind is None or (not begun and hopeless))
        self.digests.save()
        self._lock.release()
        if not begun:
            _unmake(self._made)

    def begin(self, name: str) -> Transaction:
        """A transaction; two at a time have different names."""
        return Transaction(self, name, self._turn)


def admitted(folder: Path, model: str, *, force: bool) -> Manifest:
    """The manifest that a build of ``model`` starts from (design, "Overwriting"): an empty one if
    there is none, or one of an earlier schema.

    Raises as `DatabaseWriter.open_for_model`.
    """
    try:
        manifest = read_manifest(folder)
    except DatabaseError:
        earlier = listed_before((folder / MANIFEST).read_bytes())
        if not force and (earlier is None or earlier.model != model):
            raise
        return Manifest(model, replaced=earlier and earlier.schema)
    if manifest and manifest.model == model:
        return manifest
    if manifest and not force:
        raise OutputError(
            "PTM-O010",
            f"holds the database of another model, {manifest.model}",
            file=folder,
            remedy="name another folder with -o, or give --force to replace it",
        )
    if not force and _has_foreign_files(folder):
        raise OutputError(
            "PTM-O010",
            "the folder is not empty and not a ptmtools database",
            file=folder,
            remedy="name another folder with -o, or give --force to write into it",
        )
    return Manifest(model)


def _has_foreign_files(folder: Path) -> bool:
    with writing(folder):
        return folder.is_dir() and bool({e.name for e in folder.iterdir()} - {STAGING, LOCK})


def _unmake(made: list[Path]) -> None:
    with suppress(OSError):
        for folder in reversed(made):
            folder.rmdir()
