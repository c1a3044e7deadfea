"""The command `ptm`: its table of commands, and the exit status of a failure.

The module of a command is imported when the command is called, so that ``ptm --version`` and
``ptm --help`` need nothing but Click. A failure prints one line on stderr, ``ptm: … [CODE]``, and
ends with an exit status of `ptmtools.errors`.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from ptmtools import plugins
from ptmtools.cli.console import BROKEN_PIPE, Console, abandon_stdout, report
from ptmtools.cli.entry import Entry
from ptmtools.cli.interrupts import LostInterrupts, is_interrupt
from ptmtools.progress import listen
from ptmtools.version import __version__

if TYPE_CHECKING:
    from ptmtools.pipeline.stage import Stage

_CLI = "ptmtools.cli"

#: The headings of ``ptm --help``, in their order; those of other packages follow.
HEADINGS = ("Start", "Build and check", "Publish", "Images", "Other representations")
#: The commands of the product. Besides, each stage has a command, and so has each entry point of
#: the group ``ptmtools.commands``.
OWN = {
    "build-scene": Entry(
        "Build and check", "Build or update a database from a model.", f"{_CLI}.build:build_scene"
    ),
    "info": Entry(
        "Build and check", "Describe a model, a database or a .ptm file.", f"{_CLI}.info:info"
    ),
    "validate": Entry(
        "Build and check", "Check a database or a .ptm file.", f"{_CLI}.check:validate"
    ),
    "status": Entry(
        "Build and check",
        "Show which stages of a database are up to date.",
        f"{_CLI}.build:status",
    ),
    "plot": Entry("Build and check", "Draw the floor plan of a database.", f"{_CLI}.check:plot"),
    "render": Entry(
        "Build and check",
        "Draw a view of a database or an octree texture.",
        f"{_CLI}.render:render",
    ),
    "warm-up": Entry(
        "Build and check", "Compile before the first run.", f"{_CLI}.build:warm_up", hidden=True
    ),
    "serve": Entry(
        "Publish", "Serve a database to browsers on this machine.", f"{_CLI}.publish:serve"
    ),
    "publish": Entry("Publish", "Write a database as a web site.", f"{_CLI}.publish:publish"),
    "tour": Entry("Publish", "Label the works of a building.", f"{_CLI}.tour:commands"),
    "encode": Entry("Images", "Encode images as .ptm files.", f"{_CLI}.images:encode"),
    "decode": Entry("Images", "Decode .ptm files to images.", f"{_CLI}.images:decode"),
}


def entries() -> dict[str, Entry]:
    """All commands that are not stages, by name; raises as `plugins.declarations`."""
    return {**plugins.declarations("commands", Entry), **OWN}


def commands_by_heading() -> dict[str, dict[str, Entry]]:
    """Heading → name → command, in the order of ``ptm --help``."""
    groups: dict[str, dict[str, Entry]] = {heading: {} for heading in HEADINGS}
    for name, entry in (OWN | entries()).items():
        groups.setdefault(entry.heading, {})[name] = entry
    return {heading: group for heading, group in groups.items() if group}


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
        return [*OWN, *plugins.points("commands"), *_stages()]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if entry := OWN.get(cmd_name):
            return entry.load()
        if point := plugins.points("commands").get(cmd_name):
            return plugins.load("commands", point, Entry).load()
        stage = _stages().get(cmd_name)
        if stage is None:
            return None
        from ptmtools.cli.build import stage_command

        return stage_command(stage)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """The commands and options that begin so; imports no command."""
        abouts = {name: entry.about for name, entry in entries().items() if not entry.hidden}
        abouts |= {name: stage.about for name, stage in _stages().items()}
        return [
            *(CompletionItem(n, help=a) for n, a in abouts.items() if n.startswith(incomplete)),
            *click.Command.shell_complete(self, ctx, incomplete),
        ]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        tables = {
            heading: [(name, entry.about) for name, entry in group.items() if not entry.hidden]
            for heading, group in commands_by_heading().items()
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
    interrupts = LostInterrupts()
    try:
        with interrupts:
            status = ptm.main(list(arguments), "ptm", standalone_mode=False, obj=console)
        sys.stdout.flush()
        return status if isinstance(status, int) else 0
    except BaseException as fault:
        if interrupts.any and not is_interrupt(fault):
            fault.__cause__ = KeyboardInterrupt()
        status = report(fault, console.verbose)
        try:
            sys.stdout.flush()
        except OSError:
            abandon_stdout()
        return status


def run() -> None:
    """The console script."""
    sys.exit(main(sys.argv[1:]))
