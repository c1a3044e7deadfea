"""`ptm walk-campus`: what a walk through a campus loads and shows, over a modelled link."""

from __future__ import annotations

from typing import Any

import click

from ptmtools.cli.common import as_json, voiced
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.lab.campus.options import CampusWalkOptions


@click.command("walk-campus")
@click.argument("campus", type=click.Path())
@click.option(
    "--walk",
    "walk_file",
    type=click.Path(),
    required=True,
    metavar="FILE",
    help="A walk, as `ptm path` writes it.",
)
@click.option(
    "--db",
    type=click.Path(),
    help="A database of the same model: pictures are compared with its full picture, not with that "
    "of the campus.",
)
@options_of(CampusWalkOptions)
@click.option(
    "--every",
    type=click.IntRange(0),
    default=5,
    show_default=True,
    help="Measure the picture of every Nth frame, of five a second; 0: of none.",
)
@click.option(
    "--only",
    default="*",
    metavar="NAMES",
    help="Objects, with * and ?, as if there were no others.",
)
@click.option(
    "--trace",
    "trace_file",
    type=click.Path(),
    metavar="FILE",
    help="How the link changes over time, JSON or CSV.",
)
@as_json
@voiced
def walk_campus(
    voice: Voice,
    campus: str,
    walk_file: str,
    db: str | None,
    every: int,
    only: str,
    trace_file: str | None,
    as_json: bool,
    **values: Any,
) -> None:
    """Walk through CAMPUS, a folder that `ptm campus` wrote, with each preset, and say what was
    loaded, when, what came too late, and what it showed.

    The output is Markdown: a row for each measure, and the MB received by every half minute.
    """
    options = take(CampusWalkOptions, values)
    from ptmtools.lab.campus.report import document, received, table
    from ptmtools.lab.campus.simulation import simulate_campus
    from ptmtools.lab.campus.world import prepare_campus
    from ptmtools.lab.walk import read_walk
    from ptmtools.link import read_trace
    from ptmtools.output.served import read_served

    walk = read_walk(walk_file)
    trace = read_trace(trace_file) if trace_file else None
    served = read_served(db) if db else None
    with voice.progress() as progress:
        world = prepare_campus(campus, walk, served, every=every, only=only, progress=progress)
    runs = [simulate_campus(world, quality, options, trace) for quality in options.qualities]
    if as_json:
        voice.emit_json(document(campus, runs))
        return
    voice.say(
        f"{walk.length:.0f} m in {walk.duration:.0f} s, {world.stock.objects:,} objects, "
        f"{options.bandwidth}bit/s, {options.latency}\n"
    )
    for line in (*table(runs), "", *received(runs)):
        voice.say(line)
