"""Charts by xatlas, in a process of its own.

xatlas 0.0.11 begins to prepare a mesh while others are added, and its threads may read a task in a
list that has moved meanwhile: on a busy machine one build in hundreds crashed. More rarely its
threads do not end when an atlas is destroyed. So it runs in a child,
``python -P -m ptmtools.light.packing``, which replies before it destroys the atlas and ends itself
if that takes too long. A crash or a deadlock costs another attempt in a new child. The result does
not depend on threads.

Tried and rejected: a new child for each atlas, which needs 0.22 s of processor time to start, while
a small mesh is packed in 0.007 s.
"""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints, Singles
from ptmtools.child import module_process, watch_child
from ptmtools.errors import WorkerError
from ptmtools.store.archive import pack_arrays, unpack_arrays

#: Attempts at one atlas, and seconds without any progress after which one ends.
_ATTEMPTS, _IDLE = 3, 20.0
#: Seconds for one atlas: for any, and per byte of the request (a triangle has about 25).
_SECONDS, _SECONDS_PER_BYTE = 600.0, 1e-3
#: Seconds to destroy an atlas, and to wait for a child that was killed.
_DESTRUCTION, _ENDING = 5.0, 10.0
_LENGTH = struct.Struct("<Q")
Mesh = tuple[Singles, NDArray[np.uint32]]


@dataclass(frozen=True)
class PackedCharts:
    """An atlas.

    Attributes
    ----------
    width, height: texels.
    uv: of each mesh (n, 2) in [0, 1], from the upper left.
    index: of each mesh (T, 3) into its `uv`.
    """

    width: int
    height: int
    uv: list[Singles]
    index: list[Ints]


def pack(meshes: Sequence[Mesh], density: float, padding: int) -> PackedCharts:
    """The atlas of some meshes, (V, 3) points and (T, 3) faces, that share no chart.

    density: texels to the unit of the points. padding: texels between charts beyond those that are
    read.

    Raises WorkerError: PTM-W004 xatlas ended the process in all attempts, PTM-W006 it stood still
    in the last one.
    """
    points, faces = zip(*meshes, strict=True)
    request = {**_concatenate("points", points), **_concatenate("faces", faces)}
    request["options"] = np.array([density, padding], np.float64)
    reply = unpack_arrays(_ask(pack_arrays(request)), file="xatlas")
    width, height = reply["size"].tolist()
    return PackedCharts(width, height, _split(reply, "uv"), _split(reply, "index"))


def _concatenate(name: str, arrays: Sequence[NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Arrays as one: a message of many is slow."""
    rows = np.array([len(array) for array in arrays], np.int64)
    return {name: np.concatenate(arrays), f"{name}_rows": rows}


def _split(message: Mapping[str, NDArray[Any]], name: str) -> list[Any]:
    """Inverse of `_concatenate`."""
    return np.split(message[name], np.cumsum(message[f"{name}_rows"])[:-1])


#: The child of a process, by the number of that process: a fork has none.
_child: tuple[int, subprocess.Popen[bytes]] | None = None
_asking = threading.Lock()


def _ask(request: bytes) -> bytes:
    """The reply of the child, which is started at the first request and after a failure."""
    global _child
    with _asking:
        for _ in range(_ATTEMPTS):
            if _child is None or _child[0] != os.getpid():
                _child = os.getpid(), _start()
            process, reply = _child[1], None
            assert process.stdin
            assert process.stdout
            watch = watch_child(process.pid, process.kill, _IDLE)
            try:
                with watch, suppress(OSError):
                    _send(process.stdin, request)
                    reply = _receive(process.stdout)
            finally:  # Ctrl-C, too: the next request must not get this reply
                if reply is None or watch.expired:
                    _child = None
                    process.kill()
                    with suppress(subprocess.TimeoutExpired):
                        process.communicate(timeout=_ENDING)
            if reply is not None:
                return reply
    raise WorkerError(
        "PTM-W006" if watch.expired else "PTM-W004",
        f"xatlas {'stands still' if watch.expired else 'crashes'} while it lays out lightmaps",
        remedy="build with --light none",
    )


def _start() -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        **module_process("ptmtools.light.packing"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )


def _send(stream: IO[bytes], message: bytes) -> None:
    stream.write(_LENGTH.pack(len(message)))
    stream.write(message)
    stream.flush()


def _receive(stream: IO[bytes]) -> bytes | None:
    """The next message; None at the end of a stream."""
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    message = stream.read(length)
    return message if len(message) == length else None


def _serve() -> None:
    """Replies to requests until there are no more."""
    import faulthandler
    import signal

    # Ctrl-C is for the parent, whose end ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests, replies = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no reply
    while (request := _receive(requests)) is not None:
        seconds = _SECONDS + _SECONDS_PER_BYTE * len(request)
        # These timers end the process even if no other thread of it can run.
        faulthandler.dump_traceback_later(seconds, exit=True)
        atlas, reply = _reply(request)
        _send(replies, reply)
        faulthandler.dump_traceback_later(_DESTRUCTION, exit=True)
        del atlas
        faulthandler.cancel_dump_traceback_later()


def _reply(request: bytes) -> tuple[object, bytes]:
    """The atlas, which is destroyed with its last reference, and the reply."""
    import xatlas

    message = unpack_arrays(request, file="request")
    density, padding = message["options"].tolist()
    meshes = list(zip(_split(message, "points"), _split(message, "faces"), strict=True))
    atlas: Any = xatlas.Atlas()
    for points, faces in meshes:
        atlas.add_mesh(points, faces)
    packing = xatlas.PackOptions()
    packing.padding, packing.bilinear = int(padding), True
    packing.texels_per_unit = density
    atlas.generate(xatlas.ChartOptions(), packing)
    _, index, uv = zip(*(atlas.get_mesh(k) for k in range(len(meshes))), strict=True)
    reply = {
        **_concatenate("uv", uv),
        **_concatenate("index", [corners.astype(np.int64) for corners in index]),
    }
    reply["size"] = np.array([atlas.width, atlas.height], np.int64)
    return atlas, pack_arrays(reply)


if __name__ == "__main__":
    _serve()
