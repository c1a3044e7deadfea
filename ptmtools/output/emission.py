"""Artifacts → the served files (paper §6), by the emitters of `--format`, and the cost of a visit.

`write_files` writes several files at a time: each is on the disk before it has its name
(`ptmtools.files`), and most of the time goes into waiting for that. A server sends a gzip copy in
place of its file (nginx: `gzip_static on`), and VRML browsers open it by themselves. It holds no
name and no time, so its bytes depend only on the file and the version of zlib.

`visit_of` measures a visit in bytes of files, with whole lossless textures unless stated otherwise.
A *VRML browser* opens the root and loads all cells and the fallback image of every texture. A
client of the *hints* fetches the index, the record of its cell, and the geometry and the textures
of the cells visible from it; the geometry in a form without an entry file, if one was written. Its
**first room is complete** with the index, the record of the first viewpoint's cell, the geometry of
all cells visible from it, the cell's own textures and the coarsest level of the others: nothing is
missing, and the room has the model's resolution. Before, it is drawn with the simplified meshes of
objects that have levels of detail. The **resident** set in a cell is everything that
the client holds once all visible cells are loaded. Means are over places: a cell counts by its
volume.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby
from pathlib import Path

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.errors import DatabaseError
from ptmtools.files import real_folder, refuse_existing, write_bytes, writing
from ptmtools.output.content import Content, EmitExtras
from ptmtools.output.emitter import GZIP, Emitter, File
from ptmtools.output.emitters import chosen_emitters
from ptmtools.output.model import EmitReport, TextureRecord, VisitCost
from ptmtools.output.names import HINTS, RECORD_FILES, mesh_path, path_of
from ptmtools.output.options import EmitOptions
from ptmtools.output.viewpoints import place_viewpoints
from ptmtools.parallel import map_in_order
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs, over_places

#: Files written at a time.
_WRITER_THREADS = 8
#: Deflate, no name, no time, best compression, no system (RFC 1952).
_GZIP = bytes([0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 2, 255])
#: Suffixes of the files that get a gzip copy.
_TEXT = (".wrl", ".json")


def compress(data: bytes) -> bytes:
    """A gzip file of these bytes."""
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    body = deflate.compress(data) + deflate.flush()
    check = zlib.crc32(data).to_bytes(4, "little")
    return _GZIP + body + check + (len(data) & 0xFFFFFFFF).to_bytes(4, "little")


def write_files(
    folder: Path, files: Iterable[File], *, force: bool, gzip: bool
) -> Iterator[dict[str, int]]:
    """Writes files; yields for each the name → bytes of the file and its copy. At the end all are
    on the disk.

    Parameters
    ----------
    folder: an existing folder.
    files: names relative to the folder, and contents; missing folders are created.
    force: overwrite files; a gzip copy that is not written again is deleted.
    gzip: also write copies of VRML and JSON files.

    Raises OutputError: PTM-O001 to PTM-O003, PTM-O005, of the first file that cannot be written.
    """

    def write(file: File) -> dict[str, int]:
        name, content = file
        data = content.encode() if isinstance(content, str) else content
        copy = folder / f"{name}{GZIP}"
        real_folder(folder, name.rpartition("/")[0])
        write_bytes(folder / name, data, force=force)
        if gzip and name.endswith(_TEXT):
            packed = compress(data)
            write_bytes(copy, packed, force=force)
            return {name: len(data), f"{name}{GZIP}": len(packed)}
        if force:
            with writing(copy):
                copy.unlink(missing_ok=True)
        return {name: len(data)}

    return map_in_order(write, files, _WRITER_THREADS)


def visit_of(content: Content, sizes: Mapping[str, int]) -> VisitCost:
    """The cost of a visit.

    ``sizes``: bytes of each file, by its path in the served folder.
    """
    pvs, records = content.pvs, content.textures
    forms = [e for e in content.emitters if e.cell_files]
    nothing = np.zeros(pvs.cell_count, np.int64)
    fetched = [f for f in forms if not f.entry] or forms
    geometry = _geometry(content, fetched[0], sizes) if fetched else nothing
    meshes = _meshes(content, fetched[0], sizes) if fetched else nothing
    paints = np.zeros((pvs.cell_count, len(records)), dtype=np.bool_)
    for cell, places in enumerate(content.cell_textures):
        paints[cell, places] = True
    sees = np.array([paints[pvs.row(c)].any(axis=0) for c in range(pvs.cell_count)])
    used = np.flatnonzero(paints.any(axis=0))
    coarsest, whole = (
        np.array([end(r) if r.levels else 0 for r in records], np.int64)
        for end in (lambda record: record.levels[0].end, finest_bytes)
    )
    at_hand = pvs.at_hand(geometry) + sees @ whole
    first = content.viewpoints[0].cell
    opening = [
        sizes[HINTS],
        sizes[path_of(first, RECORD_FILES)],
        geometry[pvs.row(first)].sum(),
        whole[paints[first]].sum(),
        coarsest[sees[first] & ~paints[first]].sum(),
    ]
    texels = np.array([r.finest[0] * r.finest[1] for r in records], np.float64)
    shares: tuple[float, float] | tuple[None, None] = (None, None)
    if len(used):
        shares = over_places(sees @ texels / texels[used].sum(), pvs.viewers)
    mean, greatest = over_places(at_hand, pvs.viewers)
    until = _until_shares(content, geometry, paints, whole)
    volume = pvs.volume_at_hand
    images = sum(records[i].fallback_bytes for i in used.tolist() if content.options.fallback)
    browsed = [sizes[f.entry] + int(_geometry(content, f, sizes).sum()) for f in forms if f.entry]
    return VisitCost(
        browser=browsed[0] + images if browsed else None,
        first_room=int(sum(opening)),
        simplified=int(sum(opening) - meshes[pvs.row(first)].sum()) if content.meshes else None,
        mean_at_hand=round(mean),
        most_at_hand=round(greatest),
        mean_90=round(over_places(until[:, 0], pvs.viewers)[0]),
        mean_99=round(over_places(until[:, 1], pvs.viewers)[0]),
        everything=int(geometry.sum() + whole[used].sum()),
        mean_volume=volume[0],
        most_volume=volume[1],
        mean_texels=shares[0],
        most_texels=shares[1],
    )


#: Shares of the average view of a cell whose bytes are reported.
SHARES = (0.9, 0.99)


def _until_shares(content: Content, geometry: Ints, paints: Bools, whole: Ints) -> Floats:
    """(C, 2) bytes, with their textures, of the cell itself and of the fewest others that cover
    each of `SHARES` of the average view of a cell.

    ``geometry``: (C,) bytes of cells; ``paints``: (C, T) which textures each uses, and ``whole``:
    (T,) their bytes.
    """
    result = np.zeros((content.pvs.cell_count, len(SHARES)))
    for cell in range(len(result)):
        seen, share = content.pvs.row(cell), content.ach.row(cell)
        order = np.lexsort((np.arange(len(seen)), -share, seen != cell))
        covered = np.cumsum(share[order])
        for k, least in enumerate(SHARES):
            some = seen[order[: int(np.searchsorted(covered, least)) + 1]]
            result[cell, k] = geometry[some].sum() + whole[paints[some].any(axis=0)].sum()
    return result


def finest_bytes(record: TextureRecord) -> int:
    """Bytes of a texture with its finest level: the `.ptm`, and the preview of a level that it
    lacks."""
    image = record.previews[-1].preview.bytes if record.level_count > len(record.levels) else 0
    return record.levels[-1].end + image


def _geometry(content: Content, form: Emitter, sizes: Mapping[str, int]) -> Ints:
    """(C,) bytes of the cells in a form, with all objects as modelled."""
    paths = (path_of(cell, form.cell_files) for cell in range(content.cells.cell_count))
    return np.array([sizes[path] for path in paths], np.int64) + _meshes(content, form, sizes)


def _meshes(content: Content, form: Emitter, sizes: Mapping[str, int]) -> Ints:
    """(C,) of these, bytes of objects that have levels of detail."""
    finest = np.zeros(content.cells.cell_count, np.int64)
    for mesh in content.meshes if form.has_meshes else ():
        finest[mesh.cell] += sizes[mesh_path(mesh.files[-1])]
    return finest


def emit(
    scene: Scene,
    cells: Cells,
    pvs: Pvs,
    ach: Ach,
    textures: tuple[TextureRecord, ...],
    out: str | os.PathLike[str],
    options: EmitOptions = EmitOptions(),  # noqa: B008 - a frozen value
    extras: EmitExtras = EmitExtras(),  # noqa: B008 - a frozen value
) -> EmitReport:
    """Writes the files of every emitter that ``options.format`` names into the folder ``out``. The
    textures themselves are written by the stage before.

    Parameters
    ----------
    textures: one record for every image that a material in use names, those of lightmaps, and
        those of normal maps.
    extras: results of optional stages, and how to run; `EmitExtras`.

    Raises
    ------
    DatabaseError: PTM-D600 there are no cells; PTM-D601 in float32, a number is not finite or a
        cell is flat; PTM-D004 an image has no record; PTM-D008 the artifacts do not belong
        together.
    InputError: PTM-I111 a given viewpoint lies in no cell.
    OutputError: PTM-O001 to PTM-O003, PTM-O005, see `ptmtools.files`.
    LimitError: PTM-L400 a cell is longer than a GLB can be.
    """
    folder = Path(out)
    _check(scene, cells, pvs, ach, textures)
    emitters = chosen_emitters(options.format)
    for name in _owned_names(emitters) if not extras.force else ():
        remedy = "specify another folder, or use --force to overwrite it"
        refuse_existing(folder / name, remedy)
    images = tuple(record for record in textures if record.image >= 0)
    viewpoints, notes = place_viewpoints(scene, cells, options, images)
    content = Content(
        scene, cells, pvs, ach, textures, options, extras, viewpoints, tuple(emitters)
    )
    sizes = _write_forms(content, folder, gzip=options.gzip)
    return EmitReport(
        files=tuple(sizes),
        viewpoints=viewpoints,
        shapes=len(content.geometry.object),
        triangles=len(content.geometry.triangle),
        collapsed=content.geometry.collapsed,
        bytes=sum(sizes.values()),
        visit=visit_of(content, sizes),
        notes=notes,
    )


def _owned_names(emitters: Iterable[Emitter]) -> list[str]:
    return [name for emitter in emitters for name in emitter.owns]


def _write_forms(content: Content, folder: Path, *, gzip: bool) -> dict[str, int]:
    """Writes the files of all emitters; the bytes of each by its name."""
    written = [emitter.writer.load()(content) for emitter in content.emitters]
    for name in _owned_names(content.emitters):
        if name.endswith("/"):
            real_folder(folder, name[:-1])
    sizes: dict[str, int] = {}
    entries = {emitter.entry for emitter in content.emitters}
    for files in written:
        # An entry is written after the files that it leads to are on the disk.
        for _, group in groupby(files, lambda file: file[0] in entries):
            for file_sizes in write_files(folder, group, force=content.extras.force, gzip=gzip):
                sizes |= file_sizes
    return sizes


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
            "PTM-D008",
            f"the stages do not belong together: {fault}",
            remedy="run the stages again, from `cells` on",
        )
    shown = [scene.materials[m] for m in np.unique(scene.triangle_material[source]).tolist()]
    used = {m.image for m in shown} | {m.normal.image for m in shown if m.normal}
    for image in sorted(used - {-1} - {texture.image for texture in textures}):
        raise DatabaseError(
            "PTM-D004",
            f"the texture {scene.images[image].name!r} was not encoded",
            remedy="run the stage `textures` again",
        )
