"""Bytes of the page and of what its features add.

    python benchmarks/page_weight.py

Bytes are those of ``gzip -9``, as servers send them, of the files of the package; ``index.html`` of
a site also has its settings. Each script is loaded only for its feature. With zlib: a Python with
zlib-ng prints other sizes.
"""

from __future__ import annotations

import gzip
from collections.abc import Iterator
from pathlib import Path

from ptmtools.site.program import PAGE
from ptmtools_systems import PAGE as SYSTEMS_PAGE

#: The first load, and all other files: feature → files. A file that is missing here is an error.
FIRST = ("index.html", "viewer.js", "worker.js", "decoder.wasm")
FEATURES = {
    "panels, policies besides `best`": ("later.js",),
    "comparison (`?compare`)": ("compare.js",),
    "a language besides English": ("words-de.js",),
    "tour": ("tour.js",),
    "light": ("light.js",),
    "statues as octrees": ("statues.js",),
    "statues as normal maps, normal maps of materials": ("reliefs.js",),
    "interlaced images (`?form=gpuii`)": ("sets.js",),
    "without buttons, kiosk, devices (`?ui=…`)": ("embedded.js",),
    "gamepad": ("gamepad.js",),
    "headset": ("xr.js",),
    "walk without a network (`--offline`)": ("register.js", "offline.js"),
    "`<ptm-walk>`, in the page of others": ("ptm-walk.js",),
    "editor (`ptm serve --edit`), never published": ("editor.js",),
    "page of an octree texture": ("form.html", "apo.js"),
    "page of an interlaced image": ("form.html", "interlace.js"),
    "page of a campus": ("form.html", "campus.js"),
}


def main() -> None:
    """Prints the table."""
    print("\n".join(rows()))


def rows() -> Iterator[str]:
    """Its lines. Raises ValueError: a file of the page belongs to no feature."""
    named = {*FIRST, *(name for names in FEATURES.values() for name in names)}
    files = {file.name: file for page in (PAGE, SYSTEMS_PAGE) for file in page.iterdir()}
    others = files.keys() - named
    if strange := sorted(name for name in others if not name.startswith("words-")):
        raise ValueError(f"no feature has {', '.join(strange)}")
    yield "| feature | files | bytes |"
    yield "|---|---|--:|"
    for feature, names in {"every walk": FIRST, **FEATURES}.items():
        total = sum(sent(files[name]) for name in names)
        yield f"| {feature} | {', '.join(f'`{name}`' for name in names)} | {total:,} |"


def sent(file: Path) -> int:
    """Bytes of a file as a server sends it."""
    return len(gzip.compress(file.read_bytes(), 9, mtime=0))


if __name__ == "__main__":
    main()
