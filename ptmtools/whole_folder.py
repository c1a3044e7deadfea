"""Folders of ours that are written whole or not at all: beside their place, then renamed.

One that is there already is replaced with ``force`` alone, and only if it is of the same form and
holds nothing that such a folder does not: nothing is removed that we did not write.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ptmtools.errors import OutputError
from ptmtools.files import exchanged, leads_inside, open_regular, refuse_existing, writing

#: How an index begins, in so many first bytes.
_HEAD = 256


@dataclass(frozen=True)
class FolderForm:
    """What tells folders of one kind.

    Attributes
    ----------
    index: the file that says what the others are, a JSON document. format: its member of that name.
    command: that writes such folders.
    owns: whether a path in it, with slashes, is one of its files'.
    """

    index: str
    format: str
    command: str
    owns: Callable[[str], bool]

    def check(self, folder: str | os.PathLike[str], *, force: bool = False) -> None:
        """Whether a folder may be written: nothing is there, or nothing in it, or with ``force``
        one of this form.

        Raises OutputError: PTM-O001 it is there already; PTM-O010 it is something else, or
        holds other files too; PTM-O002 it cannot be looked into.
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
                    remedy="name another with -o; --force does not replace it either",
                )
            strange = next((n for n, plain in _paths(target) if not (plain and self.owns(n))), None)
            if strange is not None:
                raise OutputError(
                    "PTM-O010",
                    f"holds {strange[:80]}, which `{self.command}` did not write; nothing was "
                    "changed",
                    file=folder,
                    remedy="move it away, or name another folder with -o",
                )
            if not force:
                refuse_existing(folder, "use --force to replace it, or name another folder")

    def write(
        self,
        folder: str | os.PathLike[str],
        files: Iterable[tuple[str, bytes]],
        *,
        force: bool = False,
    ) -> None:
        """Writes a folder of (path, bytes), whole or not at all; raises what `staged` raises."""
        with self.staged(folder, force=force) as put:
            for path, data in files:
                put(path, data)

    @contextlib.contextmanager
    def staged(
        self, folder: str | os.PathLike[str], *, force: bool = False
    ) -> Iterator[Callable[[str, bytes], None]]:
        """Takes files, by path and contents, which become the folder once the context ends; if
        that fails nothing has changed.

        Raises OutputError: what `check` raises; PTM-O002, PTM-O003 it cannot be written.
        """
        self.check(folder, force=force)
        # A link was chosen by whoever named it; what it leads to is replaced.
        target = Path(os.path.realpath(folder))
        marked = f".{target.name[:200]}.{os.urandom(6).hex()}"
        beside, old = target.with_name(f"{marked}.part"), target.with_name(f"{marked}.old")
        with writing(folder):
            try:
                beside.mkdir()
                yield lambda path, data: self._put(beside, path, data)
                self.check(folder, force=force)  # something may have come to be there meanwhile
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
        """Whether an index begins as ours do; the rest of it may be damaged."""
        try:
            with open_regular(index) as file:
                return f'"{self.format}"'.encode() in file.read(_HEAD)
        except OSError:
            return False

    def _remove(self, folder: Path) -> None:
        """A folder of ours, and nothing else that has come to be in it."""
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
    """Of all that is in a folder, but for folders that hold something: the path, with slashes, and
    whether it is a file."""
    for place, folders, files in os.walk(folder):
        for name in [*folders, *files]:
            path = Path(place, name)
            mode = os.lstat(path).st_mode
            if not stat.S_ISDIR(mode) or not os.listdir(path):
                yield PurePosixPath(path.relative_to(folder)).as_posix(), stat.S_ISREG(mode)


def _replace(target: Path, new: Path, old: Path) -> None:
    """Gives a new folder its name, and what has it now another: at once where that can be done."""
    there = os.path.lexists(target)
    if there and exchanged(new, target):
        return
    if there:
        os.rename(target, old)
    try:
        os.rename(new, target)
    except OSError:
        if there:
            os.rename(old, target)
        raise
