"""The stage `scene`: a model becomes arrays, a list of its images, and a copy of each.

The list is an artifact of its own beside the arrays, so that a texture that is painted over touches
neither the cells nor what follows from them. If nothing but the contents of plain images (see
`SourceImage`) has changed, the model itself is not read again: nothing else could come of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ptmtools.errors import DatabaseError, naming
from ptmtools.pipeline.images import image_rows_of, images_of, keep_images
from ptmtools.pipeline.run import Artifacts, Job
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.store.digests import Digests
from ptmtools.store.layout import IMAGE_LIST, IMAGES, sha256
from ptmtools.store.manifest import StageRecord
from ptmtools.store.transaction import Transaction

if TYPE_CHECKING:
    from ptmtools.scene.model import SourceImage
    from ptmtools.scene.options import IngestOptions


def inputs_of(artifacts: Artifacts, _: IngestOptions) -> dict[str, str]:
    """See `Stage.inputs`; as far as can be known without reading the model: the files that it was
    made of before."""
    assert artifacts.model
    before = artifacts.before(SCENE)
    names = before.inputs if before else ()
    return files_of(artifacts.model, names, artifacts.db.digests)


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


def repainted(artifacts: Artifacts, work: StageRecord) -> dict[int, str] | None:
    """Which rows of the list of images have other contents, and the names of their files, if the
    contents of plain images are all that has changed since the last run; else None."""
    before = artifacts.before(SCENE)
    if before is None or before.inputs.keys() != work.inputs.keys():
        return None
    if (before.recipe, before.parameters) != (work.recipe, work.parameters):
        return None
    try:
        rows = image_rows_of(artifacts)
    except DatabaseError:
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


def foresee(artifacts: Artifacts, work: StageRecord) -> bool:
    """See `Stage.foresee`: known if plain images alone have been painted over. ``artifacts`` then
    hold the list of images as it will be."""
    changed = repainted(artifacts, work)
    if changed is None:
        return False
    new = {i: {"sha256": work.inputs[name]} for i, name in changed.items()}
    rows = [{**row, **new.get(i, {})} for i, row in enumerate(image_rows_of(artifacts))]
    artifacts.hold(IMAGE_LIST, rows)
    return True


class ReadingJob(Job):
    """Reads the model of the run."""

    @property
    def _model(self) -> Path:
        assert self.run.model
        return self.run.model

    def make(self, transaction: Transaction, work: StageRecord) -> StageRecord:
        """Raises what `ingest` and `check_image` raise."""
        return self._repainted(transaction, work) or self._read(transaction, work)

    def _read(self, transaction: Transaction, work: StageRecord) -> StageRecord:
        from ptmtools.scene import ingest
        from ptmtools.scene.notes import line, warnings

        run = self.run
        scene = ingest(self._model, self.options, run.progress, workers=run.workers.here)
        run.keep(SCENE, scene)
        transaction.put_arrays(SCENE.name, scene.to_arrays())
        self._put_images(transaction, scene.images, scene.images)
        assert SCENE.counts
        return replace(
            work,
            inputs=files_of(self._model, scene.files, run.db.digests),
            counts={**SCENE.counts(scene), **self._bytes(scene.files, scene.images)},
            notes=tuple(map(line, scene.notes)),
            warnings=tuple(warnings(scene.notes)),
        )

    def _repainted(self, transaction: Transaction, work: StageRecord) -> StageRecord | None:
        """The scene, if nothing but plain images has changed; None if more has."""
        from ptmtools.scene.images import is_plain
        from ptmtools.scene.model import SourceImage
        from ptmtools.scene.source import FileRange, HeldBytes

        changed = repainted(self.run, work)
        if changed is None:
            return None
        before, rows = self.run.record(SCENE), image_rows_of(self.run)
        fresh: dict[int, SourceImage] = {}
        for i, name in changed.items():
            try:
                data = FileRange(self._model.parent / name)()
            except OSError:
                return None
            limit = self.options.limit << 20
            if sha256(data) != work.inputs[name] or not is_plain(data, rows[i]["name"], limit):
                return None
            held = HeldBytes(data)
            fresh[i] = SourceImage(rows[i]["name"], work.inputs[name], held, (name,), True)
        old = {f"{IMAGES}/{before.inputs[name]}" for name in changed.values()} | {IMAGE_LIST}
        kept = {name: digest for name, digest in before.outputs.items() if name not in old}
        if not transaction.keep(kept):
            return None
        images = [fresh.get(i, image) for i, image in enumerate(images_of(self.run))]
        self._put_images(transaction, images, fresh.values())
        counts = {**before.counts, **self._bytes(work.inputs, images)}
        return replace(work, counts=counts, notes=before.notes, warnings=before.warnings)

    def _bytes(self, names: Iterable[str], images: Iterable[SourceImage]) -> dict[str, int]:
        """What the model's files take, and those of its images apart."""
        painted = {name for image in images for name in image.files} - {self._model.name}
        files = {name: self._model.parent / name for name in {self._model.name, *names} | painted}
        sizes = {name: f.stat().st_size for name, f in files.items() if f.is_file()}
        image_bytes = sum(length for name, length in sizes.items() if name in painted)
        return {"model_bytes": sum(sizes.values()) - image_bytes, "image_bytes": image_bytes}

    def _put_images(
        self,
        transaction: Transaction,
        images: Iterable[SourceImage],
        fresh: Iterable[SourceImage],
    ) -> None:
        """Stages the list of images, and a copy of each that is new and can be decoded."""
        from ptmtools.texture.images import check_image
        from ptmtools.texture.model import Limits

        transaction.put(IMAGE_LIST, keep_images(self.run, images))
        for image in fresh:
            data = image.load()
            with naming(image.name):
                check_image(data, Limits(self.options.limit << 20))
            transaction.put(f"{IMAGES}/{image.sha256}", data)
