"""`ptm apo`: a mesh of many triangles as a simplified one and an octree texture."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from ptmtools.apo.model import ApoOptions
from ptmtools.cli.batch import no_name
from ptmtools.cli.common import as_json, voiced, workers
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.quantities import count, size
from ptmtools.scene.options import IngestOptions


@click.command("apo")
@click.argument("mesh", metavar="MESH|DIR", type=click.Path())
@click.option(
    "-o",
    "--output",
    "folder",
    type=click.Path(),
    metavar="DIR",
    help="The folder to write. By default bust.ply makes bust.apo, in the same folder.",
)
@options_of(ApoOptions, IngestOptions)
@click.option("--force", is_flag=True, help="Replace a folder that ptm apo has written.")
@workers
@as_json
@voiced
def apo(
    voice: Voice,
    mesh: str,
    folder: str | None,
    force: bool,
    workers: int,
    as_json: bool,
    **values: Any,
) -> None:
    """Turn a mesh of many triangles into a simplified mesh and an octree texture of its normals,
    which streams level by level (docs/format-apo.md).
    """
    from ptmtools.apo.files import FORM, files_of
    from ptmtools.apo.making import make_apo
    from ptmtools.apo.reading import read_index
    from ptmtools.executors import open_executor
    from ptmtools.executors.model import processors
    from ptmtools.scene import ingest
    from ptmtools.scene.notes import warnings

    if not mesh or folder == "":
        raise no_name()
    options, read = take(ApoOptions, values), take(IngestOptions, values)
    target = os.fspath(Path(mesh).with_suffix(".apo")) if folder is None else folder
    FORM.check(target, force=force)
    with voice.progress() as progress, open_executor(workers) as executor:
        scene = ingest(mesh, read, progress, workers=workers or processors())
        made = make_apo(scene, options, executor, progress)
    FORM.write(target, files_of(made), force=force)
    index = read_index(target)
    if as_json:
        voice.emit_json(index.document)
        return
    for warning in [*warnings(scene.notes), *made.notes]:
        voice.warn(warning)
    whole = sum(stream.ends[-1] for stream in (index.normals, index.colors) if stream)
    voice.say(
        f"{target}: {made.source:,} triangles → {len(made.mesh.triangles):,} faces, "
        f"{size(int(index.mesh['bytes']))}; octree of {count(index.levels, 'level')}, "
        f"{int(index.start[-1]):,} texels, {size(whole)}"
    )
