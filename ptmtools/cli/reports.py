"""The commands that check a database or a `.ptm` file, and that draw a database."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import click

from ptmtools.cli.batch import no_name
from ptmtools.cli.common import as_json, database, forced, voiced
from ptmtools.cli.output import Voice, count, size
from ptmtools.cli.parameters import options_of, take
from ptmtools.database import PlotOptions, ValidationReport
from ptmtools.errors import CheckError
from ptmtools.pipeline import Artifacts, DatabaseFolder, shoot_segments
from ptmtools.pipeline import validate as check
from ptmtools.visibility import SegmentReport

#: Findings that are shown without ``-v``.
SHOWN_ISSUES = 20

target = click.argument("target", metavar="FILE|DB", type=click.Path())


@click.command("validate")
@target
@click.option(
    "--segments",
    type=click.IntRange(0),
    default=0,
    metavar="N",
    help="Also shoot N random segments: what sees each other must be potentially visible.",
)
@click.option("--strict / --no-strict", help="Warnings are errors.")
@as_json
@voiced
def validate(voice: Voice, target: str, segments: int, strict: bool, as_json: bool) -> None:
    """Check a database or a .ptm file.

    Exits with 8 if it finds an error.
    """
    if not target:
        raise no_name()
    with voice.progress() as progress:
        report = check(target, progress)
        shot = shoot_segments(target, segments, progress) if segments else None
    _tell_findings(voice, target, report, shot, as_json)
    failed = len(report.errors) + (len(report.warnings) if strict else 0)
    failed += len(shot.missed) if shot else 0
    if failed:
        raise CheckError("PTM-C001", f"{count(failed, 'finding')} to be mended", file=target)


@click.command("plot")
@database
@click.option("-o", "--output", type=click.Path(), required=True, help="The picture, a PNG.")
@options_of(PlotOptions)
@forced
@voiced
def plot(voice: Voice, db: str, output: str, force: bool, **values: Any) -> None:
    """Draw the floor plan of DB, storey by storey: cells, portals, and with --cell what it sees."""
    from ptmtools.database import plot_plan

    options = take(PlotOptions, values)
    artifacts = Artifacts(DatabaseFolder.open(db))
    done = artifacts.db.manifest.stages
    report = plot_plan(
        artifacts.scene,
        artifacts.cells,
        artifacts.pvs if "pvs" in done else None,
        artifacts.ach if "ach" in done else None,
        output,
        options,
        force=force,
    )
    voice.say(f"{output}: the floor plan of {db}, {count(len(report.floors), 'storey')}")


def _tell_findings(
    voice: Voice,
    target: str,
    report: ValidationReport,
    shot: SegmentReport | None,
    as_json: bool,
) -> None:
    if as_json:
        ok = report.ok and not (shot and shot.missed)
        segments = {"segments": asdict(shot)} if shot else {}
        voice.emit_json({"ok": ok, **asdict(report), **segments})
        return
    shown = report.issues if voice.verbose else report.issues[:SHOWN_ISSUES]
    for issue in shown:
        voice.say(str(issue))
    if len(shown) < len(report.issues):
        voice.say(f"{len(report.issues) - len(shown):,} more findings; -v shows them all")
    if shot:
        for pair in shot.missed:
            a, b = pair.cells
            voice.say(f"{target}: error: cells {a} and {b} see each other outside the PVS")
        voice.say(
            f"{target}: {count(shot.tried, 'random segment')}, {shot.unoccluded:,} unoccluded; "
            f"{shot.missed_segments:,} outside the PVS, {count(shot.hairlines, 'hairline')}"
        )
    voice.say(
        f"{target}: {count(report.files, 'file')}, {size(report.bytes)}; "
        f"{count(len(report.errors), 'error')}, {count(len(report.warnings), 'warning')}"
    )
