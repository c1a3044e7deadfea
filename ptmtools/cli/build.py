"""Commands that build a database: `ptm build-scene`, one for each stage, `status` and `warm-up`."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    cluster_options,
    force_option,
    jobs_option,
    json_option,
    new_database_option,
    option,
    options_of,
    take,
    with_console,
)
from ptmtools.output.emitters import GLTF
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene as build, run_stage
from ptmtools.pipeline.command import build_command, open_database
from ptmtools.pipeline.records import NEVER_RUN, StageReport
from ptmtools.pipeline.report import BuildReport, Visitor
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import STAGES
from ptmtools.quantities import count, size
from ptmtools.store.layout import SERVED
from ptmtools.store.objects import is_url
from ptmtools.store.remote import folder_to_build

if TYPE_CHECKING:
    from ptmtools.pipeline.status import StagePlan


#: Textures that are listed without ``-v``.
SHOWN_TEXTURES = 5

_PLANNED = {"current": "unchanged", "run": "would run", "maybe": "may run"}


def build_scene() -> click.Command:
    """The command that runs all stages, with the options of all."""
    return click.command("build-scene", cls=_BuildCommand)(_from_model(None))


class _BuildCommand(Command):
    """The command that runs all stages; its help lists the input formats."""

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        from ptmtools.scene.formats import format_list

        super().format_help_text(ctx, formatter)
        formatter.write_paragraph()
        with formatter.indentation():
            formatter.write_text(f"Formats of models: {format_list()}.")


def stage_command(stage: Stage[Any]) -> click.Command:
    """The command of a stage."""
    command = _from_model(stage) if stage.from_model else _of_database(stage)
    return click.command(stage.name, cls=Command, help=stage.about)(command)


def _from_model(last: Stage[Any] | None) -> Callable[..., None]:
    """The function of a command that reads a model and runs all stages, or those up to ``last``."""
    stages = list(STAGES.values())
    stages = stages[: stages.index(last) + 1] if last else stages

    @click.argument("model", type=click.Path())
    @new_database_option
    @options_of(*(stage.options for stage in stages), layered=last is None)
    @(jobs_option if last else cluster_options)
    @force_option(
        "Replace the database of another model, or write into a folder that is not a database."
    )
    @option("--rebuild", is_flag=True, help="Run all stages, even those that are up to date.")
    @option("--dry-run", is_flag=True, help="Show which stages would run, and why; write nothing.")
    @json_option
    @with_console
    def command(
        console: Console,
        model: str,
        db: str,
        dry_run: bool,
        rebuild: bool,
        workers: int,
        force: bool,
        scheduler: str | None = None,
        **values: Any,
    ) -> None:
        """Build a database from MODEL, or bring it up to date.

        MODEL is a file, and the database a folder. Both may be URLs such as s3://bucket/house.db. A
        second run repeats only the stages whose input or options have changed.
        """
        options: list[Any] = [take(stage.options, values) for stage in stages]
        if dry_run:
            from ptmtools.pipeline.status import plan_build

            plans = plan_build(model, db, *options, force=force)[: len(stages)]
            document = {"schema": 1, "stages": [asdict(plan) for plan in plans]}
            console.result(document, plan_lines(plans, every=console.verbose))
            return
        with console.progress() as progress:
            report = build(
                model,
                db,
                *options,
                until=last,
                workers=workers,
                scheduler=scheduler,
                force=force,
                rebuild=rebuild,
                progress=progress,
                tell=partial(_print_stage, console),
            )
        print_report(console, report)

    return command


def _of_database(stage: Stage[Any]) -> Callable[..., None]:
    """The function of a command that runs one stage of a database."""

    @click.argument("db", type=click.Path())
    @options_of(stage.options)
    @cluster_options
    @json_option
    @with_console
    def command(
        console: Console,
        db: str,
        workers: int,
        scheduler: str | None,
        wanted: bool = False,
        **values: Any,
    ) -> None:
        with console.progress() as progress:
            report = run_stage(
                db,
                take(stage.options, values),
                workers=workers,
                scheduler=scheduler,
                progress=progress,
                tell=partial(_print_stage, console),
            )
        if not (wanted and console.as_json):
            print_report(console, report)
        if wanted:
            with folder_to_build(db) as (folder, remote):
                database = open_database(folder)
                database.elsewhere = remote
                details, lines = stage.details(Artifacts(database), verbose=console.verbose)
            console.result(asdict(details), lines)

    if not stage.details_about:
        return command
    return option("--report", "wanted", is_flag=True, help=stage.details_about)(command)


@click.command("status", cls=Command)
@click.argument("db", type=click.Path())
@json_option
@with_console
def status(console: Console, db: str) -> None:
    """Show which stages of DB are done, stale or damaged, and which process is writing to it."""
    from ptmtools.pipeline.status import database_status

    state = database_status(db)
    model = f"database of {state.model}" if state.model else "no stage has finished yet"
    lines = [f"{db}: {model}"]
    for stage in state.stages:
        summary = STAGES[stage.stage].summarize(stage.counts) if stage.counts else ""
        files = f"{count(stage.files, 'file')}, {size(stage.bytes)}" if stage.files else ""
        line = f"{stage.stage:<9}{stage.state:>8}   {files:<22} {stage.why or summary}"
        lines.append(line.rstrip())
    if state.writer:
        lines.append(f"locked by {state.writer}, which is writing to it")
    if state.interrupted:
        kept = f"; the next one keeps {count(state.waiting, 'finished texture')}"
        lines.append(f"a run was interrupted{kept if state.waiting else ''}")
    if not state.finished and not state.writer:
        lines.append(f"not finished: run `{build_command(db)}`")
    console.result({"schema": 1, **asdict(state)}, lines)


@click.command("warm-up", cls=Command)
@with_console
def warm_up(console: Console) -> None:
    """Compile the code that the first build, image, check, view or octree texture would compile.

    This takes a minute, once per release and user. Without this command, the first build compiles
    the code; use it for container images, and before the workers of a cluster start.
    """
    from ptmtools.jit import compilations
    from ptmtools.pipeline.warm_up import warm_building, warm_images, warm_objects

    start, before = time.perf_counter(), compilations()
    warm_building()
    warm_images()
    warm_objects()
    seconds = time.perf_counter() - start
    fresh = compilations() > before
    console.print(f"compiled in {seconds:.1f} s" if fresh else "nothing to compile")


def plan_lines(plans: Iterable[StagePlan], *, every: bool) -> Iterator[str]:
    """The text of a plan, with ``every`` texture."""
    for plan in plans:
        reasons = list(plan.reasons)
        if plan.textures and plan.plan == "run":
            shown = plan.textures if every else plan.textures[:SHOWN_TEXTURES]
            more = len(plan.textures) - len(shown)
            names = ", ".join(shown) + (f" and {more:,} more" if more else "")
            reasons.append(f"encode {count(len(plan.textures), 'texture')}: {names}")
        first = reasons[0] if reasons else ""
        yield f"{plan.stage:<9}{_PLANNED[plan.plan]:>10}   {first}".rstrip()
        yield from (f"{'':<22}{line}" for line in reasons[1:])


def _print_stage(console: Console, stage: StageReport) -> None:
    """Prints the report of a stage as soon as it has finished."""
    if console.as_json:
        return
    done = f"{stage.seconds:7.1f} s" if stage.ran else "unchanged"
    summary = STAGES[stage.stage].summarize(stage.counts)
    console.print(f"{stage.stage:<9}{done:>10}   {summary}{_tasks(stage)}")
    if console.verbose or stage.reasons != NEVER_RUN:
        for reason in stage.reasons:
            console.print(f"{'':<22}because {reason}")
    for warning in stage.warnings:
        console.print(f"warning: {warning}")
    for note in filter(_is_runner_up, stage.further):
        console.print(f"note: {note}")


def print_report(console: Console, report: BuildReport) -> None:
    """Prints the totals of a run, its notes and the next steps; see also `_print_stage`."""
    if console.as_json:
        console.json(asdict(report))
        return
    memory = f", peak memory {size(report.peak_memory)}" if report.peak_memory else ""
    console.print(f"{'total':<9}{report.seconds:>8.1f} s{memory}")
    further = [n for stage in report.stages for n in stage.further if not _is_runner_up(n)]
    for note in further if console.verbose else ():
        console.print(f"note: {note}")
    if further and not console.verbose:
        console.print(
            f"{count(len(further), 'note')} not shown; -v lists "
            f"{'it' if len(further) == 1 else 'them'}"
        )
    for line in visitor_lines(report.visitor):
        console.print(line)
    if report.visitor:
        _print_next_steps(console, report.database)


def _print_next_steps(console: Console, database: str) -> None:
    ptm, db = _program_name(), shlex.quote(database)
    console.print("")
    console.print(f"Database: {db}. Next steps:")
    if is_url(database):
        first = f"{ptm} publish {db} -o site", "write a web site"
    elif all((Path(database) / SERVED / output).exists() for output in GLTF.owns):
        first = f"{ptm} serve {db} --open", "walk through it in a browser"
    else:
        first = f"{ptm} emit {db} --format vrml,gltf", "also write the files of `ptm serve`"
    steps = (
        first,
        (f"{ptm} plot {db} -o plan.png", "draw its floor plan"),
        (f"{ptm} validate {db}", "check every file"),
    )
    width = max(len(command) for command, _ in steps)
    for command, purpose in steps:
        console.print(f"  {command:<{width}}  {purpose}")


def _is_runner_up(note: str) -> bool:
    """Whether a note is printed with its stage although it is not a warning."""
    from ptmtools.scene.notes import RUNNER_UP

    return note.endswith(f"[{RUNNER_UP}]")


def visitor_lines(visitor: Visitor | None) -> Iterator[str]:
    """The text on the downloads of a visitor of the database, if they are known."""
    for number, line in enumerate(visitor.lines() if visitor else ()):
        yield f"{'' if number else 'download':<9} {line}".rstrip()


def _tasks(stage: StageReport) -> str:
    """The counts of new and reused tasks of a stage, if some were reused."""
    if not stage.ran or stage.tasks is None:
        return ""
    total, kept, resumed = stage.tasks
    if not kept and not resumed:
        return ""
    taken = f", {resumed:,} by the interrupted run" if resumed else ""
    return f"; {total - kept - resumed:,} encoded, {kept:,} unchanged{taken}"


def _program_name() -> str:
    """The word by which the user called this command: ``ptm``, or a path if it is not on PATH."""
    called = sys.argv[0]
    on_path = shutil.which("ptm")
    if Path(called).name != "ptm" or (
        on_path and os.path.realpath(on_path) == os.path.realpath(called)
    ):
        return "ptm"
    return shlex.quote(called)
