"""Commands of the laboratory: `ptm path`, `simulate` and `walk-campus`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

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
    output_option,
    take,
    with_console,
)
from ptmtools.errors import InputError, OutputError, naming
from ptmtools.files import refuse_existing, write_bytes, writing
from ptmtools.link import read_trace
from ptmtools.options import arguments
from ptmtools.output.names import HINTS
from ptmtools.output.served import read_served
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.progress import Progress
from ptmtools.quantities import count
from ptmtools.rendering.light import with_lamp
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.walk import Walk, read_walk, walk_text
from ptmtools_lab import figures
from ptmtools_lab.campus.options import CampusWalkOptions
from ptmtools_lab.campus.world import CampusFrames, CampusWorld, prepare_campus
from ptmtools_lab.comparing import RunResult, SimulateOptions, apply_counting, play, require_hints
from ptmtools_lab.measures import require as require_flip
from ptmtools_lab.path.making import path_through
from ptmtools_lab.path.options import PathOptions
from ptmtools_lab.policies.paper import PaperOptions
from ptmtools_lab.report import as_csv, document, table
from ptmtools_lab.tables import Drawing
from ptmtools_lab.world import World, prepare, read_forms, relief_of

T = TypeVar("T")

#: Rooms that are listed without ``-v``.
SHOWN = 12
#: Duration of the default walk of ``ptm simulate``, s.
DURATION = 150.0
#: The heading of the options on what is simulated, and an option under it.
WALKS = "Walk and reference"
reference = partial(option, heading=WALKS)
#: ``--trace``, as ``trace_file``.
trace_option = file_option(
    "trace", "File with the bandwidth, latency and loss of the link over time, JSON or CSV.", WALKS
)


@click.command("path", cls=Command)
@database_argument
@output_option("Walk to write, a JSON file.", required=True)
@options_of(PathOptions)
@force_option()
@json_option
@with_console
def path_command(console: Console, db: str, output: str, force: bool, **values: Any) -> None:
    """Generate a walk through every room of DB: on floors and through doors, with stops at
    pictures.

    The walk begins at a viewpoint. The same seed always gives the same walk.
    """
    options = take(PathOptions, values)
    check_writable(output, force=force)
    artifacts = Artifacts(open_database(db))
    with naming(db):
        path = path_through(artifacts, options)
    write_bytes(output, walk_text(path.walk).encode(), force=force)
    document = {
        "rooms": path.rooms,
        "visited": list(path.visited),
        "unreachable": list(path.unreachable),
        "stops": path.stops,
        "length": round(path.walk.length, 3),
        "duration": path.walk.duration,
        "samples": len(path.walk.time),
    }
    lines = [
        f"{output}: {len(path.visited):,} of {count(path.rooms, 'room')}, "
        f"{path.walk.length:.0f} m in {path.walk.duration:.0f} s, {count(path.stops, 'stop')}"
    ]
    unvisited = path.rooms - len(path.visited) - len(path.unreachable)
    if unvisited and options.duration is not None:
        lines.append(f"a longer --duration visits {count(unvisited, 'more room')}")
    if not path.walk.length:
        lines.append("the walk stays in one place: no other is reachable")
    if path.unreachable:
        shown = path.unreachable if console.verbose else path.unreachable[:SHOWN]
        more = ", …; -v lists all" if len(shown) < len(path.unreachable) else ""
        lines.append(
            f"not reachable on foot, at eye height: {count(len(path.unreachable), 'room')}, cell "
            f"{', '.join(map(str, shown))}{more}"
        )
    console.result(document, lines)


@click.command("walk-campus", cls=Command)
@click.argument("campus", type=click.Path())
@file_option(
    "walk", "Walk: a file of `ptm path`, or a recording of the viewer.", WALKS, required=True
)
@reference(
    "--db",
    type=click.Path(),
    help="Database of the same model. The reference is then an image of this database fully "
    "loaded, not of the campus.",
)
@options_of(CampusWalkOptions)
@reference(
    "--every",
    type=click.IntRange(0),
    default=5,
    help="Measure the image of every Nth frame (the simulation draws five frames per second); "
    "0 measures none.",
)
@reference(
    "--only",
    default="*",
    metavar="NAMES",
    help="Keep only objects with these names; * and ? are wildcards.",
)
@trace_option
@file_option("plot", "Also plot charts 1 to 5 of the campus paper, as a PNG or an SVG.")
@force_option()
@json_option
@with_console
def walk_campus(
    console: Console,
    campus: str,
    walk_file: str,
    db: str | None,
    trace_file: str | None,
    plot_file: str | None,
    force: bool,
    **values: Any,
) -> None:
    """Simulate a walk through CAMPUS, which `ptm campus` wrote, with each preset, and report
    downloads, objects shown late, and the image error.

    The output is Markdown: a row for each measure, and the MB received per half minute.
    """
    options = take(CampusWalkOptions, values)
    from ptmtools_lab import campus_report as report
    from ptmtools_lab.campus.simulation import simulate_campus

    if plot_file is not None:
        report.form_of(plot_file)
        check_writable(plot_file, force=force)
        figures.require()
    walk = read_walk(walk_file)
    trace = read_trace(trace_file) if trace_file else None
    served = read_served(db) if db else None
    with console.progress() as progress:
        world = prepare_campus(
            campus, walk, served, frames=pick(CampusFrames, values), progress=progress
        )
    runs = [simulate_campus(world, quality, options, trace) for quality in options.qualities]
    if plot_file is not None:
        write_bytes(plot_file, report.picture(runs, report.form_of(plot_file)), force=force)
    head = (
        f"{walk.length:.0f} m in {walk.duration:.0f} s, {world.stock.objects:,} objects, "
        f"{options.bandwidth}bit/s, {options.latency}\n"
    )
    lines = head, *report.table(runs), "", *report.received_table(runs)
    console.result(report.document(campus, runs), lines)


@click.command("simulate", cls=Command)
@database_argument
@file_option(
    "walk",
    f"Walk: a file of `ptm path`, or a recording of the viewer. Repeatable. "
    f"Default: a new walk of {DURATION:.0f} s.",
    WALKS,
    multiple=True,
)
@reference(
    "--seed",
    "seeds",
    type=click.IntRange(0),
    multiple=True,
    help="Seed of the walk that is generated if --walk is not given; 1 by default. Repeatable.",
)
@options_of(SimulateOptions, PaperOptions)
@reference(
    "--against",
    type=click.Path(),
    metavar="DB",
    help="Another database of the same model, such as one without --max-error. The reference is "
    "then an image of that database fully loaded, not of DB.",
)
@reference(
    "--campus",
    type=click.Path(),
    metavar="DIR",
    help="Campus of the same model, which `ptm campus` wrote, for the policies campus-….",
)
@trace_option
@option(
    "--flip",
    heading="Output",
    is_flag=True,
    help="Also measure FLIP, the perceived difference, in 12 frames of each run. This takes "
    "seconds per run.",
)
@file_option("csv", "Also write all frames as CSV.")
@file_option("plot", "Also plot --measure over time, as a PNG.")
@option(
    "--measure",
    heading="Output",
    type=click.Choice(list(figures.MEASURES)),
    default="e",
    help="Measure to plot: e (mean error per pixel), rmse (root mean square error), missing (share "
    "of the wanted levels that is not loaded) or quality (loaded levels as a share of all "
    "levels).",
)
@file_option(
    "frames",
    "Also draw frames of the first policy, bandwidth, memory and walk, as PNGs.",
    metavar="DIR",
)
@option(
    "--every",
    heading="Output",
    type=click.FloatRange(0, min_open=True),
    default=10.0,
    metavar="SECONDS",
    help="Interval between the frames of --frames.",
)
@file_option(
    "strip",
    "Also write one PNG with the view from the start of the walk after 10, 35 and 80 s of "
    "loading, after 3 s from a local server, and fully loaded, for the same run as --frames.",
)
@force_option()
@json_option
@with_console
def simulate(
    console: Console,
    db: str,
    walk_file: tuple[str, ...],
    seeds: tuple[int, ...],
    trace_file: str | None,
    flip: bool,
    **values: Any,
) -> None:
    """Simulate visitors who walk through DB and clients that load it over a modelled link, and
    measure the images that they see.

    The command simulates every policy with every link and every amount of memory. It does not
    change DB.
    """
    options, paper = take(SimulateOptions, values), take(PaperOptions, values)
    others, output = pick(OtherForms, values), pick(SimulateOutput, values)
    with_paper = any(policy.options for policy in options.policies)
    if paper != PaperOptions() and not with_paper:
        raise click.UsageError(f"{arguments([paper])[0]} needs --policy paper")
    if walk_file and seeds:
        raise click.UsageError("use either --walk or --seed")
    output.check()
    if flip:
        require_flip()
    _check_campus(options, others.campus, drawn=bool(output.frames_file or output.strip_file))
    trace = read_trace(trace_file) if trace_file else None
    walks = {file: read_walk(file) for file in walk_file} or _new_walks(db, seeds)
    with console.progress() as progress:
        worlds, campuses = _prepare_worlds(db, walks, options, others, progress)
        played = play(worlds, options, trace, progress, flip=flip, campuses=campuses, paper=paper)
    output.write(worlds, played, paper)
    paper_options = paper if with_paper else None
    lines = table(played, worlds, lit=options.lit, against=others.against, campuses=campuses)
    if given := arguments([paper]):
        lines.insert(0, f"policy paper with {' '.join(given)}")
    result = document(
        db, played, worlds, lit=options.lit, against=others.against, paper=paper_options
    )
    console.result(result, lines)


@dataclass(frozen=True)
class OtherForms:
    """Another database and a campus of the same model, if the command line names them."""

    against: str | None
    campus: str | None


@dataclass(frozen=True)
class SimulateOutput:
    """The files to write beside the report, and the options of `simulate` on them."""

    csv_file: str | None
    plot_file: str | None
    measure: str
    frames_file: str | None
    every: float
    strip_file: str | None
    force: bool

    def check(self) -> None:
        """Raises, before anything is simulated, what writing would raise."""
        files = [file for file in (self.csv_file, self.plot_file, self.strip_file) if file]
        for file in files:
            check_writable(file, force=self.force)
        if len({Path(file).resolve() for file in files}) < len(files):
            raise click.UsageError("two pictures or tables have the same file name")
        if self.frames_file:
            _check_folder(Path(self.frames_file), self.force)
        if self.plot_file:
            figures.require()

    def write(
        self, worlds: Mapping[str, World], played: Sequence[RunResult], paper: PaperOptions
    ) -> None:
        """Writes the files of runs; frames and strip are of the first."""
        if self.csv_file:
            write_bytes(self.csv_file, as_csv(played).encode(), force=self.force)
        if self.plot_file:
            write_bytes(self.plot_file, figures.picture(played, self.measure), force=self.force)
        first = worlds[played[0].walk]
        if self.frames_file:
            folder = Path(self.frames_file)
            with writing(folder):
                folder.mkdir(parents=True, exist_ok=True)
            for name, data in figures.frames(first, played[0].run, self.every):
                write_bytes(folder / name, data, force=self.force)
        if self.strip_file:
            write_bytes(self.strip_file, figures.strip(first, played[0], paper), force=self.force)


def pick(cls: type[T], values: Mapping[str, Any]) -> T:
    """A record of parsed values whose names are those of its fields."""
    names = (field.name for field in fields(cls))  # type: ignore[arg-type]
    return cls(**{name: values[name] for name in names if name in values})


def _prepare_worlds(
    db: str,
    walks: Mapping[str, Walk],
    options: SimulateOptions,
    others: OtherForms,
    progress: Progress,
) -> tuple[dict[str, World], dict[str, CampusWorld]]:
    """The worlds of walks, through the database and through the campus, if there is one."""
    served, compared = read_served(db), read_served(others.against) if others.against else None
    if options.lit:
        served, compared = with_lamp(served), with_lamp(compared) if compared else None
    require_hints(served, options.policies)
    pyramids = read_pyramids(served, progress)
    relief = relief_of(served, pyramids, compared, lit=options.lit, progress=progress)
    shown = relief.reference.pyramids if relief and relief.reference else pyramids
    campuses = {
        name: prepare_campus(others.campus, walk, compared or served, shown, progress=progress)
        for name, walk in walks.items()
        if others.campus
    }
    forms = read_forms(served, pyramids, (p.form for p in options.policies), progress)
    drawing = Drawing(forms=forms, relief=relief)
    worlds = {
        name: apply_counting(
            prepare(served, walk, pyramids, progress=progress, drawing=drawing), options
        )
        for name, walk in walks.items()
    }
    return worlds, campuses


def _check_campus(options: SimulateOptions, campus: str | None, *, drawn: bool) -> None:
    """Raises UsageError if policies of a campus and ``--campus`` do not go together, or if there is
    no client of a database whose frames can be drawn."""
    names = [policy.name for policy in options.campus_policies]
    if names and not campus:
        raise click.UsageError(
            f"policy {names[0]} needs --campus, a folder that `ptm campus` wrote"
        )
    if campus and not names:
        raise click.UsageError(
            "--campus is for policies such as campus-medium; add one to --policy"
        )
    if drawn and not options.policies:
        raise click.UsageError("--frames and --strip draw clients of DB; add such a policy")


def _check_folder(folder: Path, force: bool) -> None:
    """Raises the `OutputError` of writing files into the folder: PTM-O001 it is not empty, PTM-O002
    it, or a folder above it, is a file."""
    nearest = next(p for p in (folder, *folder.absolute().parents) if p.exists())
    if not nearest.is_dir():
        raise OutputError(
            "PTM-O002",
            f"cannot be created: {nearest.name} is not a folder",
            file=folder,
            remedy="specify another folder",
        )
    if not force and nearest == folder and any(folder.iterdir()):
        refuse_existing(folder, "use --force to replace frames in it, or specify another folder")


def _new_walks(db: str, seeds: tuple[int, ...]) -> dict[str, Walk]:
    """New walks through a database, by name."""
    if (Path(db) / HINTS).exists():
        raise InputError(
            "PTM-I701",
            "is a served folder, which does not record the walkable floor",
            file=db,
            remedy="use a walk with --walk FILE, or the database that the folder belongs to",
        )
    artifacts = Artifacts(open_database(db))
    return {
        f"seed {seed}": path_through(artifacts, PathOptions(seed=seed, duration=DURATION)).walk
        for seed in dict.fromkeys(seeds or (PathOptions.seed,))
    }
