"""The stage `scene`: a model becomes arrays, a list of its images, and a copy of each.

The list is an artifact of its own beside the arrays, so that a texture that is painted over touches
neither the cells nor what follows from them. If nothing but the contents of plain images (see
`SourceImage`) has changed, the model itself is not read again: nothing else could come of it.

The images of a scene in its database: a list of them, and a copy of each under its SHA-256."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools.errors import DatabaseError, naming
from ptmtools.pipeline.run import Artifacts, Job
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.store.digests import Digests
from ptmtools.store.layout import IMAGE_LIST, IMAGES, sha256
from ptmtools.store.manifest import StageRecord
from ptmtools.store.transaction import Transaction

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.scene.model import Scene, SourceImage
    from ptmtools.scene.options import IngestOptions


_IMAGE_NAME = re.compile(r"[A-Za-z0-9_-]+\.[A-Za-z0-9]+")
_SHA256 = re.compile(r"[0-9a-f]{64}")


def image_rows(data: bytes) -> list[Mapping[str, Any]]:
    """The rows of the list of images: name, sha256, files and plain, as in `SourceImage`.

    Raises ValueError, KeyError, TypeError or RecursionError if it is no such list. Names and
    digests become names of files, and are those that ingest gives.
    """
    rows: list[Mapping[str, Any]] = json.loads(data)["images"]
    for row in rows:
        if not (_IMAGE_NAME.fullmatch(row["name"]) and _SHA256.fullmatch(row["sha256"])):
            raise ValueError("an image with an impossible name or digest")
        texts = isinstance(row["files"], list) and all(isinstance(f, str) for f in row["files"])
        if not texts or not isinstance(row["plain"], bool):
            raise TypeError("an image without a list of files")
    return rows


def image_rows_of(artifacts: Artifacts) -> list[Mapping[str, Any]]:
    """The list of the scene's images; raises PTM-D004 to PTM-D006."""
    data = artifacts.db.read_output
    return artifacts.held(IMAGE_LIST, lambda: image_rows(data(SCENE.name, IMAGE_LIST)))


def image_digests(artifacts: Artifacts) -> dict[str, str]:
    """Name → SHA-256 of the scene's images, in their order; raises as `image_rows_of`."""
    return {row["name"]: row["sha256"] for row in image_rows_of(artifacts)}


def images_of(artifacts: Artifacts) -> tuple[SourceImage, ...]:
    """The scene's images, each read when it is loaded; raises as `image_rows_of`."""
    from ptmtools.scene.model import SourceImage

    def loader(digest: str) -> Callable[[], bytes]:
        return lambda: artifacts.db.read(f"{IMAGES}/{digest}", digest)

    def images() -> tuple[SourceImage, ...]:
        return tuple(
            SourceImage(
                row["name"], row["sha256"], loader(row["sha256"]), tuple(row["files"]), row["plain"]
            )
            for row in image_rows_of(artifacts)
        )

    return artifacts.held(IMAGES, images)


def load_scene(artifacts: Artifacts, arrays: Mapping[str, NDArray[np.generic]]) -> Scene:
    """See `Stage.load`."""
    from ptmtools.scene.model import Scene

    return Scene.from_arrays(arrays, images_of(artifacts))


def keep_images(artifacts: Artifacts, images: Iterable[SourceImage]) -> bytes:
    """Keeps images that were just read; returns the text of their list, see `image_rows`."""
    kept = tuple(images)
    rows = [
        {"name": i.name, "sha256": i.sha256, "files": list(i.files), "plain": i.plain} for i in kept
    ]
    artifacts.hold(IMAGES, kept)
    artifacts.hold(IMAGE_LIST, rows)
    return (json.dumps({"images": rows}, indent=1, ensure_ascii=False) + "\n").encode()


def missing_images(artifacts: Artifacts, scene: Scene) -> Iterator[tuple[str, str, str]]:
    """The images of a scene that its database has no copy of, see `Stage.check`."""
    outputs = artifacts.record(SCENE).outputs
    for image in scene.images:
        if outputs.get(f"{IMAGES}/{image.sha256}") != image.sha256:
            yield IMAGE_LIST, image.name, "is not in the database"


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
