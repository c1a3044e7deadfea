"""Writes a model as a campus folder: objects and textures in parallel, and the index.

Nothing in the folder depends on the number of workers, on time, or on the folder's name.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.executor import Executor
from ptmtools.lazy import component
from ptmtools.light.occlusion import Occluders
from ptmtools.progress import Progress, silent
from ptmtools.scene.ingestion import ingest
from ptmtools.scene.model import Material, Scene
from ptmtools.scene.options import IngestOptions
from ptmtools_systems.campus.making import ObjectSource, make_object
from ptmtools_systems.campus.model import (
    ALPHA,
    FORM,
    INDEX,
    Campus,
    CampusMaterial,
    CampusObject,
    Names,
    RecordFile,
    TextureFile,
)
from ptmtools_systems.campus.objects import ObjectPart, notes_on, parts_of
from ptmtools_systems.campus.options import CampusOptions
from ptmtools_systems.campus.records import files_of, read_places, read_records
from ptmtools_systems.campus.second_set import model_light, model_masks
from ptmtools_systems.campus.textures import BaseImage, Mask, texture_files


@dataclass(frozen=True)
class Made:
    """A written campus.

    Attributes
    ----------
    campus: the index.
    scene: that of the model, for its notes.
    notes: further notes.
    seconds: duration of each phase.
    covered, computed: texels of lightmaps that are read on faces, and computed ones.
    """

    campus: Campus
    scene: Scene
    notes: tuple[str, ...]
    seconds: Mapping[str, float]
    covered: int
    computed: int


def make_campus(
    model: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    options: CampusOptions = CampusOptions(),  # noqa: B008 - a frozen value
    reading: IngestOptions = IngestOptions(),  # noqa: B008
    executor: Executor | None = None,
    *,
    force: bool = False,
    progress: Progress = silent,
    records: str | os.PathLike[str] | None = None,
) -> Made:
    """Write the campus of a model.

    Parameters
    ----------
    model: as for `ptmtools.scene.ingest`, with ``reading`` its options.
    folder: new, or with ``force`` one that holds a campus.
    executor: does the objects and textures; one after the other without.
    records: folder with HTML files named after objects (`read_records`), and a table of icons and
        ranks (`read_places`).

    Raises
    ------
    InputError: as ingest and `read_records`; PTM-I701 no lightmaps in the model.
    LimitError: PTM-L400 too many objects; as `read_records`.
    OutputError: PTM-O001, O002, O003, O010 of the folder.
    MissingComponentError: PTM-M100 lightmaps are to be baked, and xatlas is not installed.
    """
    executor = executor or Executor()
    FORM.check(folder, force=force)
    if options.lightmaps != "none":
        component("xatlas", "PTM-M100", "lightmaps need xatlas", "campus")
    seconds, since = {}, [time.perf_counter()]

    def end(phase: str) -> None:
        since.append(time.perf_counter())
        seconds[phase] = since[-1] - since[-2]

    given = _read_model(Path(model), options, reading, records, executor.workers, progress)
    end("reading")
    with FORM.stage_files(folder, force=force) as put:
        limits = reading.limit << 20, options.quality
        textures = _write_textures(put, given.bases, limits, executor, progress)
        end("textures")
        made = _write_objects(put, given, textures, executor, progress)
        end("objects")
        space, materials = given.scene.space, given.source.materials
        drawn = options.lods, options.lightmaps, made.objects, materials, tuple(textures)
        campus = Campus(space.origin, space.metres, space.up, *drawn)
        put(INDEX, index_bytes(campus))
    end("writing")
    notes = *given.notes, *made.notes
    return Made(campus, given.scene, notes, seconds, made.covered, made.computed)


@dataclass(frozen=True)
class _Given:
    """What the files of a campus are made from: the objects by their names in files, the record of
    each that has one, and its icon and rank."""

    scene: Scene
    source: ObjectSource
    bases: list[BaseImage]
    tasks: list[tuple[str, ObjectPart]]
    records: Mapping[str, tuple[RecordFile, bytes]]
    places: Mapping[str, Mapping[str, Any]]
    notes: tuple[str, ...]


def _read_model(
    path: Path,
    options: CampusOptions,
    reading: IngestOptions,
    records: str | os.PathLike[str] | None,
    workers: int,
    progress: Progress,
) -> _Given:
    scene = ingest(path, reading, progress, workers=workers)
    masks, mask_notes = model_masks(path, scene, reading)
    painted = model_light(path, reading) if options.lightmaps == "model" else None
    parts = parts_of(scene, options.small)
    notes = *mask_notes, *notes_on(parts)
    names = Names()
    bases, of_image = _bases(scene, masks, names)
    materials, material = _materials(scene, of_image, bases)
    tasks = [(names.take(part.label, "object"), part) for part in parts]
    pages: dict[str, bytes] = {}
    places: dict[str, dict[str, Any]] = {}
    if records is not None:
        labels = [(name, part.label) for name, part in tasks]
        pages, page_notes = read_records(records, labels)
        places, place_notes = read_places(records, labels)
        notes = *notes, *page_notes, *place_notes
    source = ObjectSource(
        scene.points,
        scene.triangles,
        scene.uv,
        scene.colors,
        scene.two_sided,
        material,
        materials,
        Occluders.from_scene(scene),
        options,
        painted,
    )
    return _Given(scene, source, bases, tasks, files_of(pages), places, notes)


def _write_textures(
    put: Callable[[str, bytes], None],
    bases: list[BaseImage],
    limits: tuple[int, int],
    executor: Executor,
    progress: Progress,
) -> list[TextureFile]:
    textures = []
    for done, written in enumerate(executor.each(texture_files, limits, bases)):
        progress(done, len(bases), "textures")
        for record, data in written:
            put(record.file, data)
            textures.append(record)
    return textures


class _Objects(NamedTuple):
    """The objects as written, with notes and sums of `ObjectMade`."""

    objects: tuple[CampusObject, ...]
    notes: list[str]
    covered: int
    computed: int


def _write_objects(
    put: Callable[[str, bytes], None],
    given: _Given,
    textures: list[TextureFile],
    executor: Executor,
    progress: Progress,
) -> _Objects:
    """Writes the objects, and adds their lightmaps to the textures."""
    objects, covered, computed = [], 0, 0
    notes: list[str] = []
    for done, made in enumerate(executor.each(make_object, given.source, given.tasks)):
        progress(done, len(given.tasks), "objects")
        for file, data in made.meshes:
            put(file, data)
        for record, data in made.lightmaps:
            put(record.file, data)
            textures.append(record)
        row, page = given.records.get(made.record.name, (None, b""))
        if row is not None:
            put(row.file, page)
        objects.append(replace(made.record, record=row, **given.places.get(made.record.name, {})))
        notes += made.notes
        covered, computed = covered + made.covered, computed + made.computed
    progress(len(given.tasks), len(given.tasks), "objects")
    return _Objects(tuple(objects), notes, covered, computed)


def index_bytes(campus: Campus) -> bytes:
    """The bytes of campus.json."""
    text = json.dumps(campus.to_document(), indent=1, ensure_ascii=False, allow_nan=False)
    return f"{text}\n".encode("utf-8", "replace")


def _bases(
    scene: Scene, masks: Mapping[int, Mask], names: Names
) -> tuple[list[BaseImage], dict[int, int]]:
    """The textures, one for each distinct image and mask; and the index of each material's."""
    index_of: dict[tuple[int, str], int] = {}
    bases: list[BaseImage] = []
    base_of: dict[int, int] = {}
    for number, material in enumerate(scene.materials):
        if material.image < 0:
            continue
        image, mask = scene.images[material.image], masks.get(number)
        # By the content of the mask: two files may be equal.
        key = material.image, "" if mask is None else _digest(mask)
        if key not in index_of:
            index_of[key] = len(bases)
            name = names.take(Path(image.name).stem, "texture")
            bases.append(BaseImage(name, image, alpha=False, mask=mask))
        base_of[number] = index_of[key]
        if _cut_out(scene, material):
            known = bases[index_of[key]]
            bases[index_of[key]] = BaseImage(known.base, known.image, True, known.mask)
    return bases, base_of


def _cut_out(scene: Scene, material: Material) -> bool:
    """Whether the alpha of its image counts."""
    return material.transparent and not scene.images[material.image].plain


def _digest(mask: Mask) -> str:
    from ptmtools.store.layout import sha256

    return f"{sha256(mask.load())} {mask.band} {mask.inverted}"


def _materials(
    scene: Scene, base_of: Mapping[int, int], bases: list[BaseImage]
) -> tuple[tuple[CampusMaterial, ...], NDArray[np.int32]]:
    """The materials of a campus, one for each material of the scene and the sides that show it; and
    (T,) the material of each face."""
    key = 2 * scene.triangle_material.astype(np.int64) + scene.two_sided
    used, place = np.unique(key, return_inverse=True)
    materials = []
    for number, both in (divmod(code, 2) for code in used.tolist()):
        base = bases[base_of[number]] if number in base_of else None
        given = scene.materials[number]
        channels = () if base is None else base.channels
        if base is not None and not _cut_out(scene, given):
            channels = tuple(channel for channel in channels if channel != ALPHA)
        materials.append(_material(given, base, channels, bool(both)))
    return tuple(materials), place.ravel().astype(np.int32)


def _material(
    given: Material, base: BaseImage | None, channels: tuple[str, ...], both: bool
) -> CampusMaterial:
    tested = given.cutoff is not None
    return CampusMaterial(
        name=given.name,
        base=None if base is None else base.base,
        channels=channels,
        wrap=(given.wrap_s, given.wrap_t),
        color=given.color,
        opacity=given.opacity,
        alpha="mask" if tested else "blend" if given.transparent else "opaque",
        cutoff=given.cutoff,
        two_sided=both,
    )
