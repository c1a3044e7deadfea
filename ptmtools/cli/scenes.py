"""The commands that build a database: one for each stage, and one for all."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from ptmtools.cells.options import SubdivideOptions
from ptmtools.cli.common import (
    as_json,
    database,
    forced,
    many_machines,
    new_database,
    voiced,
    workers,
)
from ptmtools.cli.output import Voice, count, size
from ptmtools.cli.parameters import Numbers, options_of, take
from ptmtools.coverage.options import AchOptions
from ptmtools.database.model import EmitOptions, GivenViewpoint
from ptmtools.pipeline.build import (
    build_scene as build,
)
from ptmtools.pipeline.build import (
    make_ach,
    make_cells,
    make_files,
    make_pvs,
    make_textures,
)
from ptmtools.pipeline.changes import NEVER_RUN
from ptmtools.pipeline.options import BuildOptions, TextureOptions
from ptmtools.pipeline.report import BuildReport, StageReport
from ptmtools.scene.options import IngestOptions
from ptmtools.visibility.options import PvsOptions

#: Notes that are shown without ``-v``.
SHOWN_NOTES = 12

model_argument = click.argument("model", type=click.Path())
viewpoints = click.option(
    "--viewpoint",
    "viewpoints",
    type=Numbers([3, 4]),
    multiple=True,
    metavar="X,Y,Z[,YAW]",
    help="A place to start from, and from which cells are to be reached: world metres; the yaw "
    "in degrees, counter-clockwise from -Z. May be given several times.",
)


@click.command("build-scene")
@model_argument
@new_database
@options_of(IngestOptions)
@options_of(SubdivideOptions, omit=["viewpoints"])
@options_of(PvsOptions)
@options_of(AchOptions)
@options_of(TextureOptions, omit=["limit"])
@options_of(EmitOptions, omit=["viewpoints", "fallback"])
@viewpoints
@many_machines
@forced
@click.option("--dry-run", is_flag=True, help="Say what would be done, and why; write nothing.")
@as_json
@voiced
def build_scene(
    voice: Voice,
    model: str,
    db: str,
    as_json: bool,
    viewpoints: Any,
    dry_run: bool,
    **values: Any,
) -> None:
    """Build the database DB from MODEL, or bring it up to date.

    MODEL is an OBJ, glTF or GLB file, or what pymeshlab reads. Only what changed since the last
    build is computed again.
    """
    options = BuildOptions(
        ingest=take(IngestOptions, values, share=["limit"]),
        subdivide=take(SubdivideOptions, values, viewpoints=_positions(viewpoints)),
        pvs=take(PvsOptions, values),
        ach=take(AchOptions, values),
        emit=take(EmitOptions, values, share=["fallback"], viewpoints=_given(viewpoints)),
        textures=take(TextureOptions, values),
        **values,
    )
    if dry_run:
        from ptmtools.cli.status import tell_plan
        from ptmtools.pipeline.plan import plan_build

        tell_plan(voice, plan_build(model, db, options), as_json)
        return
    with voice.progress() as progress:
        report = build(model, db, options, progress)
    _tell(voice, report, as_json)


@click.command("cells")
@model_argument
@new_database
@options_of(IngestOptions)
@options_of(SubdivideOptions, omit=["viewpoints"])
@viewpoints
@workers
@forced
@as_json
@voiced
def cells(
    voice: Voice,
    model: str,
    db: str,
    as_json: bool,
    force: bool,
    workers: int,
    viewpoints: Any,
    **values: Any,
) -> None:
    """Read MODEL and cut it into cells and portals: the first stage of the database DB."""
    read = take(IngestOptions, values)
    cut = take(SubdivideOptions, values, viewpoints=_positions(viewpoints))
    with voice.progress() as progress:
        report = make_cells(model, db, read, cut, workers, force=force, progress=progress)
    _tell(voice, report, as_json)


@click.command("pvs")
@database
@options_of(PvsOptions)
@click.option(
    "--report",
    "wanted",
    is_flag=True,
    help="Say what the sets look like: sizes, the "
    "costliest portals, and openings that show suspiciously much.",
)
@many_machines
@as_json
@voiced
def pvs(
    voice: Voice,
    db: str,
    as_json: bool,
    workers: int,
    scheduler: str | None,
    wanted: bool,
    **values: Any,
) -> None:
    """Find which cells of DB may see each other."""
    with voice.progress() as progress:
        done = make_pvs(db, take(PvsOptions, values), workers, progress, scheduler)
    if not wanted:
        _tell(voice, done, as_json)
        return
    from ptmtools.cli.visibility import tell_pvs
    from ptmtools.pipeline import Artifacts, DatabaseFolder
    from ptmtools.visibility.report import report

    artifacts = Artifacts(DatabaseFolder.open(db))
    told = report(artifacts.cells, artifacts.pvs)
    if as_json:
        voice.emit_json(asdict(told))
    else:
        _tell(voice, done, as_json)
        tell_pvs(voice, told)


@click.command("ach")
@database
@options_of(AchOptions)
@many_machines
@as_json
@voiced
def ach(
    voice: Voice, db: str, as_json: bool, workers: int, scheduler: str | None, **values: Any
) -> None:
    """Measure how much of the view from each cell of DB each visible cell covers."""
    with voice.progress() as progress:
        report = make_ach(db, take(AchOptions, values), workers, progress, scheduler)
    _tell(voice, report, as_json)


@click.command("textures")
@database
@options_of(TextureOptions)
@many_machines
@as_json
@voiced
def textures(
    voice: Voice, db: str, as_json: bool, workers: int, scheduler: str | None, **values: Any
) -> None:
    """Encode the images of DB as progressive textures."""
    with voice.progress() as progress:
        report = make_textures(db, take(TextureOptions, values), workers, progress, scheduler)
    _tell(voice, report, as_json)


@click.command("emit")
@database
@options_of(EmitOptions, omit=["viewpoints"])
@viewpoints
@as_json
@voiced
def emit(voice: Voice, db: str, as_json: bool, viewpoints: Any, **values: Any) -> None:
    """Write the VRML97 files and hints.json of DB."""
    options = take(EmitOptions, values, viewpoints=_given(viewpoints))
    with voice.progress() as progress:
        report = make_files(db, options, progress)
    _tell(voice, report, as_json)


def _positions(given: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    return tuple(viewpoint[:3] for viewpoint in given)


def _given(given: tuple[tuple[float, ...], ...]) -> tuple[GivenViewpoint, ...]:
    return tuple(GivenViewpoint((x, y, z), rest[0] if rest else None) for x, y, z, *rest in given)


def _tell(voice: Voice, report: BuildReport, as_json: bool) -> None:
    if as_json:
        voice.emit_json(asdict(report))
        return
    for stage in report.stages:
        done = f"{stage.seconds:7.1f} s" if stage.ran else "unchanged"
        voice.say(
            f"{stage.stage:<9}{done:>10}   {figures(stage.stage, stage.counts)}{_tasks(stage)}"
        )
        if voice.verbose or stage.reasons != NEVER_RUN:
            for reason in stage.reasons:
                voice.say(f"{'':<22}because {reason}")
    memory = f", at most {size(report.peak_memory)} of memory" if report.peak_memory else ""
    voice.say(f"{'all':<9}{report.seconds:>8.1f} s{memory}")
    shown = report.notes if voice.verbose else report.notes[:SHOWN_NOTES]
    for note in shown:
        voice.say(f"note: {note}")
    if len(shown) < len(report.notes):
        voice.say(f"note: {len(report.notes) - len(shown):,} more; -v shows them all")
    if any(stage.stage == "emit" for stage in report.stages):
        ptm, db = _invoked(), shlex.quote(report.database)
        voice.say("")
        voice.say(f"The database is {db}. Next:")
        for command, told in (
            (f"{ptm} plot {db} -o plan.png", "its floor plan"),
            (f"{ptm} validate {db}", "check every file"),
            (f"python3 -m http.server -d {db}/www", "serve it; start at root.wrl"),
        ):
            voice.say(f"  {command:<50} {told}")


def _tasks(stage: StageReport) -> str:
    """How many tasks of a stage had been done before, if it ran for the rest."""
    if not stage.ran or stage.tasks is None:
        return ""
    total, kept, resumed = stage.tasks
    if not kept and not resumed:
        return ""
    taken = f", {resumed:,} by the run that was interrupted" if resumed else ""
    return f"; {total - kept - resumed:,} encoded, {kept:,} as they were{taken}"


def _invoked() -> str:
    """How the user calls this command: by its name, or by a path where it is not on PATH."""
    called = sys.argv[0]
    found = shutil.which("ptm")
    if Path(called).name != "ptm" or (
        found and os.path.realpath(found) == os.path.realpath(called)
    ):
        return "ptm"
    return shlex.quote(called)


def figures(stage: str, counts: Mapping[str, Any]) -> str:
    """What a stage made, on one line. A manifest may say anything."""
    try:
        return _figures(stage, counts)
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return "figures that make no sense"


def _figures(stage: str, n: Mapping[str, Any]) -> str:
    match stage:
        case "scene":
            guessed = [w for w, k in (("unit", "unit_guessed"), ("up axis", "up_guessed")) if n[k]]
            how = f" ({' and '.join(guessed)} guessed)" if guessed else ""
            return (
                f"{count(n['triangles'], 'triangle')} in {count(n['objects'], 'object')}, "
                f"{count(n['images'], 'image')}; 1 unit = {n['metres']:g} m, {n['up']} up{how}"
            )
        case "cells":
            state = "closed" if n["closed"] else "open"
            made = (
                f" of {count(n['leaves'], 'leaf', 'leaves')}" if n["leaves"] != n["cells"] else ""
            )
            return f"{count(n['cells'], 'cell')}{made}, {count(n['portals'], 'portal')}; {state}"
        case "pvs":
            return f"a cell sees {n['average_share']:.1%} of all cells on average"
        case "ach":
            return (
                f"{count(n['samples'], 'sample point')}; backend {n['backend']} ({n['renderer']})"
            )
        case "textures":
            raw, stored = n["raw_bytes"], n["ptm_bytes"]
            share = f" ({stored / raw:.1%})" if raw else ""
            return f"{count(n['textures'], 'texture')}, {size(raw)} → {size(stored)}{share}"
        case _:
            return (
                f"{count(n['files'], 'file')}, {size(n['bytes'])}; "
                f"{count(n['triangles'], 'triangle')}, {count(n['viewpoints'], 'viewpoint')}"
            )
