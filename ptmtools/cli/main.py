"""The command `ptm`: its table of commands, and the exit status of a failure.

The module of a command is imported when the command is called, so that ``ptm --version`` and
``ptm --help`` need nothing but Click. A failure prints one line on stderr, ``ptm: … [CODE]``, and
ends with an exit status of `ptmtools.errors`.
"""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from ptmtools.cli.console import BROKEN_PIPE, Console, abandon_stdout, report
from ptmtools.progress import listen
from ptmtools.version import __version__

if TYPE_CHECKING:
    from ptmtools.pipeline.stage import Stage


@dataclass(frozen=True)
class Entry:
    """A command: its line in ``ptm --help``, and ``module:function``, which is the `click.Command`
    or makes it."""

    about: str
    place: str
    hidden: bool = False

    def load(self) -> click.Command:
        """The command; imports its module."""
        module, _, name = self.place.partition(":")
        command = getattr(importlib.import_module(f"ptmtools.cli.{module}"), name)
        return command if isinstance(command, click.Command) else command()


#: Heading → name → command. Besides, each stage has a command.
GROUPS: dict[str, dict[str, Entry]] = {
    "Start": {
        "sample": Entry("Write a model to try ptmtools on.", "sample:sample"),
    },
    "Build and check": {
        "build-scene": Entry("Build or update a database from a model.", "build:build_scene"),
        "info": Entry("Describe a model, a database or a .ptm file.", "info:info"),
        "validate": Entry("Check a database or a .ptm file.", "check:validate"),
        "status": Entry("Show which stages of a database are up to date.", "build:status"),
        "plot": Entry("Draw the floor plan of a database.", "check:plot"),
        "render": Entry("Draw a view of a database or an octree texture.", "render:render"),
        "warm-up": Entry("Compile before the first run.", "build:warm_up", hidden=True),
    },
    "Publish": {
        "serve": Entry("Serve a database to browsers on this machine.", "publish:serve"),
        "publish": Entry("Write a database as a web site.", "publish:publish"),
        "tour": Entry("Label the works of a building.", "tour:commands"),
    },
    "Images": {
        "encode": Entry("Encode images as .ptm files.", "images:encode"),
        "decode": Entry("Decode .ptm files to images.", "images:decode"),
        "compare": Entry("Compare .ptm with other image formats.", "images:compare"),
        "interlace": Entry(
            "Split an image into files that add detail step by step.", "interlaced:interlace"
        ),
        "deinterlace": Entry("Join the files of an interlaced image.", "interlaced:deinterlace"),
    },
    "Other representations": {
        "apo": Entry(
            "Convert a mesh to a simplified mesh and an octree texture.", "representations:apo"
        ),
        "campus": Entry(
            "Convert a model to objects with levels of detail.", "representations:campus"
        ),
    },
    "Experiments": {
        "path": Entry("Generate a walk through every room of a database.", "lab:path_command"),
        "simulate": Entry(
            "Simulate visitors and the clients that load a database for them.", "lab:simulate"
        ),
        "walk-campus": Entry("Simulate a walk through a campus.", "lab:walk_campus"),
        "tradeoff": Entry("Measure the cost and the benefit of each option.", "tradeoff:tradeoff"),
    },
}
COMMANDS = {name: entry for group in GROUPS.values() for name, entry in group.items()}


class Commands(click.Group):
    """A group whose commands are imported when they are called."""

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except BrokenPipeError:  # Click would make it an internal error
            ctx.exit(BROKEN_PIPE)
        except KeyboardInterrupt as fault:  # Click would print an empty line first
            raise click.Abort from fault

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*COMMANDS, *_stages()]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if entry := COMMANDS.get(cmd_name):
            return entry.load()
        stage = _stages().get(cmd_name)
        if stage is None:
            return None
        from ptmtools.cli.build import stage_command

        return stage_command(stage)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """The commands and options that begin so; imports no command."""
        abouts = {name: entry.about for name, entry in COMMANDS.items() if not entry.hidden}
        abouts |= {name: stage.about for name, stage in _stages().items()}
        return [
            *(CompletionItem(n, help=a) for n, a in abouts.items() if n.startswith(incomplete)),
            *click.Command.shell_complete(self, ctx, incomplete),
        ]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        tables = {
            heading: [(name, entry.about) for name, entry in group.items() if not entry.hidden]
            for heading, group in GROUPS.items()
        }
        tables["Individual stages of build-scene"] = [(n, s.about) for n, s in _stages().items()]
        width = max(len(name) for rows in tables.values() for name, _ in rows)
        for heading, rows in tables.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(width), about) for name, about in rows])


def _stages() -> dict[str, Stage[Any]]:
    """The stages that have a command, by its name."""
    from ptmtools.pipeline.stages import STAGES

    return {name: stage for name, stage in STAGES.items() if not stage.joined}


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="`ptm COMMAND --help` explains a command. Exit statuses: docs/guide/cli.md. Terms: "
    "docs/guide/glossary.md.",
)
@click.version_option(__version__, prog_name="ptm", message="%(prog)s %(version)s")
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
@click.option("-v", "--verbose", is_flag=True, help="Print details, and the traceback of an error.")
@click.pass_context
def ptm(ctx: click.Context, quiet: bool, verbose: bool) -> None:
    """Turn an architectural model into a database that clients can stream."""
    console = ctx.ensure_object(Console)
    console.quiet, console.verbose = quiet, verbose
    if not quiet and sys.stderr.isatty():
        listen(console.warn)


def main(arguments: Sequence[str]) -> int:
    """Runs one command; returns its exit status. Never raises."""
    console = Console()
    warnings.filterwarnings("ignore", module=r"PIL\.")  # serious ones become errors of ptmtools
    try:
        status = ptm.main(list(arguments), "ptm", standalone_mode=False, obj=console)
        sys.stdout.flush()
        return status if isinstance(status, int) else 0
    except BaseException as fault:
        status = report(fault, console.verbose)
        try:
            sys.stdout.flush()
        except OSError:
            abandon_stdout()
        return status


def run() -> None:
    """The console script."""
    sys.exit(main(sys.argv[1:]))
