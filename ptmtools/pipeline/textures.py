"""The stage `textures`: the images of a scene become progressive textures, one task each.

A texture of whose image and options the last run made its files keeps them, and one that an
interrupted run has finished is taken over. The others are encoded by the executor, in threads where
it is this machine's: the compiled kernels and zlib let go of the interpreter. Each is written as
soon as it is there, so what waits is a few images for each worker.
"""

from __future__ import annotations

import json
import re
import time
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

from ptmtools.errors import naming
from ptmtools.files import open_regular
from ptmtools.parallel import BackgroundLoop, Executor
from ptmtools.pipeline.encoding import ImageTask, encoded_image, encoded_there, shared_disk
from ptmtools.pipeline.options import TextureOptions
from ptmtools.pipeline.reading import image_digests, images_of
from ptmtools.pipeline.run import Artifacts, Job, Run
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages.textures import TEXTURES
from ptmtools.pipeline.trimming import notes_on_trim, unresolved, unresolved_counts
from ptmtools.quantities import count, size
from ptmtools.store.layout import SERVED, STAGES_FOLDER, sha256
from ptmtools.store.manifest import StageRecord
from ptmtools.store.transaction import Transaction

if TYPE_CHECKING:
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


def inputs_of(artifacts: Artifacts, options: TextureOptions) -> dict[str, str]:
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


def waiting_textures(artifacts: Artifacts, work: StageRecord) -> list[str]:
    """See `Stage.tasks`: also those whose files are lost."""
    before = artifacts.before(TEXTURES)
    stale = set(stale_textures(before, work))
    outputs = before.outputs if before else {}
    lost = {
        name
        for name in work.inputs.keys() - stale
        if artifacts.db.damaged(
            {file: digest for file, digest in outputs.items() if Path(file).stem == Path(name).stem}
        )
    }
    return [name for name in work.inputs if name in stale | lost]


class TexturesJob(Job):
    """Encodes the images of the scene, in the background as far as that is worth it."""

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
        self.run.commit(self.stage)
        self.run.report(self.stage, self._why, self._seconds, self._tasks)

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
            for left in executor.each(encoded_there, disk, tasks, releases_lock=True, chunk=chunk):
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
            f"--max-side {most} leaves {count(len(below), 'texture')} smaller still, since each "
            f"level is half the next: {name} has {finest.width} x {finest.height}; "
            f"{width} x {height} would add about {size(more)}"
        )


def header_of(file: Path) -> PtmHeader:
    """The header of a `.ptm` of ours; raises what `read_header` raises."""
    from ptmtools.texture.container import HEAD_MAX, read_header

    with open_regular(file) as stream, naming(file):
        return read_header(stream.read(HEAD_MAX))
