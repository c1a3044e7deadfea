"""`ptm tour`: labels and stops of a database."""

from __future__ import annotations

from pathlib import Path

import click

from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    database_argument,
    force_option,
    json_option,
    option,
    output_option,
    with_console,
)
from ptmtools.quantities import count


@click.group("tour")
def commands() -> None:
    """Labels and stops of a building, in a file that `ptm serve` and `ptm publish` show
    (docs/formats/tour.md)."""


@commands.command("init", cls=Command)
@database_argument
@output_option("File to write. Default: tour.json in the folder that contains the database.")
@force_option()
@json_option
@with_console
def init(console: Console, db: str, output: str | None, force: bool) -> None:
    """Write a tour with a label for each picture and each named room of DB, a view of it, and the
    names of the places."""
    from ptmtools.files import refuse_existing, write_bytes
    from ptmtools.output.served import place_names
    from ptmtools.pipeline.artifacts import Artifacts
    from ptmtools.pipeline.command import naming_command, open_database
    from ptmtools.pipeline.stages import CELLS, SCENE
    from ptmtools.tour.model import NAME
    from ptmtools.tour.starting import first_tour

    file = Path(db).absolute().parent / NAME if output is None else Path(output)
    if not force:
        refuse_existing(file)
    with naming_command(db):
        folder = open_database(db)
        artifacts = Artifacts(folder)
        scene, cells, places = artifacts[SCENE], artifacts[CELLS], place_names(db)
    text, pictures, rooms = first_tour(scene, cells, folder.manifest.model, places)
    write_bytes(file, text.encode(), force=force)
    if pictures + rooms:
        labels = f"labels of {count(pictures, 'picture')} and {count(rooms, 'room')}"
        remedy = "write their texts into the file, or on the page with `ptm serve DB --edit`"
    else:
        labels = "no label yet: no object is a picture, and the model names no room"
        remedy = (
            "place labels with `ptm serve DB --edit`; a picture is upright, flat, with an image of "
            "its own, above the floor (docs/formats/tour.md)"
        )
    console.result(
        {"tour": str(file), "pictures": pictures, "rooms": rooms, "places": len(places)},
        [f"{file}: {labels}; names of {count(len(places), 'place')}", remedy],
    )


@commands.command("check", cls=Command)
@database_argument
@option(
    "--tour",
    "choice",
    type=click.Path(),
    metavar="FILE",
    default="",
    help="The tour. Default: tour.json in the folder that contains the database.",
)
@json_option
@with_console
def check(console: Console, db: str, choice: str) -> None:
    """Check a tour against DB: its form, its files, and the objects, rooms and places that it
    names."""
    from ptmtools.errors import InputError
    from ptmtools.pipeline.command import naming_command, open_database
    from ptmtools.site.tours import site_tour
    from ptmtools.tour.model import NAME

    with naming_command(db):
        tour, note = site_tour(open_database(db), choice, lambda file, _: file.name)
    if tour is None:
        raise InputError(
            "PTM-I120",
            note or f"there is no {NAME} beside the database",
            file=db,
            remedy="make one with `ptm tour init DB`, or name one with --tour",
        )
    labels, stops = len(tour.document["labels"]), len(tour.document["stops"])
    languages = tour.document["languages"]
    console.result(
        {"labels": labels, "stops": stops, "languages": languages},
        [f"{count(labels, 'label')}, {count(stops, 'stop')}, in {', '.join(languages)}"],
    )
