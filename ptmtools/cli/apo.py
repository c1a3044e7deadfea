"""`ptm apo`: a mesh of many triangles as a simplified one and an octree texture."""

from __future__ import annotations

import os
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ptmtools.cli.batch import no_name
from ptmtools.cli.common import as_json, voiced, workers
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.neighbours.apo.model import ApoOptions
from ptmtools.neighbours.apo.picture import RenderOptions
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
@click.option(
    "--render",
    "view",
    type=click.Path(),
    metavar="VIEW.png",
    help="Draw what a client shows, as a PNG. Of a DIR that is there already nothing else is done.",
)
@options_of(RenderOptions)
@click.option(
    "--force", is_flag=True, help="Replace a folder that ptm apo has written, or the picture."
)
@workers
@as_json
@voiced
def apo(
    voice: Voice,
    mesh: str,
    folder: str | None,
    view: str | None,
    force: bool,
    workers: int,
    as_json: bool,
    **values: Any,
) -> None:
    """Turn a mesh of many triangles into a simplified mesh and an octree texture of its normals,
    which streams level by level (docs/formats/apo.md), and draw such a folder.
    """
    from ptmtools.neighbours.apo.files import INDEX, read_index
    from ptmtools.scene.ingestion import check_file

    if not mesh or "" in (folder, view):
        raise no_name()
    drawn = take(RenderOptions, values)
    if view is not None:
        _check_picture(view, force)
    made = folder is None and view is not None and (Path(mesh) / INDEX).is_file()
    if made:
        _refuse_making(values)
    else:
        check_file(Path(mesh))
    target = mesh if made else folder or os.fspath(Path(mesh).with_suffix(".apo"))
    if not made:
        _make(voice, mesh, target, values, workers, force)
    index = read_index(target)
    said: dict[str, Any] = {}
    if view is not None:
        said = _draw(target, view, drawn, force)
    if as_json:
        voice.emit_json({**index.document, **({"picture": said} if said else {})})
        return
    if said:
        by = f"{said['levels']} of {count(index.levels, 'level')}"
        voice.say(f"{view}: {target} by {by}, {said['renderer']}")
    if not made:
        source, mesh_file = index.document["source"], index.mesh
        whole = sum(stream.ends[-1] for stream in (index.normals, index.colors) if stream)
        voice.say(
            f"{target}: {source['triangles']:,} triangles → {mesh_file['faces']:,} faces, "
            f"{size(mesh_file['bytes'])}; octree of {count(index.levels, 'level')}, "
            f"{int(index.start[-1]):,} texels, {size(whole)}"
        )


def _make(
    voice: Voice, model: str, folder: str, values: dict[str, Any], workers: int, force: bool
) -> None:
    from ptmtools.neighbours.apo.files import FORM, files_of
    from ptmtools.neighbours.apo.making import make_apo
    from ptmtools.parallel import open_executor, processors
    from ptmtools.scene import ingest
    from ptmtools.scene.notes import outside, warnings

    options, read = take(ApoOptions, values), take(IngestOptions, values)
    FORM.check(folder, force=force)
    with voice.progress() as progress, open_executor(workers) as executor:
        scene = ingest(model, read, progress, workers=workers or processors())
        if scene.space.up_guessed or scene.space.unit_guessed:
            # Guessed by what buildings are like; a statue stays as it is.
            read = replace(read, up=read.up or "y", unit=read.unit or "m")
            scene = ingest(model, read, progress, workers=workers or processors())
        made = make_apo(scene, options, executor, progress)
    FORM.write(folder, files_of(made), force=force)
    for warning in [*warnings(outside(scene.notes)), *made.notes]:
        voice.warn(warning)


def _check_picture(view: str, force: bool) -> None:
    """Raises OutputError PTM-O102 for a picture that is no PNG, PTM-O001 if it is there."""
    from ptmtools.errors import OutputError
    from ptmtools.files import refuse_existing

    if Path(view).suffix.lower() != ".png":
        raise OutputError("PTM-O102", "only PNG is drawn", file=view, remedy="name it .png")
    if not force:
        refuse_existing(view)


def _refuse_making(values: dict[str, Any]) -> None:
    """Raises UsageError for an option of what is made already."""
    context = click.get_current_context()
    of_picture = {each.name for each in fields(RenderOptions)}
    for name in values:
        given = context.get_parameter_source(name) == ParameterSource.COMMANDLINE
        if given and name not in of_picture:
            raise click.UsageError(
                f"--{name.replace('_', '-')} is for making an octree texture; this one is made"
            )


def _draw(folder: str, view: str, options: RenderOptions, force: bool) -> dict[str, Any]:
    import numpy as np

    from ptmtools.files import write_bytes
    from ptmtools.neighbours.apo.files import read_mesh, read_octree
    from ptmtools.neighbours.apo.picture import render
    from ptmtools.texture.images import png_bytes

    mesh, octree = read_mesh(folder), read_octree(folder)
    normals = mesh.normals.astype(np.float64)
    found = render(octree, mesh.points, mesh.triangles, options, normals)
    write_bytes(view, png_bytes(found.picture), force=force)
    levels = octree.levels if options.levels is None else min(options.levels, octree.levels)
    return {"file": view, "levels": levels, "renderer": found.renderer}
