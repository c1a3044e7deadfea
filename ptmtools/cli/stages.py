"""The commands that build a database: `build-scene` runs all stages, and each has its own."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.common import (
    as_json,
    database,
    forced,
    many_machines,
    new_database,
    voiced,
    workers,
)
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.lazy import Lazy
from ptmtools.output.emitters import GLTF
from ptmtools.pipeline.build import Visitor, build_scene as build, run_stage
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.report import BuildReport, StageReport
from ptmtools.pipeline.run import NEVER_RUN, Artifacts
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import EMIT, PVS, STAGES
from ptmtools.quantities import count, size
from ptmtools.store.layout import SERVED

#: What ``ptm STAGE DB --report`` prints besides: what that is, and a function of the artifacts that
#: returns it as a document and as lines.
REPORTS: dict[Stage[Any], tuple[str, Lazy[Callable[..., tuple[Any, list[str]]]]]] = {
    PVS: (
        "Print a summary of the sets: their sizes, the most expensive portals, and openings "
        "through which suspiciously much is visible.",
        Lazy("ptmtools.cli.visibility:visibility_report"),
    )
}

model_argument = click.argument("model", type=click.Path())


def build_scene() -> click.Command:
    """The command that runs all stages, with the options of all."""
    return click.command("build-scene")(_from_model(None))


def stage_command(stage: Stage[Any]) -> click.Command:
    """The command of a stage."""
    command = _from_model(stage) if stage.from_model else _of_database(stage)
    return click.command(stage.name, help=stage.about)(command)


def _from_model(last: Stage[Any] | None) -> Callable[..., None]:
    """All stages, or the first ones up to one that is cut out of the model."""
    stages = list(STAGES.values())
    stages = stages[: stages.index(last) + 1] if last else stages

    @model_argument
    @new_database
    @options_of(*(stage.options for stage in stages))
    @(workers if last else many_machines)
    @forced
    @click.option(
        "--rebuild", is_flag=True, help="Run every stage again, even if it is up to date."
    )
    @click.option(
        "--dry-run", is_flag=True, help="Show what would be done, and why; write nothing."
    )
    @as_json
    @voiced
    def command(
        voice: Voice,
        model: str,
        db: str,
        as_json: bool,
        dry_run: bool,
        rebuild: bool,
        workers: int,
        force: bool,
        scheduler: str | None = None,
        **values: Any,
    ) -> None:
        """Build a database from MODEL, or bring it up to date.

        MODEL is an OBJ, glTF or GLB file, or in a format that trimesh, pymeshlab, IfcOpenShell or
        usd-core reads. The database is a folder: museum.obj makes museum.db, unless -o names
        another. Only what has changed since the last build is computed again.
        """
        options: list[Any] = [take(stage.options, values) for stage in stages]
        if dry_run:
            from ptmtools.cli.status import print_plan
            from ptmtools.pipeline.build import plan_build

            plans = plan_build(model, db, *options, force=force)
            print_plan(voice, plans[: len(stages)], as_json)
            return
        with voice.progress() as progress:
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
                tell=partial(_say_stage, voice, as_json),
            )
        print_report(voice, report, as_json)

    return command


def _of_database(stage: Stage[Any]) -> Callable[..., None]:
    @database
    @options_of(stage.options)
    @many_machines
    @as_json
    @voiced
    def command(
        voice: Voice,
        db: str,
        as_json: bool,
        workers: int,
        scheduler: str | None,
        wanted: bool = False,
        **values: Any,
    ) -> None:
        with voice.progress() as progress:
            report = run_stage(
                db,
                take(stage.options, values),
                workers=workers,
                scheduler=scheduler,
                progress=progress,
                tell=partial(_say_stage, voice, as_json),
            )
        if not wanted:
            print_report(voice, report, as_json)
            return
        document, lines = REPORTS[stage][1].load()(Artifacts(open_database(db)), voice.verbose)
        if as_json:
            voice.emit_json(document)
            return
        print_report(voice, report, as_json)
        for line in lines:
            voice.say(line)

    if stage in REPORTS:
        return click.option("--report", "wanted", is_flag=True, help=REPORTS[stage][0])(command)
    return command


def _say_stage(voice: Voice, as_json: bool, stage: StageReport) -> None:
    """Says what became of a stage as soon as it is done, so that its warnings come before what
    takes long."""
    if as_json:
        return
    done = f"{stage.seconds:7.1f} s" if stage.ran else "unchanged"
    summary = STAGES[stage.stage].summarize(stage.counts)
    voice.say(f"{stage.stage:<9}{done:>10}   {summary}{_tasks(stage)}")
    if voice.verbose or stage.reasons != NEVER_RUN:
        for reason in stage.reasons:
            voice.say(f"{'':<22}because {reason}")
    for warning in stage.warnings:
        voice.say(f"warning: {warning}")
    for note in filter(_is_runner_up, stage.further):
        voice.say(f"note: {note}")


def print_report(voice: Voice, report: BuildReport, as_json: bool) -> None:
    """Says what a run has done as a whole; its stages have been told of (`_say_stage`)."""
    if as_json:
        voice.emit_json(asdict(report))
        return
    memory = f", at most {size(report.peak_memory)} of memory" if report.peak_memory else ""
    voice.say(f"{'all':<9}{report.seconds:>8.1f} s{memory}")
    further = [n for stage in report.stages for n in stage.further if not _is_runner_up(n)]
    for note in further if voice.verbose else ():
        voice.say(f"note: {note}")
    if further and not voice.verbose:
        voice.say(f"{count(len(further), 'further note')}; -v lists them")
    if report.visitor:
        print_visitor(voice, report.visitor)
    if any(stage.stage == EMIT.name for stage in report.stages):
        ptm, db = _invoked(), shlex.quote(report.database)
        voice.say("")
        voice.say(f"The database is {db}. Next:")
        walkable = all((Path(report.database) / SERVED / own).exists() for own in GLTF.owns)
        commands = {
            **(
                {f"{ptm} serve {db} --open": "walk through it in a browser"}
                if walkable
                else {
                    f"{ptm} emit {db} --format vrml,gltf": "write what `ptm serve` shows, as well"
                }
            ),
            f"{ptm} plot {db} -o plan.png": "draw its floor plan",
            f"{ptm} validate {db}": "check every file",
        }
        width = max(map(len, commands))
        for command, purpose in commands.items():
            voice.say(f"  {command:<{width}}  {purpose}")


def _is_runner_up(note: str) -> bool:
    """Whether a note is shown beside its stage although it is no warning."""
    from ptmtools.scene.notes import RUNNER_UP

    return note.endswith(f"[{RUNNER_UP}]")


def print_visitor(voice: Voice, visitor: Visitor) -> None:
    """Says what a database means for a visitor."""
    for head, line in zip_longest(["visitor"], visitor.lines(), fillvalue=""):
        voice.say(f"{head:<9} {line}".rstrip())


def _tasks(stage: StageReport) -> str:
    """How many tasks of a stage had been done before, if it ran for the rest."""
    if not stage.ran or stage.tasks is None:
        return ""
    total, kept, resumed = stage.tasks
    if not kept and not resumed:
        return ""
    taken = f", {resumed:,} by the run that was interrupted" if resumed else ""
    return f"; {total - kept - resumed:,} encoded, {kept:,} unchanged{taken}"


def _invoked() -> str:
    """How the user calls this command: by its name, or by a path where it is not on PATH."""
    called = sys.argv[0]
    found = shutil.which("ptm")
    if Path(called).name != "ptm" or (
        found and os.path.realpath(found) == os.path.realpath(called)
    ):
        return "ptm"
    return shlex.quote(called)
