"""The pages that are held against each other, each as the files that a server has.

All rivals draw by three.js, joined and shortened with their page by esbuild, and sent compressed:

==============  =================================================================================
glb-png         one GLB of the whole model, the textures within as PNG
glb-webp        the same as lossless WebP; glb-webp-90 at quality 90, which is lossy
glb-etc1s       the same as KTX2 with ETC1S, which graphics cards hold in half a byte a texel
glb-uastc       the same as KTX2 with UASTC and Zstandard, a byte a texel
coarse-first    a GLB without images, then the textures with 256 texels a side, then the full ones
==============  =================================================================================

A GLB is shown once it is there with all its images: GLTFLoader does not begin before. The walk page
enters as ``ptm``.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.web_rivals.images import MEDIA, in_form
from benchmarks.web_rivals.models import whole_glb
from benchmarks.web_rivals.packages import ESBUILD, KTX2, THREE
from ptmtools.scene.model import Scene
from ptmtools.site.content import Entry

PAGES = Path(__file__).with_name("pages")
#: Files of more bytes are textures for the most part, which gzip does not make smaller.
_COMPRESSED = 16 << 20
_BASIS = "examples/jsm/libs/basis/basis_transcoder"
WALK = "ptm"
RIVALS = ("glb-png", "glb-webp", "glb-webp-90", "glb-etc1s", "glb-uastc", "coarse-first")


@dataclass(frozen=True)
class Entrant:
    """A page and what it downloads.

    Attributes
    ----------
    name: of it. files: by name.
    complete: JavaScript that is true once nothing more will come.
    steady: whether what it asks for, and in what order, does not depend on the link.
    """

    name: str
    files: Mapping[str, Entry]
    complete: str = "window.rival?.complete"
    steady: bool = True


def require(names: Iterable[str]) -> None:
    """Raises SystemExit with the remedy for what is not installed, before anything is made."""
    forms = {name.removeprefix("glb-") for name in names if name != WALK}
    if forms:
        THREE.require()
        ESBUILD.require()
    if any(MEDIA.get(form) == "image/ktx2" for form in forms):
        KTX2.require()


def rival(name: str, scene: Scene, viewpoint: Mapping[str, Any]) -> Entrant:
    """One of `RIVALS`, for a scene that is looked at from one of the viewpoints of its index."""
    if name == "coarse-first":
        return _coarse_first(scene, viewpoint)
    form = name.removeprefix("glb-")
    media = MEDIA[form]
    model = whole_glb(scene, in_form(scene.images, form), media)
    entries = [_entry("model.glb", model, "model/gltf-binary", len(model) <= _COMPRESSED)]
    files, script = {"model": "model.glb"}, "whole.js"
    if media == "image/ktx2":
        files["transcoder"], script = "basis/", "whole_ktx2.js"
        entries += [
            _entry("basis/basis_transcoder.js", _of_three("js"), "text/javascript", True),
            _entry("basis/basis_transcoder.wasm", _of_three("wasm"), "application/wasm", True),
        ]
    return _page(name, script, files, entries, viewpoint)


def walk_page(database: Path) -> Entrant:
    """The page that `ptm publish` makes of a database. What it asks for depends on the link."""
    from ptmtools.site.content import site_of

    return Entrant(WALK, site_of(database).entries, "window.ptm?.state().complete", steady=False)


def _coarse_first(scene: Scene, viewpoint: Mapping[str, Any]) -> Entrant:
    entries = [_entry("model.glb", whole_glb(scene), "model/gltf-binary", True)]
    files: dict[str, Any] = {"model": "model.glb"}
    for kind, form, suffix in (("small", "jpeg-256", "jpg"), ("full", "png", "png")):
        images = in_form(scene.images, form)
        files[kind] = [f"{kind}/{k:03d}.{suffix}" for k in range(len(images))]
        rows = zip(files[kind], images, strict=True)
        entries += [_entry(name, data, MEDIA[form]) for name, data in rows]
    return _page("coarse-first", "coarse_first.js", files, entries, viewpoint)


def _page(
    name: str,
    script: str,
    files: Mapping[str, Any],
    entries: list[Entry],
    viewpoint: Mapping[str, Any],
) -> Entrant:
    """The model is asked for at once, beside the script."""
    settings = json.dumps({"files": files, "view": viewpoint}).replace("<", "\\u003c")
    page = (PAGES / "page.html").read_text()
    page = page.replace("{{model}}", files["model"]).replace("{{settings}}", settings)
    both = [
        _entry("index.html", page.encode(), "text/html; charset=utf-8", True),
        _entry("page.js", _joined(script), "text/javascript", True),
    ]
    return Entrant(name, {entry.name: entry for entry in both + entries})


def _entry(name: str, data: bytes, media: str, compressed: bool = False) -> Entry:
    return Entry(name, data, media, forever=True, compressed=compressed)


def _of_three(suffix: str) -> bytes:
    return (THREE.folder / f"{_BASIS}.{suffix}").read_bytes()


@cache
def _joined(script: str) -> bytes:
    """A script of `PAGES` with what it imports, shortened."""
    with tempfile.TemporaryDirectory(prefix="joined-") as folder:
        out = Path(folder) / "page.js"
        options = ["--bundle", "--minify", "--format=esm", "--target=esnext", "--log-level=error"]
        subprocess.run(
            [ESBUILD.folder / "bin/esbuild", PAGES / script, *options, f"--outfile={out}"],
            env=os.environ | {"NODE_PATH": str(THREE.folder.parent)},
            check=True,
        )
        return out.read_bytes()
