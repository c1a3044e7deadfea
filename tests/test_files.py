"""A file is, at any moment, as it was before or whole."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import IO

import pytest

from ptmtools.errors import OutputError
from ptmtools.files import write_bytes, write_with

KILLED = """
import os, signal, sys
from ptmtools.files import write_with
def write(file):
    file.write(b"half")
    file.flush()
    os.kill(os.getpid(), signal.SIGKILL)
write_with(sys.argv[1], write, force=True)
"""


def unnamed_files(folder: Path) -> bool:
    """Whether this system, and this disk, can have files without a name."""
    try:
        os.close(os.open(folder, os.O_TMPFILE | os.O_RDWR))
    except (AttributeError, OSError):
        return False
    return os.path.exists("/proc/self/fd")


def test_a_killed_process_leaves_nothing(tmp_path: Path) -> None:
    if not unnamed_files(tmp_path):
        pytest.skip("this disk has no files without a name")
    (tmp_path / "a").write_bytes(b"before")
    run = subprocess.run([sys.executable, "-c", KILLED, tmp_path / "a"])
    assert run.returncode == -signal.SIGKILL
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_bytes() == b"before"


@pytest.mark.parametrize("unnamed", [True, False])
def test_a_file_appears_when_it_is_whole(
    unnamed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not unnamed:
        monkeypatch.delattr(os, "O_TMPFILE", raising=False)
    (tmp_path / "a").write_bytes(b"before")

    def write(file: object) -> None:
        file.write(b"after, ")  # type: ignore[attr-defined]
        assert (tmp_path / "a").read_bytes() == b"before"
        file.write(b"whole")  # type: ignore[attr-defined]
        file.seek(2)  # type: ignore[attr-defined]
        assert file.read(3) == b"ter"  # type: ignore[attr-defined]

    write_with(tmp_path / "a", write, force=True)
    assert (tmp_path / "a").read_bytes() == b"after, whole"
    umask = os.umask(0)
    os.umask(umask)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o666 & ~umask
    with pytest.raises(OutputError, match="PTM-O001"):
        write_bytes(tmp_path / "a", b"no")
    with pytest.raises(ZeroDivisionError):
        write_with(tmp_path / "b", lambda file: 1 // 0)
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize("force", [False, True])
def test_a_file_that_came_to_be_meanwhile_is_not_written_over(tmp_path: Path, force: bool) -> None:
    target = tmp_path / "a"

    def write(file: IO[bytes]) -> None:
        file.write(b"mine")
        target.write_bytes(b"theirs")

    if force:
        write_with(target, write, force=True)
        assert target.read_bytes() == b"mine"
    else:
        with pytest.raises(OutputError, match="PTM-O001"):
            write_with(target, write)
        assert target.read_bytes() == b"theirs"
    assert list(tmp_path.iterdir()) == [target]
