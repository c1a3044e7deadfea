"""`ptm render`: a view of a database, or of an octree texture."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.batch import check_writable, no_name
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    force_option,
    given_options,
    json_option,
    local_copy,
    options_of,
    output_option,
    take,
    with_console,
)
from ptmtools.errors import OutputError
from ptmtools.options import option_name
from ptmtools.quantities import count
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools_systems.apo.picture import RenderOptions


@click.command("render", cls=Command)
@click.argument("target", metavar="DB|DIR", type=click.Path(), callback=local_copy)
@output_option("PNG to write.", metavar="FILE", required=True)
@options_of(ViewOptions, RenderOptions)
@force_option("Replace an existing picture.")
@json_option
@with_console
def render(console: Console, target: str, output: str, force: bool, **values: Any) -> None:
    """Draw a view of DB with its finest textures, or of DIR, a folder that `ptm apo` wrote.

    DB is a database or its folder `www`. The view is taken from a viewpoint of the database, or
    from --eye.
    """
    from ptmtools_systems.apo.files import INDEX

    if not target or not output:
        raise no_name()
    check_picture(output, force=force)
    of_octree = (Path(target) / INDEX).is_file()
    _refuse_others(target, of_octree)
    if of_octree:
        # Without a value each kind of picture has its own default for the field of view.
        given = {name: value for name, value in values.items() if value is not None}
        record, line = draw_octree(target, output, take(RenderOptions, given), force=force)
    else:
        from ptmtools.output.served import read_served

        view = take(ViewOptions, values)
        with console.progress() as progress:
            picture = draw_view(read_served(target), view, progress)
        _write(output, picture, force=force)
        record = {"file": output, "width": view.width, "height": view.height}
        line = f"{output}: {target}, {view.width} x {view.height}"
    console.result(record, [line])


def draw_octree(
    folder: str, output: str, options: RenderOptions, *, force: bool
) -> tuple[dict[str, Any], str]:
    """Writes a picture of an octree texture; returns its JSON document and its line of text.

    Raises what reading the folder and `ptmtools.apo.picture.render` raise.
    """
    import numpy as np

    from ptmtools_systems.apo.files import read_mesh, read_octree
    from ptmtools_systems.apo.picture import render as draw

    mesh, octree = read_mesh(folder), read_octree(folder)
    normals = mesh.normals.astype(np.float64)
    rendering = draw(octree, mesh.points, mesh.triangles, options, normals)
    _write(output, rendering.picture, force=force)
    levels = octree.levels if options.levels is None else min(options.levels, octree.levels)
    document = {
        "file": output,
        "levels": levels,
        "octree_levels": octree.levels,
        "renderer": rendering.renderer,
    }
    shown = f"{levels} of {count(octree.levels, 'level')}"
    return document, f"{output}: {folder}, {shown}, {rendering.renderer}"


def check_picture(output: str, *, force: bool) -> None:
    """Raises OutputError: PTM-O101 it is not a PNG; PTM-O001, O002 it cannot be written."""
    if Path(output).suffix.lower() != ".png":
        raise OutputError("PTM-O101", "is not a PNG", file=output, remedy="name it .png")
    check_writable(output, force=force)


def _write(output: str, picture: Any, *, force: bool) -> None:
    from ptmtools.files import write_bytes
    from ptmtools.texture.images import png_bytes

    write_bytes(output, png_bytes(picture), force=force)


def _refuse_others(target: str, of_octree: bool) -> None:
    """Raises UsageError for options that do not apply to the target."""
    kinds = ("a database", ViewOptions), ("an octree texture", RenderOptions)
    (has, own), (needs, other) = kinds[::-1] if of_octree else kinds
    for wrong in sorted(given_options(other) - {option_name(field) for field in fields(own)}):
        raise click.UsageError(f"--{wrong} is for {needs}; {target} is {has}")
