"""The bytes of a file as they are sent: themselves, or a gzip copy that is made once."""

from __future__ import annotations

import asyncio
import hashlib
import os
from collections import defaultdict
from collections.abc import AsyncIterator
from contextlib import suppress
from functools import partial
from typing import BinaryIO
from urllib.parse import quote

from anyio.to_thread import run_sync

from ptmtools.files import open_regular
from ptmtools.output.emission import compressed
from ptmtools.site.content import Entry, state_of

#: Bytes that are read, or handed on, at a time.
PIECE = 1 << 18
#: Files of more bytes are not compressed, which is done in memory.
_MOST = 64 << 20


class Stored:
    """Bytes to be sent, in memory or in an open file.

    Attributes
    ----------
    size: bytes. tag: a strong entity tag, of these bytes and no others.
    """

    def __init__(self, source: bytes | BinaryIO, tag: str | None = None) -> None:
        self._source = source
        if isinstance(source, bytes):
            self.size = len(source)
            self.tag = tag or f'"{hashlib.sha256(source).hexdigest()[:20]}"'
        else:
            state = os.fstat(source.fileno())
            self.size = state.st_size
            self.tag = tag or f'"{state.st_mtime_ns:x}-{state.st_size:x}"'

    def read(self, begin: int, end: int) -> bytes | memoryview:
        """The bytes [begin, end); fewer if the file has been cut since."""
        if isinstance(self._source, bytes):
            return memoryview(self._source)[begin:end]
        self._source.seek(begin)
        return self._source.read(end - begin)

    async def pieces(self, begin: int, end: int) -> AsyncIterator[bytes | memoryview]:
        """The bytes [begin, end), a few at a time; what is a file is read in another thread, and
        closed in the end."""
        try:
            for at in range(begin, end, PIECE):
                upto = min(at + PIECE, end)
                if isinstance(self._source, bytes):
                    yield self.read(at, upto)
                else:
                    yield await run_sync(self.read, at, upto)
        finally:
            self.close()

    def close(self) -> None:
        """Close the file."""
        if not isinstance(self._source, bytes):
            self._source.close()


def stored(entry: Entry) -> Stored:
    """The bytes of an entry. OSError if its file is gone, BlockingIOError if it is another one.

    A name that changes with the content is the tag, too: nothing is read for it.
    """
    source = entry.source
    tag = f'"{quote(entry.name, safe="/%")}"' if entry.forever else None
    if isinstance(source, bytes):
        return Stored(source, tag)
    file = open_regular(source)
    if entry.state and entry.state != state_of(os.fstat(file.fileno())):
        file.close()
        raise BlockingIOError(
            f"{entry.name}: the database has been built again; load the page again"
        )
    return Stored(file, tag)


class Copies:
    """Gzip copies, each made when it is first asked for, and kept."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[str, Stored | None]] = {}
        self._making: defaultdict[str, asyncio.Lock] = defaultdict(asyncio.Lock)

    async def of(self, name: str, whole: Stored) -> Stored | None:
        """The copy of a file of that name, or None where it would be no smaller."""
        if whole.size > _MOST:
            return None
        async with self._making[name]:
            tag, copy = self._kept.get(name, ("", None))
            if tag != whole.tag:
                # Who is interrupted does not wait until a large one is made.
                make = partial(_copy, whole)
                copy = await run_sync(make, abandon_on_cancel=True)
                self._kept[name] = whole.tag, copy
            return copy


def _copy(whole: Stored) -> Stored | None:
    packed = b""
    with suppress(OSError, ValueError):  # closed under the hands of one that was given up
        packed = compressed(bytes(whole.read(0, whole.size)))
    if not packed or len(packed) >= whole.size:
        return None
    return Stored(packed, f'{whole.tag[:-1]}-gzip"')
