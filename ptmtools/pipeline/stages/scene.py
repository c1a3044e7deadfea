"""Reads the model: arrays in metres, a list of its images, and a copy of each image.

The list is a file of its own beside the arrays, so that a repainted texture changes neither the
cells nor the stages after them. So are the lights of the model. If only the contents of plain
images (see `SourceImage`) have changed, the model is not read again: the arrays would be the same.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools.errors import DatabaseError
from ptmtools.lazy import Lazy
from ptmtools.pipeline.artifacts import Artifacts, Run
from ptmtools.pipeline.stage import Counts, SceneOrigin, Stage, changes_of
from ptmtools.quantities import count
from ptmtools.scene.options import IngestOptions
from ptmtools.store.layout import IMAGE_LIST, IMAGES, LIGHTS, arrays_of, sha256

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.scene.lights import Lights
    from ptmtools.scene.model import Scene, SourceImage
    from ptmtools.store.digests import Digests
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction


_IMAGE_NAME = re.compile(r"[A-Za-z0-9_-]+\.[A-Za-z0-9]+")
_SHA256 = re.compile(r"[0-9a-f]{64}")


def image_rows(artifacts: Artifacts) -> list[Mapping[str, Any]]:
    """The list of the scene's images: name, sha256, files and plain, as in `SourceImage`, and their
    bytes.

    Names and digests become file names, so only the form that ingest writes is accepted. Raises
    PTM-D004 to PTM-D006, and PTM-D008 if another release of ptmtools wrote it.
    """

    def read() -> list[Mapping[str, Any]]:
        rows: list[Mapping[str, Any]]
        rows = json.loads(artifacts.db.read_output(SCENE.name, IMAGE_LIST))["images"]
        for row in rows:
            if not (_IMAGE_NAME.fullmatch(row["name"]) and _SHA256.fullmatch(row["sha256"])):
                raise ValueError("an image with an impossible name or digest")
            texts = isinstance(row["files"], list) and all(isinstance(f, str) for f in row["files"])
            if not texts or not isinstance(row["plain"], bool):
                raise TypeError("an image without a list of files")
            if type(row["bytes"]) is not int or row["bytes"] < 0:
                raise TypeError("an image without its number of bytes")
        if len({row["name"].partition(".")[0].casefold() for row in rows}) < len(rows):
            raise ValueError("two images whose textures would have the same name")
        return rows

    artifacts.check_recipe(SCENE)
    return artifacts.cached(IMAGE_LIST, read)


def image_digests(artifacts: Artifacts) -> dict[str, str]:
    """Name → SHA-256 of the scene's images, in their order; raises as `image_rows`."""
    return {row["name"]: row["sha256"] for row in image_rows(artifacts)}


def rounded_image_bytes(artifacts: Artifacts) -> int:
    """The bytes of the scene's images as in the model, or somewhat less: a power of two, so that
    what depends on them stays the same if they are repainted. 0 for none; raises as `image_rows`.
    """
    images = int(sum(row["bytes"] for row in image_rows(artifacts)))
    return 1 << images.bit_length() - 1 if images else 0


def images_of(artifacts: Artifacts) -> tuple[SourceImage, ...]:
    """The scene's images, each read when it is loaded; raises as `image_rows`."""
    from ptmtools.scene.model import SourceImage

    def image(row: Mapping[str, Any]) -> SourceImage:
        digest = row["sha256"]

        def load() -> bytes:
            return artifacts.db.read(f"{IMAGES}/{digest}", digest)

        return SourceImage(row["name"], digest, load, tuple(row["files"]), row["plain"])

    return artifacts.cached(IMAGES, lambda: tuple(map(image, image_rows(artifacts))))


def _digests(model: Path, names: Iterable[str], digests: Digests) -> dict[str, str]:
    """Name → SHA-256 of the files of a model, "" for one that is absent."""
    result = {}
    for name in dict.fromkeys((model.name, *names)):
        file = model.parent / name
        try:
            result[name] = digests.digest(file) if file.is_file() else ""
        except OSError:
            result[name] = ""
    return result


def _find_repainted(artifacts: Artifacts, work: StageRecord) -> dict[int, str] | None:
    """Row in the list → file of the repainted images, if the contents of plain images are all that
    has changed since the last run; else None."""
    before = artifacts.before(SCENE)
    if before is None or before.inputs.keys() != work.inputs.keys():
        return None
    if (before.recipe, before.parameters) != (work.recipe, work.parameters):
        return None
    try:
        rows = image_rows(artifacts)
    except DatabaseError:
        return None
    row_of = {row["files"][0]: i for i, row in enumerate(rows) if len(row["files"]) == 1}
    repainted: dict[int, str] = {}
    for name, digest in work.inputs.items():
        if before.inputs[name] != digest:
            row = rows[row_of[name]] if name in row_of else None
            if row is None or not row["plain"] or row["sha256"] != before.inputs[name]:
                return None
            repainted[row_of[name]] = name
    digests = {
        work.inputs[repainted[i]] if i in repainted else row["sha256"] for i, row in enumerate(rows)
    }
    return repainted if len(digests) == len(rows) else None


def lights_of(artifacts: Artifacts) -> Lights | None:
    """The lights of the scene; None if it has none. Raises PTM-D004 to PTM-D006, PTM-D008."""
    artifacts.check_recipe(SCENE)
    name = arrays_of(LIGHTS)
    if name not in artifacts.outputs(SCENE):
        return None

    def read() -> Lights:
        from ptmtools.scene.lights import Lights
        from ptmtools.store.archive import unpack_arrays

        data = artifacts.db.read_output(SCENE.name, name)
        lights = Lights.from_arrays(unpack_arrays(data, file=artifacts.db.path / name))
        scene = artifacts.original(SCENE)
        lights.check(len(scene.materials), len(scene.triangles))
        return lights

    return artifacts.cached(name, read)


def scene_origin(artifacts: Artifacts) -> SceneOrigin:
    """Where the scene as changed comes from; raises PTM-D004 to PTM-D006."""
    import numpy as np

    triangle = np.arange(len(artifacts.original(SCENE).triangles))
    objects = np.zeros(0, np.int32)
    for change in changes_of(SCENE):
        if artifacts.is_stored(change):
            origin = change.origin(artifacts)
            objects = np.union1d(objects, origin.objects).astype(np.int32)
            triangle = triangle[origin.triangle]
    return SceneOrigin(objects, triangle)


def _model_of(artifacts: Artifacts) -> Path:
    assert artifacts.model
    return artifacts.model


def _bytes(model: Path, names: Iterable[str], images: Iterable[SourceImage]) -> dict[str, int]:
    """The sizes of the model's files without its images, and of these."""
    painted = {name for image in images for name in image.files} - {model.name}
    files = {name: model.parent / name for name in {model.name, *names} | painted}
    sizes = {name: f.stat().st_size for name, f in files.items() if f.is_file()}
    image_bytes = sum(length for name, length in sizes.items() if name in painted)
    return {"model_bytes": sum(sizes.values()) - image_bytes, "image_bytes": image_bytes}


def _put_images(
    run: Run,
    transaction: Transaction,
    images: Iterable[SourceImage],
    fresh: Iterable[SourceImage],
    before: Iterable[Mapping[str, Any]] = (),
) -> None:
    """Stages the list of images, and a copy of each fresh one; the others are in the list
    ``before``."""
    from ptmtools.parallel import map_in_order

    images, fresh = tuple(images), tuple(fresh)

    def put(image: SourceImage) -> int:
        data = image.load()
        transaction.put(f"{IMAGES}/{image.sha256}", data, image.sha256)
        return len(data)

    sizes = {row["name"]: row["bytes"] for row in before}
    lengths = map_in_order(put, fresh, run.workers.here)
    sizes |= {image.name: length for image, length in zip(fresh, lengths, strict=True)}
    rows = [
        {
            "name": i.name,
            "sha256": i.sha256,
            "files": list(i.files),
            "plain": i.plain,
            "bytes": sizes[i.name],
        }
        for i in images
    ]
    run.cache(IMAGES, images)
    run.cache(IMAGE_LIST, rows)
    text = json.dumps({"images": rows}, indent=1, ensure_ascii=False) + "\n"
    transaction.put(IMAGE_LIST, text.encode())


class SceneStage(Stage["Scene"]):
    """Reads the model, or its repainted images alone."""

    name = "scene"
    about = "Read a model."
    recipe = 20
    changed = "only faces that use transparent texels are transparent"
    options = IngestOptions
    artifact = Lazy("ptmtools.scene.model:Scene")
    joined = True

    def inputs(self, artifacts: Artifacts, options: IngestOptions) -> dict[str, str]:
        """The files of the last run, as others are not known before the model is
        read."""
        before = artifacts.before(self)
        return _digests(_model_of(artifacts), before.inputs if before else (), artifacts.db.digests)

    def make(
        self, run: Run, options: IngestOptions, transaction: Transaction, work: StageRecord
    ) -> StageRecord:
        """Raises the errors of `ingest`."""
        repainted = self._repaint(run, options, transaction, work)
        return repainted or self._read(run, options, transaction, work)

    def _read(
        self, run: Run, options: IngestOptions, transaction: Transaction, work: StageRecord
    ) -> StageRecord:
        from ptmtools.scene import ingest
        from ptmtools.scene.notes import lines, warnings

        model = _model_of(run)
        scene = ingest(model, options, run.progress, workers=run.workers.here)
        run.keep(self, scene)
        transaction.put_arrays(self.name, scene.to_arrays())
        if scene.lights:
            transaction.put_arrays(LIGHTS, scene.lights.to_arrays())
        run.cache(arrays_of(LIGHTS), scene.lights or None)
        _put_images(run, transaction, scene.images, scene.images)
        return replace(
            work,
            inputs=_digests(model, scene.files, run.db.digests),
            counts={**self.counts(scene), **_bytes(model, scene.files, scene.images)},
            notes=tuple(lines(scene.notes)),
            warnings=tuple(warnings(scene.notes)),
        )

    def _repaint(
        self, run: Run, options: IngestOptions, transaction: Transaction, work: StageRecord
    ) -> StageRecord | None:
        """Reads the repainted images; None if more has changed."""
        from ptmtools.scene.images import is_plain
        from ptmtools.scene.model import SourceImage
        from ptmtools.scene.source import FileRange, HeldBytes

        repainted = _find_repainted(run, work)
        if repainted is None:
            return None
        model, before, rows = _model_of(run), run.record(self), image_rows(run)
        fresh: dict[int, SourceImage] = {}
        for i, name in repainted.items():
            try:
                data = FileRange(model.parent / name)()
            except OSError:
                return None
            limit = options.limit << 20
            if sha256(data) != work.inputs[name] or not is_plain(data, rows[i]["name"], limit):
                return None
            source = HeldBytes(data)
            fresh[i] = SourceImage(rows[i]["name"], work.inputs[name], source, (name,), True)
        old = {f"{IMAGES}/{before.inputs[name]}" for name in repainted.values()} | {IMAGE_LIST}
        kept = {name: digest for name, digest in before.outputs.items() if name not in old}
        if not transaction.keep(kept):
            return None
        images = [fresh.get(i, image) for i, image in enumerate(images_of(run))]
        _put_images(run, transaction, images, fresh.values(), rows)
        counts = {**before.counts, **_bytes(model, work.inputs, images)}
        return replace(work, counts=counts, notes=before.notes, warnings=before.warnings)

    def load(self, artifacts: Artifacts, arrays: Mapping[str, NDArray[np.generic]]) -> Scene:
        from ptmtools.scene.model import Scene

        return Scene.from_arrays(arrays, images_of(artifacts))

    def missing(self, artifacts: Artifacts, scene: Scene) -> Iterator[tuple[str, str, str]]:
        """The images without a copy in the database, and damaged lights."""
        try:
            lights_of(artifacts)
        except DatabaseError as fault:
            yield arrays_of(LIGHTS), "", fault.message
        outputs = artifacts.record(self).outputs
        for image in scene.images:
            if outputs.get(f"{IMAGES}/{image.sha256}") != image.sha256:
                yield IMAGE_LIST, image.name, "is not in the database"

    def foresee(self, artifacts: Artifacts, work: StageRecord) -> bool:
        """Known if only plain images were repainted."""
        repainted = _find_repainted(artifacts, work)
        if repainted is None:
            return False
        folder = _model_of(artifacts).parent
        try:
            new = {
                i: {"sha256": work.inputs[name], "bytes": (folder / name).stat().st_size}
                for i, name in repainted.items()
            }
        except OSError:  # an image is missing: the model has to be read
            return False
        rows = [{**row, **new.get(i, {})} for i, row in enumerate(image_rows(artifacts))]
        artifacts.cache(IMAGE_LIST, rows)
        return True

    def counts(self, scene: Scene) -> Counts:
        return {
            "triangles": len(scene.triangles),
            "objects": len(scene.objects),
            "materials": len(scene.materials),
            "images": len(scene.images),
            "size": (scene.points.max(axis=0) - scene.points.min(axis=0)).tolist(),
            "origin": list(scene.space.origin),
            "metres": scene.space.metres,
            "up": scene.space.up,
            "unit_guessed": scene.space.unit_guessed,
            "up_guessed": scene.space.up_guessed,
        }

    def summary(self, n: Counts) -> str:
        guessed = [
            text for text, key in (("unit", "unit"), ("up axis", "up")) if n[f"{key}_guessed"]
        ]
        how = f" ({' and '.join(guessed)} guessed)" if guessed else ""
        width, height, depth = n["size"]
        return (
            f"{count(n['triangles'], 'triangle')} in {count(n['objects'], 'object')}, "
            f"{count(n['images'], 'image')}; 1 unit = {n['metres']:g} m, {str(n['up']).upper()} up"
            f"{how}; {width:.3g} × {depth:.3g} m, {height:.3g} m high"
        )


SCENE = SceneStage()
