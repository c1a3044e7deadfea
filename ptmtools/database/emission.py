"""Artifacts → the files that are served (paper §6), by the emitters that are asked for."""

from __future__ import annotations

import os
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.database.content import Content
from ptmtools.database.emitters import chosen_emitters
from ptmtools.database.model import EmitOptions, EmitReport, OctreeRecord, TextureRecord
from ptmtools.database.names import BUNDLE
from ptmtools.database.served import write_files
from ptmtools.database.viewpoints.placement import place_viewpoints
from ptmtools.database.visit import visit_of
from ptmtools.errors import DatabaseError
from ptmtools.files import real_folder, refuse_existing
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

if TYPE_CHECKING:
    from ptmtools.coverage.need import Need


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
    need: Need | None = None,
    octrees: tuple[OctreeRecord, ...] = (),
    workers: int = 1,
) -> EmitReport:
    """Writes the files of every emitter that ``options.format`` names into the folder ``out``. The
    textures themselves are written by the stage before.

    Parameters
    ----------
    textures: one record for every image that a material in use names.
    force: overwrite files of these names, gzip copies included.
    need: how fine the textures are needed, if that is to be written.
    octrees: the octree textures of objects, which are there already.
    workers: threads that may be used.

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
    _check(scene, cells, pvs, ach, textures)
    emitters = chosen_emitters(options.format)
    owned = [name for emitter in emitters for name in emitter.owns]
    for name in owned:
        if not force:
            remedy = "name another folder, or give --force to overwrite it"
            refuse_existing(folder / name, remedy)
    viewpoints, notes = place_viewpoints(scene, cells, options, textures)
    content = Content(
        scene, cells, pvs, ach, textures, viewpoints, options, progress, need, octrees, workers
    )
    written = [emitter.files(content) for emitter in emitters]
    for name in owned:
        if name.endswith("/"):
            real_folder(folder, name[:-1])
    sizes: dict[str, int] = {}
    entries = {emitter.entry for emitter in emitters}
    for given in written:
        # What leads to others comes when those are there.
        for _, files in groupby(given, lambda file: file[0] in entries):
            for some in write_files(folder, files, force=force, gzip=options.gzip):
                sizes |= some
    return EmitReport(
        files=tuple(sizes),
        viewpoints=viewpoints,
        shapes=len(content.geometry.object),
        triangles=len(content.geometry.triangle),
        collapsed=content.geometry.collapsed,
        bytes=sum(sizes.values()),
        first_look=sum(size for name, size in sizes.items() if name.endswith(BUNDLE)),
        visit=visit_of(content, sizes),
        notes=notes,
    )


def _check(
    scene: Scene, cells: Cells, pvs: Pvs, ach: Ach, textures: Iterable[TextureRecord]
) -> None:
    if cells.cell_count == 0:
        raise DatabaseError(
            "PTM-D600", "there are no cells", remedy="subdivide a model that has rooms"
        )
    count, source = cells.cell_count, np.unique(cells.triangle_source)
    fault = ""
    if len(source) and source[-1] >= len(scene.triangles):
        fault = "the cells hold pieces of triangles that the scene lacks"
    elif not len(pvs.start) == len(ach.start) == count + 1:
        rows = f"{len(pvs.start) - 1} and {len(ach.start) - 1}"
        fault = f"pvs and ach have {rows} cells, not {count}"
    elif not np.array_equal(pvs.start, ach.start) or len(ach.value) != len(pvs.cell):
        fault = "pvs and ach have rows of different lengths"
    if fault:
        raise DatabaseError(
            "PTM-D604",
            f"the stages do not belong together: {fault}",
            remedy="run the stages again, from `cells` on",
        )
    used = {scene.materials[m].image for m in np.unique(scene.triangle_material[source]).tolist()}
    for image in sorted(used - {-1} - {texture.image for texture in textures}):
        raise DatabaseError(
            "PTM-D602",
            f"the texture {scene.images[image].name!r} was not encoded",
            remedy="run the stage `textures` again",
        )
