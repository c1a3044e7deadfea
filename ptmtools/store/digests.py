"""SHA-256 of files, cached between runs while a file is unchanged.

A build with nothing to do must not read a terabyte. A digest is computed again unless the file has
its cached size, inode, and times of modification and of status change; programs cannot set the
latter. A file that changed just before it was read could change again within the same tick of the
clock, so its digest is not cached (Git calls such an entry racy). ``ptm validate`` does not use the
cache: it reads every byte.

The cache is in the user's cache folder (``XDG_CACHE_HOME``), a file for each database; losing it
costs time only.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from ptmtools.errors import OutputError
from ptmtools.files import open_regular, write_bytes

#: Ticks of the clocks of file times, ns: most are 1 to 10 ms; those of some disks, recognised by
#: whole seconds, are 2 s.
TICK, COARSE_TICK = 50_000_000, 3_000_000_000
#: Caches of databases that were not built for this many days are removed.
KEPT_DAYS = 90

_FORMAT = 1
Stamp = tuple[int, int, int, int]


class Digests:
    """The digests of the files of a database and of its model, by absolute path."""

    def __init__(self, database: Path) -> None:
        name = hashlib.sha256(os.fsencode(database.absolute())).hexdigest()[:32]
        folder = cache_folder("digests")
        self._file = None if folder is None else folder / f"{name}.json"
        self._known: dict[str, tuple[Stamp, str]] = {}
        self._written: dict[str, tuple[Stamp, str]] = {}
        self._changed = False
        with suppress(OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
            document: Any = json.loads(self._file.read_bytes()) if self._file else {}
            if document["format"] == _FORMAT:
                self._known = {
                    str(name): ((int(a), int(b), int(c), int(d)), str(digest))
                    for name, (a, b, c, d, digest) in document["files"].items()
                }

    def digest(self, path: Path) -> str:
        """Hex digest of a regular file.

        Raises OSError if it cannot be read.
        """
        stamp = _stamp(path)
        known = self._known.get(os.path.abspath(path))
        if known is not None and known[0] == stamp:
            return known[1]
        before = time.time_ns()
        with open_regular(path) as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        self._remember(path, stamp, digest, before)
        return digest

    def note(self, path: Path, digest: str) -> None:
        """Sets the digest of a file that was just written, for the next runs."""
        with suppress(OSError):
            self._written[os.path.abspath(path)] = (_stamp(path), digest)

    def save(self) -> None:
        """Writes the cache; ignores errors."""
        for name, (stamp, digest) in self._written.items():
            with suppress(OSError):
                self._remember(Path(name), stamp, digest, time.time_ns())
        self._written = {}
        if self._file is None or not self._changed:
            return
        rows = {
            name: [*stamp, digest]
            for name, (stamp, digest) in sorted(self._known.items())
            if os.path.exists(name)
        }
        data = json.dumps({"format": _FORMAT, "files": rows}).encode()
        with suppress(OSError, OutputError):
            self._file.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(self._file, data, force=True)
            _forget_old(self._file.parent)
        self._changed = False

    def _remember(self, path: Path, stamp: Stamp, digest: str, before: int) -> None:
        """Caches the digest of a file read at the time ``before``, unless the file may have changed
        since."""
        if stamp == _stamp(path) and _is_settled(stamp, before):
            # This differs from ``path`` if a link precedes a ``..``.
            self._known[os.path.abspath(path)] = (stamp, digest)
            self._changed = True


def _stamp(path: Path) -> Stamp:
    """Size, inode, and times of modification and of change in nanoseconds."""
    state = os.stat(path)
    return state.st_size, state.st_ino, state.st_mtime_ns, state.st_ctime_ns


def _is_settled(stamp: Stamp, now: int) -> bool:
    """Whether a change at the time ``now``, ns, or later would change the stamp."""
    tick = COARSE_TICK if stamp[2] % 1_000_000_000 == 0 else TICK
    return max(stamp[2:]) + tick < now


def cache_folder(kind: str) -> Path | None:
    """The user's folder for caches of a kind; None without a home."""
    # Not Path.home, which raises for a user without a home.
    caches = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    return caches / "ptmtools" / kind if caches.is_absolute() else None


@cache
def _forget_old(folder: Path) -> None:
    """Once in a process: there may be thousands of files."""
    oldest = time.time() - KEPT_DAYS * 86_400
    with os.scandir(folder) as files:
        for file in files:
            with suppress(OSError):
                if file.name.endswith(".json") and file.stat().st_mtime < oldest:
                    os.unlink(file)
