"""The command that measures what the knobs of the stages buy."""

from __future__ import annotations

from dataclasses import asdict

import click

from ptmtools.cli.common import as_json, database, forced, voiced
from ptmtools.cli.output import Voice
from ptmtools.files import refuse_existing, write_bytes
from ptmtools.pipeline import Artifacts, DatabaseFolder
from ptmtools.tradeoff.experiment import run
from ptmtools.tradeoff.report import as_csv, table
from ptmtools.tradeoff.stages import STAGES, experiments


@click.command("tradeoff")
@database
@click.option(
    "--stage",
    "stages",
    type=click.Choice(STAGES),
    multiple=True,
    help="Of which stages; all if not given. May be given several times.",
)
@click.option(
    "--error",
    "wanted",
    type=click.FloatRange(0, min_open=True),
    help="Also name the cheapest setting whose error is at most this.",
)
@click.option(
    "--cells-tried",
    type=click.IntRange(1),
    default=24,
    show_default=True,
    help="Cells that stand for all, where hints are tried.",
)
@click.option(
    "--reference",
    type=click.IntRange(8, 2**14),
    default=4096,
    show_default=True,
    metavar="POINTS",
    help="Sample points a cell that hints are compared with.",
)
@click.option("--csv", "csv_file", type=click.Path(), help="Also write every trial as CSV.")
@click.option("--plot", "plot_file", type=click.Path(), help="Also draw error against cost, a PNG.")
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
    """Measure what the knobs of each stage cost and bring, on the scene of DB.

    A star marks the settings that no cheaper one beats. Nothing in DB is changed.
    """
    for file in (csv_file, plot_file):
        if file and not force:
            refuse_existing(file)
    ready = experiments(Artifacts(DatabaseFolder.open(db)), cells_tried, reference)
    trades = []
    with voice.progress() as progress:
        for stage in stages or STAGES:
            progress(0, 1, f"preparing {stage}")
            trades.append(run(ready[stage](), progress))
    if csv_file:
        write_bytes(csv_file, as_csv(trades).encode(), force=force)
    if plot_file:
        from ptmtools.tradeoff.figure import picture

        write_bytes(plot_file, picture(trades), force=force)
    if as_json:
        voice.emit_json([asdict(trade) for trade in trades])
        return
    for trade in trades:
        for line in table(trade, wanted):
            voice.say(line)
        voice.say("")
