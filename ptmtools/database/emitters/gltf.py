"""glTF 2.0: a GLB for every cell, and the hints with URLs of these."""

from __future__ import annotations

from ptmtools.database.emitters.emitter import Emitter
from ptmtools.database.names import GLTF_FOLDER, GLTF_HINTS
from ptmtools.lazy import Lazy

GLTF = Emitter(
    name="gltf",
    about="a GLB of each cell, and hints.json for them, in gltf/",
    owns=(f"{GLTF_FOLDER}/",),
    entry=GLTF_HINTS,
    writer=Lazy("ptmtools.database.gltf.cell:gltf_files"),
    reader=Lazy("ptmtools.database.validation.gltf:read_file"),
    check=Lazy("ptmtools.database.validation.gltf:check_files"),
    before="vrml,gltf",
)
