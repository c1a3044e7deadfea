"""Functions that worker processes can import."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import threading
import time
import uuid
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.child import watch_child
from ptmtools.errors import InputError


def slower_at_first(delay: float, i: int) -> int:
    """Finishes in another order than it begins."""
    time.sleep(delay if i % 4 == 0 else 0)
    return i * i


def at(array: np.ndarray, i: int) -> float:
    return float(array[i])


def spoil(array: np.ndarray, _: int) -> int:
    """Against the contract: to see whose array it is."""
    array[:] = -1
    return os.getpid()


def refuse(bad: int, i: int) -> int:
    if i == bad:
        raise InputError("PTM-I999", f"no {i}", file="a.png", place="byte 7", remedy="take another")
    return i


class OddError(Exception):
    """Cannot be built again from its arguments."""

    def __init__(self, one: int, other: int) -> None:
        super().__init__(f"{one} and {other}")


def fail_oddly(_: Any, i: int) -> None:
    raise OddError(i, i)


class Marked:
    """A value that leaves a file for every time that it is unpickled."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.array = np.arange(10_000.0)
        self.kept: list[int] = []

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        (self.folder / uuid.uuid4().hex).touch()


def keep(marked: Marked, i: int) -> tuple[int, int]:
    """(process, how many tasks the one object has met there)."""
    marked.kept.append(i)
    time.sleep(0.02)
    return os.getpid(), len(marked.kept)


def alone(folder: Path, i: int) -> bool:
    """Whether no other call runs in this process."""
    mine = folder / str(os.getpid())
    try:
        mine.mkdir()
    except FileExistsError:
        return False
    time.sleep(0.02)
    mine.rmdir()
    return True


def die(where: int, i: int) -> int:
    if i == where:
        os.kill(os.getpid(), signal.SIGKILL)
    return i


class _Fuse:
    """Kills its process a moment after it was pickled."""

    def __reduce__(self) -> Any:
        threading.Timer(0.01, lambda: os.kill(os.getpid(), signal.SIGKILL)).start()
        return int, ()


def die_while_sending(_: Any, i: int) -> Any:
    return bytes(200_000_000), _Fuse()


def note_and_sleep(folder: Path, seconds: float) -> None:
    (folder / str(os.getpid())).touch()
    time.sleep(seconds)


def stand_still(folder: Path, i: int) -> int:
    """Never returns where its file is not yet in the folder."""
    file = folder / str(i)
    while not file.exists():
        file.touch()
        time.sleep(600)
    return i


def send_half(folder: Path, i: int) -> bytes:
    """As `stand_still`, in the middle of its answer."""
    file = folder / str(i)
    if not file.exists():
        file.touch()

        def send(connection: Connection, answer: bytes) -> None:
            os.write(
                connection.fileno(), struct.pack("!i", len(answer)) + answer[: len(answer) // 2]
            )
            time.sleep(600)

        Connection._send_bytes = send
    return bytes(1000)


def compute(seconds: float, i: int) -> int:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        pass
    return i


def sleep(seconds: float, i: int) -> int:
    time.sleep(seconds)
    return i


def watch_a_child(seconds: float, i: int) -> int:
    with (
        subprocess.Popen(["sleep", str(seconds)]) as child,
        watch_child(child.pid, child.kill, 1.5),
    ):
        child.wait()
    return i


def process(_: Any, i: int) -> int:
    time.sleep(0.02)
    return os.getpid()


class Unreadable:
    """A value that no other process can take in."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        raise InputError("PTM-I999", "cannot be taken in")

    def __getstate__(self) -> dict[str, Any]:
        return {}


def wait_for(file: Path, i: int) -> int:
    """All tasks but the first wait until ``file`` exists."""
    while i and not file.exists():
        time.sleep(0.01)
    return i


def unsendable(_: Any, i: int) -> Any:
    """What cannot be pickled, now and then."""
    return (lambda: i) if i == 1 else i
