"""Several files by one command: which ones are meant, and what happens when one is bad."""

from __future__ import annotations

import errno
import glob
import os
import stat
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TypeVar

import click

from ptmtools.cli.failures import report
from ptmtools.cli.output import Voice, abandon_stdout
from ptmtools.errors import InputError, OutputError, PtmError
from ptmtools.files import writing

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


@dataclass(frozen=True)
class Job:
    """One file that a command works on.

    Attributes
    ----------
    source: its name; - is standard input.
    target: where the result goes; None is standard output.
    fault: why nothing can be done with it.
    """

    source: str
    target: Path | None = None
    fault: PtmError | None = None

    @property
    def to_stdout(self) -> bool:
        """Whether standard output carries the result."""
        return self.target is None and self.fault is None


def jobs_for(
    sources: Sequence[str], output: str | None, given: Sequence[str], suffix: str
) -> list[Job]:
    """What is to be done, each file once. ``given`` is what the user named the sources.

    Different sources of which the results would lie in one place are one job, a fault.

    Raises click.UsageError.
    """
    if output == "":
        raise click.BadParameter("the name is empty", None, None, "-o")
    if STANDARD in sources and len(sources) > 1:
        raise click.UsageError("standard input (-) is to be the only file")
    found = _once(sources)
    named = [name for name in found if name]
    if output == STANDARD or (output is None and any(map(_streams, named))):
        if len(named) > 1:
            raise click.UsageError("only one file can go to standard output")
        return [Job(name, fault=None if name else no_name()) for name in found]
    if output is None or os.path.isdir(output):
        folder = None if output is None else Path(output)
        beside = [_beside(name, folder, suffix) for name in named]
    elif len(named) == 1 and not os.path.isdir(given[0]):
        beside = [Path(output)]
    else:
        raise click.BadParameter(
            "for several files it must be a folder that exists", None, None, "-o"
        )
    nameless = [Job(name, fault=no_name()) for name in found if not name]
    return nameless + _apart(dict(zip(named, beside, strict=True)))


def no_name() -> InputError:
    """The error for an empty name."""
    return InputError(
        "PTM-I120", "there is no file without a name", remedy="is a variable of the shell empty?"
    )


def _once(sources: Iterable[str]) -> list[str]:
    """Without those that name a file of the same folder again. Links are files of their own."""
    found: dict[str, str] = {}
    for name in sources:
        folder, file = os.path.split(name)
        key = os.path.join(os.path.realpath(folder), file) if file else name
        found.setdefault(os.path.normcase(key), name)
    return list(found.values())


def _streams(name: str) -> bool:
    """Whether it is standard input, or a pipe that has a name; nothing can lie beside those."""
    if name == STANDARD or os.path.dirname(name) in ("/dev", "/dev/fd"):
        return True
    try:
        return stat.S_ISFIFO(os.stat(name).st_mode)
    except OSError:
        return False


def _beside(name: str, folder: Path | None, suffix: str) -> Path:
    path = Path("stdin" if name == STANDARD else name).with_suffix(suffix)
    return folder / path.name if folder else path


def _apart(targets: dict[str, Path]) -> list[Job]:
    """A job for each target that one source has."""
    places: dict[str, list[str]] = {}
    for name, target in targets.items():
        places.setdefault(os.path.normcase(os.path.realpath(target)), []).append(name)
    jobs = []
    for names in places.values():
        target = targets[names[0]]
        fault = None
        if len({os.path.realpath(name) for name in names}) > 1:
            both = "both" if len(names) == 2 else "all"
            fault = OutputError(
                "PTM-O103",
                f"{', '.join(names[:-1])} and {names[-1]} would {both} be written to it",
                file=target,
                remedy="name one of them alone, or write them into different folders",
            )
        jobs.append(Job(names[0], target, fault))
    return jobs


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
        if job.fault:
            return job.fault
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
    """What ``write`` puts into the file it is given, which can seek, goes to stdout.

    Raises OutputError PTM-O002, PTM-O003; BrokenPipeError if nobody reads it.
    """
    import shutil
    import tempfile

    with tempfile.TemporaryFile() as file:
        with writing(tempfile.gettempdir()):
            write(file)
            file.seek(0)
        try:
            shutil.copyfileobj(file, sys.stdout.buffer)
            sys.stdout.buffer.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            abandon_stdout()
            full = error.errno in (errno.ENOSPC, errno.EDQUOT)
            raise OutputError(
                "PTM-O003" if full else "PTM-O002",
                "the disk is full" if full else f"cannot be written ({error.strerror})",
                file="standard output",
                remedy="what was written is not whole",
            ) from error
