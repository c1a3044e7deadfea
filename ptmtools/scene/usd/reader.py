"""Reads USD (.usd, .usda, .usdc and .usdz) through usd-core in a child process (`sandbox`).

``python -P -m ptmtools.scene.usd.reader MEMORY SCRATCH MODEL TRIANGLES OUTSIDE`` reads the model,
with at most TRIANGLES triangles, and replies with the message of `messages.pack_source`. OUTSIDE is
empty unless files outside the model's folder are allowed.
"""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path, PurePath
from typing import Any

from ptmtools.progress import Progress, silent
from ptmtools.scene.messages import pack_source, read_in_sandbox
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.sandbox import serve
from ptmtools.scene.source import ModelSource

#: Largest number of files in the model's folder whose size is read.
_MOST_FILES = 100_000


def read_usd(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads a USD model.

    Raises InputError if it is damaged (PTM-I245, PTM-I254), has no mesh (PTM-I247), or
    refers to layers outside its folder (PTM-I205); LimitError PTM-L203, before arrays are
    allocated, for more triangles than ``options`` allow, instances included.
    """
    outside = "outside" if notes.folder.allow_outside else ""
    with tempfile.TemporaryDirectory() as scratch:
        return read_in_sandbox(
            __name__,
            "usd-core",
            path,
            notes,
            scratch,
            str(options.max_triangles),
            outside,
            other_bytes=_bytes_of_layers(notes.folder.root),
        )


def _bytes_of_layers(folder: Path) -> int:
    """The total size of the layers in a folder: a model often is a small layer that refers to
    others."""
    size, count = 0, 0
    for parent, _, names in os.walk(folder):
        for name in names:
            if PurePath(name.lower()).suffix.startswith(".usd"):
                with suppress(OSError):
                    size += os.stat(os.path.join(parent, name)).st_size
        count += len(names) + 1
        if count > _MOST_FILES:
            break
    return size


def _read_in_child(scratch: str, model: str, triangles: str, outside: str) -> dict[str, Any]:
    # Each thread allocates memory, and the library does little of the work.
    os.environ["PXR_WORK_THREAD_LIMIT"] = "1"
    from ptmtools.scene.usd.source import make_source

    notes = IngestNotes(Path(model), bool(outside))
    source, images, files = make_source(Path(model), notes, int(triangles))
    return pack_source(source, images, notes, scratch, files)


if __name__ == "__main__":
    serve(_read_in_child)
