"""Files below a folder, written a few at a time, with gzip copies if wanted.

A file is on the disk before it has its name (`ptmtools.files`), and most of the time goes into
waiting for that; meanwhile the next ones are made.

A gzip copy is what servers hand out in place of a file (nginx: `gzip_static on`) and what VRML
browsers open by themselves. It holds no name and no time, so its bytes depend on nothing but the
file and the version of zlib.
"""

from __future__ import annotations

import zlib
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType

from ptmtools.database.emitters import GZIP
from ptmtools.files import write_bytes, writing

#: Files that wait for the disk at a time, and files held in memory for it.
_WRITERS = 4
_WAITING = 8
#: Deflate, no name, no time, best compression, no system (RFC 1952).
_GZIP = bytes([0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 2, 255])
#: Suffixes of files that are copied.
_TEXT = (".wrl", ".json")


def compressed(data: bytes) -> bytes:
    """A gzip file of these bytes."""
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    body = deflate.compress(data) + deflate.flush()
    check = zlib.crc32(data).to_bytes(4, "little")
    return _GZIP + body + check + (len(data) & 0xFFFFFFFF).to_bytes(4, "little")


class ServedFiles:
    """A context manager: when it is left, all files are written, or the first fault is raised.

    Parameters
    ----------
    folder: an existing one.
    force: overwrite files; a gzip copy that is not written again goes.
    gzip: write copies of VRML and JSON files.

    Attributes
    ----------
    names: of the files, relative to the folder, in the order of `put`.
    bytes: of those that are surely written.
    """

    def __init__(self, folder: Path, *, force: bool, gzip: bool) -> None:
        self.names: list[str] = []
        self.bytes = 0
        self._folder = folder
        self._force = force
        self._gzip = gzip
        self._pool = ThreadPoolExecutor(_WRITERS, "files")
        self._pending: deque[Future[int]] = deque()

    def put(self, name: str, content: str | bytes) -> None:
        """Begins to write a file.

        Raises
        ------
        OutputError: PTM-O001 to PTM-O003, of this file or of an earlier one.
        """
        data = content.encode() if isinstance(content, str) else content
        copied = self._gzip and name.endswith(_TEXT)
        self.names += [name, name + GZIP] if copied else [name]
        self._pending.append(self._pool.submit(self._write, name, data, copied))
        while len(self._pending) >= _WAITING:
            self.bytes += self._pending.popleft().result()

    def settle(self) -> None:
        """Waits until all of them are written."""
        while self._pending:
            self.bytes += self._pending.popleft().result()

    def _write(self, name: str, data: bytes, copied: bool) -> int:
        path = self._folder / name
        other = path.with_name(path.name + GZIP)
        write_bytes(path, data, force=self._force)
        if copied:
            packed = compressed(data)
            write_bytes(other, packed, force=self._force)
            return len(data) + len(packed)
        if self._force:
            with writing(other):
                other.unlink(missing_ok=True)
        return len(data)

    def __enter__(self) -> ServedFiles:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if value is None:
                self.settle()
        finally:
            self._pool.shutdown(cancel_futures=True)
