"""`ptm render`: a view of a database, or of an octree texture."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ptmtools.cli.batch import check_writable, no_name
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    force_option,
    json_option,
    option,
    options_of,
    take,
    with_console,
)
from ptmtools.errors import OutputError
from ptmtools.neighbours.apo.picture import RenderOptions
from ptmtools.quantities import count
from ptmtools.rendering.drawing import ViewOptions, draw_view


@click.command("render", cls=Command)
@click.argument("target", metavar="DB|DIR", type=click.Path())
@option(
    "-o",
    "--output",
    type=click.Path(),
    metavar="FILE",
    required=True,
    help="PNG to write.",
)
@options_of(ViewOptions, RenderOptions)
@force_option("Replace an existing picture.")
@json_option
@with_console
def render(
    console: Console, target: str, output: str, force: bool, as_json: bool, **values: Any
) -> None:
    """Draw a view of DB from its finest textures, or of DIR, a folder that `ptm apo` wrote.

    DB is a database or the folder that it serves. The view is that of a viewpoint, or --eye.
    """
    from ptmtools.neighbours.apo.files import INDEX

    if not target or not output:
        raise no_name()
    check_picture(output, force=force)
    of_octree = (Path(target) / INDEX).is_file()
    _refuse_others(target, of_octree)
    if of_octree:
        record = draw_octree(target, output, octree_options(values), force=force)
        line = octree_line(target, record)
    else:
        view = take(ViewOptions, values)
        with console.progress() as progress:
            from ptmtools.output.served import read_served

            served = read_served(target)
            picture = draw_view(served, view, progress)
        _write(output, picture, force=force)
        record = {"file": output, "width": view.width, "height": view.height}
        line = f"{output}: {target}, {view.width} x {view.height}"
    if as_json:
        console.json(record)
    else:
        console.print(line)


def octree_options(values: dict[str, Any]) -> RenderOptions:
    """The options of the picture of an octree texture; its own default for the field of view."""
    return take(RenderOptions, {name: v for name, v in values.items() if v is not None})


def draw_octree(folder: str, output: str, options: RenderOptions, *, force: bool) -> dict[str, Any]:
    """Writes a picture of an octree texture; returns its record as JSON.

    Raises what reading the folder and `ptmtools.apo.picture.render` raise.
    """
    import numpy as np

    from ptmtools.neighbours.apo.files import read_mesh, read_octree
    from ptmtools.neighbours.apo.picture import render as draw

    mesh, octree = read_mesh(folder), read_octree(folder)
    normals = mesh.normals.astype(np.float64)
    rendering = draw(octree, mesh.points, mesh.triangles, options, normals)
    _write(output, rendering.picture, force=force)
    levels = octree.levels if options.levels is None else min(options.levels, octree.levels)
    return {
        "file": output,
        "levels": levels,
        "octree_levels": octree.levels,
        "renderer": rendering.renderer,
    }


def octree_line(folder: str, record: dict[str, Any]) -> str:
    """The line that a command prints about a picture of an octree texture."""
    levels = f"{record['levels']} of {count(record['octree_levels'], 'level')}"
    return f"{record['file']}: {folder}, {levels}, {record['renderer']}"


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
    context = click.get_current_context()
    names = [{each.name for each in fields(cls)} for cls in (ViewOptions, RenderOptions)]
    wrong = names[0] - names[1] if of_octree else names[1] - names[0]
    for name in sorted(wrong):
        if context.get_parameter_source(name) == ParameterSource.COMMANDLINE:
            kinds = ("an octree texture", "a database")
            has, needs = kinds if of_octree else kinds[::-1]
            raise click.UsageError(f"--{name.replace('_', '-')} is for {needs}; {target} is {has}")
