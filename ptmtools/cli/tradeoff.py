"""The command that measures what the settings of the stages cost, and how accurate they are."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.common import as_json, database, forced, voiced, writable
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.coverage.options import MAX_SAMPLES
from ptmtools.files import write_bytes
from ptmtools.lab.path.making import path_through
from ptmtools.lab.path.options import PathOptions
from ptmtools.lab.tradeoff import report as sentences
from ptmtools.lab.tradeoff.experiment import EXPERIMENTS, Subject, Trade, run
from ptmtools.lab.tradeoff.knobs import KNOBS
from ptmtools.lab.tradeoff.report import as_csv, picture, require, table
from ptmtools.lab.tradeoff.walk import WalkOptions, WalkTrade, try_settings
from ptmtools.lab.walk import Walk, read_walk
from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.command import open_database

#: Sample points of the reference: at least so many that settings with fewer remain.
LEAST_POINTS = 64
#: What is tried on a walk, beside the experiments of the stages.
WALK = "walk"
#: How long the walk is that is made where none is given, s; in a hurry.
DURATION, QUICK = 60.0, 30.0


@click.command("tradeoff")
@database
@click.option(
    "--stage",
    "stages",
    type=click.Choice([WALK, *EXPERIMENTS]),
    multiple=True,
    help="Try only this: all that changes what somebody sees who walks through the building "
    f"({WALK}), or a stage by itself. May be given several times. By default all are tried.",
)
@click.option(
    "--walk",
    "walk_file",
    type=click.Path(),
    metavar="FILE",
    help="The walk, as `ptm path` writes it. By default one of "
    f"{DURATION:.0f} s is made, with --quick of {QUICK:.0f} s.",
)
@options_of(WalkOptions)
@click.option(
    "--knob",
    "knobs",
    type=click.Choice([knob.option.removeprefix("--") for knob in KNOBS]),
    multiple=True,
    help="Try only this option on the walk, with values that take long too. May be given several "
    "times. By default all are tried.",
)
@click.option("--quick", is_flag=True, help="Try one value of each option, on a shorter walk.")
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
    walk_file: str | None,
    knobs: tuple[str, ...],
    quick: bool,
    wanted: float | None,
    cells_tried: int,
    reference: int,
    csv_file: str | None,
    plot_file: str | None,
    force: bool,
    as_json: bool,
    **values: Any,
) -> None:
    """Measure what settings of each stage cost, and what they are worth, on the scene of DB.

    First what somebody sees who walks through the building: in sentences, and as a table. Then, of
    each stage, how accurate its result is; a star marks a setting if no cheaper one is more
    accurate. DB is not changed.
    """
    options = take(WalkOptions, values)
    stages = stages or (WALK, *EXPERIMENTS)
    if WALK not in stages and (walk_file or knobs):
        given = "--walk" if walk_file else "--knob"
        raise click.UsageError(f"{given} is for --stage {WALK}, which is not asked for")
    walk = read_walk(walk_file) if walk_file else None
    for file in (csv_file, plot_file):
        if file:
            writable(file, force)
    if plot_file:
        require()
    artifacts = Artifacts(open_database(db))
    subject = Subject(artifacts, cells_tried, reference)
    walked: list[WalkTrade] = []
    trades = []
    with voice.progress() as progress:
        for stage in stages:
            progress(0, 1, f"preparing {stage}")
            if stage == WALK:
                walked.append(
                    try_settings(
                        Path(db), artifacts, walk or _made(artifacts, quick), options, knobs,
                        quick=quick, progress=progress, tell=voice.warn,
                    )
                )  # fmt: skip
            else:
                experiment = EXPERIMENTS[stage].load()(subject)
                trades.append(run(stage, experiment, progress))
    every = [trade for walk in walked for trade in sentences.trades(walk)] + trades
    if csv_file:
        write_bytes(csv_file, as_csv(every).encode(), force=force)
    if plot_file:
        write_bytes(plot_file, picture(every), force=force)
    if as_json:
        found = [_walk_document(walk) for walk in walked]
        voice.emit_json([*found, *(_document(trade, wanted) for trade in trades)])
        return
    blocks = [sentences.settings_table(walk, wanted) for walk in walked]
    for lines in [*blocks, *(table(trade, wanted) for trade in trades)]:
        for line in lines:
            voice.say(line)
        voice.say("")


def _made(artifacts: Artifacts, quick: bool) -> Walk:
    """A walk through a database."""
    options = PathOptions(duration=QUICK if quick else DURATION)
    return path_through(artifacts, options).walk


def _walk_document(trade: WalkTrade) -> dict[str, Any]:
    """As JSON has it: with what is said of it."""
    return {"stage": WALK, "sentences": sentences.said(trade), **asdict(trade)}


def _document(trade: Trade, wanted: float | None) -> dict[str, Any]:
    """As JSON has it; with a wanted error, ``cheapest`` is the setting's name, or None."""
    if wanted is None:
        return asdict(trade)
    found = trade.cheapest(wanted)
    return {**asdict(trade), "cheapest": found.setting.name if found else None}
