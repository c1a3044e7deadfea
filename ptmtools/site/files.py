"""The files of a site while it is made, with hashes in their names."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from ptmtools.errors import InputError, LimitError
from ptmtools.site.about import ICONS, MANIFEST, MANIFEST_MEDIA, icon, manifest_of
from ptmtools.site.entry import DIGITS, SiteEntry, state_of
from ptmtools.store.folder import damage_error
from ptmtools.store.layout import sha256

T = TypeVar("T")
#: The folder of the files whose names have a hash.
DATA = "data"
_STRANGE = re.compile(r"[^A-Za-z0-9_-]+")


@dataclass
class SiteFiles:
    """The files so far, by name, and remarks for the user."""

    entries: dict[str, SiteEntry] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def put(self, entry: SiteEntry) -> None:
        """Adds a file under its own name."""
        self.entries[entry.name] = entry

    def note(self, text: str) -> None:
        """Adds a remark, once."""
        if text not in self.notes:
            self.notes.append(text)

    def add(
        self,
        stem: str,
        suffix: str,
        media: str,
        source: Path | bytes,
        *,
        compressed: bool = False,
        digest: str = "",
        mark: str = "",
    ) -> str:
        """Adds a file of the data; returns its URL relative to the index. ``digest``: of a file;
        ``mark``: what its name has of that instead."""
        digest = sha256(source) if isinstance(source, bytes) else digest
        # Names with a mark differ in their ends.
        cleaned = _STRANGE.sub("_", stem)[: None if mark else 64]
        name = f"{cleaned}-{(mark or digest)[:DIGITS]}{suffix}"
        state = state_of(source.stat()) if isinstance(source, Path) else None
        self.put(SiteEntry(f"{DATA}/{name}", source, media, True, compressed, state, digest))
        return name

    def render(self, draw: Callable[[], T], database: Path) -> T | None:
        """Pictures of a database; None, and a note, where Embree is missing. Raises DatabaseError
        in place of InputError."""
        try:
            return draw()
        except ImportError:
            self.note("no pictures: embreex, which renders them, is not installed")
            return None
        except LimitError:
            raise
        except InputError as fault:
            raise damage_error(Path(fault.file or database), fault.message) from None


def add_manifest(files: SiteFiles, title: str) -> None:
    """Adds the web application manifest of a site, and its icons."""
    icons = {
        size: f"{DATA}/{files.add(f'icon-{size}', '.png', 'image/png', icon(size))}"
        for size in ICONS
    }
    files.put(SiteEntry(MANIFEST, manifest_of(title, icons), MANIFEST_MEDIA))
