"""The `ptm` command: which commands there are, and what becomes of a failure.

Each command lives in a module that is imported when it is called, so that ``ptm --version`` and
``ptm --help`` need nothing but Click. Whatever goes wrong ends in one line on stderr,
``ptm: … [CODE]``, and in the exit status that `ptmtools.errors` documents.
"""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Sequence

import click

from ptmtools.cli.failures import BROKEN_PIPE, report
from ptmtools.cli.output import Voice, abandon_stdout
from ptmtools.progress import listen
from ptmtools.version import __version__

#: command → (module, function, what `ptm --help` says).
COMMANDS = {
    "build-scene": (
        "scenes",
        "build_scene",
        "Build or update a database from a model: all stages.",
    ),
    "cells": ("scenes", "cells", "Read a model and cut it into cells and portals."),
    "pvs": ("scenes", "pvs", "Find which cells may see each other."),
    "ach": ("scenes", "ach", "Measure how much of the view each visible cell covers."),
    "textures": ("scenes", "textures", "Encode the model's images as progressive textures."),
    "emit": ("scenes", "emit", "Write the VRML97 files and hints.json."),
    "status": ("status", "status", "Say which stages of a database are done."),
    "validate": ("reports", "validate", "Check a database or a .ptm file."),
    "info": ("information", "info", "Say what is in a database or a .ptm file."),
    "plot": ("reports", "plot", "Draw the floor plan of a database."),
    "tradeoff": ("tradeoff", "tradeoff", "Measure what the knobs of the stages cost and bring."),
    "encode": ("images", "encode", "Encode images as .ptm files."),
    "decode": ("images", "decode", "Decode .ptm files to images."),
    "compare": ("comparing", "compare", "Compare .ptm with other image formats: size and speed."),
}


class Commands(click.Group):
    """A group whose commands are imported when they are needed."""

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except BrokenPipeError:  # Click itself would make an internal error of it
            ctx.exit(BROKEN_PIPE)
        except KeyboardInterrupt as fault:  # Click itself would print an empty line first
            raise click.Abort from fault

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module, function, _ = COMMANDS[cmd_name]
        command = getattr(importlib.import_module(f"ptmtools.cli.{module}"), function)
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name][2]) for name in COMMANDS])


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="`ptm COMMAND --help` explains a command. Exit statuses: docs/cli.md.",
)
@click.version_option(__version__, prog_name="ptm", message="%(prog)s %(version)s")
@click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")
@click.option("-v", "--verbose", is_flag=True, help="Say more; with errors, the traceback.")
@click.pass_context
def ptm(ctx: click.Context, quiet: bool, verbose: bool) -> None:
    """Turn an architectural model into a database that streams."""
    voice = ctx.ensure_object(Voice)
    voice.quiet, voice.verbose = quiet, verbose
    if not quiet and sys.stderr.isatty():
        listen(voice.warn)


def main(arguments: Sequence[str]) -> int:
    """Runs one command; returns its exit status. Never raises."""
    voice = Voice()
    warnings.filterwarnings("ignore", module=r"PIL\.")  # whatever matters becomes an error of ours
    try:
        status = ptm.main(list(arguments), "ptm", standalone_mode=False, obj=voice)
        sys.stdout.flush()
        return status if isinstance(status, int) else 0
    except BaseException as fault:
        status = report(fault, voice.verbose)
        try:
            sys.stdout.flush()
        except OSError:
            abandon_stdout()
        return status


def run() -> None:
    """The console script."""
    sys.exit(main(sys.argv[1:]))
