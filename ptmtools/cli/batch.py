"""Several files by one command: which ones are meant, and what happens when one is bad."""

from __future__ import annotations

import glob
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import IO, TypeVar

import click

from ptmtools.cli.failures import report
from ptmtools.cli.output import Voice
from ptmtools.errors import InputError

Job = TypeVar("Job")
Result = TypeVar("Result")

#: As a file name: standard input or output.
STANDARD = "-"


def expanded(names: Iterable[str], suffixes: Sequence[str]) -> list[str]:
    """The files that are meant: a pattern that no file is called, as a shell would expand it
    (``**`` is any folder); a folder as the files of ``suffixes`` in it. What is not there stays.

    Raises InputError PTM-I128 for a folder that has none.
    """
    found: list[str] = []
    for name in names:
        if os.path.isdir(name):
            inside = sorted(
                entry.path
                for entry in os.scandir(name)
                if entry.is_file() and Path(entry.name).suffix.lower() in suffixes
            )
            if not inside:
                raise InputError(
                    "PTM-I128",
                    "is a folder without such files",
                    file=name,
                    remedy=f"their names end with {', '.join(suffixes)}",
                )
            found += inside
        elif name != STANDARD and glob.has_magic(name) and not os.path.lexists(name):
            found += sorted(glob.glob(name, recursive=True)) or [name]
        else:
            found.append(name)
    return found


def targets(
    sources: Sequence[str], output: str | None, given: Sequence[str], suffix: str
) -> list[Path | None]:
    """Where each result goes; None is stdout. ``given`` is what the user named the sources.

    Raises click.UsageError.
    """
    if STANDARD in sources and len(sources) > 1:
        raise click.UsageError("standard input (-) is to be the only file")
    if output == STANDARD or (output is None and STANDARD in sources):
        if len(sources) > 1:
            raise click.UsageError("only one file can go to standard output")
        return [None]
    beside = [Path("stdin" if name == STANDARD else name).with_suffix(suffix) for name in sources]
    if output is None:
        found = beside
    elif Path(output).is_dir():
        found = [Path(output) / path.name for path in beside]
    elif len(sources) == 1 and not Path(given[0]).is_dir():
        found = [Path(output)]
    else:
        raise click.BadParameter(
            "for several files it must be a folder that exists", None, None, "-o"
        )
    if len(set(found)) < len(found):
        raise click.UsageError("two of the files would be written to the same place")
    return list(found)


def for_each(
    voice: Voice,
    jobs: Sequence[Job],
    work: Callable[[Job, int], Result],
    tell: Callable[[Result], object],
    workers: int,
    what: str,
) -> int:
    """``work(job, threads)`` for every job, several at a time, and ``tell`` of each in their
    order. A job that fails is reported and the others go on. The first failure's exit status.

    One job has all the threads to itself; of several, each has one.
    """
    from ptmtools.texture.parallel import ordered

    workers = workers or os.cpu_count() or 1
    at_once = min(workers, len(jobs))

    def guarded(job: Job) -> Result | Exception:
        try:
            return work(job, max(1, workers // at_once))
        except Exception as fault:
            return fault

    status = 0
    with voice.progress() as progress:
        for done, result in enumerate(ordered(guarded, jobs, at_once)):
            progress(done, len(jobs), what)
            if isinstance(result, Exception):
                failed = report(result, voice.verbose)
                status = status or failed
            else:
                tell(result)
    return status


def standard_input() -> bytes:
    """All of it."""
    return sys.stdin.buffer.read()


def to_standard_output(write: Callable[[IO[bytes]], object]) -> None:
    """What ``write`` puts into the file it is given, which can seek, goes to stdout."""
    import shutil
    import tempfile

    with tempfile.TemporaryFile() as file:
        write(file)
        file.seek(0)
        shutil.copyfileobj(file, sys.stdout.buffer)
        sys.stdout.buffer.flush()
