"""`ptm sample`: a model to try ptmtools on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    force_option,
    json_option,
    options_of,
    output_option,
    take,
    with_console,
)
from ptmtools.quantities import count, size
from ptmtools_samples.samples import SAMPLES, Sample


@click.group("sample")
def sample() -> None:
    """Write a model to try ptmtools on. The same options give the same bytes."""


def sample_command(name: str, entry: Sample) -> click.Command:
    """The command that writes one sample."""
    folder_name = name.replace("-", "_")

    @output_option(f"Folder to write. Default: {folder_name}.", "folder", metavar="DIR")
    @options_of(entry.options)
    @force_option("Write into a folder that contains other files; these are not changed.")
    @json_option
    @with_console
    def write_sample(console: Console, folder: str | None, force: bool, **values: Any) -> None:
        if folder == "":
            raise click.UsageError("a name is empty")
        from ptmtools_samples.files import write

        options: Any = take(entry.options, values)
        make = entry.make.load()
        files = list(make(options, lambda text: console.warn(f"note: {text}")))
        target = Path(folder or folder_name)
        with console.progress() as progress:
            write(target, files, force=force, progress=progress)
        total = sum((target / name).stat().st_size for name, _ in files)
        model = str(target / files[-1][0])
        console.result(
            {"model": model, "files": len(files), "bytes": total},
            [f"{model}: {count(len(files), 'file')}, {size(total)}"],
        )

    about = f"{entry.about}\n\n{entry.details}"
    return click.command(name, cls=Command, help=about, short_help=entry.about)(write_sample)


for _name, _entry in SAMPLES.items():
    sample.add_command(sample_command(_name, _entry))
