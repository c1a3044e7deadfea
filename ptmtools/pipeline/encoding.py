"""Encodes one image as a task: a `.ptm`, its previews, the `Steps` of both, a fallback image.

`encode_texture` reads an image from a place, and leaves the files of its texture there. In
`Messages` the bytes travel with the task and its result. A `SharedDisk` is for processes, of this
machine or others, that see the disk of the database: only names and digests travel. (Sending the
bytes of images and textures limits the building process to eight workers, docs/design/scaling.md.)
A worker writes to a folder with a new name in every run, so one that an interrupted run has left
behind writes nowhere. A `SharedUrl` is for machines without a shared disk: they read and write
objects at the URL of the database.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from ptmtools.errors import WorkerError, naming
from ptmtools.options import option, require
from ptmtools.store.layout import IMAGES, SERVED, STAGES_FOLDER, STAGING, sha256
from ptmtools.texture.model import EncodeOptions
from ptmtools.texture.previews import FORMATS, LOSSLESS, Preview, PreviewOptions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ptmtools.executor import Executor
    from ptmtools.pipeline.artifacts import Run
    from ptmtools.scene.model import SourceImage
    from ptmtools.store.objects import Objects
    from ptmtools.store.remote import RemoteDatabase
    from ptmtools.store.transaction import Transaction
    from ptmtools.texture.images import Picture
    from ptmtools.texture.model import PtmHeader
    from ptmtools.texture.previews import Steps

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
#: Objects that are sent, and textures that are fetched, at a time.
OBJECTS_AHEAD = 8
#: Folders of the served files: `.ptm`s with fallback images and lossy sources; other previews.
FOLDER, PREVIEWS = "textures", "previews"


def ptm_file(stem: str) -> str:
    """The `.ptm` of the image with that stem, relative to the served folder."""
    return f"{FOLDER}/{stem}.ptm"


def steps_file(stem: str) -> str:
    """The `Steps` of a texture, relative to the database."""
    return f"{STAGES_FOLDER}/{FOLDER}/{stem}.json"


def preview_file(stem: str, preview: Preview) -> str:
    """A preview, relative to the served folder. Stems have no dots; the longer sides of levels
    differ."""
    suffix = FORMATS[preview.format].suffix
    if preview.exact:
        return f"{FOLDER}/{stem}{suffix}"
    return f"{PREVIEWS}/{stem}-{max(preview.width, preview.height)}{suffix}"


def stem_of(file: str) -> str:
    """The stem of the image that an output of the stage belongs to."""
    stem = Path(file).stem
    return stem.rpartition("-")[0] if f"/{PREVIEWS}/" in file else stem


@dataclass(frozen=True)
class TextureOptions(PreviewOptions, EncodeOptions):
    """Options of the textures stage."""

    heading: ClassVar[str] = "Textures"

    fallback: bool = option(
        True, "Also write a PNG of each texture, for clients that cannot read .ptm."
    )
    fallback_size: int = option(
        0,
        "Maximum width and height of the PNGs; each holds the finest level that fits. 0 sets no "
        "limit.",
        metavar="TEXELS",
    )
    trim: bool = option(
        False,
        "Omit levels finer than a screen of --trim-height can show from any place where a visitor "
        "can stand. On larger screens and with flying cameras, textures then look blurred.",
        basic=True,
    )
    trim_height: int = option(
        1080, "Height of the 16:9 screen that --trim assumes.", metavar="PIXELS"
    )
    trim_fov: float = option(60.0, "Vertical field of view that --trim assumes.", metavar="DEGREES")
    trim_distance: float = option(
        0.25,
        "Minimum distance between the eye and a surface that --trim assumes.",
        metavar="METRES",
    )
    limit: int = option(1024, "Maximum decoded size of an image.", metavar="MIB", compare=False)

    def __post_init__(self) -> None:
        """Raises InputError PTM-I111 for values out of range."""
        EncodeOptions.__post_init__(self)
        PreviewOptions.__post_init__(self)
        for name, limit in (("height", math.inf), ("fov", 180), ("distance", math.inf)):
            value = getattr(self, f"trim_{name}")
            remedy = "use a number above 0, and for an angle below 180"
            require((0 < value < limit, f"trim_{name} is {value:g}", remedy))


def encode_texels(
    options: TextureOptions, stem: str, texels: NDArray[Any]
) -> list[tuple[str, bytes]]:
    """The files of (h, w, c) texels that are no image of the model, as `encode_image`; no file of
    theirs would be smaller than their levels."""
    from ptmtools.texture.images import png_bytes

    if options.exact == "lossless-sources":
        options = replace(options, exact="always")
    return encode_image(options, f"{stem}.png", png_bytes(texels))


def bake_textures(
    run: Run,
    transaction: Transaction,
    bake: Callable[[S, T], tuple[R, list[tuple[str, bytes]]]],
    shared: S,
    tasks: Sequence[T],
    unit: str,
) -> tuple[list[R], int]:
    """Bakes textures, a task each: ``bake`` returns a result, and the files of a texture as
    `encode_image`, or none. Puts these into the transaction; returns the results, and the bytes
    of all `.ptm`s."""
    results: list[R] = []
    total = 0
    for result, files in run.workers.executor.each(bake, shared, tasks):
        run.progress(len(results), len(tasks), unit)
        results.append(result)
        for name, data in files:
            transaction.put(name, data)
        total += len(files[0][1]) if files else 0
    run.progress(len(tasks), len(tasks), unit)
    return results, total


def encode_image(
    options: TextureOptions, name: str, data: bytes, unresolved: int = 0
) -> list[tuple[str, bytes]]:
    """The files of a texture, named relative to the database: first its `.ptm` and its `Steps` as
    JSON, then its previews and, if the options ask for one, its fallback image. ``unresolved`` of
    the finest levels are left out.

    Raises as `encode_steps` and `load_image`.
    """
    from ptmtools.texture import load_image, read_header
    from ptmtools.texture.images.files import check_depth
    from ptmtools.texture.images.opening import LOSSY
    from ptmtools.texture.model import Description, Limits
    from ptmtools.texture.samples import spread_colors
    from ptmtools.texture.steps import encode_steps

    with naming(name):
        picture = load_image(data, Limits(options.limit << 20))
        check_depth(picture)
        picture = replace(picture, description=Description())
        texels = picture.array()
        visible = spread_colors(texels)
        kept = visible is texels
        if not kept:
            # The file has other colours, so that it cannot be the finest level.
            lossy = picture.lossy and picture.lossy._replace(format=LOSSY)
            picture = replace(picture, texels=visible, lossy=lossy)
        height, width = texels.shape[:2]
        levels = without_finest(options, unresolved, width, height)
        encoded = encode_steps(picture, data, levels, options)
    stem = name.rpartition(".")[0]
    files = [
        (f"{SERVED}/{ptm_file(stem)}", encoded.ptm),
        (steps_file(stem), steps_text(encoded.steps)),
    ]
    files += [
        (f"{SERVED}/{preview_file(stem, preview)}", preview_bytes)
        for preview, preview_bytes in zip(encoded.steps.previews, encoded.previews, strict=True)
    ]
    header = read_header(encoded.ptm)
    level, shared = fallback_image(encoded.steps, header, options.fallback_size)
    if options.fallback and shared is None:
        png = _png(options, data if kept else b"", picture, encoded.ptm, level)
        files.append((f"{SERVED}/{FOLDER}/{stem}.png", png))
    return files


def _png(
    options: TextureOptions, source: bytes, picture: Picture, data: bytes, level: int
) -> bytes:
    """The fallback image, of a level that may be finer than those of the `.ptm` in ``data``;
    ``source``: the file that has the texels."""
    from ptmtools.texture import decode, read_header
    from ptmtools.texture.images import png_bytes
    from ptmtools.texture.images.bare import bare
    from ptmtools.texture.model import Limits

    header, texels = read_header(data), picture.array()
    finest = len(header.levels) - 1
    if level < finest or (level == finest and (options.max_error or header.trimmed)):
        # Decoding takes more than the image, which is within the limit.
        return png_bytes(decode(data, level=level, limits=Limits(64 * texels.nbytes + (1 << 20))))
    return bare(source, "PNG") if source.startswith(PNG_MAGIC) else png_bytes(texels)


@dataclass(frozen=True)
class TextureTask:
    """An image of the database to encode.

    Attributes
    ----------
    name: as in the list of the scene's images, "wood.png". sha256: of its bytes.
    unresolved: number of its finest levels to leave out.
    data: its bytes, if they travel.
    stem: of its result files on a disk.
    file: relative to the model's folder, for an image that is no object of the database yet.
    """

    name: str
    sha256: str
    unresolved: int = 0
    data: bytes = b""
    stem: str = ""
    file: str = ""


@dataclass(frozen=True)
class OutputFile:
    """A file of a texture, named relative to the database ("" for its image): SHA-256, number of
    bytes; and these, if they travel, its path if it is on a disk, or neither if it is an object."""

    name: str
    sha256: str
    size: int
    data: bytes | None = None
    path: str = ""


@dataclass(frozen=True)
class EncodedTexture:
    """The files of a texture, the head of its `.ptm`, `HEAD_MAX` bytes or all, and the file of its
    `Steps`, which later stages need."""

    files: list[OutputFile]
    head: bytes
    steps: bytes


def encode_texture(place: Messages, task: TextureTask) -> EncodedTexture:
    """Raises as `encode_image` and the place."""
    from ptmtools.texture.container import HEAD_MAX

    image = place.read(task)
    outputs = encode_image(place.options, task.name, image, task.unresolved)
    (_, ptm), (_, steps) = outputs[:2]
    if task.file:
        outputs.append(("", image))
    files = [place.write(task, number, *output) for number, output in enumerate(outputs)]
    return EncodedTexture(files, ptm[:HEAD_MAX], steps)


@dataclass(frozen=True)
class Messages:
    """The place of images and textures that travel with the tasks and their results.

    Attributes
    ----------
    options: of all tasks.
    """

    options: TextureOptions
    #: Largest number of images in one message to a worker; a message costs a few ms.
    most_images: ClassVar[int] = 1
    #: Images that are sent at a time.
    ahead: ClassVar[int] = 1

    def send(self, run: Run, image: SourceImage, number: int, unresolved: int) -> TextureTask:
        """The task of an image, of which workers find the bytes."""
        return TextureTask(image.name, image.sha256, unresolved, image.load())

    def read(self, task: TextureTask) -> bytes:
        """The bytes of an image, in the worker."""
        return task.data

    def write(self, task: TextureTask, number: int, name: str, data: bytes) -> OutputFile:
        """A file of its texture, by the worker."""
        return OutputFile(name, sha256(data), len(data), data)


@dataclass(frozen=True)
class SharedDisk(Messages):
    """The disk of a database: the absolute paths of it and of the folder for results."""

    database: str
    out: str
    most_images: ClassVar[int] = 4

    def send(self, run: Run, image: SourceImage, number: int, unresolved: int) -> TextureTask:
        run.db.bring(f"{IMAGES}/{image.sha256}", image.sha256)
        return TextureTask(image.name, image.sha256, unresolved, stem=str(number))

    def read(self, task: TextureTask) -> bytes:
        """From `IMAGES` or, until the scene is committed, the staging folder. Raises WorkerError
        PTM-W005 where the disk cannot be seen."""
        for folder in ("", f"{STAGING}/scene", ""):
            with suppress(OSError):
                data = Path(self.database, folder, IMAGES, task.sha256).read_bytes()
                if sha256(data) == task.sha256:
                    return data
        raise _half_seen(self)

    def write(self, task: TextureTask, number: int, name: str, data: bytes) -> OutputFile:
        from ptmtools.files import write_bytes

        file = Path(self.out, f"{task.stem}-{number}")
        write_bytes(file, data, force=True)
        return OutputFile(name, sha256(data), len(data), path=str(file))


@dataclass(frozen=True)
class SharedUrl(Messages):
    """The URLs of a database and of the model's folder, if it has one."""

    url: str
    model: str = ""
    most_images: ClassVar[int] = 4
    ahead: ClassVar[int] = OBJECTS_AHEAD

    @cached_property
    def database(self) -> RemoteDatabase:
        """The database, of which a worker uses the objects alone."""
        from ptmtools.store.remote import RemoteDatabase

        return RemoteDatabase(self.url)

    @cached_property
    def files(self) -> Objects:
        """The files of the model."""
        from ptmtools.store.objects import Objects

        return Objects(self.model, reading=True)

    def __getstate__(self) -> dict[str, object]:
        return {"options": self.options, "url": self.url, "model": self.model}

    def send(self, run: Run, image: SourceImage, number: int, unresolved: int) -> TextureTask:
        assert run.remote
        file = ""
        if self.model and image.files and run.remote.size(image.sha256) is None:
            file = image.files[0]
        if not file:
            run.remote.provide(image.sha256, image.load)
        return TextureTask(image.name, image.sha256, unresolved, file=file)

    def read(self, task: TextureTask) -> bytes:
        """Its object or, if there is none, the model's file. Raises as `RemoteDatabase`; InputError
        PTM-I122 if that file has changed."""
        if not task.file:
            return self.database.read(task.sha256)
        data = self.files.read(task.file)
        if sha256(data) != task.sha256:
            raise self.files.failure("has changed since the model was read", task.file)
        return data

    def write(self, task: TextureTask, number: int, name: str, data: bytes) -> OutputFile:
        digest = sha256(data)
        self.database.write(digest, data)
        return OutputFile(name, digest, len(data))


@contextmanager
def shared_disk(
    transaction: Transaction, database: Path, options: TextureOptions, executor: Executor
) -> Iterator[Messages]:
    """The disk, if all workers are other processes that see it, otherwise messages.

    Raises WorkerError PTM-W005 if only some workers see it.
    """
    import secrets
    import shutil

    if not executor.remote:
        yield Messages(options)
        return
    out = transaction.subfolder(f"out-{secrets.token_hex(8)}")
    disk = SharedDisk(options, str(database.resolve()), str(out.resolve()))
    try:
        seen = list(executor.each(_sees, disk, range(4 * executor.workers), releases_lock=True))
        if any(seen) and not all(seen):
            raise _half_seen(disk)
        yield disk if all(seen) else Messages(options)
    finally:
        shutil.rmtree(out, ignore_errors=True)


def _sees(disk: SharedDisk, _: int) -> bool:
    return Path(disk.out).is_dir()


def _half_seen(disk: SharedDisk) -> WorkerError:
    return WorkerError(
        "PTM-W005",
        "some workers see the disk of the database and others do not",
        file=disk.database,
        remedy="mount it in the same place on all machines, or put it where only this one sees it",
    )


def steps_text(steps: Steps) -> bytes:
    """The `Steps` of a texture as JSON."""
    fields = asdict(steps)
    return json.dumps(fields.pop("detail") | fields).encode() + b"\n"


def read_steps(data: bytes) -> Steps:
    """Inverse of `steps_text`; raises ValueError, LookupError or TypeError if it is damaged."""
    from ptmtools.texture.detail import Detail
    from ptmtools.texture.previews import Steps

    fields = json.loads(data)
    red, green, blue = map(int, fields["color"])
    offsets = tuple(map(int, fields["offsets"]))
    detail = Detail(tuple(map(float, fields["differences"])), (red, green, blue), offsets)
    errors = tuple(map(float, fields["errors"]))
    previews = tuple(Preview(**row) for row in fields["previews"])
    if any(preview.format not in FORMATS for preview in previews):
        raise ValueError("a preview of another format")
    return Steps(detail, errors, int(fields["exact_levels"]), previews)


def fallback_image(steps: Steps, header: PtmHeader, size: int) -> tuple[int, Preview | None]:
    """The level of the fallback image, and the preview that serves as one; None for a PNG.

    The level is the finest that does not exceed ``size`` (0: none does): one of the `.ptm`, or the
    finest of all where that is an image. A lossy preview of that level serves; a lossless one does
    not: other images are PNG, which all VRML browsers read.
    """
    if steps.finest_is_image:
        finest = steps.previews[-1]
        if not size or max(finest.width, finest.height) <= size:
            return finest.level, None if finest.format == LOSSLESS else finest
    sides = [max(level.width, level.height) for level in header.levels]
    fitting = [n for n, side in enumerate(sides) if side <= size or not size]
    return (fitting[-1] if fitting else 0), None


def without_finest(options: TextureOptions, count: int, width: int, height: int) -> TextureOptions:
    """The options that also leave out ``count`` of the finest levels of an image, but keep at least
    the coarsest level that ``options`` keep."""
    from ptmtools.texture.encoder import kept_levels
    from ptmtools.texture.pyramid import level_sizes

    if not count:
        return options
    levels, kept = len(level_sizes(width, height)), kept_levels(width, height, options)
    last = max(min(kept[-1], levels - 1 - count), kept[0])
    return replace(options, min_level=kept[0], max_level=last)
