"""Encodes one image as a task: a `.ptm`, the `Detail` of its levels, a fallback image.

`encoded_image` takes and returns bytes. `encoded_on_disk` is for processes, of this machine or
others, that see the disk of the database: only names and digests travel. (Sending the bytes of
images and textures limits the building process to eight workers, docs/design/scaling.md.) A worker
writes to a folder with a new name in every run, so one that an interrupted run has left behind
writes nowhere.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ptmtools.errors import InputError, WorkerError, naming
from ptmtools.options import option
from ptmtools.store.layout import IMAGES, STAGING, sha256
from ptmtools.texture.model import EncodeOptions

if TYPE_CHECKING:
    from ptmtools.executor import Executor
    from ptmtools.store.transaction import Transaction
    from ptmtools.texture.detail import Detail
    from ptmtools.texture.model import PtmHeader

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class TextureOptions(EncodeOptions):
    """Options of the textures stage."""

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
        from ptmtools.texture.encoder import check_options

        check_options(self)
        possible = {
            "trim_height": self.trim_height > 0,
            "trim_fov": 0 < self.trim_fov < 180,
            "trim_distance": 0 < self.trim_distance < math.inf,
        }
        for name in (name for name, fits in possible.items() if not fits):
            raise InputError(
                "PTM-I111",
                f"{name} is {getattr(self, name):g}",
                remedy="use a number above 0, and for an angle below 180",
            )


def encoded_image(options: TextureOptions, image: tuple[str, bytes, int]) -> list[bytes]:
    """The bytes of a `.ptm`, of its `Detail` as JSON and, if the options ask for one, of its
    fallback image; from an image (name, bytes of its file, number of its finest levels to leave
    out).

    Raises as `encode` and `read_image`.
    """
    from ptmtools.texture import Limits, decode, encode_to, read_header, read_image
    from ptmtools.texture.images import png_bytes

    name, source, unresolved = image
    with naming(name):
        texels = read_image(source, Limits(options.limit << 20))
        height, width = texels.shape[:2]
        kept = without_finest(options, unresolved, width, height)
        buffer = io.BytesIO()
        detail = json.dumps(asdict(encode_to(buffer, texels, kept))).encode() + b"\n"
        data = buffer.getvalue()
    if not options.fallback:
        return [data, detail]
    header = read_header(data)
    level = fallback_level(header, options.fallback_size)
    if level < len(header.levels) - 1 or options.max_error or header.trimmed:
        # Decoding takes more than the image, which is within the limit.
        png = png_bytes(decode(data, level=level, limits=Limits(64 * texels.nbytes + (1 << 20))))
    elif source.startswith(PNG_MAGIC):
        png = bare_png(source)
    else:
        png = png_bytes(texels)
    return [data, detail, png]


@dataclass(frozen=True)
class SharedDisk:
    """The options of all tasks, and the absolute paths of the database and of the folder for
    results."""

    options: TextureOptions
    database: str
    out: str


@dataclass(frozen=True)
class ImageTask:
    """An image of the database, the stem of its result files, and the number of its finest levels
    to leave out."""

    name: str
    sha256: str
    stem: str
    unresolved: int = 0


@contextmanager
def shared_disk(
    transaction: Transaction, database: Path, options: TextureOptions, executor: Executor
) -> Iterator[SharedDisk | None]:
    """The disk, if all workers are other processes that see it; None if bytes must be sent.

    Raises WorkerError PTM-W005 if only some workers see it.
    """
    import secrets
    import shutil

    if not executor.remote:
        yield None
        return
    out = transaction.subfolder(f"out-{secrets.token_hex(8)}")
    disk = SharedDisk(options, str(database.resolve()), str(out.resolve()))
    try:
        seen = list(executor.each(_sees, disk, range(4 * executor.workers), releases_lock=True))
        if any(seen) and not all(seen):
            raise _half_seen(disk)
        yield disk if all(seen) else None
    finally:
        shutil.rmtree(out, ignore_errors=True)


def encoded_on_disk(disk: SharedDisk, image: ImageTask) -> list[tuple[str, str]]:
    """Writes the results of `encoded_image` to the shared disk: (file, SHA-256) of each.

    Raises as that; WorkerError PTM-W005 where the disk cannot be seen.
    """
    from ptmtools.files import write_bytes

    results = encoded_image(disk.options, (image.name, _image(disk, image), image.unresolved))
    files = []
    for number, data in enumerate(results):
        file = Path(disk.out, f"{image.stem}-{number}")
        write_bytes(file, data, force=True)
        files.append((str(file), sha256(data)))
    return files


def _image(disk: SharedDisk, image: ImageTask) -> bytes:
    """The bytes of an image from `IMAGES` or, until the scene is committed, the staging folder."""
    for folder in ("", f"{STAGING}/scene", ""):
        with suppress(OSError):
            data = Path(disk.database, folder, IMAGES, image.sha256).read_bytes()
            if sha256(data) == image.sha256:
                return data
    raise _half_seen(disk)


def _sees(disk: SharedDisk, _: int) -> bool:
    return Path(disk.out).is_dir()


def _half_seen(disk: SharedDisk) -> WorkerError:
    return WorkerError(
        "PTM-W005",
        "some workers see the disk of the database and others do not",
        file=disk.database,
        remedy="mount it in the same place on all machines, or put it where only this one sees it",
    )


def read_detail(data: bytes) -> Detail:
    """The `Detail` that `encoded_image` has written as JSON; raises ValueError, LookupError or
    TypeError if it is damaged."""
    from ptmtools.texture.detail import Detail

    fields = json.loads(data)
    red, green, blue = map(int, fields["color"])
    return Detail(tuple(map(float, fields["differences"])), (red, green, blue))


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


def fallback_level(header: PtmHeader, size: int) -> int:
    """The level that a fallback image of this size holds, see `TextureOptions`."""
    sides = [max(level.width, level.height) for level in header.levels]
    fitting = [n for n, side in enumerate(sides) if side <= size or not size]
    return fitting[-1] if fitting else 0


def bare_png(data: bytes) -> bytes:
    """An intact PNG without the chunks that do not change its texels: gamma, profile, text, date.

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
