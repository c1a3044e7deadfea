"""xatlas in a process of its own, which may crash."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from ptmtools.errors import WorkerError
from ptmtools.light import packing
from ptmtools.light.packing import Mesh, pack

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
MESHES: list[Mesh] = [(SQUARE + 3 * k, FACES) for k in range(3)]


def the_child() -> Any:
    assert packing._child
    return packing._child[1]


def test_meshes_share_no_place() -> None:
    packed = pack(MESHES, 16.0, 1)
    assert len(packed.uv) == len(packed.index) == 3
    size = [packed.width, packed.height]
    low, high = (
        np.array([end(uv[index].reshape(-1, 2) * size, axis=0)
                  for uv, index in zip(packed.uv, packed.index, strict=True)])
        for end in (np.min, np.max)
    )  # fmt: skip
    for a in range(3):
        for b in range(a):
            assert (low[a] > high[b]).any() or (low[b] > high[a]).any()
    assert (high - low).min() == pytest.approx(16, abs=2)


def test_a_crash_costs_another_attempt(monkeypatch: pytest.MonkeyPatch) -> None:
    first = pack(MESHES, 16.0, 1)
    before = the_child()
    send = packing._send

    def crashing(stream: Any, message: bytes) -> None:
        if the_child() is before:
            os.kill(before.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
            before.wait()
        send(stream, message)

    monkeypatch.setattr(packing, "_send", crashing)
    again = pack(MESHES, 16.0, 1)
    assert the_child() is not before
    assert (again.width, again.height) == (first.width, first.height)
    for one, other in zip(first.uv + first.index, again.uv + again.index, strict=True):
        assert np.array_equal(one, other)


def test_crashes_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packing, "_receive", lambda stream: None)
    with pytest.raises(WorkerError, match="xatlas crashes") as refused:
        pack(MESHES, 16.0, 1)
    assert refused.value.code == "PTM-W004"


SILENT = "import time; time.sleep(600)"
HALF = """
import struct, sys, time
sys.stdout.buffer.write(struct.pack("<Q", 1000) + bytes(10))
sys.stdout.flush()
time.sleep(600)
"""
#: An atlas whose destruction does not end.
STUCK = """
import time
from ptmtools.light import packing

class Atlas:
    def __init__(self, atlas):
        self.atlas = atlas
    def __del__(self):
        time.sleep(600)

reply = packing._reply
def with_stuck_atlas(request):
    atlas, message = reply(request)
    return Atlas(atlas), message

packing._reply, packing._DESTRUCTION = with_stuck_atlas, 0.05
packing._serve()
"""


def planted(monkeypatch: pytest.MonkeyPatch, *scripts: str) -> None:
    """Makes the next children run scripts."""
    rest, start = list(scripts), packing._start

    def started() -> subprocess.Popen[bytes]:
        if not rest:
            return start()
        command = [sys.executable, "-c", rest.pop(0)]
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    monkeypatch.setattr(packing, "_start", started)
    monkeypatch.setattr(packing, "_child", None)


def test_a_child_that_stands_still_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    planted(monkeypatch, SILENT, HALF)
    monkeypatch.setattr(packing, "_IDLE", 0.5)
    assert pack(MESHES, 16.0, 1).width > 0


def test_children_that_stand_still_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    planted(monkeypatch, SILENT, HALF, SILENT)
    monkeypatch.setattr(packing, "_IDLE", 0.2)
    with pytest.raises(WorkerError, match="xatlas stands still") as refused:
        pack(MESHES, 16.0, 1)
    assert refused.value.code == "PTM-W006"
    assert packing._child is None


def test_the_reply_comes_before_the_destruction(monkeypatch: pytest.MonkeyPatch) -> None:
    planted(monkeypatch, STUCK)
    first = pack(MESHES, 16.0, 1)
    stuck = the_child()
    assert stuck.wait(10) == 1  # by itself
    again = pack(MESHES, 16.0, 1)
    assert the_child() is not stuck
    assert (again.width, again.height) == (first.width, first.height)
