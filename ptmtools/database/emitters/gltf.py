"""glTF 2.0: a GLB for every cell."""

from __future__ import annotations

from ptmtools.database.emitters.emitter import Emitter
from ptmtools.database.names import GLTF_FILES, GLTF_FOLDER
from ptmtools.lazy import Lazy

GLTF = Emitter(
    name="gltf",
    about="a GLB of each cell, in gltf/",
    owns=(f"{GLTF_FOLDER}/",),
    writer=Lazy("ptmtools.database.gltf.cell:gltf_files"),
    reader=Lazy("ptmtools.database.validation.gltf:read_file"),
    check=Lazy("ptmtools.database.validation.gltf:check_files"),
    cell_files=GLTF_FILES,
)
