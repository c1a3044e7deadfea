"""The pages that are held against each other, each as the files that a server has.

All rivals draw by three.js, joined and shortened with their page by esbuild, and sent compressed:

==============  =================================================================================
glb-png         one GLB of the whole model, the textures within as PNG
glb-webp        the same as lossless WebP; glb-webp-90 at quality 90, which is lossy
glb-etc1s       the same as KTX2 with ETC1S, which graphics cards hold in half a byte a texel
glb-uastc       the same as KTX2 with UASTC and Zstandard, a byte a texel
coarse-first    a GLB without images, then the textures with 256 texels a side, then the full ones
gltf-transform  glb-png after ``gltf-transform optimize`` (``optimized.OPTIMIZE``)
needle          ``@needle-tools/gltf-progressive`` with level files (``progressive.py``)
source          the model's own file, for scenes whose model is a GLB with Draco
==============  =================================================================================

A GLB is shown once it is there with all its images: GLTFLoader does not begin before. The walk page
enters as ``ptm``; ``ptm-never`` is its site without exact levels, ``ptm-no-preview`` that without
previews.

Every page is measured against the *full picture*: the same view with all texels of all textures,
exact. Each renderer draws its own, once and over a fast link: three.js from ``glb-png``, the walk
page from the site of a database with all exact levels. So a page is charged for texels and geometry
that differ, not for the filters, the order of blending or the edges in which two renderers differ;
a common renderer would charge all others for those. By how much the two full pictures differ is
printed with each table (0.017 in the museum), and ``--common`` measures all from the picture of
three.js.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from benchmarks.npm import ESBUILD, GLTF_TRANSFORM, KTX2, NEEDLE, THREE
from benchmarks.web_rivals.images import MEDIA, in_form
from benchmarks.web_rivals.models import whole_glb
from benchmarks.web_rivals.optimized import OPTIMIZE, gltf_transform
from benchmarks.web_rivals.progressive import progressive
from ptmtools.scene.model import Scene
from ptmtools.site.entry import SiteEntry

PAGES = Path(__file__).with_name("pages")
#: Files of more bytes are textures for the most part, which gzip does not make smaller.
_COMPRESSED = 16 << 20
_BASIS = "examples/jsm/libs/basis/basis_transcoder"
_DRACO = "examples/jsm/libs/draco/gltf"
WALK, SOURCE, LOSSLESS = "ptm", "source", "glb-png"
#: Sites of the walk page, by the options of `ptm publish`.
WALKS: dict[str, dict[str, Any]] = {
    WALK: {},
    "ptm-never": {"exact": "never"},
    "ptm-no-preview": {"preview": False},
}
RIVALS = (
    LOSSLESS,
    "glb-webp",
    "glb-webp-90",
    "glb-etc1s",
    "glb-uastc",
    "coarse-first",
    "gltf-transform",
    "needle",
    SOURCE,
)


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
    files: Mapping[str, SiteEntry]
    complete: str = "window.rival?.complete"
    steady: bool = True

    @cached_property
    def digest(self) -> str:
        """Of all that it sends."""
        total = hashlib.sha256(self.complete.encode())
        for name in sorted(self.files):
            entry = self.files[name]
            total.update(f"{name} {entry.media} {entry.compressed} ".encode())
            total.update(hashlib.sha256(entry.read()).digest())
        return total.hexdigest()


@dataclass(frozen=True)
class Subject:
    """What is shown: a scene, from one of the viewpoints of an index; ``source``: the model's own
    file if it is a GLB."""

    scene: Scene
    index: Mapping[str, Any]
    source: Path | None = None

    @property
    def viewpoint(self) -> Mapping[str, Any]:
        """The first."""
        view: Mapping[str, Any] = self.index["viewpoints"][0]
        return view


def require(names: Iterable[str]) -> None:
    """Raises SystemExit with the remedy for what is not installed, before anything is made."""
    forms = {name.removeprefix("glb-") for name in names if name not in WALKS}
    if forms:
        THREE.require()
        ESBUILD.require()
    if any(MEDIA.get(form) == "image/ktx2" for form in forms):
        KTX2.require()
    if forms & {"gltf-transform", "needle"}:
        GLTF_TRANSFORM.require()
    if "needle" in forms:
        NEEDLE.require()


def rival(name: str, subject: Subject) -> Entrant:
    """One of `RIVALS`, for a scene.

    Raises ValueError for ``source`` of a model that is no GLB in metres, Y up.
    """
    if name in _MADE:
        return _MADE[name](subject)
    scene = subject.scene
    form = name.removeprefix("glb-")
    media = MEDIA[form]
    files: dict[str, Any] = {"model": "model.glb"}
    entries, script = [_model(whole_glb(scene, in_form(scene.images, form), media))], "whole.js"
    if media == "image/ktx2":
        files["transcoder"], script = "basis/", "whole_ktx2.js"
        entries += [
            _entry("basis/basis_transcoder.js", _of_three(f"{_BASIS}.js"), "text/javascript", True),
            _entry(
                "basis/basis_transcoder.wasm", _of_three(f"{_BASIS}.wasm"), "application/wasm", True
            ),
        ]
    return _page(name, script, files, entries, subject)


def walk_page(database: Path, name: str = WALK) -> Entrant:
    """One of `WALKS` of a database. What it asks for depends on the link."""
    from ptmtools.site.content import SiteOptions, site_of

    files = site_of(database, SiteOptions(**WALKS[name])).entries
    return Entrant(name, files, "window.ptm?.state().complete", steady=False)


def _coarse_first(subject: Subject) -> Entrant:
    scene = subject.scene
    entries = [_entry("model.glb", whole_glb(scene), "model/gltf-binary", True)]
    files: dict[str, Any] = {"model": "model.glb"}
    for kind, form, suffix in (("small", "jpeg-256", "jpg"), ("full", "png", "png")):
        images = in_form(scene.images, form)
        files[kind] = [f"{kind}/{k:03d}.{suffix}" for k in range(len(images))]
        rows = zip(files[kind], images, strict=True)
        entries += [_entry(name, data, MEDIA[form]) for name, data in rows]
    return _page("coarse-first", "coarse_first.js", files, entries, subject)


def _optimized(subject: Subject) -> Entrant:
    scene = subject.scene
    whole = whole_glb(scene, in_form(scene.images, "png"), MEDIA["png"])
    entries = [_model(gltf_transform("optimize", whole, *OPTIMIZE))]
    return _page("gltf-transform", "whole_meshopt.js", {"model": "model.glb"}, entries, subject)


def _needle(subject: Subject) -> Entrant:
    model, levels = progressive(subject.scene)
    entries = [_model(model)]
    entries += [_entry(name, data, "model/gltf-binary") for name, data in levels.items()]
    return _page("needle", "progressive.js", {"model": "model.glb"}, entries, subject)


def _source(subject: Subject) -> Entrant:
    index = subject.index
    if subject.source is None or (index["up"], index["unit"]) != ("y", 1.0):
        raise ValueError("the model is no GLB in metres, Y up")
    entries = [_model(subject.source.read_bytes())]
    for name, media in (
        ("draco_wasm_wrapper.js", "text/javascript"),
        ("draco_decoder.wasm", "application/wasm"),
    ):
        entries.append(_entry(f"draco/{name}", _of_three(f"{_DRACO}/{name}"), media, True))
    files = {"model": "model.glb", "decoder": "draco/", "origin": index["origin"]}
    return _page(SOURCE, "whole_draco.js", files, entries, subject)


_MADE = {
    "coarse-first": _coarse_first,
    "gltf-transform": _optimized,
    "needle": _needle,
    SOURCE: _source,
}


def _page(
    name: str, script: str, files: Mapping[str, Any], entries: list[SiteEntry], subject: Subject
) -> Entrant:
    """The model is asked for at once, beside the script."""
    settings = json.dumps({"files": files, "view": subject.viewpoint}).replace("<", "\\u003c")
    page = (PAGES / "page.html").read_text()
    page = page.replace("{{model}}", files["model"]).replace("{{settings}}", settings)
    both = [
        _entry("index.html", page.encode(), "text/html; charset=utf-8", True),
        _entry("page.js", _joined(script), "text/javascript", True),
    ]
    return Entrant(name, {entry.name: entry for entry in both + entries})


def _model(data: bytes) -> SiteEntry:
    return _entry("model.glb", data, "model/gltf-binary", len(data) <= _COMPRESSED)


def _entry(name: str, data: bytes, media: str, compressed: bool = False) -> SiteEntry:
    return SiteEntry(name, data, media, forever=True, compressed=compressed)


def _of_three(name: str) -> bytes:
    return (THREE.folder / name).read_bytes()


@cache
def _joined(script: str) -> bytes:
    """A script of `PAGES` with what it imports, shortened."""
    with tempfile.TemporaryDirectory(prefix="joined-") as folder:
        out = Path(folder) / "page.js"
        options = ["--bundle", "--minify", "--format=esm", "--target=esnext", "--log-level=error"]
        modules = os.pathsep.join(str(package.modules) for package in (THREE, NEEDLE))
        subprocess.run(
            [ESBUILD.folder / "bin/esbuild", PAGES / script, *options, f"--outfile={out}"],
            env=os.environ | {"NODE_PATH": modules},
            check=True,
        )
        return out.read_bytes()
