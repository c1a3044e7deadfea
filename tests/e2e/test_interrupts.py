"""Ctrl-C while processes encode textures and subdivide beside the thread that cuts cells."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.e2e.conftest import TWO_ROOMS, listing

PTM = [sys.executable, "-m", "ptmtools"]


@pytest.fixture(scope="module")
def museum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Large enough for processes beside: 4,000 triangles, and 8 textures."""
    folder = tmp_path_factory.mktemp("museum")
    script = TWO_ROOMS.parent / "make_museum.py"
    options = ["--rooms", "4", "--textures", "18", "--size", "512"]
    subprocess.run([sys.executable, script, "-o", folder, *options], check=True)
    return folder / "museum.obj"


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.002)


def in_session(leader: int) -> list[int]:
    """The living processes of a session but its leader."""
    found = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session = file.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(session) == leader != int(file.parent.name) and state != "Z":
            found.append(int(file.parent.name))
    return found


def interrupted(museum: Path, db: Path, begun: Callable[[subprocess.Popen[str]], bool]) -> str:
    """What a build has told when it was interrupted, as a terminal does it, at a moment."""
    command = [*PTM, "build-scene", museum, "-o", db, "-j", "2", "-q"]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as build:
        until(lambda: begun(build))
        os.killpg(build.pid, signal.SIGINT)
        _, told = build.communicate()
    assert build.returncode == 130
    until(lambda: not in_session(build.pid))
    return told


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="another system")
def test_all_end_at_once_and_only_the_parent_speaks(tmp_path: Path, museum: Path) -> None:
    db = tmp_path / "db"
    staged = db / ".ptm-new/textures"
    for begun in (
        lambda build: len(in_session(build.pid)) > 1,  # one is being started
        lambda _: any(staged.rglob("*.ptm")),
    ):
        told = interrupted(museum, db, begun)
        assert told == "ptm: interrupted; run the same command again to resume [PTM-X130]\n"
    again = [*PTM, "build-scene", museum, "-q", "-o"]
    subprocess.run([*again, db, "-j", "2"], check=True)
    subprocess.run([*again, tmp_path / "whole", "-j", "1"], check=True)
    assert listing(db) == listing(tmp_path / "whole")
