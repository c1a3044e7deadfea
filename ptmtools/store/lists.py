"""The files of a stage with their digests, in lists if there are many.

With up to `INLINE` files, the manifest itself has them. Of a million textures it would have
gigabytes, written again by each stage. So more files are in lists: ``stages/lists/SHA256.json``,
each named after the digest of its bytes and therefore never changed. The manifest has the digests
of the lists, and a list is read when one of its stage's files is first asked for.

A list ends with a name whose CRC-32 is divisible by `MEAN`. So the ends depend only on the names
beside them, and a file that is added, changed or removed changes one list, or two.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from os import PathLike
from typing import Any

from ptmtools import schemas
from ptmtools.errors import DatabaseError, Rebuild
from ptmtools.store.layout import LISTS, sha256

FORMAT, SCHEMA = "ptmtools file list", 1
#: Largest number of files in the manifest itself, and mean number of files in a list.
INLINE, MEAN = 1024, 1024

#: Reads the list with a SHA-256.
ReadList = Callable[[str], Mapping[str, str]]


class FileList(Mapping[str, str]):
    """Name → SHA-256 of files in lists.

    Attributes
    ----------
    lists: the SHA-256 of each list, in the order of the names.

    The first use of a file raises the errors of ``read``.
    """

    def __init__(self, lists: Sequence[str], read: ReadList) -> None:
        self.lists = tuple(lists)
        self._read = read

    @cached_property
    def _files(self) -> dict[str, str]:
        return self.files_except(())

    def files_except(self, lists: Collection[str], *, readable: bool = False) -> dict[str, str]:
        """The files that are not in these lists, of which none is read; with ``readable``, those of
        the lists that can be read."""
        files: dict[str, str] = {}
        for digest in self.lists:
            with suppress(*(DatabaseError,) if readable else ()):
                files |= {} if digest in lists else self._read(digest)
        return files

    def __getitem__(self, name: str) -> str:
        return self._files[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)

    def __bool__(self) -> bool:
        return bool(self.lists)


def list_file(digest: str) -> str:
    """The file of a list, relative to the database."""
    return f"{LISTS}/{digest}.json"


def lists_of(files: Mapping[str, str]) -> Iterator[bytes]:
    """The lists of these files; none if the manifest has them."""
    if len(files) <= INLINE:
        return
    part: dict[str, str] = {}
    for name in sorted(files):
        part[name] = files[name]
        if zlib.crc32(name.encode("utf-8", "surrogatepass")) % MEAN == 0:
            yield _text(part)
            part = {}
    if part:
        yield _text(part)


def in_lists(
    files: Mapping[str, str], read: ReadList, write: Callable[[str, bytes], None]
) -> Mapping[str, str]:
    """The files in lists, if they are many. ``write`` gets the file and the bytes of each new list,
    ``read`` reads it again."""
    digests = []
    for data in () if isinstance(files, FileList) else lists_of(files):
        digests.append(sha256(data))
        write(list_file(digests[-1]), data)
    return FileList(digests, read) if digests else files


def stored_form(files: Mapping[str, str]) -> dict[str, str] | list[str]:
    """Files as the manifest has them, or the SHA-256 of their lists."""
    return list(files.lists) if isinstance(files, FileList) else dict(sorted(files.items()))


def read_list(data: bytes, *, file: str | PathLike[str]) -> dict[str, str]:
    """Inverse of `lists_of`, for one list; ``file`` is named in the error.

    Raises DatabaseError PTM-D006 if it is none.
    """
    try:
        files: dict[str, str] = schemas.read(data, schemas.FILES)["files"]
    except schemas.ShapeError as fault:
        remedy = Rebuild("run {} again to rebuild it")
        raise DatabaseError("PTM-D006", f"damaged: {fault}", file=file, remedy=remedy) from fault
    return files


def _text(files: Mapping[str, str]) -> bytes:
    document: dict[str, Any] = {"format": FORMAT, "schema": SCHEMA, "files": files}
    return json.dumps(document, separators=(",\n", ": ")).encode() + b"\n"
