"""The command that brings a database up to date, with the options of its last build.

Errors advise a build by a `Rebuild` remedy; its command is completed here, above the table of
stages, which knows their options.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from os import PathLike
from pathlib import Path

from ptmtools.errors import DatabaseError, Rebuild
from ptmtools.options import arguments
from ptmtools.pipeline.stages import STAGES
from ptmtools.store.copies import url_of
from ptmtools.store.folder import DatabaseFolder, last_manifest
from ptmtools.store.manifest import Manifest


def build_command(db: str | PathLike[str]) -> str:
    """The command for a database, without the options that
    cannot be read."""
    manifest = last_manifest(Path(db)) or Manifest("")
    options = []
    for name, stage in STAGES.items():
        with suppress(KeyError, ValueError):
            options.append(stage.recorded(manifest.stages[name]))
    parts = [
        "ptm",
        "build-scene",
        manifest.model or "MODEL",
        "-o",
        url_of(Path(db)),
        *arguments(options),
    ]
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
            if (manifest := last_manifest(folder)) and manifest.model:
                fault.remedy = replace(fault.remedy, command=build_command(folder))
                return


def open_database(db: str | PathLike[str]) -> DatabaseFolder:
    """As `DatabaseFolder.open`; errors name the whole command."""
    with naming_command(db):
        return DatabaseFolder.open(db)
