"""Ctrl-C while processes encode textures and subdivide beside the thread that cuts cells."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.e2e.conftest import listing, make_museum

#: Stages after those that are disturbed are as quick as they can be.
QUICK = ["--light", "none", "--samples", "1"]
BUILD = [sys.executable, "-m", "ptmtools", "build-scene", *QUICK]


@pytest.fixture(scope="module")
def museum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Large enough for processes beside: 4,000 triangles, and 8 textures."""
    return make_museum(tmp_path_factory.mktemp("museum"), rooms=4, textures=18, size=256)


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.002)


def in_session(leader: int) -> list[int]:
    """The living processes of a session but its leader."""
    actual = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session = file.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(session) == leader != int(file.parent.name) and state != "Z":
            actual.append(int(file.parent.name))
    return actual


Build = subprocess.Popen[str]


def disturbed(
    museum: Path, db: Path, moment: Callable[[Build], bool], deed: Callable[[Build], object]
) -> tuple[int, str]:
    """The status of a build to which something is done at a moment, and what it has printed."""
    command = [*BUILD, museum, "-o", db, "-j", "2", "-q"]
    with subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # What is started in the background may have been told to ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as build:
        until(lambda: moment(build))
        deed(build)
        _, printed = build.communicate()
    until(lambda: not in_session(build.pid))
    return build.returncode, printed


pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="another system")


def test_all_end_at_once_and_only_the_parent_speaks(tmp_path: Path, museum: Path) -> None:
    db = tmp_path / "db"
    staged = db / ".ptm-new/textures"
    for begun in (
        lambda build: len(in_session(build.pid)) > 1,  # one is being started
        lambda _: any(staged.rglob("*.ptm")),
    ):
        status, printed = disturbed(
            museum, db, begun, lambda build: os.killpg(build.pid, signal.SIGINT)
        )
        assert status == 130
        assert printed == "ptm: interrupted; run the same command again to resume [PTM-X130]\n"
    again = [*BUILD, museum, "-q", "-o"]
    subprocess.run([*again, db, "-j", "2"], check=True)
    subprocess.run([*again, tmp_path / "whole", "-j", "1"], check=True)
    assert listing(db) == listing(tmp_path / "whole")


def test_a_lost_worker_ends_the_build_and_leaves_what_is_finished(
    tmp_path: Path, museum: Path
) -> None:
    db = tmp_path / "db"
    staged = db / ".ptm-new/textures"

    def kill_the_workers(build: Build) -> None:
        for process in in_session(build.pid):
            if b"spawn_main" in Path(f"/proc/{process}/cmdline").read_bytes():
                os.kill(process, signal.SIGKILL)

    status, printed = disturbed(museum, db, lambda _: any(staged.rglob("*.ptm")), kill_the_workers)
    assert (status, printed.count("\n")) == (9, 1), printed
    assert "PTM-W004" in printed
    again = [*BUILD, museum, "-o", db, "--json"]
    done = subprocess.run(again, check=True, stdout=subprocess.PIPE)
    (textures,) = (s for s in json.loads(done.stdout)["stages"] if s["stage"] == "textures")
    _, kept, resumed = textures["tasks"]
    assert kept == 0
    assert resumed > 0
