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
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import accumulate, takewhile
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

from ptmtools.errors import DatabaseError, naming
from ptmtools.executors.model import Executor
from ptmtools.files import open_regular
from ptmtools.pipeline.changes import reasons
from ptmtools.pipeline.folder import sha256
from ptmtools.pipeline.manifest import StageRecord
from ptmtools.pipeline.options import TextureOptions
from ptmtools.pipeline.run import Run, work_of
from ptmtools.pipeline.stages import SERVED
from ptmtools.pipeline.transaction import Transaction

if TYPE_CHECKING:
    from ptmtools.database.model import TextureRecord
    from ptmtools.texture.model import PtmHeader

FOLDER = "textures"
#: Images that are named together at most: a message costs a few ms.
AT_A_DESK = 4
PNG_MAGIC = b"\x89PNG\r\n\x1a\n"


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
        name, count = wanted, 1
        while name.casefold() in taken:
            count += 1
            name = f"{wanted}_{count}"
        taken.add(name.casefold())
        found.append(name)
    return found


def texture_files(images: Iterable[str]) -> list[str]:
    """The `.ptm` of each image, by its name, relative to the served folder."""
    return [f"{FOLDER}/{name}.ptm" for name in texture_names(images)]


def texture_inputs(images: Mapping[str, str]) -> dict[str, str]:
    """The inputs of the stage, for name → SHA-256 of the images: under the name of each `.ptm` the
    digest of its image."""
    return dict(zip(texture_files(images), images.values(), strict=True))


def stale_textures(before: StageRecord | None, work: StageRecord) -> list[str]:
    """The `.ptm`s, relative to the served folder, that the record does not hold as they would be
    encoded."""
    if before is None or (before.recipe, before.parameters) != (work.recipe, work.parameters):
        return list(work.inputs)
    return [name for name in work.inputs if before.inputs.get(name) != work.inputs[name]]


class TextureStage:
    """One run of the stage, in steps, so that the long one may be done beside other stages."""

    def __init__(self, run: Run, options: TextureOptions) -> None:
        self._run = run
        self._options = options
        self._seconds = 0.0
        self._digests = run.image_digests
        self._names = texture_files(self._digests)
        self._before = run.db.manifest.stages.get("textures")
        self._work = work_of("textures", options, texture_inputs(self._digests))
        self._why = reasons(self._before, self._work, run.db)
        self._transaction: Transaction | None = None
        self._left: deque[int] = deque()
        self._tasks = (len(self._names), len(self._names), 0)

    @property
    def current(self) -> bool:
        """Whether there is nothing to do."""
        return not self._why

    @property
    def left(self) -> int:
        """How many textures are left to encode."""
        return len(self._left)

    def begin(self) -> None:
        """Keeps what the last run made, and takes over what an interrupted one left."""
        if self.current:
            return
        self._transaction = transaction = self._run.writer.begin("textures")
        kept, resumed = 0, 0
        stale = set(stale_textures(self._before, self._work))
        for i, name in enumerate(self._names):
            if name not in stale and self._keep(transaction, self._files(name)):
                kept += 1
            elif transaction.resume(self._task(i)):
                resumed += 1
            else:
                self._left.append(i)
        self._tasks = (len(self._names), kept, resumed)

    def encode(self, executor: Executor, stop: Event | None = None) -> None:
        """Encodes what is left, once begun; nothing is committed. With ``stop``, from another
        thread, no more images are taken.

        Raises what `encode` raises.
        """
        if self._transaction is None:
            return
        start = time.perf_counter()
        total = len(self._names)
        wanted = takewhile(lambda _: stop is None or not stop.is_set(), tuple(self._left))
        for files in self._staged(self._transaction, executor, wanted):
            self._run.progress(total - len(self._left), total, "textures")
            self._transaction.finish(self._task(self._left.popleft()), files)
        self._run.progress(total - len(self._left), total, "textures")
        self._seconds += time.perf_counter() - start

    def commit(self) -> None:
        """Makes what was encoded, all of it, part of the database."""
        if self._transaction is not None:
            outputs = self._transaction.pending()
            record = replace(self._work, outputs=outputs, counts=self._counted(self._transaction))
            self._transaction.commit({"textures": record})
        self._run.report("textures", self._why, 0.0, self._seconds, self._tasks)

    def _files(self, name: str) -> list[str]:
        """The outputs of a texture, its `.ptm` first."""
        suffixes = ("ptm", "png")[: 1 + self._options.fallback]
        return [f"{SERVED}/{name.removesuffix('ptm')}{suffix}" for suffix in suffixes]

    def _keep(self, transaction: Transaction, files: list[str]) -> bool:
        outputs = self._before.outputs if self._before else {}
        return all(name in outputs for name in files) and transaction.keep(
            {name: outputs[name] for name in files}
        )

    def _task(self, i: int) -> str:
        """A digest of all that the files of a texture depend on, their names included."""
        name = self._names[i]
        told = [self._work.recipe, self._work.parameters, name, self._work.inputs[name]]
        return sha256(json.dumps(told, sort_keys=True).encode())

    def _staged(
        self, transaction: Transaction, executor: Executor, wanted: Iterator[int]
    ) -> Iterator[list[str]]:
        """The names of the files of each image, once they are staged; in order, so it is always the
        first of what is left."""
        from ptmtools.pipeline.desk import Picture, desk_of, encoded_there

        images = self._run.images
        with desk_of(transaction, self._run.db.path, self._options, executor) as desk:
            if desk is None:
                sources = ((images[i].name, images[i].load()) for i in wanted)
                for made in executor.each(
                    encoded_image, self._options, sources, releases_lock=True
                ):
                    files = self._files(self._names[self._left[0]])
                    for name, data in zip(files, made, strict=True):
                        transaction.put(name, data)
                    yield files
                return
            chunk = max(1, min(AT_A_DESK, len(self._left) // (8 * executor.workers)))
            pictures = (Picture(images[i].name, images[i].sha256, str(i)) for i in wanted)
            for left in executor.each(
                encoded_there, desk, pictures, releases_lock=True, chunk=chunk
            ):
                files = self._files(self._names[self._left[0]])
                for name, (file, digest) in zip(files, left, strict=True):
                    transaction.take(name, Path(file), digest)
                yield files

    def _counted(self, transaction: Transaction) -> dict[str, int]:
        raw = stored = 0
        for ptm, *_ in map(self._files, self._names):
            place = transaction.folder / ptm
            header = _header(place if place.is_file() else self._run.db.path / ptm)
            finest = header.levels[-1]
            raw += finest.width * finest.height * header.texel_bytes
            stored += header.file_size
        return {"textures": len(self._names), "raw_bytes": raw, "ptm_bytes": stored}


def encoded_image(options: TextureOptions, image: tuple[str, bytes]) -> list[bytes]:
    """An image, (name, bytes of its file), as the bytes of a `.ptm` and, if there is to be one, of
    its PNG twin.

    Raises what `encode` and `read_image` raise.
    """
    from ptmtools.texture import Limits, decode, encode, read_header, read_image
    from ptmtools.texture.images import png_bytes

    name, source = image
    with naming(name):
        texels = read_image(source, Limits(options.limit << 20))
        data = encode(texels, options)
    if not options.fallback:
        return [data]
    header = read_header(data)
    level = fallback_level(header, options.fallback_size)
    if level < len(header.levels) - 1 or options.max_error or header.trimmed:
        # Decoding takes more than the image, which is within the limit.
        twin = png_bytes(decode(data, level=level, limits=Limits(64 * texels.nbytes + (1 << 20))))
    elif source.startswith(PNG_MAGIC):
        twin = bare_png(source)
    else:
        twin = png_bytes(texels)
    return [data, twin]


def fallback_level(header: PtmHeader, size: int) -> int:
    """The level that a PNG twin of this size holds, see `TextureOptions`."""
    sides = [max(level.width, level.height) for level in header.levels]
    fitting = [n for n, side in enumerate(sides) if side <= size or not size]
    return fitting[-1] if fitting else 0


def bare_png(data: bytes) -> bytes:
    """An intact PNG reduced to what makes its texels: no gamma, colour profile, text or date.

    Deflating a megatexel again takes half a second, three times as long as encoding it, and gives
    other bytes with another zlib.
    """
    kept, at = [data[: len(PNG_MAGIC)]], len(PNG_MAGIC)
    while at < len(data):
        end = at + 12 + int.from_bytes(data[at : at + 4], "big")
        kind = data[at + 4 : at + 8]
        if kind in (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"):
            kept.append(data[at:end])
        if kind == b"IEND":
            break
        at = end
    return b"".join(kept)


def texture_records(run: Run) -> tuple[TextureRecord, ...]:
    """What the emitted files say of the textures of a database."""
    from ptmtools.database import TextureLevel, TextureRecord

    record = run.db.record("textures")
    size = record.parameters.get("fallback_size")
    if type(size) is not int:
        raise DatabaseError(
            "PTM-D002",
            "damaged manifest: stage textures has no fallback_size",
            file=run.db.path,
            remedy="run `ptm textures DB` again",
        )
    records = []
    for i, name in enumerate(texture_files(image.name for image in run.images)):
        twin = f"{name.removesuffix('ptm')}png"
        has_twin = f"{SERVED}/{twin}" in record.outputs
        header = _header(run.db.path / SERVED / name)
        texels = accumulate(level.width * level.height for level in header.levels)
        levels = tuple(
            TextureLevel(
                width=level.width,
                height=level.height,
                offset=level.offset,
                length=level.length,
                gpu_bytes=count * header.texel_bytes,
            )
            for level, count in zip(header.levels, texels, strict=True)
        )
        records.append(
            TextureRecord(
                image=i,
                file=name,
                fallback=twin if has_twin else None,
                width=levels[-1].width,
                height=levels[-1].height,
                components=header.components,
                levels=levels,
                sha256=run.db.output("textures", f"{SERVED}/{name}"),
                fallback_level=fallback_level(header, size) if has_twin else None,
            )
        )
    return tuple(records)


def _header(file: Path) -> PtmHeader:
    from ptmtools.texture.container import HEAD_MAX, read_header

    with open_regular(file) as stream, naming(file):
        return read_header(stream.read(HEAD_MAX))
