"""What a reader does besides reading: where it writes, what else it opens or starts, what it takes.

Python tells an audit hook of every file that is opened, renamed, linked or removed, and of
processes and connections. What compiled libraries open without Python is found by comparing the
folders that nothing may touch.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

_WRITE = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
#: Event → which of its arguments are paths that it changes, and which the descriptor of a folder
#: that goes with each.
_CHANGES: dict[str, tuple[tuple[int, int | None], ...]] = {
    "os.rename": ((0, 2), (1, 3)), "os.link": ((1, 3),), "os.symlink": ((1, 2),),
    "os.mkdir": ((0, 2),), "os.rmdir": ((0, 1),), "os.remove": ((0, 1),),
    "os.truncate": ((0, None),), "os.chmod": ((0, 2),), "os.chown": ((0, 3),),
    "os.utime": ((0, 3),),
    "os.setxattr": ((0, None),), "os.removexattr": ((0, None),),
    "shutil.rmtree": ((0, 1),), "shutil.move": ((0, None), (1, None)),
}  # fmt: skip
_FORBIDDEN = ("subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.fork", "socket.connect",
              "socket.bind", "socket.getaddrinfo", "urllib.", "pickle.find_class")  # fmt: skip


class Watch:
    """Notes what is done outside of ``inside`` between `begin` and `end`.

    Parameters
    ----------
    inside: the folder in which anything may be written.
    outside: a folder that may not even be read.
    """

    def __init__(self, inside: Path, outside: Path) -> None:
        self._inside = os.path.realpath(inside)
        self._outside = os.path.realpath(outside)
        self._watching = False
        self._faults: list[str] = []
        sys.addaudithook(self._hook)

    def begin(self) -> None:
        """From now on."""
        self._faults = []
        self._watching = True

    def end(self) -> list[str]:
        """What was done since that may not be done."""
        self._watching = False
        return self._faults

    def _hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._watching:
            return
        if event == "open":
            self._opened(*arguments)
        elif event in _CHANGES:
            for path, folder in _CHANGES[event]:
                self._changed(event, arguments[path], None if folder is None else arguments[folder])
        elif event.startswith(_FORBIDDEN):
            self._faults.append(f"{event} {str(arguments)[:200]}")

    def _opened(self, path: Any, mode: Any, flags: Any) -> None:
        if isinstance(path, int) or path is None:
            return
        real = os.path.realpath(os.fsdecode(path))
        if isinstance(flags, int) and flags & os.O_NOFOLLOW:
            real = _itself(os.fsdecode(path))
        if isinstance(flags, int) and flags & _WRITE and not self._mine(real):
            self._faults.append(f"opened {real} for writing")
        elif self._within(real, self._outside):
            self._faults.append(f"opened {real}")

    def _changed(self, event: str, path: Any, descriptor: Any) -> None:
        if isinstance(path, int):
            return
        name = os.fsdecode(path)
        if isinstance(descriptor, int) and descriptor >= 0 and not os.path.isabs(name):
            name = os.path.join(os.path.realpath(f"/proc/self/fd/{descriptor}"), name)
        real = _itself(name)
        if not self._mine(real):
            self._faults.append(f"{event} {real}")

    def _mine(self, real: str) -> bool:
        # Kernels that are compiled on the way are kept beside their modules.
        return self._within(real, self._inside) or "__pycache__" in real

    @staticmethod
    def _within(path: str, folder: str) -> bool:
        return path == folder or path.startswith(folder + os.sep)


def _itself(path: str) -> str:
    """Where a path leads, a link at its end being itself."""
    folder, name = os.path.split(os.path.abspath(path))
    return os.path.join(os.path.realpath(folder), name)


def listing(folder: Path) -> dict[str, tuple[int, int, int]]:
    """Kind, size and time of change of all that lies in a folder; links are not followed."""
    found = {}
    for path in sorted(folder.rglob("*")):
        status = os.lstat(path)
        found[str(path)] = (status.st_mode, status.st_size, status.st_mtime_ns)
    return found


def memory_now() -> int:
    """Bytes of memory that this process holds."""
    with open("/proc/self/statm", "rb") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def most_memory() -> int:
    """The most that it held since `forget_most_memory`."""
    with open("/proc/self/status", "rb") as file:
        for line in file:
            if line.startswith(b"VmHWM:"):
                return int(line.split()[1]) * 1024
    return 0


def forget_most_memory() -> None:
    """Starts to count anew."""
    with open("/proc/self/clear_refs", "wb") as file:
        file.write(b"5")
