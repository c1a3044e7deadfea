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
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

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


def write_files(
    folder: Path, files: Iterable[tuple[str, str | bytes, bool]], *, force: bool, gzip: bool
) -> tuple[tuple[str, ...], int]:
    """The names of what was written, in the order of ``files``, and all their bytes.

    Parameters
    ----------
    folder: an existing one.
    files: name relative to the folder, contents, and whether all before must be on the disk.
    force: overwrite files; a gzip copy that is not written again goes.
    gzip: write copies of VRML and JSON files.

    Raises OutputError: PTM-O001 to PTM-O003, of the first file that cannot be written.
    """
    names: list[str] = []
    size = 0
    pending: deque[Future[int]] = deque()
    pool = ThreadPoolExecutor(_WRITERS, "files")
    try:
        for name, content, alone in files:
            while pending and (alone or len(pending) >= _WAITING):
                size += pending.popleft().result()
            data = content.encode() if isinstance(content, str) else content
            copied = gzip and name.endswith(_TEXT)
            names += [name, name + GZIP] if copied else [name]
            pending.append(pool.submit(_write, folder / name, data, copied, force))
        return tuple(names), size + sum(each.result() for each in pending)
    finally:
        pool.shutdown(cancel_futures=True)


def _write(path: Path, data: bytes, copied: bool, force: bool) -> int:
    other = path.with_name(path.name + GZIP)
    write_bytes(path, data, force=force)
    if copied:
        packed = compressed(data)
        write_bytes(other, packed, force=force)
        return len(data) + len(packed)
    if force:
        with writing(other):
            other.unlink(missing_ok=True)
    return len(data)
