"""The stage `scene`: a model becomes arrays, a list of its images, and a copy of each.

The list is an artifact of its own beside the arrays, so that a texture that is painted over touches
neither the cells nor what follows from them. If nothing but the contents of plain images (see
`SourceImage`) has changed, the model itself is not read again: nothing else could come of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools.errors import DatabaseError, naming
from ptmtools.pipeline.changes import reasons
from ptmtools.pipeline.digests import Digests
from ptmtools.pipeline.folder import sha256
from ptmtools.pipeline.manifest import StageRecord
from ptmtools.pipeline.run import Run, work_of
from ptmtools.pipeline.stages import IMAGE_LIST, IMAGES, image_list, image_rows
from ptmtools.pipeline.transaction import Transaction
from ptmtools.scene.options import IngestOptions

if TYPE_CHECKING:
    from ptmtools.scene.model import Note, Scene, SourceImage


def scene_work(
    model: Path, options: IngestOptions, before: StageRecord | None, digests: Digests
) -> StageRecord:
    """What reading a model is to do, as far as can be known without it: the files that it was made
    of before."""
    return work_of("scene", options, files_of(model, before.inputs if before else (), digests))


def files_of(model: Path, names: Iterable[str], digests: Digests) -> dict[str, str]:
    """Name → SHA-256 of the files that a model consists of, "" where there is none."""
    found = {}
    for name in dict.fromkeys((model.name, *names)):
        file = model.parent / name
        try:
            found[name] = digests.of(file) if file.is_file() else ""
        except OSError:
            found[name] = ""
    return found


def put_scene(
    run: Run, transaction: Transaction, model: Path, options: IngestOptions, workers: int
) -> tuple[StageRecord, tuple[str, ...]]:
    """The record of the scene, and why it was made anew; empty if it stands as it is.

    Raises what `ingest` and `check_image` raise.
    """
    before = run.db.manifest.stages.get("scene")
    work = scene_work(model, options, before, run.db.digests)
    why = reasons(before, work, run.db)
    if before is not None and not why:
        return before, ()
    if before is not None and (
        record := _repainted(run, transaction, model, options, before, work)
    ):
        return record, why
    return _read(run, transaction, model, options, workers), why


def _read(
    run: Run, transaction: Transaction, model: Path, options: IngestOptions, workers: int
) -> StageRecord:
    from ptmtools.scene import ingest

    scene = ingest(model, options, run.progress, workers=workers)
    run.hold("scene", scene)
    run.hold_images(scene.images)
    transaction.put_arrays("scene", scene.to_arrays())
    transaction.put(IMAGE_LIST, image_list([_row(image) for image in scene.images]))
    for image in scene.images:
        _put_image(transaction, image, options)
    return replace(
        work_of("scene", options, files_of(model, scene.files, run.db.digests)),
        outputs=transaction.pending(),
        counts=_counts(scene),
        notes=[_line(note) for note in scene.notes],
    )


def repainted(
    before: StageRecord, work: StageRecord, rows: Sequence[Mapping[str, Any]]
) -> dict[int, str] | None:
    """Which rows of the list of images have other contents, and the names of their files, if the
    contents of plain images are all that has changed; else None."""
    same = (before.recipe, before.parameters, set(before.inputs)) == (
        work.recipe,
        work.parameters,
        set(work.inputs),
    )
    if not same:
        return None
    row_of = {row["files"][0]: i for i, row in enumerate(rows) if len(row["files"]) == 1}
    changed = [name for name, digest in work.inputs.items() if before.inputs[name] != digest]
    for name in changed:
        row = rows[row_of[name]] if name in row_of else None
        if row is None or not row["plain"] or row["sha256"] != before.inputs[name]:
            return None
    found = {row_of[name]: name for name in changed}
    digests = {work.inputs[found[i]] if i in found else row["sha256"] for i, row in enumerate(rows)}
    return found if len(digests) == len(rows) else None


def _repainted(
    run: Run,
    transaction: Transaction,
    model: Path,
    options: IngestOptions,
    before: StageRecord,
    work: StageRecord,
) -> StageRecord | None:
    """The record of a scene of which nothing but plain images has changed; None if it has."""
    from ptmtools.scene.images import is_plain
    from ptmtools.scene.model import SourceImage
    from ptmtools.scene.source import FileRange, HeldBytes

    try:
        rows = image_rows(run.db.read_output("scene", IMAGE_LIST))
    except (DatabaseError, ValueError, KeyError, TypeError):
        return None
    changed = repainted(before, work, rows)
    if changed is None:
        return None
    fresh: dict[int, SourceImage] = {}
    for i, name in changed.items():
        try:
            data = FileRange(model.parent / name)()
        except OSError:
            return None
        limit = options.limit << 20
        if sha256(data) != work.inputs[name] or not is_plain(data, rows[i]["name"], limit):
            return None
        held = HeldBytes(data)
        fresh[i] = SourceImage(rows[i]["name"], work.inputs[name], held, (name,), True)
    old = {f"{IMAGES}/{before.inputs[name]}" for name in changed.values()} | {IMAGE_LIST}
    if not transaction.keep({n: digest for n, digest in before.outputs.items() if n not in old}):
        return None
    run.hold_images([fresh.get(i, image) for i, image in enumerate(run.images)])
    for image in fresh.values():
        _put_image(transaction, image, options)
    transaction.put(IMAGE_LIST, image_list([_row(image) for image in run.images]))
    return replace(work, outputs=transaction.pending(), counts=before.counts, notes=before.notes)


def _put_image(transaction: Transaction, image: SourceImage, options: IngestOptions) -> None:
    """Stages a copy of an image that has been decoded; raises what `check_image` raises."""
    from ptmtools.texture.images import check_image
    from ptmtools.texture.model import Limits

    data = image.load()
    with naming(image.name):
        check_image(data, Limits(options.limit << 20))
    transaction.put(f"{IMAGES}/{image.sha256}", data)


def _row(image: SourceImage) -> dict[str, Any]:
    return {
        "name": image.name,
        "sha256": image.sha256,
        "files": list(image.files),
        "plain": image.plain,
    }


def _counts(scene: Scene) -> Mapping[str, Any]:
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
