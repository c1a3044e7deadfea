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
from ptmtools.folder_kinds import FolderKind, folder_kind, folder_kinds
from ptmtools.options import option_name
from ptmtools.rendering.drawing import ViewOptions, draw_view

#: The kinds of folders that are drawn, and the options of each.
_DRAWN = {kind: kind.drawing.options for kind in folder_kinds().values() if kind.drawing}


@click.command("render", cls=Command)
@click.argument("target", metavar="DB|DIR", type=click.Path(), callback=local_copy)
@output_option("PNG to write.", metavar="FILE", required=True)
@options_of(ViewOptions, *(options.load() for options in _DRAWN.values()))
@force_option("Replace an existing picture.")
@json_option
@with_console
def render(console: Console, target: str, output: str, force: bool, **values: Any) -> None:
    """Draw a view of DB with its finest textures, or of DIR, a folder that `ptm apo` wrote.

    DB is a database or its folder `www`. The view is taken from a viewpoint of the database, or
    from --eye.
    """
    if not target or not output:
        raise no_name()
    check_picture(output, force=force)
    kind = folder_kind(Path(target))
    drawing = kind.drawing if kind else None
    _refuse_others(target, kind)
    if drawing:
        # Without a value each kind of picture has its own default for the field of view.
        given = {name: value for name, value in values.items() if value is not None}
        drawn = drawing.draw.load()(Path(target), take(drawing.options.load(), given))
        write_picture(output, drawn.texels, force=force)
        record = {"file": output, **drawn.document}
        line = f"{output}: {target}, {drawn.text}"
    else:
        from ptmtools.output.served import read_served

        view = take(ViewOptions, values)
        with console.progress() as progress:
            picture = draw_view(read_served(target), view, progress)
        write_picture(output, picture, force=force)
        record = {"file": output, "width": view.width, "height": view.height}
        line = f"{output}: {target}, {view.width} x {view.height}"
    console.result(record, [line])


def check_picture(output: str, *, force: bool) -> None:
    """Raises OutputError: PTM-O101 it is not a PNG; PTM-O001, O002 it cannot be written."""
    if Path(output).suffix.lower() != ".png":
        raise OutputError("PTM-O101", "is not a PNG", file=output, remedy="name it .png")
    check_writable(output, force=force)


def write_picture(output: str, picture: Any, *, force: bool) -> None:
    from ptmtools.files import write_bytes
    from ptmtools.texture.images import png_bytes

    write_bytes(output, png_bytes(picture), force=force)


def _refuse_others(target: str, kind: FolderKind | None) -> None:
    """Raises UsageError for options that do not apply to the target."""
    classes = {"a database": ViewOptions} | {k.noun: d.load() for k, d in _DRAWN.items()}
    noun = kind.noun if kind and kind.drawing else "a database"
    names = {option_name(field) for field in fields(classes[noun])}
    for drawn, options in classes.items():
        for wrong in sorted(given_options(options) - names):
            raise click.UsageError(f"--{wrong} is for {drawn}; {target} is {noun}")
