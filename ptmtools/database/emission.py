"""Artifacts → the files that are served (paper §6): a root, a file per cell, and the hints."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.database.gltf import GLTF_FOLDER, GLTF_HINTS, UP, glb_file
from ptmtools.database.hints import hints_text
from ptmtools.database.model import EmitOptions, EmitReport, TextureRecord
from ptmtools.database.names import CELL_FOLDER, HINTS, ROOT, cell_path
from ptmtools.database.served import ServedFiles
from ptmtools.database.viewpoints import place_viewpoints
from ptmtools.database.vrml import CellWriter, root_text
from ptmtools.errors import DatabaseError, OutputError
from ptmtools.files import real_folder
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs


def emit(
    scene: Scene,
    cells: Cells,
    pvs: Pvs,
    ach: Ach,
    textures: tuple[TextureRecord, ...],
    out: str | os.PathLike[str],
    options: EmitOptions = EmitOptions(),  # noqa: B008 - a frozen value
    progress: Progress = silent,
    *,
    force: bool = False,
) -> EmitReport:
    """Writes `cells/c0000.wrl` …, `hints.json` and, when all else is there, `root.wrl` into the
    folder ``out``; with ``options.format`` "gltf" the GLBs and `gltf/hints.json` before
    `hints.json`. The textures themselves are written by the stage before.

    Parameters
    ----------
    textures: one record for every image that a material in use names.
    force: overwrite files of these names, compressed twins included.

    Raises
    ------
    DatabaseError: PTM-D600 there are no cells; PTM-D601 a number is not finite in float32;
        PTM-D602 an image has no record; PTM-D603 a cell is flat in float32; PTM-D604 the
        artifacts do not belong together.
    InputError: PTM-I600 a given viewpoint lies in no cell.
    OutputError: PTM-O001 to PTM-O003, PTM-O005, see `ptmtools.files`.
    LimitError: PTM-L600 a cell is longer than a GLB can be.
    """
    folder = Path(out)
    _check(scene, cells, pvs, ach, {t.image: t for t in textures})
    gltf = options.format == "gltf"
    if not force:
        for name in (ROOT, HINTS, CELL_FOLDER, *([GLTF_FOLDER] if gltf else [])):
            if os.path.lexists(folder / name):
                raise OutputError(
                    "PTM-O001",
                    "exists already",
                    file=folder / name,
                    remedy="name another folder, or give --force to overwrite it",
                )
    viewpoints, notes = place_viewpoints(scene, cells, options)
    records = {t.image: t for t in textures}
    writer = CellWriter(scene, cells, pvs, ach.value, records, options.fallback)
    for inner in (CELL_FOLDER, *([GLTF_FOLDER] if gltf else [])):
        real_folder(folder, inner)

    count = cells.cell_count
    boxes, images = [], []
    shapes = triangles = 0
    with ServedFiles(folder, force=force, twins=options.gzip) as files:
        for c in range(count):
            progress(c, count, "cells")
            cell = writer.cell(c)
            files.put(cell_path(c), cell.text)
            boxes.append(cell.box)
            images.append(cell.images)
            shapes += cell.shapes
            triangles += cell.triangles
        progress(count, count, "cells")
        hints = partial(
            hints_text, scene.space, cells, pvs, ach, textures, images, viewpoints, options
        )
        if gltf:
            from ptmtools.database.gltf import gltf_files

            fallback = options.fallback
            for name, glb in gltf_files(
                scene, writer.geometry, count, textures, fallback, progress
            ):
                files.put(name, glb)
            files.put(GLTF_HINTS, hints(cell_url=glb_file, up=UP))
        files.put(HINTS, hints())
        root = root_text(viewpoints, boxes, options)
        files.settle()  # a root leads to files that are there
        files.put(ROOT, root)
    return EmitReport(
        files=tuple(files.names),
        viewpoints=viewpoints,
        shapes=shapes,
        triangles=triangles,
        collapsed=writer.geometry.collapsed,
        bytes=files.bytes,
        notes=notes,
    )


def _check(
    scene: Scene, cells: Cells, pvs: Pvs, ach: Ach, textures: Mapping[int, TextureRecord]
) -> None:
    if cells.cell_count == 0:
        raise DatabaseError(
            "PTM-D600", "there are no cells", remedy="subdivide a model that has rooms"
        )
    rows = {"pvs": pvs.start, "ach": ach.start}
    for stage, start in rows.items():
        if len(start) != cells.cell_count + 1:
            raise _strangers(f"{stage} has {len(start) - 1} cells, not {cells.cell_count}")
    if not np.array_equal(pvs.start, ach.start) or len(ach.value) != len(pvs.cell):
        raise _strangers("pvs and ach have rows of different lengths")
    source = np.unique(cells.triangle_source)
    if len(source) and source[-1] >= len(scene.triangles):
        raise _strangers("the cells hold pieces of triangles that the scene lacks")
    used = {scene.materials[m].image for m in np.unique(scene.triangle_material[source]).tolist()}
    for image in sorted(used - {-1} - set(textures)):
        raise DatabaseError(
            "PTM-D602",
            f"the texture {scene.images[image].name!r} was not encoded",
            remedy="run the stage `textures` again",
        )


def _strangers(what: str) -> DatabaseError:
    return DatabaseError(
        "PTM-D604",
        f"the stages do not belong together: {what}",
        remedy="run the stages again, from `cells` on",
    )
