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
from typing import TYPE_CHECKING, Any

import click

from ptmtools.cli.failures import BROKEN_PIPE, report
from ptmtools.cli.output import Voice, abandon_stdout
from ptmtools.progress import listen
from ptmtools.version import __version__

if TYPE_CHECKING:
    from ptmtools.pipeline.stage import Stage

#: Command → (module, the command in it or a function that makes it, what `ptm --help` says);
#: besides, each stage has one.
COMMANDS = {
    "build-scene": ("stages", "build_scene", "Build or update a database from a model."),
    "status": ("status", "status", "Show which stages of a database are up to date."),
    "validate": ("reports", "validate", "Check a database or a .ptm file."),
    "info": ("information", "info", "Show what is in a model, a database or a .ptm file."),
    "plot": ("reports", "plot", "Draw the floor plan of a database."),
    "tradeoff": ("tradeoff", "tradeoff", "Measure what settings cost, and what they are worth."),
    "path": ("path", "path", "Make a walk through every room of a database."),
    "simulate": ("simulate", "simulate", "Walk through a database as clients would see it."),
    "serve": ("serve", "serve", "Serve a database to browsers on this machine."),
    "publish": ("publish", "publish", "Write a walk for browsers, a folder for any web server."),
    "encode": ("images", "encode", "Encode images as .ptm files."),
    "decode": ("images", "decode", "Decode .ptm files to images."),
    "apo": ("apo", "apo", "Make a light mesh and an octree texture of a heavy mesh."),
    "interlace": ("interlacing", "interlace", "Split an image into files that sharpen it."),
    "deinterlace": ("interlacing", "deinterlace", "Join the files of an interlaced image."),
    "campus": ("campus", "campus", "Write a model as objects with levels of detail."),
    "walk-campus": ("walk_campus", "walk_campus", "Walk through a campus as clients would see it."),
    "warm-up": ("warm_up", "warm_up", "Compile for this machine, before the first run."),
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
        return [*COMMANDS, *_stages()]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in COMMANDS:
            module, function, _ = COMMANDS[cmd_name]
            found = getattr(importlib.import_module(f"ptmtools.cli.{module}"), function)
            command = found if isinstance(found, click.Command) else found()
            assert isinstance(command, click.Command)
            return command
        stage = _stages().get(cmd_name)
        if stage is None:
            return None
        from ptmtools.cli.stages import stage_command

        return stage_command(stage)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name][2]) for name in COMMANDS])
        with formatter.section("Single stages of build-scene"):
            formatter.write_dl([(name, stage.about) for name, stage in _stages().items()])


def _stages() -> dict[str, Stage[Any]]:
    """The stages that have a command, by its name."""
    from ptmtools.pipeline.stages import STAGES

    return {name: stage for name, stage in STAGES.items() if not stage.hidden}


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="`ptm COMMAND --help` explains a command. Exit statuses: docs/guide/cli.md. Terms: "
    "docs/guide/glossary.md.",
)
@click.version_option(__version__, prog_name="ptm", message="%(prog)s %(version)s")
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
@click.option("-v", "--verbose", is_flag=True, help="Print more, and tracebacks of errors.")
@click.pass_context
def ptm(ctx: click.Context, quiet: bool, verbose: bool) -> None:
    """Turn an architectural model into a database that clients can stream."""
    voice = ctx.ensure_object(Voice)
    voice.quiet, voice.verbose = quiet, verbose
    if not quiet and sys.stderr.isatty():
        listen(voice.warn)


def main(arguments: Sequence[str]) -> int:
    """Runs one command; returns its exit status. Never raises."""
    voice = Voice()
    warnings.filterwarnings("ignore", module=r"PIL\.")  # what is serious becomes an error of ours
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
