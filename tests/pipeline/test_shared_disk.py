"""Textures from workers that see the database's disk, or some of them, or none."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ptmtools import parallel
from ptmtools.errors import OutputError, WorkerError
from ptmtools.executor import Executor
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.encoding import (
    Messages,
    SharedDisk,
    TextureOptions,
    TextureTask,
    _sees,
    encode_texture,
    shared_disk,
)
from ptmtools.store.layout import sha256
from ptmtools.store.writer import DatabaseWriter

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"


class Remote(Executor):
    """One machine that sees all disks; it remembers what it was asked."""

    remote = True

    def __init__(self) -> None:
        self.asked: list[str] = []

    def each(self, function: Any, shared: Any, tasks: Any, **settings: Any) -> Iterator[Any]:
        self.asked.append(type(shared).__name__)
        return super().each(function, shared, tasks, **settings)


class Blind(Remote):
    """Of its machines every other one, or none, sees the disk."""

    def __init__(self, half: bool) -> None:
        super().__init__()
        self._half = half

    def each(self, function: Any, shared: Any, tasks: Any, **settings: Any) -> Iterator[Any]:
        if function is _sees:
            return (self._half and task % 2 == 0 for task in tasks)
        return super().each(function, shared, tasks, **settings)


def built(folder: Path, monkeypatch: pytest.MonkeyPatch, executor: Executor) -> dict[str, bytes]:
    monkeypatch.setattr(parallel, "open_executor", lambda *_: executor)
    build_scene(TWO_ROOMS / "two_rooms.obj", folder, scheduler="somewhere")
    return {
        file.relative_to(folder).as_posix(): file.read_bytes()
        for file in folder.rglob("*")
        if file.is_file()
    }


def test_names_or_bytes_make_the_same_database(tmp_path, monkeypatch) -> None:
    near, far, blind = Executor(), Remote(), Blind(half=False)
    expected = built(tmp_path / "near", monkeypatch, near)
    assert built(tmp_path / "far", monkeypatch, far) == expected
    assert built(tmp_path / "blind", monkeypatch, blind) == expected
    assert "SharedDisk" in far.asked
    assert "Messages" not in far.asked
    assert "Messages" in blind.asked


def test_a_disk_that_some_do_not_see_is_an_error(tmp_path, monkeypatch) -> None:
    with pytest.raises(WorkerError, match="PTM-W005"):
        built(tmp_path / "db", monkeypatch, Blind(half=True))


@pytest.fixture
def transaction(tmp_path):
    with DatabaseWriter.open_for_model(tmp_path / "db", "a.obj") as writer:
        yield writer.begin("textures")


def test_an_image_is_found_before_and_after_its_commit(tmp_path, transaction) -> None:
    image = (TWO_ROOMS / "floor.png").read_bytes()
    task = TextureTask("a.png", sha256(image), stem="0")
    database = tmp_path / "db"
    with shared_disk(transaction, database, TextureOptions(), Remote()) as disk:
        assert isinstance(disk, SharedDisk)
        with pytest.raises(WorkerError, match="PTM-W005"):
            encode_texture(disk, task)
        made = []
        for folder in (".ptm-new/scene/stages/images", "stages/images"):
            (database / folder).mkdir(parents=True)
            (database / folder / task.sha256).write_bytes(image)
            made.append([file.sha256 for file in encode_texture(disk, task).files])
            (database / folder / task.sha256).write_bytes(image[:-1])
        assert made[0] == made[1]
        with pytest.raises(WorkerError, match="PTM-W005"):  # damaged, both of them
            encode_texture(disk, task)


def test_a_forgotten_worker_writes_to_nowhere(tmp_path, transaction) -> None:
    image = (TWO_ROOMS / "floor.png").read_bytes()
    folder = tmp_path / "db/stages/images"
    folder.mkdir(parents=True)
    (folder / sha256(image)).write_bytes(image)
    with shared_disk(transaction, tmp_path / "db", TextureOptions(), Remote()) as disk:
        assert isinstance(disk, SharedDisk)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(OutputError):
        encode_texture(disk, TextureTask("a.png", sha256(image), stem="0"))
    assert sorted(tmp_path.rglob("*")) == before


def test_who_shares_memory_needs_no_shared_disk(tmp_path, transaction) -> None:
    with shared_disk(transaction, tmp_path, TextureOptions(), Executor()) as disk:
        assert type(disk) is Messages
