"""A campus folder comes to be in one step: everything is written beside it, and then it is renamed.

A folder that is there is replaced only if a campus is all that it holds, and only with ``force``.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ptmtools.campus.model import FORMAT, INDEX, MESHES, TEXTURES
from ptmtools.campus.names import OURS
from ptmtools.errors import OutputError
from ptmtools.files import write_bytes, writing

#: So much of an index is looked at to see whose it is.
_HEAD = 4096


class Staged:
    """The files of a campus on their way."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def write(self, name: str, data: bytes) -> None:
        """A file, by its name in the campus."""
        write_bytes(self._folder / name, data)


@contextmanager
def staged(folder: str | os.PathLike[str], *, force: bool = False) -> Iterator[Staged]:
    """Files that become the folder once the context ends; if that fails nothing has changed.

    Raises OutputError: PTM-O001 the folder holds a campus, and ``force`` is not given; PTM-O830 it
    holds something else; PTM-O002, O003 it cannot be written.
    """
    # A link is followed: whoever named it chose it.
    target = Path(os.path.realpath(folder))
    check(target, force)
    new = target.with_name(f".{target.name[:200]}.{os.urandom(6).hex()}.part")
    try:
        with writing(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            for part in (MESHES, TEXTURES):
                (new / part).mkdir(parents=True)
        yield Staged(new)
        check(target, force)
        with writing(target):
            _replace(target, new)
    finally:
        shutil.rmtree(new, ignore_errors=True)


def check(folder: Path, force: bool) -> None:
    """Raises what `staged` raises of a folder that is in the way."""
    if not os.path.lexists(folder):
        return
    if not folder.is_dir():
        raise OutputError(
            "PTM-O001", "exists and is not a folder", file=folder, remedy="name another with -o"
        )
    with writing(folder):
        names = [
            (Path(place) / file).relative_to(folder).as_posix()
            for place, _, files in os.walk(folder)
            for file in files
        ]
    foreign = sorted(name for name in names if name != INDEX and not OURS.fullmatch(name))
    if names and (foreign or not _ours(folder / INDEX)):
        held = foreign[0] if foreign else "something"
        raise OutputError(
            "PTM-O830",
            f"holds {held}, which is no part of a campus",
            file=folder,
            remedy="name another folder with -o",
        )
    if names and not force:
        raise OutputError(
            "PTM-O001",
            "already holds a campus and was not changed",
            file=folder,
            remedy="use --force to replace it, or name another folder",
        )


def _ours(index: Path) -> bool:
    """Whether an index, which may be damaged, is one of a campus."""
    with suppress(OSError), open(index, "rb") as file:
        return f'"{FORMAT}"'.encode() in file.read(_HEAD)
    return False


def _replace(target: Path, new: Path) -> None:
    """Gives the new folder its name."""
    old = None
    if target.exists():
        old = new.with_suffix(".old")
        os.rename(target, old)
    try:
        os.rename(new, target)
    except OSError:
        if old is not None:
            os.rename(old, target)
        raise
    if old is not None:
        shutil.rmtree(old, ignore_errors=True)
