"""Options and arguments that several commands share."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.output import Voice
from ptmtools.errors import OutputError
from ptmtools.files import refuse_existing, writing

Command = Callable[..., Any]

_ADDRESS = re.compile(r"\w+://.+:\d+")


def voiced(function: Command) -> Command:
    """Adds ``-q`` and ``-v``, and hands the `Voice` in as the first argument."""

    @click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
    @click.option("-v", "--verbose", is_flag=True, help="Print more, and tracebacks of errors.")
    @click.pass_obj
    @wraps(function)
    def command(voice: Voice, /, quiet: bool, verbose: bool, **values: Any) -> Any:
        voice.quiet |= quiet
        voice.verbose |= verbose
        return function(voice, **values)

    return command


def as_json(function: Command) -> Command:
    """Adds ``--json`` as ``as_json``."""
    return click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")(
        function
    )


def forced(function: Command) -> Command:
    """Adds ``--force``."""
    text = (
        "Replace existing files, or a database of another model; write into a folder that is not a "
        "database."
    )
    return click.option("--force", is_flag=True, help=text)(function)


def workers(function: Command) -> Command:
    """Adds ``-j``; 0 is one for each processor."""
    return click.option(
        "-j",
        "--jobs",
        "workers",
        type=click.IntRange(0, 1024),
        default=0,
        metavar="N",
        help="Number of workers; 0, the default, is one for each processor. It does not change the "
        "result.",
    )(function)


def many_machines(function: Command) -> Command:
    """Adds ``-j`` and ``--scheduler``, the arguments of `open_executor`."""
    return click.option(
        "--scheduler",
        metavar="ADDRESS",
        callback=_address,
        help="Run the tasks on the cluster of this Dask scheduler, such as tcp://10.0.0.1:8786; "
        "-j then limits how many run at a time; 0 is as many as the cluster has threads.",
    )(workers(function))


def _address(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    if value is not None and not _ADDRESS.fullmatch(value):
        raise click.BadParameter(f"{value!r} is not an address such as tcp://10.0.0.1:8786")
    return value


def limited(function: Command) -> Command:
    """Adds ``--limit`` as ``limits``."""

    @click.option(
        "--limit",
        type=click.IntRange(1, 1 << 20),
        default=1024,
        show_default=True,
        metavar="MIB",
        help="Refuse an image that takes more memory than this once decoded, in MiB.",
    )
    @wraps(function)
    def command(*arguments: Any, limit: int, **values: Any) -> Any:
        from ptmtools.texture.model import Limits

        return function(*arguments, limits=Limits(decoded_bytes=limit << 20), **values)

    return command


def database(function: Command) -> Command:
    """Adds the argument ``DB``."""
    return click.argument("db", type=click.Path())(function)


def new_database(function: Command) -> Command:
    """Adds ``-o DB`` to a command that is given a model; by default it lies beside the model."""

    @click.option(
        "-o",
        "--output",
        "db",
        type=click.Path(),
        metavar="DB",
        help="The database, a folder. By default museum.obj makes museum.db, in the same folder.",
    )
    @wraps(function)
    def command(*arguments: Any, model: str, db: str | None, **values: Any) -> Any:
        if not model or db == "":
            raise click.UsageError("a name is empty")
        place = os.fspath(Path(model).with_suffix(".db")) if db is None else db
        return function(*arguments, model=model, db=place, **values)

    return command


def writable(file: str, force: bool) -> None:
    """Raises the `OutputError` that writing the file would end in, before much is measured for it:
    PTM-O001 it exists, PTM-O002 there is no such folder, or none that may be written to."""
    if not force:
        refuse_existing(file)
    path = Path(file).absolute()
    if path.exists() and not path.is_file():
        raise OutputError("PTM-O002", "is not a file", file=file, remedy="name a file instead")
    with writing(file):
        os.stat(path.parent / ".")  # what is no folder fails too
        if not os.access(path.parent, os.W_OK | os.X_OK):
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
