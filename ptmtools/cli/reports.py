"""The commands that check a database or a `.ptm` file, and that draw a database."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import click

from ptmtools.cli.batch import no_name
from ptmtools.cli.common import as_json, database, forced, limited, voiced, workers
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.database import PlotOptions, ValidationReport
from ptmtools.errors import CheckError
from ptmtools.pipeline import Artifacts, shoot_segments
from ptmtools.pipeline import validate as check
from ptmtools.pipeline.stages import ACH, CELLS, PVS, SCENE
from ptmtools.quantities import count, size
from ptmtools.store.folder import DatabaseFolder
from ptmtools.texture.model import Limits
from ptmtools.visibility import SegmentReport

#: Findings that are shown without ``-v``.
SHOWN_ISSUES = 20

target = click.argument("target", metavar="FILE|DB", type=click.Path())


def _tell_codes(context: click.Context, option: click.Option, asked: bool) -> None:
    if asked:
        from ptmtools.database.validation import CODES

        for code, (severity, meaning) in sorted(CODES.items()):
            click.echo(f"{code}  {severity:<7}  {meaning}")
        context.exit()


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
@click.option(
    "--codes",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_tell_codes,
    help="List what can be found, and end.",
)
@limited
@workers
@as_json
@voiced
def validate(
    voice: Voice,
    target: str,
    segments: int,
    strict: bool,
    limits: Limits,
    workers: int,
    as_json: bool,
) -> None:
    """Check a database or a .ptm file.

    Exits with 8 if it finds an error.
    """
    if not target:
        raise no_name()
    with voice.progress() as progress:
        report = check(target, progress, limits=limits, workers=workers)
        shot = shoot_segments(target, segments, progress) if segments else None
    failed = report.error_count + (report.warning_count if strict else 0)
    failed += len(shot.missed) if shot else 0
    if as_json:
        voice.emit_json(_document(target, report, shot, failed == 0))
    else:
        _tell_findings(voice, target, report, shot)
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
    report = plot_plan(
        artifacts[SCENE],
        artifacts[CELLS],
        artifacts[PVS] if artifacts.before(PVS) else None,
        artifacts[ACH] if artifacts.before(ACH) else None,
        output,
        options,
        force=force,
    )
    voice.say(f"{output}: the floor plan of {db}, {count(len(report.floors), 'storey')}")


def _document(
    target: str, report: ValidationReport, shot: SegmentReport | None, ok: bool
) -> dict[str, Any]:
    """The report as JSON has it; its schema is published."""
    return {
        "format": "ptmtools validation",
        "schema": 1,
        "target": target,
        "ok": ok,
        "counts": {
            "files": report.files,
            "bytes": report.bytes,
            "errors": report.error_count,
            "warnings": report.warning_count,
        },
        "issues": [asdict(issue) for issue in report.issues],
        **({"segments": asdict(shot)} if shot else {}),
    }


def _tell_findings(
    voice: Voice, target: str, report: ValidationReport, shot: SegmentReport | None
) -> None:
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
        f"{count(report.error_count, 'error')}, {count(report.warning_count, 'warning')}"
    )
