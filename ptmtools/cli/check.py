"""`ptm validate` and `ptm plot`."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.batch import no_name
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    database_argument,
    force_option,
    jobs_option,
    json_option,
    limit_option,
    local_copy,
    option,
    options_of,
    output_option,
    take,
    with_console,
)
from ptmtools.diagnostics import CODES, FOLDER_CODES, NOT_BUILT, SEEN_BY_BUILD, ValidationReport
from ptmtools.errors import CheckError
from ptmtools.folder_kinds import folder_kind
from ptmtools.output import PlotOptions
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import build_command, open_database
from ptmtools.pipeline.stages import ACH, CELLS, PVS, SCENE
from ptmtools.pipeline.validation import shoot_segments, validate as check
from ptmtools.quantities import count, size
from ptmtools.store.copies import url_of
from ptmtools.texture.model import Limits
from ptmtools.visibility import SegmentReport

#: Findings that are printed without ``-v``; of more, the worst of each file.
SHOWN = 20


def _print_codes(context: click.Context, option: click.Option, given: bool) -> None:
    if given and not context.resilient_parsing:  # a shell completes a line
        for code, (severity, meaning) in sorted({**CODES, **FOLDER_CODES}.items()):
            click.echo(f"{code}  {severity:<7}  {meaning}")
        context.exit()


@click.command("validate", cls=Command)
@click.argument("target", metavar="FILE|DB", type=click.Path(), callback=local_copy)
@option(
    "--segments",
    type=click.IntRange(0),
    default=0,
    metavar="N",
    help="Also test N random line segments. If nothing blocks a segment, the cells of its two end "
    "points must be in each other's visible sets.",
)
@option("--strict/--no-strict", help="Fail on warnings too.")
@option(
    "--codes",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_codes,
    help="List the codes of all findings and exit.",
)
@limit_option
@jobs_option
@json_option
@with_console
def validate(
    console: Console,
    target: str,
    segments: int,
    strict: bool,
    limits: Limits,
    workers: int,
) -> None:
    """Check a database, another folder written by ptm, or a .ptm file.

    The findings of each file are sorted by severity. The last line names the command that repairs
    the damage. The exit status is 8 if there are errors.
    """
    if not target:
        raise no_name()
    with console.progress() as progress:
        report = check(target, progress, limits=limits, workers=workers)
        shot = shoot_segments(target, segments, progress) if segments else None
    failed = report.error_count + (report.warning_count if strict else 0)
    failed += len(shot.missed) if shot else 0
    document = _document(target, report, shot, failed == 0)
    console.result(document, _lines(target, report, shot, every=console.verbose))
    if shot and shot.tried < segments and not console.as_json:
        console.warn(
            f"only {shot.tried:,} of {segments:,} segments begin at a possible eye position and "
            "end in a cell"
        )
    if failed:
        repair = document["repair"]
        remedy = f"repair it with `{repair}`" if repair else None
        raise CheckError("PTM-C001", count(failed, "finding"), file=target, remedy=remedy)


@click.command("plot", cls=Command)
@database_argument
@output_option("PNG to write.", required=True)
@options_of(PlotOptions)
@option(
    "--walk", type=click.Path(), metavar="FILE", help="Also draw this walk, which `ptm path` wrote."
)
@force_option()
@with_console
def plot(
    console: Console, db: str, output: str, walk: str | None, force: bool, **values: Any
) -> None:
    """Draw the floor plan of DB, storey by storey: cells, portals, and the cells that
    are visible from --cell.
    """
    from ptmtools.output import plot_plan
    from ptmtools.walk import read_walk

    walked = read_walk(walk) if walk is not None else None
    options = take(PlotOptions, values)
    artifacts = Artifacts(open_database(db))
    report = plot_plan(
        artifacts[SCENE],
        artifacts[CELLS],
        artifacts[PVS] if artifacts.before(PVS) else None,
        artifacts[ACH] if artifacts.before(ACH) else None,
        output,
        options,
        way=(walked.eye, walked.direction) if walked else None,
        force=force,
    )
    console.print(f"{output}: the floor plan of {db}, {count(len(report.floors), 'storey')}")


def _document(
    target: str, report: ValidationReport, shot: SegmentReport | None, ok: bool
) -> dict[str, Any]:
    """The report as JSON, which `validation.schema.json` describes."""
    return {
        "format": "ptmtools validation",
        "schema": 1,
        "target": url_of(target),
        "ok": ok,
        "counts": {
            "files": report.files,
            "bytes": report.bytes,
            "errors": report.error_count,
            "warnings": report.warning_count,
        },
        "issues": [asdict(issue) for issue in report.issues],
        "notes": list(report.notes),
        "repair": _repair(target, report),
        **({"segments": asdict(shot)} if shot else {}),
    }


def _lines(
    target: str, report: ValidationReport, shot: SegmentReport | None, *, every: bool
) -> list[str]:
    """The findings as text, the worst of each file first; of many findings, unless ``every`` one
    is wanted, the worst of each file and the number of the others."""
    lines = [str(issue) for issue in report.issues]
    if len(lines) > SHOWN and not every:
        files = [list(issues) for _, issues in groupby(report.issues, lambda issue: issue.file)]
        files.sort(key=lambda issues: issues[0].severity != "error")
        more = [sum(issue.count for issue in issues) - 1 for issues in files]
        lines = [
            f"{issues[0]}{f' and {n:,} more' if n else ''}"
            for issues, n in zip(files[:SHOWN], more, strict=False)
        ]
        if rest := len(files) - len(lines):
            lines.append(f"findings in {count(rest, 'more file')}")
        lines.append("-v shows all findings")
    for pair in shot.missed if shot else ():
        a, b = pair.cells
        lines.append(
            f"{url_of(target)}: error: an unobstructed segment connects cells {a} and {b}, which "
            "are not in each other's visible sets"
        )
    if shot:
        lines.append(
            f"{url_of(target)}: tested {count(shot.tried, 'random segment')}: {shot.unoccluded:,} "
            f"unobstructed; {shot.missed_segments:,} of these connect cells missing from each "
            f"other's visible sets; {shot.hairlines:,} undecided (too close to an edge)"
        )
    totals = (
        f"{url_of(target)}: {count(report.files, 'file')}, {size(report.bytes)}; "
        f"{count(report.error_count, 'error')}, {count(report.warning_count, 'warning')}"
    )
    return [*lines, *(f"note: {note}" for note in report.notes), totals]


def _repair(target: str, report: ValidationReport) -> str | None:
    """The command that repairs the findings, if there is one."""
    codes = {issue.code for issue in report.issues}
    if not codes - NOT_BUILT:
        return None
    if not Path(target).is_dir():
        again = f"ptm encode IMAGE -o {shlex.quote(target)} --force"
        return again if target.endswith(".ptm") else None
    if kind := folder_kind(Path(target)):
        return f"{kind.again} -o {shlex.quote(target)} --force"
    if "PTM-D650" in codes:
        return f"{build_command(target)} --rebuild --force"
    # A build does not notice a file that is as it was written.
    seen = codes - NOT_BUILT <= SEEN_BY_BUILD
    return build_command(target) + ("" if seen else " --rebuild")
