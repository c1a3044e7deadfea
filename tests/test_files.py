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
from ptmtools.files import open_below, open_regular, real_file, real_folder, write_bytes, write_with

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


def test_a_target_that_is_a_link_is_replaced_itself(tmp_path: Path) -> None:
    (tmp_path / "kept").write_bytes(b"theirs")
    (tmp_path / "link").symlink_to("kept")
    with pytest.raises(OutputError, match="PTM-O001"):
        write_bytes(tmp_path / "link", b"mine")
    write_bytes(tmp_path / "link", b"mine", force=True)
    assert not (tmp_path / "link").is_symlink()
    assert (tmp_path / "link").read_bytes() == b"mine"
    assert (tmp_path / "kept").read_bytes() == b"theirs"


def test_names_that_no_file_has(tmp_path: Path) -> None:
    for force in (False, True):
        with pytest.raises(OutputError, match="PTM-O002"):
            write_bytes(tmp_path / ("a" * 5000), b"", force=force)
        with pytest.raises(OutputError, match="PTM-O002"):
            write_bytes(tmp_path / "a\0b", b"", force=force)
    assert not list(tmp_path.iterdir())


def test_a_dangling_link_leads_nowhere(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("elsewhere")
    with pytest.raises(OutputError, match="PTM-O001"):
        write_bytes(tmp_path / "link", b"mine")
    write_bytes(tmp_path / "link", b"mine", force=True)
    assert [path.name for path in tmp_path.iterdir()] == ["link"]


def test_folders_are_made_below_a_root(tmp_path: Path) -> None:
    made = real_folder(tmp_path / "db", "www/textures")
    assert made == tmp_path / "db/www/textures"
    assert made.is_dir()
    assert real_folder(tmp_path / "db") == tmp_path / "db"
    assert not real_folder(tmp_path / "db", "stages/x", make=False).exists()
    assert not (tmp_path / "db/stages").exists()


@pytest.mark.parametrize("relative", ["www", "www/textures", "www/textures/deeper"])
@pytest.mark.parametrize("make", [False, True])
def test_links_below_the_root_are_refused(relative: str, make: bool, tmp_path: Path) -> None:
    (tmp_path / "outside").mkdir()
    (tmp_path / "db").mkdir()
    place = tmp_path / "db" / relative
    place.parent.mkdir(parents=True, exist_ok=True)
    place.symlink_to(tmp_path / "outside")
    with pytest.raises(OutputError, match="PTM-O005"):
        real_folder(tmp_path / "db", relative, make=make)
    with pytest.raises(OutputError, match="PTM-O005"):
        real_folder(tmp_path / "db", f"{relative}/below", make=make)
    assert not list((tmp_path / "outside").iterdir())


def test_the_root_itself_may_be_a_link(tmp_path: Path) -> None:
    (tmp_path / "big disk").mkdir()
    (tmp_path / "db").symlink_to("big disk")
    real_folder(tmp_path / "db", "www")
    assert (tmp_path / "big disk/www").is_dir()


def test_a_file_in_place_of_a_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "www").write_bytes(b"")
    for make in (False, True):
        with pytest.raises(OutputError, match="PTM-O002"):
            real_folder(tmp_path, "www/textures", make=make)


@pytest.mark.parametrize(
    "name",
    [
        "a/" * 64 + "b",
        "..",
        "a/../b",
        "/etc",
        "a//b",
        "./a",
        "a/",
        "a\\b",
        "C:a",
        "\\\\host\\share",
        "a\0b",
    ],
)
def test_names_that_lead_out_are_refused(name: str, tmp_path: Path) -> None:
    for what in (real_folder, real_file):
        with pytest.raises(OutputError, match="PTM-O002"):
            what(tmp_path, name)
    assert not list(tmp_path.iterdir())


def test_real_files(tmp_path: Path) -> None:
    (tmp_path / "www").mkdir()
    (tmp_path / "www/a").write_bytes(b"a")
    assert real_file(tmp_path, "www/a") == tmp_path / "www/a"
    assert real_file(tmp_path, "www/b") is None
    assert real_file(tmp_path, "nowhere/b") is None
    assert real_file(tmp_path, "www") is None
    assert real_file(tmp_path, "") is None
    os.mkfifo(tmp_path / "www/fifo")
    assert real_file(tmp_path, "www/fifo") is None
    (tmp_path / "www/link").symlink_to("a")
    (tmp_path / "alias").symlink_to("www")
    for name in ("www/link", "alias/a"):
        with pytest.raises(OutputError, match="PTM-O005"):
            real_file(tmp_path, name)


def test_only_files_are_opened(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"a")
    (tmp_path / "link").symlink_to("a")
    for name in ("a", "link"):
        with open_regular(tmp_path / name) as file:
            assert file.read() == b"a"
    os.mkfifo(tmp_path / "fifo")  # nobody writes: opened for reading, it would block
    for other in (tmp_path / "fifo", "/dev/zero", "/dev/null"):
        with pytest.raises(OSError, match="not a regular file"):
            open_regular(other)
    with pytest.raises(IsADirectoryError):
        open_regular(tmp_path)
    with pytest.raises(FileNotFoundError):
        open_regular(tmp_path / "b")


def test_links_below_a_folder_are_not_followed(tmp_path: Path) -> None:
    """However they are reached; but the folder itself may be one."""
    folder, other = tmp_path / "db", tmp_path / "other"
    (folder / "meshes").mkdir(parents=True)
    (other / "meshes").mkdir(parents=True)
    for root in (folder, other):
        (root / "meshes" / "a").write_bytes(root.name.encode())
    (folder / "b").symlink_to(other / "meshes" / "a")
    (folder / "there").symlink_to(other / "meshes")
    (tmp_path / "link").symlink_to(folder)
    for root in (folder, tmp_path / "link"):
        with open_below(root, "meshes/a") as file:
            assert file.read() == b"db"
        for name in ("b", "there/a"):
            with pytest.raises(OSError, match="not followed"):
                open_below(root, name)
