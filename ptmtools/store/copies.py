"""The copies of databases at URLs, in the user's cache folder: their places, and back to the URLs.

::

    databases/HASH/url          the URL
    databases/HASH/db           the copy of builds, `.ptm-new/` included
    databases/HASH/read         the copy of commands that read
"""

from __future__ import annotations

from contextlib import suppress
from os import PathLike
from pathlib import Path

from ptmtools.errors import OutputError
from ptmtools.files import real_folder, write_bytes
from ptmtools.store.digests import cache_folder
from ptmtools.store.layout import sha256

DATABASES, BUILDS, READERS = "databases", "db", "read"
_URL = "url"


def folder_for(kind: str, url: str) -> Path:
    """The folder for the copies of a URL; raises OutputError PTM-O002 without a cache folder."""
    folder = cache_folder(kind)
    if folder is None:
        raise OutputError(
            "PTM-O002", "there is no folder for copies", file=url, remedy="set XDG_CACHE_HOME"
        )
    return folder / sha256(url.encode())[:32]


def note_url(folder: Path, url: str) -> None:
    """Creates a folder for copies, and notes their URL."""
    real_folder(folder)
    if not (folder / _URL).is_file():
        write_bytes(folder / _URL, url.encode(), force=True)


def url_of(path: str | PathLike[str]) -> str:
    """The URL of a copy, or of a file in it; the path itself if it is in none."""
    databases, file = cache_folder(DATABASES), Path(path)
    if databases and file.is_relative_to(databases):
        place, *steps = file.relative_to(databases).parts or ("",)
        with suppress(OSError):
            return "/".join([(databases / place / _URL).read_text(), *steps[1:]])
    return str(path)
