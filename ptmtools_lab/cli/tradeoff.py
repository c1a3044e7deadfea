"""`ptm tradeoff`: the cost of settings, and their effect on accuracy and on a walk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.batch import check_writable
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    database_argument,
    file_option,
    force_option,
    json_option,
    option,
    options_of,
    take,
    with_console,
)
from ptmtools.coverage.options import MAX_SAMPLES
from ptmtools.files import write_bytes
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.progress import Progress
from ptmtools.walk import Walk, read_walk
from ptmtools_lab.cli.simulation import pick
from ptmtools_lab.figures import require
from ptmtools_lab.path.making import path_through
from ptmtools_lab.path.options import PathOptions
from ptmtools_lab.tradeoff import EXPERIMENTS, FURTHER, report as sentences
from ptmtools_lab.tradeoff.experiment import Deadline, Subject, Trade, run
from ptmtools_lab.tradeoff.knobs import KNOBS
from ptmtools_lab.tradeoff.report import as_csv, picture, table
from ptmtools_lab.tradeoff.walk import WalkOptions, WalkTrade, require_prices, try_settings

#: An option under the heading of this command.
experiment = partial(option, heading="Experiments")
#: Fewest sample points of the reference, so that settings with fewer remain.
LEAST_POINTS = 64
#: The experiment on a walk, beside those of the stages.
WALK = "walk"
#: Share of the time that is for the walk.
_SHARE = 0.5
#: Duration of the default walk, and with ``--quick``, s.
DURATION, QUICK = 60.0, 30.0


@click.command("tradeoff", cls=Command)
@database_argument
@experiment(
    "--stage",
    "stages",
    type=click.Choice([WALK, *EXPERIMENTS, *FURTHER]),
    multiple=True,
    help=f"Run only this experiment: the effect of settings on a walk ({WALK}), the accuracy of "
    "one stage, that of a client's options (client), or that of another form of the model. "
    f"Repeatable. Default: {', '.join((WALK, *EXPERIMENTS))}.",
)
@file_option(
    "walk",
    f"Walk that `ptm path` wrote. Default: a new walk of {DURATION:.0f} s, or of {QUICK:.0f} s "
    "with --quick.",
    "Experiments",
)
@options_of(WalkOptions)
@experiment(
    "--option",
    "--knob",
    "knobs",
    type=click.Choice([knob.option.removeprefix("--") for knob in KNOBS]),
    multiple=True,
    help="Test only this option on the walk, including values that make the build slow. "
    "Repeatable. Default: all.",
)
@experiment(
    "--minutes",
    type=click.FloatRange(0, min_open=True),
    default=10.0,
    help="Time limit. The first values of the options with the greatest effect are tested first; "
    "half of the time is for the walk. Settings that remain are named.",
)
@experiment("--quick", is_flag=True, help="Test one value of each option, on a shorter walk.")
@experiment(
    "--error",
    "wanted",
    type=click.FloatRange(0, min_open=True),
    help="Also print the cheapest setting of each stage within this error.",
)
@experiment(
    "--cells-tried",
    type=click.IntRange(1),
    default=16,
    help="Number of cells, evenly spread over the database, in which coverage hints are tested.",
)
@experiment(
    "--reference",
    type=click.IntRange(LEAST_POINTS, MAX_SAMPLES),
    default=MAX_SAMPLES,
    metavar="POINTS",
    help="Number of sample points per cell in the reference hints. Only settings with fewer points "
    "are tested.",
)
@file_option("csv", "Also write all trials as CSV.")
@file_option("plot", "Also plot error against cost, as a PNG.")
@force_option()
@json_option
@with_console
def tradeoff(
    console: Console,
    db: str,
    stages: tuple[str, ...],
    walk_file: str | None,
    knobs: tuple[str, ...],
    wanted: float | None,
    **values: Any,
) -> None:
    """Measure the cost and the benefit of settings on the scene of DB. The command does not change
    DB.

    The first part is the effect on a walk through the building, in sentences and as a table: first
    the settings that only gain, then those with gains and losses. The second part is the accuracy
    of each stage; a star marks settings that no cheaper one surpasses.
    """
    options, output = take(WalkOptions, values), pick(TradeOutput, values)
    stages = stages or (WALK, *EXPERIMENTS)
    if WALK not in stages and (walk_file or knobs):
        given = "--walk" if walk_file else "--option"
        raise click.UsageError(f"{given} needs --stage {WALK}")
    walk = read_walk(walk_file) if walk_file else None
    output.check()
    artifacts = Artifacts(open_database(db))
    with console.progress() as progress:
        tell = console.warn
        effort = pick(Effort, values)
        walked, trades = effort.spend(stages, artifacts, (walk, options, knobs), progress, tell)
    output.write([trade for walk in walked for trade in sentences.trades(walk)] + trades)
    first = [
        {"stage": WALK, "sentences": sentences.sentences(trade), **asdict(trade)}
        for trade in walked
    ]
    blocks = [sentences.settings_table(walk, wanted) for walk in walked]
    blocks += [table(trade, wanted) for trade in trades]
    document = [*first, *(_document(trade, wanted) for trade in trades)]
    console.result(document, (line for lines in blocks for line in (*lines, "")))
    for trade in walked:
        require_prices(trade, Path(db))


@dataclass(frozen=True)
class Effort:
    """The options of `tradeoff` on its own time and accuracy."""

    minutes: float
    quick: bool
    cells_tried: int
    reference: int

    def spend(
        self,
        stages: Sequence[str],
        artifacts: Artifacts,
        walking: tuple[Walk | None, WalkOptions, Sequence[str]],
        progress: Progress,
        tell: Callable[[str], None],
    ) -> tuple[list[WalkTrade], list[Trade]]:
        """Runs the experiments, each within its part of the time. ``walking``: the walk, None for a
        new one, the clients, and the options to try."""
        walk, options, knobs = walking
        subject, deadline = (
            Subject(artifacts, self.cells_tried, self.reference),
            Deadline(self.minutes),
        )
        walked: list[WalkTrade] = []
        trades = []
        for number, stage in enumerate(stages):
            remaining = len(stages) - number
            until = deadline.part(max(_SHARE, 1 / remaining) if stage == WALK else 1 / remaining)
            progress(0, 1, f"preparing {stage}")
            if stage == WALK:
                duration = QUICK if self.quick else DURATION
                walk = walk or path_through(artifacts, PathOptions(duration=duration)).walk
                walked.append(
                    try_settings(
                        artifacts, walk, options, knobs,
                        quick=self.quick, deadline=until, progress=progress, tell=tell,
                    )
                )  # fmt: skip
            else:
                experiment = {**EXPERIMENTS, **FURTHER}[stage].load()(subject)
                trades.append(run(stage, experiment, progress, until))
        return walked, trades


@dataclass(frozen=True)
class TradeOutput:
    """The files to write beside the report."""

    csv_file: str | None
    plot_file: str | None
    force: bool

    def check(self) -> None:
        """Raises, before anything is measured, what writing would raise."""
        for file in (self.csv_file, self.plot_file):
            if file:
                check_writable(file, force=self.force)
        if self.plot_file:
            require()

    def write(self, trades: Sequence[Trade]) -> None:
        """Writes the files."""
        if self.csv_file:
            write_bytes(self.csv_file, as_csv(trades).encode(), force=self.force)
        if self.plot_file:
            write_bytes(self.plot_file, picture(trades), force=self.force)


def _document(trade: Trade, wanted: float | None) -> dict[str, Any]:
    """The trials of a stage as JSON; with a wanted error, ``cheapest`` is a setting or null."""
    if wanted is None:
        return asdict(trade)
    best = trade.cheapest(wanted)
    return {**asdict(trade), "cheapest": best.setting.name if best else None}
