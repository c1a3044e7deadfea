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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools.errors import naming
from ptmtools.pipeline.encoding import (
    ImageTask,
    TextureOptions,
    encoded_image,
    encoded_on_disk,
    shared_disk,
)
from ptmtools.pipeline.stage import Artifacts, Job, Run, Stage
from ptmtools.pipeline.stages.apo import APO
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.scene import SCENE, image_digests, image_rows, images_of
from ptmtools.quantities import count, size
from ptmtools.store.layout import IMAGES, SERVED, STAGES_FOLDER, sha256

if TYPE_CHECKING:
    from threading import Event

    from ptmtools.executor import Executor
    from ptmtools.parallel import BackgroundLoop
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction
    from ptmtools.texture.model import PtmHeader

FOLDER = "textures"
#: Largest number of images in one message to a worker; a message costs a few ms.
IMAGES_PER_MESSAGE = 4


def texture_files(images: Iterable[str]) -> list[str]:
    """The `.ptm` of each image, named by its stem, relative to the served folder."""
    return [f"{FOLDER}/{image.rpartition('.')[0]}.ptm" for image in images]


def detail_file(texture: str) -> str:
    """The file of the `Detail` of a `.ptm`, relative to the database."""
    return f"{STAGES_FOLDER}/{texture.removesuffix('ptm')}json"


def _inputs(artifacts: Artifacts, options: TextureOptions) -> dict[str, str]:
    """See `Stage.inputs`: the name of each `.ptm` → the digest of its image, and of the number of
    its unresolved levels."""
    images = image_digests(artifacts)
    digests = [
        sha256(f"{digest} - {fewer}".encode()) if fewer else digest
        for digest, fewer in zip(images.values(), unresolved(artifacts, options), strict=True)
    ]
    return dict(zip(texture_files(images), digests, strict=True))


def _coding(record: StageRecord) -> dict[str, Any]:
    """The parameters that change every texture; the effect of ``--trim`` is in the inputs."""
    return {n: value for n, value in record.parameters.items() if not n.startswith("trim")}


def stale_textures(before: StageRecord | None, work: StageRecord) -> list[str]:
    """The `.ptm`s, relative to the served folder, that would be encoded from another image or with
    other options than in the record."""
    if before is None or (before.recipe, _coding(before)) != (work.recipe, _coding(work)):
        return list(work.inputs)
    return [name for name in work.inputs if before.inputs.get(name) != work.inputs[name]]


def unresolved(artifacts: Artifacts, options: TextureOptions) -> list[int]:
    """The number of the finest levels of each image that ``--trim`` leaves out.

    Raises as `Artifacts`.
    """
    rows = image_rows(artifacts)
    if not options.trim:
        return [0] * len(rows)
    from ptmtools.coverage.required_levels import Screen, unresolved_levels

    screen = Screen(options.trim_height, options.trim_fov, options.trim_distance)

    def levels() -> list[int]:
        stages = artifacts[APO], artifacts[CELLS], artifacts[PVS]
        return [int(n) for n in unresolved_levels(*stages, _sizes(artifacts, options), screen)]

    return artifacts.cached(f"levels unresolved by {screen}", levels)


def _sizes(artifacts: Artifacts, options: TextureOptions) -> list[tuple[int, int]]:
    """(width, height) of the scene's images. In a dry run, an image that is not in the database yet
    counts as one texel: it will be encoded in any case."""
    from ptmtools.texture.images.opening import opened, pillow_faults
    from ptmtools.texture.model import Limits

    outputs = artifacts.record(SCENE).outputs
    sizes = []
    for image in images_of(artifacts):
        width = height = 1
        if f"{IMAGES}/{image.sha256}" in outputs:
            with naming(image.name), pillow_faults():
                file = io.BytesIO(image.load())
                width, height = opened(file, Limits(options.limit << 20)).size
        sizes.append((width, height))
    return sizes


def _left_out(header: PtmHeader, options: TextureOptions) -> list[tuple[int, int]]:
    """(width, height) of the levels that only ``--trim`` has left out, coarsest first."""
    from ptmtools.texture.encoder import kept_levels
    from ptmtools.texture.pyramid import level_sizes

    sizes = level_sizes(header.width, header.height)
    return sizes[len(sizes) - header.trimmed : kept_levels(*sizes[-1], options)[-1] + 1]


def _trimmed(
    names: Iterable[str], headers: Iterable[PtmHeader], options: TextureOptions
) -> tuple[dict[str, int], list[str]]:
    """The counts of ``--trim``: the textures with levels left out, and the decoded bytes by which
    their finest levels are smaller. And a note on each, with the bytes saved, estimated from the
    bytes for a texel of the finest level kept. Nothing without ``--trim``."""
    if not options.trim:
        return {}, []
    counts, notes = {"unresolved": 0, "unresolved_bytes": 0}, []
    for name, header in zip(names, headers, strict=True):
        if sizes := _left_out(header, options):
            (width, height), finest = sizes[-1], header.levels[-1]
            kept = finest.width * finest.height
            counts["unresolved"] += 1
            counts["unresolved_bytes"] += (width * height - kept) * header.texel_bytes
            saved = finest.length * sum(w * h for w, h in sizes) // kept
            notes.append(
                f"--trim leaves out {count(len(sizes), 'level')} of {name}: {finest.width} x "
                f"{finest.height} of {width} x {height}, about {size(saved)} less"
            )
    return counts, notes


class TexturesJob(Job):
    """Encodes the images of the scene, in the background where that pays."""

    @staticmethod
    def tasks(artifacts: Artifacts, work: StageRecord) -> list[str]:
        """The textures to encode, those with lost files included, see `Job.tasks`."""
        before = artifacts.before(TEXTURES)
        stale = set(stale_textures(before, work))
        outputs = before.outputs if before else {}

        def is_lost(name: str) -> bool:
            stem = Path(name).stem
            files = {file: digest for file, digest in outputs.items() if Path(file).stem == stem}
            return artifacts.db.damaged(files) is not None

        return [name for name in work.inputs if name in stale or is_lost(name)]

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
        """See `Job.begin`."""
        from ptmtools.parallel import BackgroundLoop

        self._prepare()
        executor = self.run.workers.background(self.left)
        if executor:
            free = self.run.workers.alone.free
            self._background = BackgroundLoop(self.encode, executor, free)

    def raise_failure(self) -> None:
        """See `Job.raise_failure`."""
        if self._background:
            self._background.check()

    def abandon(self) -> None:
        """See `Job.abandon`."""
        if self._background:
            self._background.abandon()

    def do(self) -> None:
        """Encodes the textures left, with all workers, and commits."""
        self._prepare()
        if self._background:
            self._background.finish()
            self._background = None
        if self.left:
            self.encode(self.run.workers.executor)
        if transaction := self._transaction:
            headers = list(self._headers(transaction))
            counts, notes = _trimmed(self._names, headers, self.options)
            notes = [*notes_on_size(self._names, headers, self.options.max_side), *notes]
            record = replace(self._work, counts={**counts_of(headers), **counts}, notes=notes)
            self.run.settle(self.stage, transaction, record)
        self.run.end(self.stage, self._why, self._seconds, self._tasks)

    def _prepare(self) -> None:
        """Once: keeps the textures of the last run, and takes over those of an interrupted one."""
        if self._prepared:
            return
        self._prepared = True
        self._work, self._why = self.planned()
        self._names = list(self._work.inputs)
        self._fewer = unresolved(self.run, self.options)
        self._tasks = (len(self._names), len(self._names), 0)
        if not self._why:
            return
        # Not `Run.begin`: another stage may be running.
        self._transaction = transaction = self.run.writer.begin(self.stage.name)
        kept, resumed = 0, 0
        before = self.run.before(self.stage)
        stale = set(stale_textures(before, self._work))
        outputs = before.outputs if before else {}
        for i, name in enumerate(self._names):
            files = {file: outputs.get(file, "") for file in self._files(name)}
            if name not in stale and transaction.keep(files):
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
        assert self._transaction
        start, transaction = time.perf_counter(), self._transaction
        total, images, fewer = len(self._names), images_of(self.run), self._fewer
        wanted = takewhile(lambda _: stop is None or not stop.is_set(), tuple(self._left))
        with shared_disk(transaction, self.run.db.path, self.options, executor) as disk:
            results: Iterator[Sequence[bytes | tuple[str, str]]]
            if disk is None:
                sources = ((images[i].name, images[i].load(), fewer[i]) for i in wanted)
                results = executor.each(encoded_image, self.options, sources, releases_lock=True)
            else:
                chunk = max(1, min(IMAGES_PER_MESSAGE, len(self._left) // (8 * executor.workers)))
                tasks = (
                    ImageTask(images[i].name, images[i].sha256, str(i), fewer[i]) for i in wanted
                )
                results = executor.each(
                    encoded_on_disk, disk, tasks, releases_lock=True, chunk=chunk
                )
            for result in results:
                files = self._files(self._names[self._left[0]])
                for name, output in zip(files, result, strict=True):
                    if isinstance(output, bytes):
                        transaction.put(name, output)
                    else:
                        transaction.take(name, Path(output[0]), output[1])
                self.run.progress(total - len(self._left), total, "textures")
                transaction.finish(self._task(self._left.popleft()), files)
        self.run.progress(total - len(self._left), total, "textures")
        self._seconds += time.perf_counter() - start

    def _files(self, name: str) -> list[str]:
        """The outputs of a texture, in the order of `encoded_image`."""
        fallback = [f"{SERVED}/{name.removesuffix('ptm')}png"] if self.options.fallback else []
        return [f"{SERVED}/{name}", detail_file(name), *fallback]

    def _task(self, i: int) -> str:
        """A digest of everything that the files of a texture depend on, their names included."""
        name = self._names[i]
        depends = [self._work.recipe, _coding(self._work), name, self._work.inputs[name]]
        return sha256(json.dumps(depends, sort_keys=True).encode())

    def _headers(self, transaction: Transaction) -> Iterator[PtmHeader]:
        """The headers of all textures, staged or committed."""
        for ptm, *_ in map(self._files, self._names):
            staged = transaction.folder / ptm
            yield header_of(staged if staged.is_file() else self.run.db.path / ptm)


def counts_of(headers: Iterable[PtmHeader]) -> dict[str, int]:
    """The counts of the stage."""
    counts = {"textures": 0, "raw_bytes": 0, "ptm_bytes": 0}
    for header in headers:
        finest = header.levels[-1]
        counts["textures"] += 1
        counts["raw_bytes"] += finest.width * finest.height * header.texel_bytes
        counts["ptm_bytes"] += header.file_size
    return counts


def notes_on_size(names: Iterable[str], headers: Iterable[PtmHeader], most: int) -> Iterator[str]:
    """The texture farthest below ``--max-side``, where no level has that size: levels halve."""
    from ptmtools.texture.encoder import level_above

    below = []
    for name, header in zip(names, headers, strict=True):
        finest, above = header.levels[-1], level_above(header)
        side = max(finest.width, finest.height)
        if above and side < most:
            below.append((side, name, finest, above))
    if below:
        _, name, finest, (width, height, more) = min(below, key=lambda each: each[:2])
        yield (
            f"--max-side {most} keeps less than that of {count(len(below), 'texture')}, because "
            f"sides halve from level to level: {name} has {finest.width} x {finest.height}; "
            f"{width} x {height} would add about {size(more)}"
        )


def header_of(file: Path) -> PtmHeader:
    """The header of a `.ptm`; raises as `read_header`."""
    from ptmtools.files import open_regular
    from ptmtools.texture.container import HEAD_MAX, read_header

    with open_regular(file) as stream, naming(file):
        return read_header(stream.read(HEAD_MAX))


def _summary(n: Mapping[str, Any]) -> str:
    raw, stored = n["raw_bytes"], n["ptm_bytes"]
    share = f" ({stored / raw:.1%})" if raw else ""
    trim = ""
    if unresolved := n.get("unresolved"):
        trim = f"; {size(n['unresolved_bytes'])} of {count(unresolved, 'texture')} omitted"
    return f"{count(n['textures'], 'texture')}, {size(raw)} → {size(stored)}{share}{trim}"


TEXTURES: Stage[None] = Stage(
    name="textures",
    about="Encode the model's images as progressive textures.",
    recipe=4,
    changed="the effect of each level and the mean colour of each texture are recorded",
    options=TextureOptions,
    reads=lambda options: (SCENE, APO, CELLS, PVS) if options.trim else (SCENE,),
    inputs=_inputs,
    summary=_summary,
    job=TexturesJob,
)
