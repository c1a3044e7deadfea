"""`ptm publish`: a database as a folder for any static host."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import click

from ptmtools.cli.common import as_json, database, voiced
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.quantities import count, size
from ptmtools.site.content import SiteOptions, site_of
from ptmtools.site.publishing import COARSE, PublishOptions, publish as write, weight_of


@click.command("publish")
@database
@click.option(
    "-o", "--output", "folder", type=click.Path(), required=True, help="The site, a folder."
)
@options_of(SiteOptions, PublishOptions)
@click.option(
    "--force",
    is_flag=True,
    help="Write into a folder that is not a site, and replace files of the same names in it.",
)
@as_json
@voiced
def publish(voice: Voice, db: str, folder: str, force: bool, as_json: bool, **values: Any) -> None:
    """Write what a browser needs to walk through DB to a folder that any web server can serve.

    Publishing again changes only what has changed.
    """
    site_options, options = take(SiteOptions, values), take(PublishOptions, values)
    with voice.progress() as progress:
        site = site_of(db, site_options, progress)
        done = write(site, folder, options, force=force, progress=progress)
    weight = weight_of(site)
    if as_json:
        changed = {name: list(names) for name, names in asdict(done).items()}
        voice.emit_json({**changed, "notes": list(site.notes), "bytes": asdict(weight)})
        return
    for note in site.notes:
        voice.warn(note)
    removed = f", {count(len(done.removed), 'file')} removed" if done.removed else ""
    voice.say(
        f"{folder}: {count(len(done.written), 'file')} written, "
        f"{len(done.unchanged):,} unchanged{removed}"
    )
    voice.say(f"a visitor downloads {size(weight.page)} for the page itself,")
    voice.say(
        f"{size(weight.first_room)} in total until the first room is shown (textures of up to "
        f"{COARSE} texels a side),"
    )
    voice.say(
        f"then {size(weight.mean_room)} for another room on average, at most "
        f"{size(weight.worst_room)} (cell {weight.worst_cell}), and {size(weight.whole)} in all"
    )
