"""Encodes the images of the scene as progressive textures (paper §4), one task for each image.

A texture keeps its files if its image and the options are those of the last run, and takes over
those that an interrupted run has finished. The executor encodes the others, in threads on this
machine: the compiled kernels and zlib release the interpreter lock. Each texture is written at
once, so only a few images per worker wait in memory.

``--trim`` leaves out the finest levels that no eye resolves from any place where a visitor can
stand.
"""

from __future__ import annotations

import io
import json
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools.errors import naming
from ptmtools.pipeline.artifacts import Artifacts, Run
from ptmtools.pipeline.encoding import (
    OBJECTS_AHEAD,
    EncodedTexture,
    Messages,
    SharedUrl,
    TextureOptions,
    TextureTask,
    encode_texture,
    ptm_file,
    read_steps,
    shared_disk,
    stem_of,
    steps_file,
)
from ptmtools.pipeline.stage import Counts, Stage, Turn
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.scene import SCENE, image_digests, image_rows, images_of
from ptmtools.quantities import count, size
from ptmtools.store.layout import IMAGES, SERVED, sha256
from ptmtools.texture.previews import LOSSLESS

if TYPE_CHECKING:
    from threading import Event

    from ptmtools.executor import Executor
    from ptmtools.parallel import BackgroundLoop
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction
    from ptmtools.texture.model import PtmHeader
    from ptmtools.texture.previews import Steps
    from ptmtools.texture.sources import PtmSource


def texture_files(images: Iterable[str]) -> list[str]:
    """The `.ptm` of each image, named by its stem, relative to the served folder."""
    return [ptm_file(image.rpartition(".")[0]) for image in images]


def _coding(record: StageRecord) -> dict[str, Any]:
    """The parameters that change every texture; the effect of ``--trim`` is in the inputs."""
    return {n: value for n, value in record.parameters.items() if not n.startswith("trim")}


def stale_textures(before: StageRecord | None, work: StageRecord) -> list[str]:
    """The `.ptm`s, relative to the served folder, that would be encoded from another image or with
    other options than in the record."""
    if before is None or (before.recipe, _coding(before)) != (work.recipe, _coding(work)):
        return list(work.inputs)
    return [name for name in work.inputs if before.inputs.get(name) != work.inputs[name]]


def unresolved_level_counts(artifacts: Artifacts, options: TextureOptions) -> list[int]:
    """The number of the finest levels of each image that ``--trim`` leaves out.

    Raises as `Artifacts`.
    """
    rows = image_rows(artifacts)
    if not options.trim:
        return [0] * len(rows)
    from ptmtools.coverage.required_levels import VisitorScreen, unresolved_levels

    screen = VisitorScreen(options.trim_height, options.trim_fov, options.trim_distance)

    def levels() -> list[int]:
        stages = artifacts[SCENE], artifacts[CELLS], artifacts[PVS]
        return [int(n) for n in unresolved_levels(*stages, _sizes(artifacts, options), screen)]

    return artifacts.cached(f"levels unresolved by {screen}", levels)


def _sizes(artifacts: Artifacts, options: TextureOptions) -> list[tuple[int, int]]:
    """(width, height) of the scene's images. In a dry run, an image that is not in the database yet
    counts as one texel: it will be encoded in any case."""
    from ptmtools.texture.images.opening import open_image, pillow_faults
    from ptmtools.texture.model import Limits

    outputs = artifacts.record(SCENE).outputs
    sizes = []
    for image in images_of(artifacts):
        width = height = 1
        if f"{IMAGES}/{image.sha256}" in outputs:
            with naming(image.name), pillow_faults():
                file = io.BytesIO(image.load())
                width, height = open_image(file, Limits(options.limit << 20)).size
        sizes.append((width, height))
    return sizes


@dataclass(frozen=True)
class StoredTexture:
    """A texture as stored.

    Attributes
    ----------
    name: of its `.ptm`. header, steps: see their classes.
    """

    name: str
    header: PtmHeader
    steps: Steps

    @property
    def finest(self) -> tuple[int, int, int]:
        """Width, height and bytes of the finest level, which may exist as an image only."""
        if self.steps.finest_is_image:
            preview = self.steps.previews[-1]
            return preview.width, preview.height, preview.bytes
        level = self.header.levels[-1]
        return level.width, level.height, level.length

    def estimated_bytes(self, width: int, height: int) -> int:
        """Of another level, by the bytes for a texel of the finest one."""
        finest_width, finest_height, length = self.finest
        return length * width * height // (finest_width * finest_height)

    def finer(self) -> list[tuple[int, int]]:
        """(width, height) of the levels of the image that are finer than the finest one stored,
        coarsest first."""
        from ptmtools.texture.pyramid import level_sizes

        sizes = level_sizes(self.header.width, self.header.height)
        return sizes[sizes.index(self.finest[:2]) + 1 :]


def _trim_counts(
    textures: Iterable[StoredTexture], options: TextureOptions
) -> tuple[dict[str, int], list[str]]:
    """The counts of ``--trim``: the textures with levels left out, and the decoded bytes by which
    their finest levels are smaller. And a note on each, with the bytes saved as estimated. Nothing
    without ``--trim``."""
    if not options.trim:
        return {}, []
    from ptmtools.texture.encoder import kept_levels
    from ptmtools.texture.pyramid import level_sizes

    counts, notes = {"unresolved": 0, "unresolved_bytes": 0}, []
    for texture in textures:
        header, (kept_width, kept_height, _) = texture.header, texture.finest
        all_sizes = level_sizes(header.width, header.height)
        last = kept_levels(header.width, header.height, options)[-1]
        sizes = [size for size in texture.finer() if all_sizes.index(size) <= last]
        if sizes:
            width, height = sizes[-1]
            counts["unresolved"] += 1
            counts["unresolved_bytes"] += (
                width * height - kept_width * kept_height
            ) * header.texel_bytes
            saved = sum(texture.estimated_bytes(*size) for size in sizes)
            notes.append(
                f"--trim leaves out {count(len(sizes), 'level')} of {texture.name}: {kept_width} x "
                f"{kept_height} of {width} x {height}, about {size(saved)} less"
            )
    return counts, notes


def _files_by_stem(record: StageRecord | None) -> dict[str, dict[str, str]]:
    """The outputs of a record with their digests, by the stem of their image."""
    files: dict[str, dict[str, str]] = {}
    for name, digest in (record.outputs if record else {}).items():
        files.setdefault(stem_of(name), {})[name] = digest
    return files


class TexturesTurn(Turn):
    """Encodes the images of the scene, in the background where that pays."""

    def __init__(self, run: Run, stage: Stage[None], options: TextureOptions) -> None:
        super().__init__(run, stage, options)
        self._seconds = 0.0
        self._transaction: Transaction | None = None
        self._left: deque[int] = deque()
        self._names: list[str] = []
        self._fewer: list[int] = []
        self._prepared = False
        self._background: BackgroundLoop | None = None

    @property
    def left(self) -> int:
        """Number of textures left to encode."""
        return len(self._left)

    def begin(self) -> None:
        from ptmtools.parallel import BackgroundLoop

        self._prepare()
        executor = self.run.workers.background(self.left)
        if executor:
            free = self.run.workers.alone.free
            self._background = BackgroundLoop(self.encode, executor, free)

    def raise_failure(self) -> None:
        if self._background:
            self._background.check()

    def abandon(self) -> None:
        if self._background:
            self._background.abandon()

    def take(self) -> None:
        """Encodes the textures left, with all workers, and commits."""
        self._prepare()
        if self._background:
            self._background.finish()
            self._background = None
        if self.left:
            self.encode(self.run.workers.executor)
        if transaction := self._transaction:
            textures = list(self._stored(transaction))
            counts, notes = _trim_counts(textures, self.options)
            notes = [*notes_on_size(textures, self.options.max_side), *notes]
            record = replace(self._work, counts={**counts_of(textures), **counts}, notes=notes)
            self.run.settle(self.stage, transaction, record)
        self.run.end(self.stage, self._why, self._seconds, self._tasks)

    def _prepare(self) -> None:
        """Once: keeps the textures of the last run, and takes over those of an interrupted one."""
        if self._prepared:
            return
        self._prepared = True
        self._work, self._why = self.planned()
        self._names = list(self._work.inputs)
        self._fewer = unresolved_level_counts(self.run, self.options)
        self._tasks = (len(self._names), len(self._names), 0)
        if not self._why:
            return
        # Not `Run.begin`: another stage may be running.
        self._transaction = transaction = self.run.writer.begin(self.stage.name)
        kept, resumed = 0, 0
        before = self.run.before(self.stage)
        stale = set(stale_textures(before, self._work))
        files = _files_by_stem(before)
        for i, name in enumerate(self._names):
            stored_files = files.get(stem_of(name))
            if stored_files and name not in stale and transaction.keep(stored_files):
                kept += 1
            elif transaction.resume(self._task(i)):
                resumed += 1
            else:
                self._left.append(i)
        self._tasks = (len(self._names), kept, resumed)

    def encode(self, executor: Executor, stop: Event | None = None) -> None:
        """Encodes the textures left, until another thread sets ``stop``; commits nothing.

        Raises as `encode`.
        """
        from ptmtools.parallel import map_in_order

        assert self._transaction
        start, run, transaction = time.perf_counter(), self.run, self._transaction
        total, images, fewer = len(self._names), images_of(run), self._fewer
        wanted = takewhile(lambda _: stop is None or not stop.is_set(), tuple(self._left))
        opening: AbstractContextManager[Messages]
        if run.remote and executor.machines:
            opening = nullcontext(SharedUrl(self.options, run.remote.url, run.folder_url))
        else:
            opening = shared_disk(transaction, run.db.path, self.options, executor)
        with opening as place:

            def send(i: int) -> TextureTask:
                return place.send(run, images[i], i, fewer[i])

            share = len(self._left) // (8 * executor.workers)
            results = executor.each(
                encode_texture,
                place,
                map_in_order(send, wanted, place.ahead),
                releases_lock=True,
                chunk=max(1, min(place.most_images, share)),
            )
            for result in results:
                names = self._put(transaction, result)
                run.progress(total - len(self._left), total, "textures")
                transaction.finish(self._task(self._left.popleft()), names)
        run.progress(total - len(self._left), total, "textures")
        self._seconds += time.perf_counter() - start

    def _put(self, transaction: Transaction, texture: EncodedTexture) -> list[str]:
        """Stages the files of a texture; their names."""
        from ptmtools.texture.container import read_header

        run = self.run
        for file in texture.files:
            if file.data is not None:
                transaction.put(file.name, file.data, file.sha256)
            elif file.path:
                transaction.take(file.name, Path(file.path), file.sha256)
            else:
                assert run.remote
                run.remote.note(file.sha256, file.size)
                if file.name:
                    transaction.leave(file.name, file.sha256)
        names = [file.name for file in texture.files if file.name]
        run.cache(names[0], read_header(texture.head))
        run.cache(names[1], read_steps(texture.steps))
        return names

    def _task(self, i: int) -> str:
        """A digest of everything that the files of a texture depend on, their names included."""
        name = self._names[i]
        depends = [self._work.recipe, _coding(self._work), name, self._work.inputs[name]]
        return sha256(json.dumps(depends, sort_keys=True).encode())

    def _stored(self, transaction: Transaction) -> Iterator[StoredTexture]:
        """All textures, staged or committed."""
        from ptmtools.parallel import map_in_order

        def one(name: str) -> StoredTexture:
            return stored_texture(self.run, name, transaction.source, transaction.read)

        return map_in_order(one, self._names, OBJECTS_AHEAD)


def stored_texture(
    artifacts: Artifacts,
    name: str,
    source: Callable[[str], PtmSource],
    read: Callable[[str], bytes],
) -> StoredTexture:
    """The texture of a `.ptm`; ``source`` and ``read`` open files of the database."""
    from ptmtools.texture.container import HEAD_MAX, read_header
    from ptmtools.texture.sources import first_bytes

    ptm, steps = f"{SERVED}/{name}", steps_file(stem_of(name))
    with naming(artifacts.db.path / ptm):
        header = artifacts.cached(ptm, lambda: read_header(first_bytes(source(ptm), HEAD_MAX)))
    return StoredTexture(name, header, artifacts.cached(steps, lambda: read_steps(read(steps))))


def counts_of(textures: Iterable[StoredTexture]) -> dict[str, int]:
    """The counts of the stage."""
    counts = {"textures": 0, "raw_bytes": 0, "ptm_bytes": 0, "preview_bytes": 0, "kept_sources": 0}
    for texture in textures:
        width, height, _ = texture.finest
        counts["textures"] += 1
        counts["raw_bytes"] += width * height * texture.header.texel_bytes
        counts["ptm_bytes"] += texture.header.file_size
        counts["preview_bytes"] += sum(preview.bytes for preview in texture.steps.previews)
        counts["kept_sources"] += any(
            preview.exact and preview.format != LOSSLESS for preview in texture.steps.previews
        )
    return counts


def notes_on_size(textures: Iterable[StoredTexture], side_limit: int) -> Iterator[str]:
    """The texture farthest below ``--max-side``, where no level has that size: levels halve."""
    below = []
    for texture in textures:
        width, height, _ = texture.finest
        if (finer := texture.finer()) and max(width, height) < side_limit:
            below.append((max(width, height), texture.name, texture, finer[0]))
    if below:
        _, name, texture, above = min(below, key=lambda row: row[:2])
        width, height, _ = texture.finest
        yield (
            f"--max-side {side_limit} keeps less than that of {count(len(below), 'texture')}, "
            f"because sides halve from level to level: {name} has {width} x {height}; "
            f"{above[0]} x {above[1]} would add about {size(texture.estimated_bytes(*above))}"
        )


class TexturesStage(Stage[None]):
    """Encodes the images of the scene."""

    name = "textures"
    about = "Encode the model's images as progressive textures."
    recipe = 9
    changed = "what alpha hides has the colours of what is visible around"
    options = TextureOptions
    opens_inputs = True

    def read_with(self, options: TextureOptions) -> tuple[Stage[Any], ...]:
        return (SCENE, CELLS, PVS) if options.trim else (SCENE,)

    def sources(self, options: TextureOptions) -> tuple[Stage[Any], ...]:
        """Without ``--trim`` it reads the images only, which no stage changes."""
        return super().sources(options) if options.trim else (SCENE,)

    def inputs(self, artifacts: Artifacts, options: TextureOptions) -> dict[str, str]:
        """The name of each `.ptm` → the digest of its image, and of the number of
        its unresolved levels."""
        images = image_digests(artifacts)
        digests = [
            sha256(f"{digest} - {fewer}".encode()) if fewer else digest
            for digest, fewer in zip(
                images.values(), unresolved_level_counts(artifacts, options), strict=True
            )
        ]
        return dict(zip(texture_files(images), digests, strict=True))

    def changed_input(self, names: list[str]) -> str:
        """Its inputs are images."""
        return SCENE.name

    def tasks(self, artifacts: Artifacts, work: StageRecord) -> list[str]:
        """The textures to encode, those with lost files included."""
        before = artifacts.before(self)
        stale = set(stale_textures(before, work))
        files = _files_by_stem(before)

        def is_lost(name: str) -> bool:
            return artifacts.db.first_damage(files.get(stem_of(name), {})) is not None

        return [name for name in work.inputs if name in stale or is_lost(name)]

    def turn(self, run: Run, options: TextureOptions) -> TexturesTurn:
        return TexturesTurn(run, self, options)

    def summary(self, n: Counts) -> str:
        raw, stored = n["raw_bytes"], n["ptm_bytes"]
        share = f" ({stored / raw:.1%})" if raw else ""
        more = ""
        if previews := n.get("preview_bytes"):
            more = f"; previews {size(previews)}"
            if kept := n["kept_sources"]:
                more += f", of which {count(kept, 'lossy image')} of the model"
        if unresolved := n.get("unresolved"):
            more += f"; {size(n['unresolved_bytes'])} of {count(unresolved, 'texture')} omitted"
        return f"{count(n['textures'], 'texture')}, {size(raw)} → {size(stored)}{share}{more}"


TEXTURES = TexturesStage()
