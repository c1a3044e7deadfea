"""`ptm campus`: a model as objects with levels of detail."""

from __future__ import annotations

from typing import Any

import click

from ptmtools.cli.common import as_json, voiced, workers
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.neighbours.campus.options import CampusOptions
from ptmtools.neighbours.campus.reading import record, summary
from ptmtools.quantities import count
from ptmtools.scene.options import IngestOptions


@click.command("campus")
@click.argument("model", type=click.Path())
@click.option(
    "-o", "--output", "folder", type=click.Path(), required=True, help="The campus, a folder."
)
@options_of(CampusOptions, IngestOptions)
@click.option("--force", is_flag=True, help="Replace a campus that is there.")
@workers
@as_json
@voiced
def campus(
    voice: Voice,
    model: str,
    folder: str,
    force: bool,
    workers: int,
    as_json: bool,
    **values: Any,
) -> None:
    """Write MODEL as a campus: each object in several levels of detail with a lightmap of its own,
    textures by size and channel, and what each preset of quality loads.

    A client loads the coarsest meshes first, and refines the objects that are nearest.
    """
    if not model or not folder:
        raise click.UsageError("a name is empty")
    options, reading = take(CampusOptions, values), take(IngestOptions, values)
    from ptmtools.neighbours.campus.building import make_campus
    from ptmtools.parallel import open_executor
    from ptmtools.scene.notes import line, outside, warnings

    with voice.progress() as progress, open_executor(workers) as executor:
        made = make_campus(
            model, folder, options, reading, executor, force=force, progress=progress
        )
    said = outside(made.scene.notes)
    if as_json:
        seconds = {name: round(value, 3) for name, value in made.seconds.items()}
        notes = [line(note) for note in said]
        voice.emit_json({**record(made.campus), "seconds": seconds, "notes": [*notes, *made.notes]})
        return
    for warning in warnings(said):
        voice.warn(warning)
    for note in made.notes:
        voice.warn(f"note: {note}")
    if voice.verbose:
        for each in said:
            voice.warn(f"note: {line(each)}")
    voice.say(f"{folder}: {count(len(made.campus.files()) + 1, 'file')}")
    for text in summary(made.campus):
        voice.say(text)
