"""The command that brings a database up to date, with the options of its last build.

Errors advise a build by a `Rebuild` remedy; its command is completed here, above the table of
stages, which knows their options.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from os import PathLike
from pathlib import Path

from ptmtools.errors import DatabaseError, Rebuild
from ptmtools.files import open_regular
from ptmtools.options import arguments
from ptmtools.pipeline.stages import STAGES
from ptmtools.store.folder import DatabaseFolder, read_manifest
from ptmtools.store.layout import MANIFEST
from ptmtools.store.manifest import StageRecord, listed_before


def build_command(db: str | PathLike[str]) -> str:
    """The command for a database, also for one of an earlier schema; without the options that
    cannot be read."""
    model, stages = _recorded(Path(db))
    options = []
    for name, stage in STAGES.items():
        with suppress(KeyError, ValueError):
            options.append(stage.recorded(stages[name]))
    parts = ["ptm", "build-scene", model or "MODEL", "-o", str(db), *arguments(options)]
    return shlex.join(parts)


@contextmanager
def naming_command(db: str | PathLike[str]) -> Iterator[None]:
    """Completes the `Rebuild` remedy of an error of the database."""
    try:
        yield
    except DatabaseError as fault:
        if isinstance(fault.remedy, Rebuild):
            fault.remedy = replace(fault.remedy, command=build_command(db))
        raise


def complete_remedy(fault: DatabaseError) -> None:
    """As `naming_command`, for the database that contains the file of the error."""
    if (
        isinstance(fault.remedy, Rebuild)
        and fault.file
        and fault.remedy == Rebuild(fault.remedy.text)
    ):
        for folder in (Path(fault.file), *Path(fault.file).parents):
            if _recorded(folder)[0]:
                fault.remedy = replace(fault.remedy, command=build_command(folder))
                return


def open_database(db: str | PathLike[str]) -> DatabaseFolder:
    """As `DatabaseFolder.open`; errors name the whole command."""
    with naming_command(db):
        return DatabaseFolder.open(db)


def _recorded(folder: Path) -> tuple[str, Mapping[str, StageRecord]]:
    """The model of a database, "" if it is not known, and the records of its stages."""
    with suppress(DatabaseError):
        manifest = read_manifest(folder)
        return (manifest.model, manifest.stages) if manifest else ("", {})
    with suppress(OSError), open_regular(folder / MANIFEST) as stream:
        if earlier := listed_before(stream.read()):
            return earlier.model, earlier.stages
    return "", {}
