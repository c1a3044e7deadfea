"""Commands that take several files: expansion of names, names of results, failures of one file."""

from __future__ import annotations

import errno
import glob
import os
import re
import stat
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from ptmtools.cli.console import Console, abandon_stdout, report
from ptmtools.cli.parameters import (
    force_option,
    jobs_option,
    json_option,
    limit_option,
    option,
    with_console,
)
from ptmtools.errors import InputError, OutputError, PtmError, naming
from ptmtools.files import output_error, refuse_existing, write_with, writing
from ptmtools.store.layout import sha256

if TYPE_CHECKING:
    from ptmtools.texture.model import Limits

#: The report on a file, as in JSON.
Report = dict[str, Any]

#: As a file name: standard input or output.
STANDARD = "-"


def expand_patterns(names: Iterable[str], suffixes: Sequence[str]) -> list[str]:
    """The files of patterns, which are expanded as by a shell (``**`` is any folder) unless a file
    has that very name; of folders, their files with one of the ``suffixes``; other names unchanged.

    Raises InputError PTM-I120 for a folder without such files.
    """
    files: list[str] = []
    for name in names:
        if os.path.isdir(name):
            inside = sorted(
                entry.path
                for entry in os.scandir(name)
                if entry.is_file() and Path(entry.name).suffix.lower() in suffixes
            )
            if not inside:
                raise InputError(
                    "PTM-I120",
                    "is a folder without such files",
                    file=name,
                    remedy=f"their names end with {', '.join(suffixes)}",
                )
            files += inside
        elif _several(name):
            files += sorted(glob.glob(name, recursive=True)) or [name]
        else:
            files.append(name)
    return files


def many_files(function: Callable[..., Any]) -> Callable[..., Any]:
    """Adds the options of a command that converts files one by one, and passes the `Batch`."""

    @option(
        "--skip-existing",
        is_flag=True,
        help="Skip files whose result exists, for example after an interrupted run.",
    )
    @limit_option
    @jobs_option
    @force_option()
    @json_option
    @with_console
    @wraps(function)
    def command(
        console: Console,
        force: bool,
        skip_existing: bool,
        workers: int,
        limits: Limits,
        **values: Any,
    ) -> Any:
        if force and skip_existing:
            raise click.UsageError("use either --force or --skip-existing, not both")
        return function(Batch(console, force, skip_existing, workers, limits), **values)

    return command


@dataclass(frozen=True)
class FileJob:
    """One file that a command works on.

    Attributes
    ----------
    source: its name; - is standard input.
    target: the file for the result; None is standard output.
    folder: a folder to create first.
    fault: the reason why the file is skipped.
    """

    source: str
    target: Path | None = None
    folder: Path | None = None
    fault: PtmError | None = None

    @property
    def streams(self) -> bool:
        """Whether the source or the result is a stream."""
        return self.to_stdout or _streams(self.source)

    @property
    def to_stdout(self) -> bool:
        """Whether standard output carries the result."""
        return self.target is None and self.fault is None

    def put(self, write: Callable[[IO[bytes]], object], force: bool) -> None:
        """Stores the result that ``write`` writes into a seekable file."""
        if self.target is None:
            to_standard_output(write)
            return
        with naming(self.target):
            if self.folder:
                with writing(self.folder):
                    self.folder.mkdir(parents=True, exist_ok=True)
            write_with(self.target, write, force=force)


@dataclass(frozen=True)
class Shard:
    """The ``number``-th of ``count`` parts of the jobs of a command, from 1 on. Together they are
    all jobs, and each job is in one."""

    number: int
    count: int

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    def jobs(self, jobs: Sequence[FileJob]) -> list[FileJob]:
        """The jobs of this part: by a digest of the path of each source below the folder that all
        have in common. So a machine may have mounted that folder elsewhere than another, and a
        new file in it changes the part of no other."""
        folders = [os.path.dirname(os.path.abspath(job.source)) for job in jobs if job.source]
        common = os.path.commonpath(folders) if folders else ""

        def part(job: FileJob) -> int:
            name = os.path.relpath(os.path.abspath(job.source), common) if job.source else ""
            digest = sha256(os.fsencode(name.replace(os.sep, "/")))
            return int(digest[:16], 16) % self.count + 1

        return [job for job in jobs if part(job) == self.number]


class ShardOf(click.ParamType):  # type: ignore[type-arg]  # generic only in newer Clicks
    """``K/N``."""

    name = "shard"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Shard:
        if isinstance(value, Shard):
            return value
        match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", str(value), re.ASCII)
        if not match or not 1 <= int(match[1]) <= int(match[2]):
            self.fail(f"{value!r} is not a part such as 3/16, with 1 <= 3 <= 16", param, ctx)
        return Shard(int(match[1]), int(match[2]))


def jobs_for(
    given: Sequence[str],
    inside: Sequence[str],
    output: str | None,
    suffix: str,
    suffixes: Sequence[str],
) -> list[FileJob]:
    """One job for each file of `expand_patterns`.

    ``output`` is a folder if it exists as one or ends with a slash, or if the user has ``given``
    several files, a folder or a pattern; a single file of the last two may still go to a name with
    one of ``suffixes``. Sources whose results would have the same name become one job with a
    fault.

    Raises click.UsageError; InputError PTM-I120.
    """
    sources = expand_patterns(given, inside)
    if output == "":
        raise click.BadParameter("the name is empty", None, None, "-o")
    if STANDARD in sources and len(sources) > 1:
        raise click.UsageError("standard input (-) must be the only file")
    unique = _once(sources)
    named = [name for name in unique if name]
    nameless = [FileJob(name, fault=no_name()) for name in unique if not name]
    if output == STANDARD or (output is None and any(map(_streams, named))):
        if len(named) > 1:
            raise click.UsageError("only one file can go to standard output")
        return nameless + [FileJob(name) for name in named]
    if output is None:
        return nameless + _make_jobs(
            {name: _output_path(name, None, suffix) for name in named}, None
        )
    several = max(len(given), len(named)) > 1 or any(
        name != STANDARD and _several(name) for name in given
    )
    is_file = Path(output).suffix.lower() in suffixes
    if os.path.isdir(output) or output.endswith(("/", os.sep)) or (several and not is_file):
        folder = Path(output)
        if os.path.lexists(folder) and not folder.is_dir():
            raise click.BadParameter(f"{folder} is a file, not a folder", None, None, "-o")
        return nameless + _make_jobs({n: _output_path(n, folder, suffix) for n in named}, folder)
    if len(named) > 1:
        raise click.BadParameter(
            f"{output} is one file, but there are {len(named)} to write: specify a folder, or end "
            "the name with a slash",
            None,
            None,
            "-o",
        )
    return nameless + [FileJob(name, Path(output)) for name in named]


def _several(name: str) -> bool:
    """Whether a name is a folder or a pattern."""
    return os.path.isdir(name) or (glob.has_magic(name) and not os.path.lexists(name))


def no_name() -> InputError:
    """The error for an empty name."""
    return InputError(
        "PTM-I120",
        "the name of a file is empty",
        remedy="check the shell variable that it comes from",
    )


def _once(sources: Iterable[str]) -> list[str]:
    """The names without repetitions of a file. Links are files of their own."""
    files: dict[str, str] = {}
    for name in sources:
        folder, file = os.path.split(name)
        key = os.path.join(os.path.realpath(folder), file) if file else name
        files.setdefault(os.path.normcase(key), name)
    return list(files.values())


def _streams(name: str) -> bool:
    """Whether a name is standard input or a named pipe."""
    if name == STANDARD or os.path.dirname(name) in ("/dev", "/dev/fd"):
        return True
    try:
        return stat.S_ISFIFO(os.stat(name).st_mode)
    except OSError:
        return False


def _output_path(name: str, folder: Path | None, suffix: str) -> Path:
    path = Path("stdin" if name == STANDARD else name).with_suffix(suffix)
    return folder / path.name if folder else path


def _make_jobs(targets: dict[str, Path], folder: Path | None) -> list[FileJob]:
    """A job for each target; with a fault if several sources have it."""
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
                "PTM-O101",
                f"{', '.join(names[:-1])} and {names[-1]} would {both} be written to this file",
                file=target,
                remedy="name one of them alone, or write them into different folders",
            )
        jobs.append(FileJob(names[0], target, folder, fault))
    return jobs


@dataclass(frozen=True)
class Batch:
    """The options with which a command converts its files."""

    console: Console
    force: bool
    skip_existing: bool
    workers: int
    limits: Limits

    def skips(self, target: Path | None) -> bool:
        """Whether to keep an existing result; raises OutputError PTM-O001 without an option."""
        if target is None or self.force:
            return False
        if not self.skip_existing:
            refuse_existing(target)
        return target.exists()

    def each(
        self,
        jobs: Sequence[FileJob],
        work: Callable[[FileJob, int], Report],
        lines: Callable[[Report], Iterable[str]],
    ) -> tuple[int, list[Report]]:
        """Runs ``work(job, threads)`` for every job, several at a time; a single job has all the
        threads, each of several has one. The other jobs continue after a failure. See `report`.
        """
        from ptmtools.parallel import map_in_order

        workers = self.workers or os.cpu_count() or 1
        self.console.to_stderr = any(job.to_stdout for job in jobs)
        at_once = min(workers, len(jobs))

        def try_work(job: FileJob) -> Report | Exception:
            if job.fault:
                return job.fault
            try:
                return work(job, max(1, workers // at_once))
            except Exception as fault:
                return fault

        return self.report(map_in_order(try_work, jobs, at_once), len(jobs), lines)

    def report(
        self,
        results: Iterable[Report | Exception],
        total: int,
        lines: Callable[[Report], Iterable[str]],
    ) -> tuple[int, list[Report]]:
        """Prints the ``lines`` of each report, or all reports as JSON at the end; warnings and
        failures go to stderr. Returns the exit status of the first failure, and the reports of
        the other jobs, in order."""
        console, status = self.console, 0
        reports: list[Report] = []
        with console.progress() as progress:
            for done, result in enumerate(results):
                progress(done, total, "files")
                if isinstance(result, Exception):
                    with console.above_progress():
                        failed = report(result, console.verbose)
                    status = status or failed
                    continue
                reports.append(result)
                if result.get("warning"):
                    console.warn(f"{result['file']}: {result['warning']}")
                for line in lines(result) if not console.as_json else ():
                    console.print(line)
        if console.as_json:
            console.json(reports)
        return status, reports


def standard_input() -> bytes:
    """The bytes of standard input."""
    return sys.stdin.buffer.read()


def to_standard_output(write: Callable[[IO[bytes]], object]) -> None:
    """Copies to stdout what ``write`` writes into a seekable file.

    Raises OutputError PTM-O002, PTM-O003; BrokenPipeError if the reader has ended.
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


def check_writable(file: str, *, force: bool) -> None:
    """Raises the `OutputError` of writing the file, before a long computation of its content:
    PTM-O001 it exists, PTM-O002 its folder is missing or read-only."""
    if not force:
        refuse_existing(file)
    path = Path(file).absolute()
    if path.exists() and not path.is_file():
        raise OutputError("PTM-O002", "is not a file", file=file, remedy="specify a file instead")
    with writing(file):
        os.stat(path.parent / ".")  # fails if the parent is a file
        if not os.access(path.parent, os.W_OK | os.X_OK):
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
