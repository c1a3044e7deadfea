"""Other representations of a model: `ptm apo` and `ptm campus`."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.batch import no_name
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    file_option,
    force_option,
    given_options,
    jobs_option,
    json_option,
    option,
    options_of,
    output_option,
    take,
    with_console,
)
from ptmtools.cli.render import check_picture, write_picture
from ptmtools.quantities import count, size
from ptmtools.scene.options import IngestOptions
from ptmtools_systems.apo.model import ApoOptions
from ptmtools_systems.apo.picture import RenderOptions, draw_folder
from ptmtools_systems.campus.options import CampusOptions
from ptmtools_systems.campus.reading import record, summary

#: Fields of `IngestOptions` that these commands do not have: they draw no normal maps.
NOT_READ = ("normal_maps",)


@click.command("apo", cls=Command)
@click.argument("mesh", metavar="MESH", type=click.Path())
@output_option(
    "Folder to write. Default: beside the mesh, such as bust.apo for bust.ply.",
    "folder",
    metavar="DIR",
)
@options_of(ApoOptions, IngestOptions, without=NOT_READ)
@option("--render", "view", type=click.Path(), hidden=True, help="Now `ptm render`.")
@options_of(RenderOptions, hidden=True)
@force_option("Replace a folder that ptm apo wrote.")
@jobs_option
@json_option
@with_console
def apo(
    console: Console,
    mesh: str,
    folder: str | None,
    view: str | None,
    force: bool,
    workers: int,
    **values: Any,
) -> None:
    """Convert a mesh with many triangles to a simplified mesh and an octree texture of its normals.

    The octree streams level by level (docs/formats/apo.md). `ptm render DIR -o view.png` draws it.
    """
    from ptmtools.scene.ingestion import check_file
    from ptmtools_systems.apo.files import INDEX, read_index

    if not mesh or "" in (folder, view):
        raise no_name()
    exists = folder is None and view is not None and (Path(mesh) / INDEX).is_file()
    if view is not None:
        console.warn("note: --render of `ptm apo` is now `ptm render DIR -o VIEW.png`")
        check_picture(view, force=force)
    if exists:
        for wrong in sorted(given_options(ApoOptions, IngestOptions)):
            raise click.UsageError(f"--{wrong} is for the conversion of a mesh, not for a folder")
    else:
        check_file(Path(mesh))
    options = take(RenderOptions, values)
    target = mesh if exists else folder or os.fspath(Path(mesh).with_suffix(".apo"))
    if not exists:
        _convert(console, mesh, target, values, workers, force)
    index = read_index(target)
    document, lines = dict(index.document), list[str]()
    if view is not None:
        drawn = draw_folder(Path(target), options)
        write_picture(view, drawn.texels, force=force)
        document["picture"] = {"file": view, **drawn.document}
        lines.append(f"{view}: {target}, {drawn.text}")
    if not exists:
        source, mesh_file = index.document["source"], index.mesh
        whole = sum(stream["ends"][-1] for stream in (index.normals, index.colors) if stream)
        lines.append(
            f"{target}: {source['triangles']:,} triangles → {mesh_file['faces']:,} faces, "
            f"{size(mesh_file['bytes'])}; octree of {count(index.levels, 'level')}, "
            f"{int(index.start[-1]):,} texels, {size(whole)}"
        )
    console.result(document, lines)


def _convert(
    console: Console, model: str, folder: str, values: dict[str, Any], workers: int, force: bool
) -> None:
    """Writes the folder of a mesh."""
    from ptmtools.parallel import open_executor, processors
    from ptmtools.scene import ingest
    from ptmtools.scene.notes import exterior_notes, warnings
    from ptmtools_systems.apo.files import FORM, files_of
    from ptmtools_systems.apo.making import make_apo

    options, read = take(ApoOptions, values), _reading(values)
    FORM.check(folder, force=force)
    with console.progress() as progress, open_executor(workers) as executor:
        scene = ingest(model, read, progress, workers=workers or processors(), ask=False)
        if scene.space.up_guessed or scene.space.unit_guessed:
            # The estimate assumes a building; a statue stays unchanged.
            read = replace(read, up=read.up or "y", unit=read.unit or "m")
            scene = ingest(model, read, progress, workers=workers or processors(), ask=False)
        octree = make_apo(scene, options, executor, progress)
    FORM.write(folder, files_of(octree), force=force)
    for warning in [*warnings(exterior_notes(scene.notes)), *octree.notes]:
        console.warn(warning)


def _reading(values: dict[str, Any]) -> IngestOptions:
    """How the model is read: without normal maps."""
    return replace(take(IngestOptions, values), normal_maps="none")


@click.command("campus", cls=Command)
@click.argument("model", type=click.Path())
@output_option("Folder of the campus to write.", "folder", required=True)
@file_option(
    "records",
    "Folder with an HTML file for each object that a visitor can read about, named after the "
    "object: Library.html; places.json in it has icons and ranks of the menu.",
    CampusOptions.heading,
    metavar="DIR",
)
@options_of(CampusOptions, IngestOptions, without=NOT_READ)
@force_option("Replace a folder that ptm campus wrote.")
@jobs_option
@json_option
@with_console
def campus(
    console: Console,
    model: str,
    folder: str,
    records_file: str | None,
    force: bool,
    workers: int,
    **values: Any,
) -> None:
    """Convert MODEL to a campus: objects in several levels of detail, a lightmap for each object,
    one texture file for each size and channel, and a file list for each quality preset.

    A client loads the coarsest meshes first, and refines the nearest objects.
    """
    if not model or not folder or records_file == "":
        raise click.UsageError("a name is empty")
    options, reading = take(CampusOptions, values), _reading(values)
    from ptmtools.parallel import open_executor
    from ptmtools.scene.notes import exterior_notes, line, warnings
    from ptmtools_systems.campus.building import make_campus

    with console.progress() as progress, open_executor(workers) as executor:
        result = make_campus(
            model,
            folder,
            options,
            reading,
            executor,
            force=force,
            progress=progress,
            records=records_file,
        )
    scene_notes = exterior_notes(result.scene.notes)
    if not console.as_json:
        shown = [*warnings(scene_notes), *(f"note: {note}" for note in result.notes)]
        for text in shown + [f"note: {line(note)}" for note in scene_notes if console.verbose]:
            console.warn(text)
    document = {
        **record(result.campus),
        "seconds": {name: round(value, 3) for name, value in result.seconds.items()},
        "notes": [*map(line, scene_notes), *result.notes],
    }
    head = f"{folder}: {count(len(result.campus.files()) + 1, 'file')}"
    console.result(document, [head, *summary(result.campus)])
