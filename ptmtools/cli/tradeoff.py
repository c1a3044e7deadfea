"""The command that measures what the settings of the stages cost, and how accurate they are."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import click

from ptmtools.cli.common import as_json, database, forced, voiced, writable
from ptmtools.cli.output import Voice
from ptmtools.coverage.options import MAX_SAMPLES
from ptmtools.files import write_bytes
from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.tradeoff.experiment import Trade, run
from ptmtools.tradeoff.experiments import EXPERIMENTS, Subject
from ptmtools.tradeoff.figure import picture, require
from ptmtools.tradeoff.report import as_csv, table

#: Sample points of the reference: at least so many that settings with fewer remain.
LEAST_POINTS = 64


@click.command("tradeoff")
@database
@click.option(
    "--stage",
    "stages",
    type=click.Choice(list(EXPERIMENTS)),
    multiple=True,
    help="Try only this stage. May be given several times. By default all are tried.",
)
@click.option(
    "--error",
    "wanted",
    type=click.FloatRange(0, min_open=True),
    help="Also name the cheapest setting of each stage whose error is at most this.",
)
@click.option(
    "--cells-tried",
    type=click.IntRange(1),
    default=16,
    show_default=True,
    help="Try coverage hints in this many cells, as a sample of all.",
)
@click.option(
    "--reference",
    type=click.IntRange(LEAST_POINTS, MAX_SAMPLES),
    default=MAX_SAMPLES,
    show_default=True,
    metavar="POINTS",
    help="Compare coverage hints with those of this many other sample points in each cell; only "
    "settings with fewer points are tried.",
)
@click.option("--csv", "csv_file", type=click.Path(), help="Also write every trial as CSV.")
@click.option(
    "--plot", "plot_file", type=click.Path(), help="Also plot error against cost, as a PNG."
)
@forced
@as_json
@voiced
def tradeoff(
    voice: Voice,
    db: str,
    stages: tuple[str, ...],
    wanted: float | None,
    cells_tried: int,
    reference: int,
    csv_file: str | None,
    plot_file: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Measure what settings of each stage cost, and how accurate they are, on the scene of DB.

    A star marks a setting if no cheaper one is more accurate. DB is not changed.
    """
    for file in (csv_file, plot_file):
        if file:
            writable(file, force)
    if plot_file:
        require()
    subject = Subject(Artifacts(open_database(db)), cells_tried, reference)
    trades = []
    with voice.progress() as progress:
        for stage in stages or EXPERIMENTS:
            progress(0, 1, f"preparing {stage}")
            experiment = EXPERIMENTS[stage].load()(subject)
            trades.append(run(stage, experiment, progress))
    if csv_file:
        write_bytes(csv_file, as_csv(trades).encode(), force=force)
    if plot_file:
        write_bytes(plot_file, picture(trades), force=force)
    if as_json:
        voice.emit_json([_document(trade, wanted) for trade in trades])
        return
    for trade in trades:
        for line in table(trade, wanted):
            voice.say(line)
        voice.say("")


def _document(trade: Trade, wanted: float | None) -> dict[str, Any]:
    """As JSON has it; with a wanted error, ``cheapest`` is the setting's name, or None."""
    if wanted is None:
        return asdict(trade)
    found = trade.cheapest(wanted)
    return {**asdict(trade), "cheapest": found.setting.name if found else None}
