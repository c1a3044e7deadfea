"""`ptm simulate`: what clients show on a walk, over a modelled link, with so much memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ptmtools.cli.common import as_json, database, forced, voiced, writable
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.errors import InputError, OutputError
from ptmtools.files import refuse_existing, write_bytes, writing
from ptmtools.lab import figures as figure, figures as pictures
from ptmtools.lab.campus.world import prepare_campus
from ptmtools.lab.comparing import SimulateOptions, counted, play, require_hints
from ptmtools.lab.measures import require as require_flip
from ptmtools.lab.path.making import path_through
from ptmtools.lab.path.options import PathOptions
from ptmtools.lab.report import as_csv, document, table
from ptmtools.lab.walk import Walk, read_walk
from ptmtools.lab.world import prepare, read_forms, relief_of
from ptmtools.link import read_trace
from ptmtools.output.names import HINTS
from ptmtools.output.served import read_served
from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.render import lit

#: How long the walk is that is made where none is given, s.
DURATION = 150.0


@click.command("simulate")
@database
@click.option(
    "--walk",
    "walk_files",
    type=click.Path(),
    multiple=True,
    metavar="FILE",
    help="A walk, as `ptm path` writes it. May be given several times. By default one of "
    f"{DURATION:.0f} s is made.",
)
@click.option(
    "--seed",
    "seeds",
    type=click.IntRange(0),
    multiple=True,
    help="Seed of the walk that is made without --walk; 1 by default. May be given several times.",
)
@options_of(SimulateOptions)
@click.option(
    "--against",
    type=click.Path(),
    metavar="DB",
    help="Another database of the same model: pictures are compared with its full one instead of "
    "that of DB. Such as one without --apo, or without --max-error.",
)
@click.option(
    "--campus",
    type=click.Path(),
    metavar="DIR",
    help="A campus of the same model, as `ptm campus` wrote it, for the policies campus-….",
)
@click.option(
    "--trace",
    "trace_file",
    type=click.Path(),
    metavar="FILE",
    help="How the link changes over time, JSON or CSV.",
)
@click.option(
    "--flip",
    is_flag=True,
    help="Also measure FLIP, the difference as people see it, of 12 frames of each run; takes "
    "seconds a run.",
)
@click.option("--csv", "csv_file", type=click.Path(), help="Also write every frame as CSV.")
@click.option("--plot", "plot_file", type=click.Path(), help="Also plot over time, as a PNG.")
@click.option(
    "--measure",
    type=click.Choice(list(figure.MEASURES)),
    default="e",
    show_default=True,
    help="What is plotted.",
)
@click.option(
    "--frames",
    "frames_folder",
    type=click.Path(),
    metavar="DIR",
    help="Also draw frames as PNGs, of the first policy, bandwidth, memory and walk, with what it "
    "shows.",
)
@click.option(
    "--every",
    type=click.FloatRange(0, min_open=True),
    default=10.0,
    show_default=True,
    help="Seconds from one frame that is drawn to the next.",
)
@click.option(
    "--strip",
    "strip_file",
    type=click.Path(),
    metavar="FILE",
    help="Also draw, of the first likewise, what is seen after 10, 35 and 80 s where the walk "
    "begins, and the full picture, as a PNG.",
)
@forced
@as_json
@voiced
def simulate(
    voice: Voice,
    db: str,
    walk_files: tuple[str, ...],
    seeds: tuple[int, ...],
    against: str | None,
    campus: str | None,
    trace_file: str | None,
    flip: bool,
    csv_file: str | None,
    plot_file: str | None,
    measure: str,
    frames_folder: str | None,
    every: float,
    strip_file: str | None,
    force: bool,
    as_json: bool,
    **values: Any,
) -> None:
    """Walk through DB with clients that fetch it over a modelled link, and say what they showed.

    Every policy walks over every link with every amount of memory. The walks are those of --walk,
    or made as `ptm path` makes them. DB is not changed.
    """
    options = take(SimulateOptions, values)
    if walk_files and seeds:
        raise click.UsageError("--seed is of the walk that is made without --walk")
    files = [file for file in (csv_file, plot_file, strip_file) if file]
    for file in files:
        writable(file, force)
    if len({Path(file).resolve() for file in files}) < len(files):
        raise click.UsageError("one file is named for two pictures or tables")
    frames_to = Path(frames_folder) if frames_folder else None
    if frames_to:
        _fillable(frames_to, force)
    if plot_file:
        figure.require()
    if flip:
        require_flip()
    _check_campus(options, campus, drawn=bool(frames_to or strip_file))
    trace = read_trace(trace_file) if trace_file else None
    walks = {file: read_walk(file) for file in walk_files} or _made(db, seeds)
    served, other = read_served(db), read_served(against) if against else None
    if options.lit:
        served, other = lit(served), lit(other) if other else None
    require_hints(served, options.policies)
    with voice.progress() as progress:
        pyramids = read_pyramids(served, progress)
        relief = relief_of(served, pyramids, other, lit=options.lit, progress=progress)
        shown = relief.reference.pyramids if relief and relief.reference else pyramids
        campuses = {
            name: prepare_campus(campus, walk, other or served, shown, progress=progress)
            for name, walk in walks.items()
            if campus
        }
        forms = read_forms(served, pyramids, (p.form for p in options.policies), progress)
        worlds = {
            name: counted(
                prepare(served, walk, pyramids, progress=progress, forms=forms, relief=relief),
                options,
            )
            for name, walk in walks.items()
        }
        played = play(worlds, options, trace, progress, flip=flip, campuses=campuses)
    if csv_file:
        write_bytes(csv_file, as_csv(played).encode(), force=force)
    if plot_file:
        write_bytes(plot_file, figure.picture(played, measure), force=force)
    first = worlds[played[0].walk]
    if frames_to:
        with writing(frames_to):
            frames_to.mkdir(parents=True, exist_ok=True)
        for name, data in pictures.frames(first, played[0].run, every):
            write_bytes(frames_to / name, data, force=force)
    if strip_file:
        write_bytes(strip_file, pictures.strip(first, played[0]), force=force)
    if as_json:
        voice.emit_json(document(db, played, worlds, lit=options.lit, against=against))
        return
    for line in table(played, worlds, lit=options.lit, against=against, campuses=campuses):
        voice.say(line)


def _check_campus(options: SimulateOptions, campus: str | None, *, drawn: bool) -> None:
    """Raises UsageError if a campus is named and not walked through, or the other way round, or if
    frames of it are to be drawn."""
    asked = [policy.name for policy in options.campus_policies]
    if asked and not campus:
        raise click.UsageError(
            f"policy {asked[0]} needs --campus, a folder that `ptm campus` wrote"
        )
    if campus and not asked:
        raise click.UsageError(
            "--campus is for policies such as campus-medium; add one to --policy"
        )
    if drawn and not options.policies:
        raise click.UsageError(
            "--frames and --strip draw what clients of DB show; add such a policy"
        )


def _fillable(folder: Path, force: bool) -> None:
    """Raises the `OutputError` that filling the folder would end in: PTM-O001 there is something in
    it, PTM-O002 it cannot be made, since it or what it is to be in is a file."""
    nearest = next(p for p in (folder, *folder.absolute().parents) if p.exists())
    if not nearest.is_dir():
        raise OutputError(
            "PTM-O002",
            f"cannot be made: {nearest.name} is no folder",
            file=folder,
            remedy="name another folder",
        )
    if not force and nearest == folder and any(folder.iterdir()):
        refuse_existing(folder, "use --force to replace frames in it, or name another folder")


def _made(db: str, seeds: tuple[int, ...]) -> dict[str, Walk]:
    """Walks through a database, by what they are called."""
    if (Path(db) / HINTS).exists():
        raise InputError(
            "PTM-I702",
            "is a served folder, which does not say where one can walk",
            file=db,
            remedy="give a walk with --walk FILE, or the database that the folder belongs to",
        )
    artifacts = Artifacts(open_database(db))
    return {
        f"seed {seed}": path_through(artifacts, PathOptions(seed=seed, duration=DURATION)).walk
        for seed in dict.fromkeys(seeds or (PathOptions.seed,))
    }
