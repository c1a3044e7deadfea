"""Output of a command: results on stdout, messages, progress and failures on stderr."""

from __future__ import annotations

import errno
import math
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from ptmtools.cli.interrupts import is_interrupt
from ptmtools.errors import DatabaseError, PtmError
from ptmtools.progress import Progress, silent

if TYPE_CHECKING:
    from rich.progress import Progress as Bars, TaskID


#: Exit statuses beside those of the error classes; see `ptmtools.errors`.
INTERNAL, USAGE, INTERRUPTED, BROKEN_PIPE = 1, 2, 130, 141

_MEMORY = (
    "not enough memory; use smaller images, fewer cells (--max-leaves) or fewer workers (-j 1) "
    "[PTM-L099]"
)


@dataclass
class Console:
    """The output of a command.

    Attributes
    ----------
    quiet: print errors only.
    verbose: print all notes, and tracebacks of errors.
    as_json: print the result as JSON.
    to_stderr: stdout carries a file, and results go to stderr.
    """

    quiet: bool = False
    verbose: bool = False
    as_json: bool = False
    to_stderr: bool = False
    #: The progress bars on the terminal, if any.
    _bars: Bars | None = None

    def print(self, text: str) -> None:
        """Prints a line of the result on stdout."""
        if not self.quiet:
            with self.above_progress():
                click.echo(printable(text), err=self.to_stderr)

    def result(self, document: Any, lines: Iterable[str]) -> None:
        """Prints the result of a command: its JSON document, or its lines."""
        if self.as_json:
            self.json(document)
            return
        for line in lines:
            self.print(line)

    def warn(self, text: str) -> None:
        """Prints a line on stderr about a problem that does not stop the command, unless quiet."""
        if self.quiet:
            return
        with self.above_progress():
            click.echo(f"ptm: {printable(text)}", err=True)

    @contextmanager
    def above_progress(self) -> Iterator[None]:
        """Lines printed in this context stay above the progress bar."""
        if self._bars:
            self._bars.stop()
        try:
            yield
        finally:
            if self._bars:
                self._bars.start()

    def json(self, document: Any) -> None:
        """Prints the result as JSON on stdout, also with ``--quiet``; numbers that are not finite
        become null."""
        import json

        text = json.dumps(_finite(document), indent=1, ensure_ascii=False, allow_nan=False)
        click.echo(text.encode("utf-8", "backslashreplace"), err=self.to_stderr)

    @contextmanager
    def progress(self) -> Iterator[Progress]:
        """Shows a progress bar if stderr is a terminal."""
        if self.quiet or not sys.stderr.isatty():
            yield silent
            return
        from rich.console import Console as Terminal
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress as Bars,
            TextColumn,
            TimeElapsedColumn,
        )

        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
        # stdout may be a file.
        with Bars(
            *columns,
            TimeElapsedColumn(),
            console=Terminal(stderr=True),
            transient=True,
            redirect_stdout=False,
        ) as bars:
            task: dict[str, TaskID] = {}

            def update(done: int, total: int, what: str) -> None:
                if what not in task:
                    task[what] = bars.add_task(what, total=total)
                bars.update(task[what], completed=done, total=total)

            self._bars = bars
            try:
                yield update
            finally:
                self._bars = None


def printable(text: str) -> str:
    """A text with control characters and lone surrogates escaped, which names of models and files
    may hold; line ends and tabs stay."""
    if text.isprintable():
        return text
    return "".join(
        letter if letter.isprintable() or letter in "\n\t" else ascii(letter)[1:-1]
        for letter in text
    )


def _finite(value: Any) -> Any:
    """A JSON document with None for NaN and the infinities."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {name: _finite(inner) for name, inner in value.items()}
    return [_finite(inner) for inner in value] if isinstance(value, (list, tuple)) else value


def abandon_stdout() -> None:
    """Discards the buffer of stdout, which Python would otherwise try to write again at its end."""
    with suppress(OSError, ValueError):  # the stream is not a file
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def report(fault: BaseException, verbose: bool) -> int:
    """Prints a failure, with ``verbose`` its traceback; returns the exit status."""
    status, line = describe(fault)
    if line:
        print(f"ptm: {printable(line)}", file=sys.stderr)
    if verbose and not isinstance(fault, click.ClickException | SystemExit):
        import traceback

        traceback.print_exception(fault)
    return status


def describe(fault: BaseException) -> tuple[int, str]:
    """(exit status, one line) of the exception that ended a command; the line may be empty."""
    match fault:
        case PtmError():
            if isinstance(fault, DatabaseError):
                from ptmtools.pipeline.command import complete_remedy

                complete_remedy(fault)
            if fault.file:
                from ptmtools.store.copies import url_of

                fault.file = url_of(fault.file)
            return fault.exit_status, str(fault)
        case click.exceptions.NoArgsIsHelpError():
            return USAGE, fault.format_message()
        case click.UsageError():
            path = fault.ctx.command_path if fault.ctx else "ptm"
            message = " ".join(fault.format_message().split()).rstrip(".")
            return USAGE, f"{message}; see `{path} --help` [PTM-U001]"
        case click.exceptions.Exit():
            return fault.exit_code, ""
        case KeyboardInterrupt() | click.Abort():
            return INTERRUPTED, "interrupted; run the same command again to resume [PTM-X130]"
        case BrokenPipeError():
            return BROKEN_PIPE, ""
        case MemoryError():
            return 7, _MEMORY
        case ImportError() if "failed to map segment" in str(fault):  # no room for a library
            return 7, _MEMORY
        case OSError(errno=errno.ENOSPC | errno.EDQUOT):
            return 4, f"{_file_of(fault)}the disk is full; free some space and run again [PTM-O003]"
        case OSError(errno=int()):
            return (
                3,
                f"{_file_of(fault)}{fault.strerror}; check the path and its permissions [PTM-I122]",
            )
        case SystemExit():
            return fault.code if isinstance(fault.code, int) else INTERNAL, ""
    if is_interrupt(fault):
        return describe(KeyboardInterrupt())
    message = " ".join(str(fault).split())
    return INTERNAL, (
        f"internal error, {type(fault).__name__}: {message}; please report it, "
        "run with -v for the traceback [PTM-X001]"
    )


def _file_of(fault: OSError) -> str:
    return f"{fault.filename}: " if fault.filename else ""
