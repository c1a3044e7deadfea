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
import re
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

    from ptmtools.parallel import BackgroundLoop, Executor
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction
    from ptmtools.texture.model import PtmHeader

FOLDER = "textures"
#: Images that are named together at most: a message costs a few ms.
AT_ONCE = 4


def texture_names(images: Iterable[str]) -> list[str]:
    """The name of each texture without suffix, unique without regard to case: the image's stem,
    and with its suffix where two images share a stem."""
    names = [image.rpartition(".") for image in images]
    stems = [stem or suffix for stem, _, suffix in names]
    often: dict[str, int] = {}
    for stem in stems:
        often[stem.casefold()] = often.get(stem.casefold(), 0) + 1
    taken: set[str] = set()
    found = []
    for (_, _, suffix), stem in zip(names, stems, strict=True):
        shared = often[stem.casefold()] > 1
        wanted = f"{stem}_{re.sub('[^A-Za-z0-9]', '', suffix)}" if shared else stem
        name, number = wanted, 1
        while name.casefold() in taken:
            number += 1
            name = f"{wanted}_{number}"
        taken.add(name.casefold())
        found.append(name)
    return found


def texture_files(images: Iterable[str]) -> list[str]:
    """The `.ptm` of each image, by its name, relative to the served folder."""
    return [f"{FOLDER}/{name}.ptm" for name in texture_names(images)]


def detail_file(texture: str) -> str:
    """Where the `Detail` of a `.ptm` is kept, relative to the database."""
    return f"{STAGES_FOLDER}/{texture.removesuffix('ptm')}json"


def _inputs(artifacts: Artifacts, options: TextureOptions) -> dict[str, str]:
    """See `Stage.inputs`: under the name of each `.ptm` the digest of its image; where levels of it
    are left out that no eye resolves, one of that and their number."""
    images = image_digests(artifacts)
    digests = [
        sha256(f"{digest} - {fewer}".encode()) if fewer else digest
        for digest, fewer in zip(images.values(), unresolved(artifacts, options), strict=True)
    ]
    return dict(zip(texture_files(images), digests, strict=True))


def _coding(record: StageRecord) -> dict[str, Any]:
    """The parameters that count for every texture; what ``--trim`` does to one is in its input."""
    return {n: value for n, value in record.parameters.items() if not n.startswith("trim")}


def stale_textures(before: StageRecord | None, work: StageRecord) -> list[str]:
    """The `.ptm`s, relative to the served folder, that the record does not hold as they would be
    encoded."""
    if before is None or (before.recipe, _coding(before)) != (work.recipe, _coding(work)):
        return list(work.inputs)
    return [name for name in work.inputs if before.inputs.get(name) != work.inputs[name]]


def unresolved(artifacts: Artifacts, options: TextureOptions) -> list[int]:
    """Of each image of the scene how many of its finest levels are left out for that.

    Raises what reading the artifacts of the scene, the cells and the sets raises.
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
    """(width, height) of the scene's images. One that is not in the database yet, of a dry run,
    counts as a texel: it is encoded anew in any case."""
    from ptmtools.texture.images.opening import opened, pillow_faults
    from ptmtools.texture.model import Limits

    there = artifacts.record(SCENE).outputs
    found = []
    for image in images_of(artifacts):
        width = height = 1
        if f"{IMAGES}/{image.sha256}" in there:
            with naming(image.name), pillow_faults():
                file = io.BytesIO(image.load())
                width, height = opened(file, Limits(options.limit << 20)).size
        found.append((width, height))
    return found


def _left_out(header: PtmHeader, options: TextureOptions) -> list[tuple[int, int]]:
    """(width, height) of the levels that only ``--trim`` has left out, coarsest first."""
    from ptmtools.texture.encoder import kept_levels
    from ptmtools.texture.pyramid import level_sizes

    sizes = level_sizes(header.width, header.height)
    return sizes[len(sizes) - header.trimmed : kept_levels(*sizes[-1], options)[-1] + 1]


def unresolved_counts(headers: Iterable[PtmHeader], options: TextureOptions) -> dict[str, int]:
    """The figures of ``--trim``, none without: of how many textures levels were left out, and how
    many bytes less their finest levels have, decoded."""
    if not options.trim:
        return {}
    found = {"unresolved": 0, "unresolved_bytes": 0}
    for header in headers:
        if sizes := _left_out(header, options):
            (width, height), finest = sizes[-1], header.levels[-1]
            found["unresolved"] += 1
            texels = width * height - finest.width * finest.height
            found["unresolved_bytes"] += texels * header.texel_bytes
    return found


def notes_on_trim(
    names: Iterable[str], headers: Sequence[PtmHeader], options: TextureOptions
) -> Iterator[str]:
    """Which textures have less levels for it, and what about that saves: as many bytes for a texel
    as the finest level that is kept."""
    for name, header in zip(names, headers, strict=True):
        sizes = _left_out(header, options) if options.trim else []
        if sizes:
            (width, height), finest = sizes[-1], header.levels[-1]
            texels = sum(w * h for w, h in sizes)
            saved = finest.length * texels // (finest.width * finest.height)
            yield (
                f"--trim leaves out {count(len(sizes), 'level')} of {name}: {finest.width} x "
                f"{finest.height} of {width} x {height}, about {size(saved)} less"
            )


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
        """How many textures are left to encode."""
        return len(self._left)

    def begin(self) -> None:
        """See `Job.begin`."""
        from ptmtools.parallel import BackgroundLoop

        self._prepare()
        executor = self.run.workers.background(self.left)
        if executor:
            free = self.run.workers.alone.free
            self._background = BackgroundLoop(self.encode, executor, free)

    def check(self) -> None:
        """See `Job.check`."""
        if self._background:
            self._background.check()

    def abandon(self) -> None:
        """See `Job.abandon`."""
        if self._background:
            self._background.abandon()

    def do(self) -> None:
        """Encodes what is left, with all workers, and commits."""
        self._prepare()
        if self._background:
            self._background.finish()
            self._background = None
        if self.left:
            self.encode(self.run.workers.executor)
        if transaction := self._transaction:
            headers = list(self._headers(transaction))
            record = replace(
                self._work,
                counts={**counts_of(headers), **unresolved_counts(headers, self.options)},
                notes=(
                    *notes_on_size(self._names, headers, self.options.max_side),
                    *notes_on_trim(self._names, headers, self.options),
                ),
            )
            self.run.settle(self.stage, transaction, record)
        self.run.end(self.stage, self._why, self._seconds, self._tasks)

    def _prepare(self) -> None:
        """Once: keeps what the last run made, and takes over what an interrupted one left."""
        if self._prepared:
            return
        self._prepared = True
        self._work, self._why = self.planned()
        self._names = list(self._work.inputs)
        self._fewer = unresolved(self.run, self.options)
        self._tasks = (len(self._names), len(self._names), 0)
        if not self._why:
            return
        # Not `Run.begin`: another stage may be under way.
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
        """Encodes what is left; nothing is committed. No more images are taken once another thread
        sets ``stop``.

        Raises what `encode` raises.
        """
        assert self._transaction
        start = time.perf_counter()
        total = len(self._names)
        wanted = takewhile(lambda _: stop is None or not stop.is_set(), tuple(self._left))
        for files in self._staged(self._transaction, executor, wanted):
            self.run.progress(total - len(self._left), total, "textures")
            self._transaction.finish(self._task(self._left.popleft()), files)
        self.run.progress(total - len(self._left), total, "textures")
        self._seconds += time.perf_counter() - start

    def _files(self, name: str) -> list[str]:
        """The outputs of a texture, in the order of `encoded_image`."""
        fallback = [f"{SERVED}/{name.removesuffix('ptm')}png"] if self.options.fallback else []
        return [f"{SERVED}/{name}", detail_file(name), *fallback]

    def _task(self, i: int) -> str:
        """A digest of all that the files of a texture depend on, their names included."""
        name = self._names[i]
        depends = [self._work.recipe, _coding(self._work), name, self._work.inputs[name]]
        return sha256(json.dumps(depends, sort_keys=True).encode())

    def _staged(
        self, transaction: Transaction, executor: Executor, wanted: Iterator[int]
    ) -> Iterator[list[str]]:
        """The names of the files of each image, once they are staged; in order, so it is always the
        first of what is left."""
        images, fewer = images_of(self.run), self._fewer
        with shared_disk(transaction, self.run.db.path, self.options, executor) as disk:
            if disk is None:
                sources = ((images[i].name, images[i].load(), fewer[i]) for i in wanted)
                for made in executor.each(encoded_image, self.options, sources, releases_lock=True):
                    files = self._files(self._names[self._left[0]])
                    for name, data in zip(files, made, strict=True):
                        transaction.put(name, data)
                    yield files
                return
            chunk = max(1, min(AT_ONCE, len(self._left) // (8 * executor.workers)))
            tasks = (ImageTask(images[i].name, images[i].sha256, str(i), fewer[i]) for i in wanted)
            for left in executor.each(
                encoded_on_disk, disk, tasks, releases_lock=True, chunk=chunk
            ):
                files = self._files(self._names[self._left[0]])
                for name, (file, digest) in zip(files, left, strict=True):
                    transaction.take(name, Path(file), digest)
                yield files

    def _headers(self, transaction: Transaction) -> Iterator[PtmHeader]:
        """Of all textures, wherever they are."""
        for ptm, *_ in map(self._files, self._names):
            place = transaction.folder / ptm
            yield header_of(place if place.is_file() else self.run.db.path / ptm)


def counts_of(headers: Iterable[PtmHeader]) -> dict[str, int]:
    """The figures of the stage."""
    found = {"textures": 0, "raw_bytes": 0, "ptm_bytes": 0}
    for header in headers:
        finest = header.levels[-1]
        found["textures"] += 1
        found["raw_bytes"] += finest.width * finest.height * header.texel_bytes
        found["ptm_bytes"] += header.file_size
    return found


def notes_on_size(names: Iterable[str], headers: Iterable[PtmHeader], most: int) -> Iterator[str]:
    """What ``--max-side`` has chosen where no level is of that size, as levels halve: the texture
    that is farthest below it."""
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
    """The header of a `.ptm` of ours; raises what `read_header` raises."""
    from ptmtools.files import open_regular
    from ptmtools.texture.container import HEAD_MAX, read_header

    with open_regular(file) as stream, naming(file):
        return read_header(stream.read(HEAD_MAX))


def _summary(n: Mapping[str, Any]) -> str:
    raw, stored = n["raw_bytes"], n["ptm_bytes"]
    share = f" ({stored / raw:.1%})" if raw else ""
    trim = ""
    if unresolved := n.get("unresolved"):
        trim = f"; of {count(unresolved, 'texture')} {size(n['unresolved_bytes'])} left out"
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
