"""`ptm path`: a walk through every room of a database."""

from __future__ import annotations

from typing import Any

import click

from ptmtools.cli.common import as_json, database, forced, voiced, writable
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.errors import naming
from ptmtools.files import write_bytes
from ptmtools.lab.path.making import Path, path_through
from ptmtools.lab.path.options import PathOptions
from ptmtools.lab.walk import walk_text
from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.quantities import count

#: Rooms that are named without ``-v``.
SHOWN = 12


@click.command("path")
@database
@click.option("-o", "--output", type=click.Path(), required=True, help="The walk, a JSON file.")
@options_of(PathOptions)
@forced
@as_json
@voiced
def path(voice: Voice, db: str, output: str, force: bool, as_json: bool, **values: Any) -> None:
    """Make a walk through every room of DB: on floors and through doors, with stops at pictures.

    It begins where a viewpoint is. The same seed makes the same walk.
    """
    options = take(PathOptions, values)
    writable(output, force)
    artifacts = Artifacts(open_database(db))
    with naming(db):
        made = path_through(artifacts, options)
    write_bytes(output, walk_text(made.walk).encode(), force=force)
    if as_json:
        voice.emit_json(_document(made))
        return
    voice.say(
        f"{output}: {len(made.visited):,} of {count(made.rooms, 'room')}, "
        f"{made.walk.length:.0f} m in {made.walk.duration:.0f} s, {count(made.stops, 'stop')}"
    )
    left = made.rooms - len(made.visited) - len(made.unreachable)
    if left and options.duration is not None:
        voice.say(f"{count(left, 'room')} more with a longer --duration")
    if not made.walk.length:
        voice.say("there is one place to stand and nowhere to go")
    if made.unreachable:
        named = made.unreachable if voice.verbose else made.unreachable[:SHOWN]
        more = ", …; -v names all" if len(named) < len(made.unreachable) else ""
        rooms = count(len(made.unreachable), "room")
        voice.say(
            f"no way on foot, at the height of eyes, to {rooms}: cell "
            f"{', '.join(map(str, named))}{more}"
        )


def _document(made: Path) -> dict[str, Any]:
    return {
        "rooms": made.rooms,
        "visited": list(made.visited),
        "unreachable": list(made.unreachable),
        "stops": made.stops,
        "length": round(made.walk.length, 3),
        "duration": made.walk.duration,
        "samples": len(made.walk.time),
    }
