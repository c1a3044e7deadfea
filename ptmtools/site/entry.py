"""The files of a site."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from ptmtools.output.emission import compress

#: Hex digits of a SHA-256 that make a name unique.
DIGITS = 10
#: Values of ``Cache-Control``: of contents that never change, and of those revalidated before use.
FOREVER, FRESH = "public, max-age=31536000, immutable", "no-cache"
_MARK = rf"-[0-9a-f]{{{DIGITS}}}"
_MARKED = re.compile(rf"data/(sets/)?[^/]*{_MARK}[.-][^/]*|(data|viewer){_MARK}/.*")


def is_marked(name: str) -> bool:
    """Whether the name of a file of a site has a hash, and so changes with the content. A hash may
    look like a date in other names: only those of the site's own folders count."""
    return _MARKED.fullmatch(name) is not None


@dataclass(frozen=True)
class SiteEntry:
    """A file of a site.

    Attributes
    ----------
    name: its URL relative to the site, percent-encoded as in links.
    source: the file, or the bytes themselves.
    media: its media type.
    forever: whether the name changes with the content, so that caches may keep it for ever.
    compressed: whether clients that accept gzip get it compressed; others may ask for ranges.
    state: of a file, `state_of` at the time when its contents were checked.
    digest: the recorded SHA-256 of a file, "" if none is.
    """

    name: str
    source: Path | bytes
    media: str
    forever: bool = False
    compressed: bool = False
    state: tuple[int, int, int] | None = None
    digest: str = ""

    @property
    def caching(self) -> str:
        """The value of ``Cache-Control``."""
        return FOREVER if self.forever else FRESH

    def read(self, end: int | None = None) -> bytes:
        """All bytes, or those up to an end."""
        if isinstance(self.source, bytes):
            return self.source[:end]
        with self.source.open("rb") as stream:
            return stream.read(-1 if end is None else end)


def state_of(stat: os.stat_result) -> tuple[int, int, int]:
    """Inode, time in ns, bytes: they change when a file is written again."""
    return stat.st_ino, stat.st_mtime_ns, stat.st_size


def stamp_of(file: Path) -> tuple[int, ...]:
    """`state_of` a file; () where it does not exist."""
    try:
        return state_of(file.stat())
    except OSError:
        return ()


def link_bytes(entry: SiteEntry) -> int:
    """Bytes of a file on the link without headers; of its gzip copy where that is sent."""
    if isinstance(entry.source, Path) and not entry.compressed:
        return entry.source.stat().st_size
    data = entry.read()
    return min(len(data), len(compress(data))) if entry.compressed else len(data)
