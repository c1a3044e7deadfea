"""Reads USD (.usd, .usda, .usdc and .usdz) through usd-core, in a process of its own (`apart`).

The library composes the stage of layers (`layers`). What of it is drawn, and where, is found by
`drawn`, and made into triangles by `source`. As a program:
``python -P -m ptmtools.scene.usd.reader MEMORY SCRATCH MODEL MOST OUTSIDE``, where ``MOST`` is the
number of triangles that may be, and ``OUTSIDE`` empty if files outside of the model's folder may
not be read.
"""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ptmtools.errors import MissingComponentError
from ptmtools.scene.messages import pack_source, read_in_sandbox
from ptmtools.scene.notes import Findings
from ptmtools.scene.options import USD
from ptmtools.scene.sandbox import serve
from ptmtools.scene.source import MAX_VERTICES, Source

#: So many files of the model's folder are looked at for their size.
_MOST_FILES = 100_000


def read_usd(path: Path, findings: Findings, max_triangles: int = MAX_VERTICES) -> Source:
    """Read a USD model.

    Raises InputError where it is damaged (PTM-I245, PTM-I254), has no mesh (PTM-I247), or
    is composed of files outside its folder (PTM-I205); LimitError PTM-L203 for more than
    ``max_triangles``, as often as they are shown, before anything is made of them; and
    MissingComponentError PTM-M100.
    """
    if find_spec("pxr") is None:
        raise MissingComponentError(
            "PTM-M100",
            "usd-core is needed for this format, and is not installed",
            remedy="pip install 'ptmtools[usd]'",
        )
    outside = "outside" if findings.folder.allow_outside else ""
    with tempfile.TemporaryDirectory() as scratch:
        return read_in_sandbox(
            __name__,
            "usd-core",
            path,
            findings,
            scratch,
            str(max_triangles),
            outside,
            other_bytes=_bytes_of_layers(findings.folder.root),
        )


def _bytes_of_layers(folder: Path) -> int:
    """How large all layers in a folder are: a model is often a small one that refers to others."""
    total, left = 0, _MOST_FILES
    for parent, _, names in os.walk(folder):
        for name in names:
            if name.lower().endswith(USD):
                with suppress(OSError):
                    total += os.stat(os.path.join(parent, name)).st_size
        left -= len(names) + 1
        if left < 0:
            break
    return total


def _read_in_child(scratch: str, model: str, most: str, outside: str) -> dict[str, Any]:
    # Each thread takes memory that none of them needs: most of the work is ours.
    os.environ["PXR_WORK_THREAD_LIMIT"] = "1"
    from ptmtools.scene.usd.source import make_source

    findings = Findings(Path(model), bool(outside))
    source, images, files = make_source(Path(model), findings, int(most))
    return pack_source(source, images, findings, scratch, files)


if __name__ == "__main__":
    serve(_read_in_child)
