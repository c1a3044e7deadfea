"""The stages in their order: each one function, and `build_scene` all of them.

Reading and subdividing go together: nothing is written before a model has proved to be one that
can be cut into cells.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.database import EmitOptions
from ptmtools.pipeline.emission import put_files
from ptmtools.pipeline.folder import DatabaseWriter, sha256
from ptmtools.pipeline.run import IMAGES, Run, StageReport, peak_memory, work_of
from ptmtools.pipeline.textures import TextureOptions, check_images, check_options, put_textures
from ptmtools.progress import Progress, silent
from ptmtools.scene import IngestOptions, Note, Scene, ingest
from ptmtools.visibility.options import PvsOptions
from ptmtools.visibility.pvs import compute_pvs

PathLike = str | os.PathLike[str]

#: Above this share of cells visible on average, culling by cells does not pay.
CULLING_GAINS_LITTLE = 0.7


@dataclass(frozen=True)
class BuildOptions:
    """The options of all stages.

    Attributes
    ----------
    ingest, subdivide, pvs, ach, textures, emit: of each stage.
    workers: threads or processes; 0 is one for each processor. Changes nothing in the result.
    force: write into a folder that is not ours, or over the database of another model.
    """

    ingest: IngestOptions = field(default_factory=IngestOptions)
    subdivide: SubdivideOptions = field(default_factory=SubdivideOptions)
    pvs: PvsOptions = field(default_factory=PvsOptions)
    ach: AchOptions = field(default_factory=AchOptions)
    textures: TextureOptions = field(default_factory=TextureOptions)
    emit: EmitOptions = field(default_factory=EmitOptions)
    workers: int = 0
    force: bool = False


@dataclass(frozen=True)
class BuildReport:
    """What a run over a database did.

    Attributes
    ----------
    model: the model's file name.
    database: the folder.
    stages: in the order in which they were dealt with.
    seconds: of all together.
    peak_memory: bytes, the most that this process ever held; 0 where the system does not tell.
    """

    model: str
    database: str
    stages: tuple[StageReport, ...]
    seconds: float
    peak_memory: int

    def counts(self, stage: str) -> Mapping[str, Any]:
        """The figures of a stage; empty if it was no part of this run."""
        return next((s.counts for s in self.stages if s.stage == stage), {})

    @property
    def notes(self) -> tuple[str, ...]:
        """What the stages have to say, in their order."""
        return tuple(note for stage in self.stages for note in stage.notes)


def build_scene(
    model: PathLike, db: PathLike, options: BuildOptions | None = None, progress: Progress = silent
) -> BuildReport:
    """Builds a database, or brings it up to date: only stages whose inputs, options or software
    changed are run.

    Raises
    ------
    InputError, LimitError: what is wrong with the model, from `ingest` and the other stages.
    OutputError, DatabaseError: what is wrong with the database, from `DatabaseWriter`.
    """
    options = options or BuildOptions()
    workers = _workers(options.workers)
    start = time.perf_counter()
    check_options(options.textures)
    with DatabaseWriter.open_for_model(db, Path(model).name, force=options.force) as writer:
        run = Run(writer, progress)
        _read_and_cut(run, Path(model), options.ingest, options.subdivide)
        put_textures(run, options.textures, workers)
        _look(run, replace(options.pvs, workers=workers))
        _sample(run, replace(options.ach, workers=workers))
        put_files(run, options.emit)
        return _closing(run, start)


def make_cells(
    model: PathLike,
    db: PathLike,
    ingest_options: IngestOptions | None = None,
    subdivide_options: SubdivideOptions | None = None,
    *,
    force: bool = False,
    progress: Progress = silent,
) -> BuildReport:
    """Reads a model and cuts it into cells: the first two stages of a database."""
    start = time.perf_counter()
    with DatabaseWriter.open_for_model(db, Path(model).name, force=force) as writer:
        run = Run(writer, progress)
        _read_and_cut(
            run,
            Path(model),
            ingest_options or IngestOptions(),
            subdivide_options or SubdivideOptions(),
        )
        return _closing(run, start)


def make_pvs(
    db: PathLike, options: PvsOptions | None = None, workers: int = 0, progress: Progress = silent
) -> BuildReport:
    """Runs the visibility stage of a database; ``workers`` as in `BuildOptions`."""
    start = time.perf_counter()
    with DatabaseWriter.open_for_stage(db) as writer:
        run = Run(writer, progress)
        _look(run, replace(options or PvsOptions(), workers=_workers(workers)))
        return _closing(run, start)


def make_ach(
    db: PathLike, options: AchOptions | None = None, workers: int = 0, progress: Progress = silent
) -> BuildReport:
    """Runs the coverage stage of a database; ``workers`` as in `BuildOptions`."""
    start = time.perf_counter()
    with DatabaseWriter.open_for_stage(db) as writer:
        run = Run(writer, progress)
        _sample(run, replace(options or AchOptions(), workers=_workers(workers)))
        return _closing(run, start)


def make_textures(
    db: PathLike,
    options: TextureOptions | None = None,
    workers: int = 0,
    progress: Progress = silent,
) -> BuildReport:
    """Runs the textures stage of a database; ``workers`` as in `BuildOptions`."""
    start = time.perf_counter()
    with DatabaseWriter.open_for_stage(db) as writer:
        run = Run(writer, progress)
        put_textures(run, options or TextureOptions(), _workers(workers))
        return _closing(run, start)


def make_files(
    db: PathLike, options: EmitOptions | None = None, progress: Progress = silent
) -> BuildReport:
    """Writes the served files of a database."""
    start = time.perf_counter()
    with DatabaseWriter.open_for_stage(db) as writer:
        run = Run(writer, progress)
        put_files(run, options or EmitOptions())
        return _closing(run, start)


def _workers(asked: int) -> int:
    return asked or os.cpu_count() or 1


def _closing(run: Run, start: float) -> BuildReport:
    return BuildReport(
        model=run.db.manifest.model,
        database=str(run.db.path),
        stages=tuple(run.reports),
        seconds=time.perf_counter() - start,
        peak_memory=peak_memory(),
    )


def _read_and_cut(
    run: Run, model: Path, ingest_options: IngestOptions, subdivide_options: SubdivideOptions
) -> None:
    """The scene and the cells: one transaction, unless the scene is what it was."""
    writer, start = run.writer, time.perf_counter()
    before = writer.manifest.stages.get("scene")
    files = tuple(before.inputs) if before else ()
    work = work_of(ingest_options, _files_of(model, files))
    records = {}
    if not writer.is_current("scene", work):
        scene = ingest(model, ingest_options, run.progress)
        check_images(scene)
        run.hold("scene", scene)
        writer.put_arrays("scene", scene.to_arrays())
        for image in scene.images:
            writer.put(f"{IMAGES}/{image.sha256}", image.load())
        records["scene"] = replace(
            work_of(ingest_options, _files_of(model, scene.files)),
            outputs=writer.pending(),
            counts=_scene_counts(scene),
            notes=[_line(note) for note in scene.notes],
        )
    read = time.perf_counter()

    outputs = records["scene"].outputs if records else writer.manifest.stages["scene"].outputs
    work = work_of(subdivide_options, {"stages/scene.npz": outputs["stages/scene.npz"]})
    cut = not writer.is_current("cells", work)
    if cut:
        cells = subdivide(run.scene, subdivide_options, run.progress)
        run.hold("cells", cells)
        held = set(writer.pending())
        writer.put_arrays("cells", cells.to_arrays())
        records["cells"] = replace(
            work,
            outputs={n: h for n, h in writer.pending().items() if n not in held},
            counts={
                "cells": cells.cell_count,
                "leaves": cells.leaf_count,
                "portals": cells.portal_count,
                "pieces": len(cells.triangle),
                "closed": cells.closed,
            },
            notes=cells.notes,
        )
    if records:
        writer.commit(records)
    run.report("scene", "scene" in records, start, read)
    run.report("cells", cut, read)


def _files_of(model: Path, names: tuple[str, ...]) -> dict[str, str]:
    """Name → SHA-256 of the files that a model consists of, "" where there is none."""
    found = {}
    for name in (model.name, *names):
        file = model.parent / name
        found[name] = sha256(file.read_bytes()) if file.is_file() else ""
    return found


def _scene_counts(scene: Scene) -> dict[str, Any]:
    return {
        "triangles": len(scene.triangles),
        "objects": len(scene.objects),
        "materials": len(scene.materials),
        "images": len(scene.images),
        "origin": list(scene.space.origin),
        "metres": scene.space.metres,
        "up": scene.space.up,
        "unit_guessed": scene.space.unit_guessed,
        "up_guessed": scene.space.up_guessed,
    }


def _line(note: Note) -> str:
    where = f"{note.place}: " if note.place else ""
    times = f" ({note.count:,} times)" if note.count > 1 else ""
    return f"{where}{note.message}{times} [{note.code}]"


def _look(run: Run, options: PvsOptions) -> None:
    def compute() -> tuple[Mapping[str, Any], tuple[str, ...]]:
        pvs = compute_pvs(run.cells, options, run.progress)
        run.hold("pvs", pvs)
        run.writer.put_arrays("pvs", pvs.to_arrays())
        share = pvs.average_share
        notes = []
        if (
            share > CULLING_GAINS_LITTLE and pvs.cell_count > 1
        ):  # of one, the cells stage has said it
            notes.append(
                f"culling by visibility gains little here: on average a cell sees "
                f"{share:.0%} of all cells, as in a single hall"
            )
        if not pvs.conservative:
            notes.append(
                "the visible sets are of what random lines showed: a client that loads by them "
                "will show holes (`--pvs full` or `fast` for use)"
            )
        if pvs.fallbacks:
            notes.append(
                f"the search was cut short at {pvs.fallbacks:,} portals; "
                "their sets are larger than need be, never smaller"
            )
        figures = {
            "average_share": share,
            "fallbacks": pvs.fallbacks,
            "ties": int(pvs.ties.sum()),
            "decided_exactly": int(pvs.decided.sum()),
            "opened": int(pvs.opened.sum()),
            "leaks": len(pvs.leak),
        }
        return figures | {"conservative": pvs.conservative}, tuple(notes)

    run.stage("pvs", options, run.inputs("cells"), compute)


def _sample(run: Run, options: AchOptions) -> None:
    def compute() -> tuple[Mapping[str, Any], tuple[str, ...]]:
        ach = compute_ach(run.scene, run.cells, run.pvs, options, run.progress)
        run.hold("ach", ach)
        run.writer.put_arrays("ach", ach.to_arrays())
        notes = _coverage_notes(ach, options)
        known = bool(np.isfinite(ach.uncertain).any())
        return {
            "backend": ach.backend,
            "renderer": ach.renderer,
            "samples": int(ach.samples.sum()),
            "rejected": int(ach.rejected.sum()),
            "most_missed": float(ach.missed.max(initial=0.0)),
            "mean_uncertain": float(np.nanmean(ach.uncertain)) if known else None,
        }, notes

    run.stage("ach", options, run.inputs("scene", "cells", "pvs"), compute)


def _coverage_notes(ach: Ach, options: AchOptions) -> tuple[str, ...]:
    notes = []
    if blind := int((ach.samples == 0).sum()):
        notes.append(f"no sample point was found in {blind:,} cells")
    if options.tolerance is not None:
        short = int((~(ach.uncertain <= options.tolerance)).sum())
        if short:
            notes.append(
                f"{short:,} cells did not reach the tolerance of {options.tolerance:g} "
                f"with {options.points:,} sample points (`--samples`); their `uncertain` says how "
                "near they came"
            )
    return tuple(notes)
