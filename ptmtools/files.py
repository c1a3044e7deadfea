"""Writes files atomically, and opens files of unknown origin safely.

The bytes go to a temporary file in the target's folder, are flushed to the disk, and take the
target's name in one step. After an error, the temporary file is removed and the target unchanged.
On Linux, the temporary file has no name until it is complete (``O_TMPFILE``), so that a killed
process leaves none; elsewhere it leaves a hidden ``.part`` file.

Links are not followed: a target that is a symbolic link is itself replaced, and `real_folder`
refuses links below its root. This guards against links that already exist, such as in a database
from elsewhere, not against a process that replaces folders at the same moment.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import stat
import sys
from collections.abc import Callable, Iterator
from io import BufferedReader
from pathlib import Path
from typing import IO

from ptmtools.errors import OutputError

#: Largest depth of folders below a root.
_MAX_DEPTH = 64
#: Arguments of renameat2: AT_FDCWD, RENAME_EXCHANGE.
_HERE, _EXCHANGE = -100, 2


def write_bytes(path: str | os.PathLike[str], data: bytes, *, force: bool = False) -> None:
    """Write ``data`` to ``path``; an existing file is replaced only with ``force``.

    Raises OutputError: PTM-O001 the file exists, PTM-O002 it cannot be written, PTM-O003 the disk
    is full.
    """
    write_with(path, lambda file: file.write(data), force=force)


def write_with(
    path: str | os.PathLike[str], write: Callable[[IO[bytes]], object], *, force: bool = False
) -> None:
    """As `write_bytes`, with ``write(file)``; the binary file can be read and can seek."""
    target = Path(path)
    if "\0" in os.fspath(target):
        raise OutputError("PTM-O002", "has a NUL in its name", file=target)
    with writing(target):
        blocked = target.exists() and not target.is_file()
    if blocked:  # renaming would replace a device
        kind = "a folder" if target.is_dir() else "a device"
        raise OutputError(
            "PTM-O002", f"is {kind}, not a file", file=target, remedy="specify a file instead"
        )
    if not force:
        refuse_existing(target)
    temporary = target.with_name(f".{target.name[:200]}.{os.urandom(6).hex()}.part")
    with writing(target):
        try:
            with _temporary(temporary) as (file, named):
                write(file)
                file.flush()
                os.fsync(file.fileno())
                if not named:
                    # Python calls linkat, which follows the link in /proc, only with a folder's
                    # descriptor; its value is ignored.
                    descriptor = file.fileno()
                    os.link(f"/proc/self/fd/{descriptor}", temporary, src_dir_fd=descriptor)
            if not force:
                _claim(temporary, target)
            os.replace(temporary, target)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)


def _claim(temporary: Path, target: Path) -> None:
    """Gives the file its name unless the name was taken meanwhile, PTM-O001."""
    try:
        os.link(temporary, target)
    except FileExistsError:
        refuse_existing(target)
    except OSError:  # a disk without links: not atomic
        refuse_existing(target)


@contextlib.contextmanager
def _temporary(path: Path) -> Iterator[tuple[IO[bytes], bool]]:
    """A new file, and whether it has the name ``path`` or none yet."""
    try:
        flags = os.O_TMPFILE | os.O_RDWR | os.O_CLOEXEC
        os.stat("/proc/self/fd")
        descriptor = os.open(path.parent, flags, 0o666)
    except (AttributeError, OSError):  # another system, another kind of disk, or a real fault
        with open(path, "x+b") as file:
            yield file, True
        return
    with open(descriptor, "w+b") as file:
        yield file, False


@contextlib.contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turns an OSError while ``path`` is written into an OutputError, PTM-O002 or PTM-O003."""
    try:
        yield
    except OSError as error:
        raise output_error(path, error) from error


def refuse_existing(
    path: str | os.PathLike[str], remedy: str = "use --force to replace it, or specify another file"
) -> None:
    """Raises OutputError PTM-O001 if ``path`` exists."""
    if os.path.lexists(path):
        raise OutputError(
            "PTM-O001",
            "already exists and was not changed",
            file=path,
            remedy=remedy,
        )


def open_regular(path: str | os.PathLike[str]) -> BufferedReader:
    """Opens a regular file for reading; a pipe could block, and a device may never end.

    Raises OSError, with EINVAL for a pipe or device; ValueError for a NUL in the name.
    """
    flags = os.O_RDONLY
    for name in ("O_BINARY", "O_CLOEXEC", "O_NOCTTY", "O_NONBLOCK"):
        flags |= getattr(os, name, 0)
    descriptor = os.open(path, flags)
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "not a regular file", os.fspath(path))
    except BaseException:
        os.close(descriptor)
        raise
    return os.fdopen(descriptor, "rb")


def open_below(root: str | os.PathLike[str], name: str) -> BufferedReader:
    """As `open_regular`, for the file ``name`` (with slashes) of a folder of unknown origin;
    refuses links below ``root``, which may itself be a link.

    Raises OSError, with ELOOP for a link; ValueError.
    """
    path = Path(root)
    for step in name.split("/"):
        path /= step
        if path.is_symlink():
            message = "a symbolic link, which is not followed"
            raise OSError(errno.ELOOP, message, os.fspath(path))
    return open_regular(path)


def real_folder(root: Path, relative: str = "", *, make: bool = True) -> Path:
    """The folder ``relative`` (with slashes) below ``root``, which may itself be a link. Creates
    absent folders, unless ``make`` is False.

    Raises
    ------
    OutputError: PTM-O005 if a component below the root is a symbolic link; PTM-O002 if one is no
        folder, or the name leads out of the root, or a folder cannot be created; PTM-O003.
    """
    path, steps = root, _steps(root, relative)
    with writing(path.joinpath(*steps)):
        if make:
            path.mkdir(parents=True, exist_ok=True)
        for step in steps:
            path /= step
            if make:
                with contextlib.suppress(FileExistsError):
                    path.mkdir()
            mode = _mode(path)
            if stat.S_ISLNK(mode):
                raise _link_error(path)
            if mode and not stat.S_ISDIR(mode):
                raise OutputError(
                    "PTM-O002",
                    "is not a folder",
                    file=path,
                    remedy="move it away, or specify another output",
                )
    return path


def real_place(root: Path, relative: str) -> Path:
    """The path of the file ``relative`` below ``root``, whose folder is created; raises as
    `real_folder`."""
    *folders, name = _steps(root, relative)
    return real_folder(root, "/".join(folders)) / name


def real_file(root: Path, relative: str) -> Path | None:
    """The regular file ``relative`` (with slashes) below ``root``, or None if there is none.

    For files to be moved, removed or continued. Raises OutputError PTM-O005 if it, or a folder on
    its path, is a symbolic link; and as `real_folder`.
    """
    steps = _steps(root, relative)
    if not steps:
        return None
    file = real_folder(root, "/".join(steps[:-1]), make=False) / steps[-1]
    with writing(file):
        mode = _mode(file)
    if stat.S_ISLNK(mode):
        raise _link_error(file)
    return file if stat.S_ISREG(mode) else None


def _steps(root: Path, name: str) -> list[str]:
    """The components of a relative name, which leads out on no system."""
    if not name:
        return []
    if not leads_inside(name):
        raise OutputError(
            "PTM-O002",
            f"{name[:80]!r} would lead out of the folder, or is nested too deep",
            file=root,
            remedy="nothing was written; the name comes from a damaged file",
        )
    return name.split("/")


def leads_inside(name: str) -> bool:
    """Whether a relative name, with slashes, stays below its root on every system."""
    steps = name.split("/")
    unsafe = any(letter in name for letter in "\\\0:") or {"", ".", ".."}.intersection(steps)
    return not unsafe and len(steps) <= _MAX_DEPTH


def _mode(path: Path) -> int:
    """The file mode of a path, of the link itself if it is one; 0 if the path does not exist."""
    try:
        return os.lstat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return 0


def _link_error(path: Path) -> OutputError:
    return OutputError(
        "PTM-O005",
        "is a symbolic link, which is not followed when writing",
        file=path,
        remedy="put a real folder or file in its place, or specify another output",
    )


def exchange(first: Path, second: Path) -> bool:
    """Exchanges the names of two folders of one disk atomically; False where that is impossible."""
    call = getattr(ctypes.CDLL(None), "renameat2", None) if sys.platform == "linux" else None
    if call is None:
        return False
    return bool(call(_HERE, os.fsencode(first), _HERE, os.fsencode(second), _EXCHANGE) == 0)


def output_error(target: str | os.PathLike[str], error: OSError) -> OutputError:
    """The OutputError for an OSError, PTM-O002 or PTM-O003."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return OutputError(
            "PTM-O003",
            "the disk is full",
            file=target,
            remedy="nothing was written; make room or write elsewhere",
        )
    remedy = "check that the folder exists and may be written to"
    if error.errno == errno.ENOENT:
        remedy = f"create the folder {Path(target).parent} first"
    reason = error.strerror or str(error)
    return OutputError("PTM-O002", f"cannot be written ({reason})", file=target, remedy=remedy)
