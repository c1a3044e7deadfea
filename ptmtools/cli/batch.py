"""Several files by one command: which ones are meant, and what happens when one is bad."""

from __future__ import annotations

import glob
import os
import stat
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from ptmtools.cli.common import as_json, forced, limited, voiced, workers
from ptmtools.cli.failures import report
from ptmtools.cli.output import Voice, abandon_stdout
from ptmtools.errors import InputError, OutputError, PtmError, naming
from ptmtools.files import output_error, refuse_existing, write_with, writing

if TYPE_CHECKING:
    from ptmtools.texture.model import Limits

#: What is said of a file, as in JSON.
Report = dict[str, Any]

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
        elif _several(name):
            found += sorted(glob.glob(name, recursive=True)) or [name]
        else:
            found.append(name)
    return found


def many_files(function: Callable[..., Any]) -> Callable[..., Any]:
    """Adds the options of a command that makes a file of each file, and hands in the `Batch`."""

    @click.option(
        "--skip-existing",
        is_flag=True,
        help="Skip files whose result exists already, for example after an interrupted run.",
    )
    @limited
    @workers
    @forced
    @as_json
    @voiced
    @wraps(function)
    def command(
        voice: Voice,
        force: bool,
        skip_existing: bool,
        workers: int,
        limits: Limits,
        as_json: bool,
        **values: Any,
    ) -> Any:
        if force and skip_existing:
            raise click.UsageError("give either --force or --skip-existing, not both")
        return function(Batch(voice, force, skip_existing, workers, limits, as_json), **values)

    return command


@dataclass(frozen=True)
class Job:
    """One file that a command works on.

    Attributes
    ----------
    source: its name; - is standard input.
    target: where the result goes; None is standard output.
    folder: one to make first, if it is not there.
    fault: why nothing can be done with it.
    """

    source: str
    target: Path | None = None
    folder: Path | None = None
    fault: PtmError | None = None

    @property
    def to_stdout(self) -> bool:
        """Whether standard output carries the result."""
        return self.target is None and self.fault is None

    def put(self, write: Callable[[IO[bytes]], object], force: bool) -> None:
        """What ``write`` puts into the file it is given, which can seek, goes where it belongs."""
        if self.target is None:
            to_standard_output(write)
            return
        with naming(self.target):
            if self.folder:
                with writing(self.folder):
                    self.folder.mkdir(parents=True, exist_ok=True)
            write_with(self.target, write, force=force)


def jobs_for(
    given: Sequence[str],
    inside: Sequence[str],
    output: str | None,
    suffix: str,
    suffixes: Sequence[str],
) -> list[Job]:
    """What is to be done, each of the files that `expanded` finds once.

    ``output`` is a folder if it is one already or ends with a slash, or if those ``given`` by the
    user are several, a folder or a pattern; of the last two, a single file may still go to a name
    with one of ``suffixes``. Different sources whose results would lie in one place are one job, a
    fault.

    Raises click.UsageError; InputError PTM-I128.
    """
    sources = expanded(given, inside)
    if output == "":
        raise click.BadParameter("the name is empty", None, None, "-o")
    if STANDARD in sources and len(sources) > 1:
        raise click.UsageError("standard input (-) must be the only file")
    found = _once(sources)
    named = [name for name in found if name]
    nameless = [Job(name, fault=no_name()) for name in found if not name]
    if output == STANDARD or (output is None and any(map(_streams, named))):
        if len(named) > 1:
            raise click.UsageError("only one file can go to standard output")
        return nameless + [Job(name) for name in named]
    if output is None:
        return nameless + _apart({name: _beside(name, None, suffix) for name in named}, None)
    several = max(len(given), len(named)) > 1 or any(
        name != STANDARD and _several(name) for name in given
    )
    is_file = Path(output).suffix.lower() in suffixes
    if os.path.isdir(output) or output.endswith(("/", os.sep)) or (several and not is_file):
        folder = Path(output)
        if os.path.lexists(folder) and not folder.is_dir():
            raise click.BadParameter(f"{folder} is a file, not a folder", None, None, "-o")
        return nameless + _apart({n: _beside(n, folder, suffix) for n in named}, folder)
    if len(named) > 1:
        raise click.BadParameter(
            f"{output} is one file, but there are {len(named)} to write: name a folder, or end the "
            "name with a slash",
            None,
            None,
            "-o",
        )
    return nameless + [Job(name, Path(output)) for name in named]


def _several(name: str) -> bool:
    """Whether a name that the user gave stands for any number of files."""
    return os.path.isdir(name) or (glob.has_magic(name) and not os.path.lexists(name))


def no_name() -> InputError:
    """The error for an empty name."""
    return InputError(
        "PTM-I120",
        "the name of a file is empty",
        remedy="check the shell variable that it comes from",
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


def _apart(targets: dict[str, Path], folder: Path | None) -> list[Job]:
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
                f"{', '.join(names[:-1])} and {names[-1]} would {both} be written to this file",
                file=target,
                remedy="name one of them alone, or write them into different folders",
            )
        jobs.append(Job(names[0], target, folder, fault))
    return jobs


@dataclass(frozen=True)
class Batch:
    """How a command treats its files: as its options say."""

    voice: Voice
    force: bool
    skip_existing: bool
    workers: int
    limits: Limits
    as_json: bool

    def skips(self, target: Path | None) -> bool:
        """Whether the result is there and stays. Raises OutputError PTM-O001 if it must not be."""
        if target is None or self.force:
            return False
        if not self.skip_existing:
            refuse_existing(target)
        return target.exists()

    def each(
        self,
        jobs: Sequence[Job],
        work: Callable[[Job, int], Report],
        lines: Callable[[Report], Iterable[str]],
    ) -> tuple[int, list[Report]]:
        """``work(job, threads)`` for every job, several at a time; the first failure's exit status,
        and the reports of those done, in the order of the jobs.

        What ``lines`` makes of a report is printed, or with ``as_json`` all of them at the end; in
        both cases a warning in it goes to stderr. A job that fails is reported and the others go
        on. One job has all the threads to itself; of several, each has one.
        """
        from ptmtools.texture.parallel import ordered

        voice, workers = self.voice, self.workers or os.cpu_count() or 1
        voice.to_stderr = any(job.to_stdout for job in jobs)
        at_once = min(workers, len(jobs))

        def guarded(job: Job) -> Report | Exception:
            if job.fault:
                return job.fault
            try:
                return work(job, max(1, workers // at_once))
            except Exception as fault:
                return fault

        status = 0
        reports: list[Report] = []
        with voice.progress() as progress:
            for done, result in enumerate(ordered(guarded, jobs, at_once)):
                progress(done, len(jobs), "files")
                if isinstance(result, Exception):
                    with voice.above_progress():
                        failed = report(result, voice.verbose)
                    status = status or failed
                    continue
                reports.append(result)
                if result.get("warning"):
                    voice.warn(f"{result['file']}: {result['warning']}")
                for line in lines(result) if not self.as_json else ():
                    voice.say(line)
        if self.as_json:
            voice.emit_json(reports)
        return status, reports


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
            fault = output_error("standard output", error)
            fault.remedy = "the output is incomplete"
            raise fault from error
