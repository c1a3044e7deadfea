"""Files below a folder, written a few at a time, with gzip copies if wanted.

A file is on the disk before it has its name (`ptmtools.files`), and most of the time goes into
waiting for that; meanwhile the next ones are made.

A gzip copy is what servers hand out in place of a file (nginx: `gzip_static on`) and what VRML
browsers open by themselves. It holds no name and no time, so its bytes depend on nothing but the
file and the version of zlib.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from ptmtools.database.emitters import GZIP
from ptmtools.files import real_folder, write_bytes, writing
from ptmtools.texture.parallel import ordered

#: Files that wait for the disk at a time.
_WRITERS = 8
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
    folder: Path, files: Iterable[tuple[str, str | bytes]], *, force: bool, gzip: bool
) -> Iterator[dict[str, int]]:
    """Of each file what was written, itself and a copy, as name → bytes; at the end all are on the
    disk.

    Parameters
    ----------
    folder: an existing one.
    files: name relative to the folder, and contents; folders on the way are made.
    force: overwrite files; a gzip copy that is not written again goes.
    gzip: write copies of VRML and JSON files.

    Raises OutputError: PTM-O001 to PTM-O003, PTM-O005, of the first file that cannot be written.
    """

    def write(file: tuple[str, str | bytes]) -> dict[str, int]:
        name, content = file
        data = content.encode() if isinstance(content, str) else content
        copy = folder / f"{name}{GZIP}"
        real_folder(folder, name.rpartition("/")[0])
        write_bytes(folder / name, data, force=force)
        if gzip and name.endswith(_TEXT):
            packed = compressed(data)
            write_bytes(copy, packed, force=force)
            return {name: len(data), f"{name}{GZIP}": len(packed)}
        if force:
            with writing(copy):
                copy.unlink(missing_ok=True)
        return {name: len(data)}

    return ordered(write, files, _WRITERS)
