"""What a command says: messages and progress on stderr, results on stdout."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from ptmtools.progress import Progress, silent

if TYPE_CHECKING:
    from rich.progress import Progress as Bars, TaskID


@dataclass
class Voice:
    """How much to say: `quiet` nothing but errors, `verbose` every note and tracebacks.

    With `to_stderr`, stdout carries a file, and what is said goes to stderr.
    """

    quiet: bool = False
    verbose: bool = False
    to_stderr: bool = False
    #: Where a progress bar is being shown.
    _bars: Bars | None = None

    def say(self, text: str) -> None:
        """A line of the result, on stdout."""
        if not self.quiet:
            with self.above_progress():
                click.echo(printable(text), err=self.to_stderr)

    def warn(self, text: str) -> None:
        """A line on stderr, of what is wrong and does not stop the command."""
        with self.above_progress():
            click.echo(f"ptm: {printable(text)}", err=True)

    @contextmanager
    def above_progress(self) -> Iterator[None]:
        """What is printed meanwhile stays above the progress bar, if one is shown."""
        if self._bars:
            self._bars.stop()
        try:
            yield
        finally:
            if self._bars:
                self._bars.start()

    def emit_json(self, document: Any) -> None:
        """The result as JSON on stdout; ``--quiet`` does not silence what was asked for. What is
        not a finite number, which JSON cannot say, becomes null."""
        import json

        text = json.dumps(_finite(document), indent=1, ensure_ascii=False, allow_nan=False)
        click.echo(text.encode("utf-8", "backslashreplace"), err=self.to_stderr)

    @contextmanager
    def progress(self) -> Iterator[Progress]:
        """A progress bar if stderr is a terminal, else nothing."""
        if self.quiet or not sys.stderr.isatty():
            yield silent
            return
        from rich.console import Console
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
            console=Console(stderr=True),
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
    """A text without what terminals obey, which names of models and files may hold; line ends and
    tabs stay. What no file can be written with is escaped too."""
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
    """Nothing more goes to stdout: what its buffer holds, which Python would try to write once more
    as it ends, is lost."""
    with suppress(OSError, ValueError):  # of a stream that is no file
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
