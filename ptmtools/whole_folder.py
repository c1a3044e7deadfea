"""Writes folders of a known form atomically: beside their place, then renamed.

An existing folder is replaced only with ``force``, if it is of the same form and contains no other
files: nothing is removed that ptmtools has not written.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ptmtools.errors import OutputError
from ptmtools.files import exchange, leads_inside, open_regular, refuse_existing, writing

#: The format of an index is within this many bytes.
_HEAD = 256


@dataclass(frozen=True)
class FolderForm:
    """A kind of folder.

    Attributes
    ----------
    index: the JSON file that describes the others.
    format: its member of that name.
    command: the command that writes such folders.
    owns: whether a path in the folder, with slashes, is one of its files.
    """

    index: str
    format: str
    command: str
    owns: Callable[[str], bool]

    def check(self, folder: str | os.PathLike[str], *, force: bool = False) -> None:
        """Checks that a folder may be written: it is absent or empty, or with ``force`` of this
        form.

        Raises OutputError: PTM-O001 it exists; PTM-O010 it is something else, or contains
        other files too; PTM-O002 it cannot be read.
        """
        with writing(folder):
            target = Path(os.path.realpath(folder))
            os.stat(target.parent)
            if not os.path.lexists(target) or (target.is_dir() and not os.listdir(target)):
                return
            if not target.is_dir() or not self._is_ours(target / self.index):
                raise OutputError(
                    "PTM-O010",
                    f"is not a folder that `{self.command}` wrote, and was not changed",
                    file=folder,
                    remedy="specify another with -o; --force does not replace it either",
                )
            foreign = next((n for n, plain in _paths(target) if not (plain and self.owns(n))), None)
            if foreign is not None:
                raise OutputError(
                    "PTM-O010",
                    f"holds {foreign[:80]}, which `{self.command}` did not write; nothing was "
                    "changed",
                    file=folder,
                    remedy="move it away, or specify another folder with -o",
                )
            if not force:
                refuse_existing(folder, "use --force to replace it, or specify another folder")

    def write(
        self,
        folder: str | os.PathLike[str],
        files: Iterable[tuple[str, bytes]],
        *,
        force: bool = False,
    ) -> None:
        """Writes a folder of (path, bytes), atomically; raises as `staged`."""
        with self.stage_files(folder, force=force) as put:
            for path, data in files:
                put(path, data)

    @contextlib.contextmanager
    def stage_files(
        self, folder: str | os.PathLike[str], *, force: bool = False
    ) -> Iterator[Callable[[str, bytes], None]]:
        """A function of path and contents that adds a file; the files become the folder as the
        context ends. After an error, nothing has changed.

        Raises OutputError: as `check`; PTM-O002, PTM-O003 it cannot be written.
        """
        self.check(folder, force=force)
        # If the folder is a link, its target is replaced.
        target = Path(os.path.realpath(folder))
        marked = f".{target.name[:200]}.{os.urandom(6).hex()}"
        beside, old = target.with_name(f"{marked}.part"), target.with_name(f"{marked}.old")
        with writing(folder):
            try:
                beside.mkdir()
                yield lambda path, data: self._put(beside, path, data)
                self.check(folder, force=force)  # it may have been created meanwhile
                _replace(target, beside, old)
            finally:
                self._remove(beside)
            self._remove(old)

    def _put(self, folder: Path, path: str, data: bytes) -> None:
        if not leads_inside(path) or not self.owns(path):
            raise ValueError(f"{path!r} is no file of such a folder")
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        with open(file, "xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())

    def _is_ours(self, index: Path) -> bool:
        """Whether an index begins with the format; the rest may be damaged."""
        try:
            with open_regular(index) as file:
                return f'"{self.format}"'.encode() in file.read(_HEAD)
        except OSError:
            return False

    def _remove(self, folder: Path) -> None:
        """Removes the files of this form, and the folders that this empties."""
        if not folder.is_dir():
            return
        for path, plain in list(_paths(folder)):
            if plain and self.owns(path):
                with contextlib.suppress(OSError):
                    (folder / path).unlink()
        for place, _, _ in os.walk(folder, topdown=False):
            with contextlib.suppress(OSError):
                os.rmdir(place)


def _paths(folder: Path) -> Iterator[tuple[str, bool]]:
    """The path, with slashes, of each file, link or empty folder in a folder, and whether it is a
    regular file."""
    for place, folders, files in os.walk(folder):
        for name in [*folders, *files]:
            path = Path(place, name)
            mode = os.lstat(path).st_mode
            if not stat.S_ISDIR(mode) or not os.listdir(path):
                yield PurePosixPath(path.relative_to(folder)).as_posix(), stat.S_ISREG(mode)


def _replace(target: Path, new: Path, old: Path) -> None:
    """Moves ``new`` to ``target``, and an existing target to ``new`` or ``old``; atomically where
    that is possible."""
    exists = os.path.lexists(target)
    if exists and exchange(new, target):
        return
    if exists:
        os.rename(target, old)
    try:
        os.rename(new, target)
    except OSError:
        if exists:
            os.rename(old, target)
        raise
