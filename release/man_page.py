"""Writes the manual page of `ptm`, ptm.1, from the help of its commands.

    python release/man_page.py -o release/man/ptm.1

The commands write their help as they do for ``--help-all``, into a formatter that emits the macros
of man(7). No date: the same release gives the same bytes.
"""

from __future__ import annotations

import argparse
import re
import textwrap
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from ptmtools.cli.main import ptm
from ptmtools.cli.parameters import HELP_ALL
from ptmtools.version import __version__

HEAD = f"""\
.TH PTM 1 "" "ptmtools {__version__}" "User Commands"
.ad l
.nh
.SH NAME
ptm \\- prepare architectural scenes for walking through them over a network
"""
TAIL = """\
.SH EXIT STATUS
0 after success, else the number of a kind of error, from 1 to 9;
130 after an interruption.
Errors end with a code in brackets.
.SH SEE ALSO
The guide and the list of codes are in the folder docs of the source.
"""
#: Code in a help text.
CODE = re.compile(r"`([^`]+)`")


def escaped(text: str) -> str:
    """A text as lines of roff."""
    text = CODE.sub(r"\\fB\1\\fR", text.replace("\\", r"\e").replace("-", r"\-"))
    text = text.replace("|", r"|\:")  # a long choice may break there
    lines = textwrap.wrap(text, 78, break_long_words=False, break_on_hyphens=False)
    return "\n".join(rf"\&{line}" if line[0] in ".'" else line for line in lines)


class ManFormatter(click.HelpFormatter):
    """Emits paragraphs, headings and lists of definitions as macros."""

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        self.write(f".PP\n\\fB{escaped(prog)}\\fR {escaped(args)}\n")

    def write_paragraph(self) -> None:
        """The text that follows begins one anyway."""

    def write_text(self, text: str) -> None:
        for paragraph in text.replace("\b", "").split("\n\n"):
            self.write(f".PP\n{escaped(paragraph)}\n")

    def write_heading(self, heading: str) -> None:
        self.write(f".SS {escaped(heading)}\n")

    def write_dl(
        self, rows: Iterable[tuple[str, str]], col_max: int = 30, col_spacing: int = 2
    ) -> None:
        for term, text in rows:
            self.write(f".TP\n\\fB{escaped(term)}\\fR\n{escaped(text)}\n")

    @contextmanager
    def indentation(self) -> Iterator[None]:
        yield


def _context(
    command: click.Command, name: str, parent: click.Context | None = None
) -> click.Context:
    return click.Context(command, parent, name, **command.context_settings)


def commands_of(
    command: click.Command, context: click.Context
) -> Iterator[tuple[click.Command, click.Context]]:
    """The command and those below it that are not hidden, each with its context."""
    yield command, context
    if isinstance(command, click.Group):
        names = [item.value for item in command.shell_complete(context, "")]
        for name in command.list_commands(context):
            child = command.get_command(context, name)
            if child is not None and name in names:
                yield from commands_of(child, _context(child, name, context))


def man_page() -> str:
    """The page, in roff."""
    text = HEAD
    for command, context in commands_of(ptm, _context(ptm, "ptm")):
        context.meta[HELP_ALL] = True
        formatter = ManFormatter()
        command.format_help(context, formatter)
        title = "SYNOPSIS" if command is ptm else escaped(context.command_path)
        text += f".SH {title}\n{formatter.getvalue()}"
    return re.sub(r"(\.S[HS] .*\n)\.PP\n", r"\1", text + TAIL)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE")
    output: Path = parser.parse_args().output
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(man_page(), "utf-8")


if __name__ == "__main__":
    main()
