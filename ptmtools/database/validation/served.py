"""What has been read of a database's served files, for the emitters' checks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ptmtools.database.validation.findings import Findings
from ptmtools.database.validation.textures import ReadTexture
from ptmtools.database.validation.urls import Urls
from ptmtools.store.layout import SERVED


@dataclass
class ServedDatabase:
    """Files are named relative to the served folder.

    Attributes
    ----------
    found: what is wrong.
    urls: finds what URLs name.
    held: what the emitters' readers gave of each of their files; none that gave None.
    textures: of each `.ptm` that could be read.
    """

    found: Findings
    urls: Urls
    held: dict[str, Any] = field(default_factory=dict)
    textures: dict[str, ReadTexture] = field(default_factory=dict)

    def add(self, code: str, path: str, place: str, message: str) -> None:
        """A finding in a served file."""
        self.found.add(code, f"{SERVED}/{path}", place, message)
