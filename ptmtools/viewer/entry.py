"""What a site consists of."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Entry:
    """A file of a site.

    Attributes
    ----------
    name: its URL relative to the site, percent-encoded as it stands in links.
    source: where its bytes are, or the bytes.
    media: its media type.
    forever: whether the name changes with the content, so that caches may keep it for ever.
    compressed: whether it is sent compressed to who takes that; else in byte ranges to who asks.
    state: of a file, what `state_of` said of it when it was known to be the right one.
    """

    name: str
    source: Path | bytes
    media: str
    forever: bool = False
    compressed: bool = False
    state: tuple[int, int, int] | None = None

    def read(self) -> bytes:
        """All its bytes."""
        return self.source if isinstance(self.source, bytes) else self.source.read_bytes()


def state_of(stat: os.stat_result) -> tuple[int, int, int]:
    """What changes when a file is written again: inode, time in ns, bytes."""
    return stat.st_ino, stat.st_mtime_ns, stat.st_size
