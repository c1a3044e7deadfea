"""Encoding by processes, of this machine or others, that see the disk of the database.

Only names and digests travel then: a worker reads the image where it lies and leaves what it makes
in a folder of this run, from which it is moved to its place. (Through the process that builds, the
bytes of images and textures keep eight workers busy and no more, docs/design/scaling.md.) The
folder's name is new in every run, so whatever a forgotten worker of an earlier run still writes,
it writes to nowhere.
"""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from ptmtools.errors import WorkerError
from ptmtools.executors.model import Executor
from ptmtools.files import write_bytes
from ptmtools.pipeline.encoding import encoded_image
from ptmtools.pipeline.options import TextureOptions
from ptmtools.store.layout import IMAGES, STAGING, sha256
from ptmtools.store.transaction import Transaction


@dataclass(frozen=True)
class SharedDisk:
    """What the tasks share.

    Attributes
    ----------
    options: of the stage.
    database: the folder, absolute.
    out: the folder for what is made, absolute.
    """

    options: TextureOptions
    database: str
    out: str


@dataclass(frozen=True)
class ImageTask:
    """A task: an image of the database, the name of what is made of it, without suffix, and how
    many of its finest levels are left out."""

    name: str
    sha256: str
    made: str
    unresolved: int = 0


@contextmanager
def shared_disk(
    transaction: Transaction, database: Path, options: TextureOptions, executor: Executor
) -> Iterator[SharedDisk | None]:
    """The disk, if the tasks are done on machines that see this disk; else None, and bytes travel.

    Raises WorkerError PTM-W005 if some do and some do not.
    """
    if not executor.remote:
        yield None
        return
    out = transaction.subfolder(f"out-{secrets.token_hex(8)}")
    disk = SharedDisk(options, str(database.resolve()), str(out.resolve()))
    try:
        tries = range(4 * executor.workers)
        seen = list(executor.each(_sees, disk, tries, releases_lock=True))
        if any(seen) and not all(seen):
            raise _half_seen(disk)
        yield disk if all(seen) else None
    finally:
        shutil.rmtree(out, ignore_errors=True)


def encoded_there(disk: SharedDisk, image: ImageTask) -> list[tuple[str, str]]:
    """As a task: `encoded_image`, its results written to the shared disk: (file, SHA-256) of each.

    Raises what that raises; WorkerError PTM-W005 where the disk is not to be seen.
    """
    results = encoded_image(disk.options, (image.name, _image(disk, image), image.unresolved))
    made = []
    for number, data in enumerate(results):
        file = Path(disk.out, f"{image.made}-{number}")
        write_bytes(file, data, force=True)
        made.append((str(file), sha256(data)))
    return made


def _image(disk: SharedDisk, image: ImageTask) -> bytes:
    """Its bytes, from their place or, until the scene is committed, from where they wait for it."""
    place = f"{IMAGES}/{image.sha256}"
    for folder in ("", f"{STAGING}/scene", ""):
        with suppress(OSError):
            data = Path(disk.database, folder, place).read_bytes()
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
