"""`ptm sample`: a model to try ptmtools on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    force_option,
    given_options,
    json_option,
    options_of,
    output_option,
    take,
    with_console,
)
from ptmtools.quantities import count, size
from ptmtools_samples.options import MuseumOptions


@click.command("sample", cls=Command)
@click.argument("model", type=click.Choice(["museum", "two-rooms"]))
@output_option("Folder to write. Default: museum or two_rooms.", "folder", metavar="DIR")
@options_of(MuseumOptions)
@force_option("Write into a folder that contains other files; these are not changed.")
@json_option
@with_console
def sample(console: Console, model: str, folder: str | None, force: bool, **values: Any) -> None:
    """Write a model to try ptmtools on: OBJ, MTL and PNG files.

    museum is a building with pictures, statues and stairs; two-rooms is small enough to check by
    hand. The same options give the same bytes.
    """
    if folder == "":
        raise click.UsageError("a name is empty")
    if model == "two-rooms" and (wrong := sorted(given_options(MuseumOptions))):
        raise click.UsageError(f"--{wrong[0]} is for the museum")
    options = take(MuseumOptions, values)
    from ptmtools_samples.files import constant, write
    from ptmtools_samples.museum import make_museum
    from ptmtools_samples.two_rooms import two_rooms

    if model == "museum":
        files = list(make_museum(options, lambda text: console.warn(f"note: {text}")))
    else:
        files = [(name, constant(data)) for name, data in two_rooms().items()]
    target = Path(folder or model.replace("-", "_"))
    with console.progress() as progress:
        write(target, files, force=force, progress=progress)
    total = sum((target / name).stat().st_size for name, _ in files)
    obj = target / files[-1][0]
    console.result(
        {"model": str(obj), "files": len(files), "bytes": total},
        [f"{obj}: {count(len(files), 'file')}, {size(total)}"],
    )
