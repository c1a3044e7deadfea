"""Builds into stores of objects: what is sent, interruptions, several machines and processes."""

from __future__ import annotations

import logging
import os
import pickle
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cells.options import SubdivideOptions
from ptmtools.cluster import Cluster
from ptmtools.errors import DatabaseError, OutputError
from ptmtools.output import EmitOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.encoding import TextureOptions
from ptmtools.store import lists
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import IMAGES, MANIFEST
from ptmtools.store.objects import Objects
from ptmtools.store.remote import RemoteDatabase, fetch_database
from ptmtools.texture.images.png import png_bytes
from tests.conftest import files_below
from tests.e2e.conftest import make_museum
from tests.parallel.urls import (
    DIM,
    EMBREE,
    FAST,
    built_here,
    few_in_lists,
    manifest_of,
    objects_of,
    painted,
)
from tests.stores import Store


def test_workers_that_share_no_folder(
    store: Store,
    bucket: str,
    tmp_path: Path,
    machine: Callable[[], Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Model and database are objects; a worker is killed; the bytes are those of a local build."""
    from distributed import LocalCluster

    model = make_museum(tmp_path / "model", size=96)
    for name, data in files_below(model.parent).items():
        store.client().put_object(Bucket=bucket, Key=f"models/{name}", Body=data)
    expected = built_here(model, tmp_path / "here")

    asked: list[tuple[str, int]] = []
    each = Cluster.each

    def recorded(self: Cluster, function: Any, shared: Any, tasks: Any, **settings: Any) -> Any:
        def seen(values: Any) -> Iterator[Any]:
            for value in values:
                asked.append((function.__name__, len(pickle.dumps(value))))
                yield value

        asked.append((function.__name__, len(pickle.dumps(shared))))
        return seen(each(self, function, shared, seen(tasks), **settings))

    monkeypatch.setattr(Cluster, "each", recorded)
    monkeypatch.setattr("ptmtools.pipeline.encoding.SharedUrl.most_images", 1)
    # One loop over all textures: the worker is killed during it, not before the next one begins.
    monkeypatch.setattr("ptmtools.parallel.Workers.background", lambda *_: None)
    killed: list[int] = []
    # boto adds it to the agent of each request.
    env = {"AWS_SDK_UA_APP_ID": "worker", "XDG_CACHE_HOME": str(tmp_path / "of-workers")}
    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address=":0",
        silence_logs=logging.CRITICAL,
        env=env,
    ) as cluster:

        def progress(done: int, total: int, unit: str) -> None:
            if unit == "textures" and 0 < done < total and not killed:
                killed.append(cluster.workers[0].pid)
                os.kill(killed[0], signal.SIGKILL)

        store.requests.clear()
        build_scene(
            f"s3://{bucket}/models/{model.name}",
            f"s3://{bucket}/museum.db",
            EMBREE,
            DIM,
            scheduler=cluster.scheduler_address,
            progress=progress,
        )
    assert killed
    requests = list(store.requests)
    by_workers = [request for request in requests if "app/worker" in request.agent]
    begin = f"/{bucket}/museum.db/objects/"
    read = {r.path for r in by_workers if r.method == "GET"}
    written = {r.path.removeprefix(begin) for r in by_workers if r.method == "PUT"}
    manifest = manifest_of(store, bucket, "museum.db")
    outputs = manifest.outputs()
    images = {digest for name, digest in outputs.items() if name.startswith(f"{IMAGES}/")}
    textures = set(manifest.stages["textures"].outputs.values())
    assert len(images) == 9
    files = set(manifest.stages["scene"].inputs) - {"museum.obj", "museum.mtl"}
    assert read == {f"/{bucket}/models/{name}" for name in files}
    assert images | textures <= written
    # No image is sent, and no texture fetched, but for the coarse levels that probes see.
    others = [r for r in requests if r not in by_workers]
    assert not {r.path.removeprefix(begin) for r in others if not r.ranged} & (images | textures)
    assert not {r.path.removeprefix(begin) for r in others} & images
    # Names and digests alone passed through the scheduler.
    assert max(size for name, size in asked if name == "encode_texture") < 2000
    assert sum(len(data) for name, data in expected.items() if name.endswith(".ptm")) > 50_000

    machine()
    assert files_below(fetch_database(f"s3://{bucket}/museum.db")) == expected


@pytest.mark.parametrize("inline", [lists.INLINE, 4])
def test_an_update_sends_what_changed_and_removes_the_rest(
    store: Store,
    bucket: str,
    rooms: Path,
    tmp_path: Path,
    machine: Callable[[], Path],
    monkeypatch: pytest.MonkeyPatch,
    inline: int,
) -> None:
    """Also where the manifest has lists."""
    monkeypatch.setattr(lists, "INLINE", inline)
    monkeypatch.setattr(lists, "MEAN", 4)
    url = f"s3://{bucket}/db"
    report = build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    assert report.database == url
    before = manifest_of(store, bucket, "db").files()
    assert objects_of(store, bucket, "db") == set(before.values())
    store.requests.clear()
    build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    assert store.written(bucket) == []
    machine()  # which has no copy yet
    (rooms.parent / "floor.png").write_bytes(png_bytes(np.zeros((8, 8, 3), np.uint8)))
    store.requests.clear()
    build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    after = manifest_of(store, bucket, "db").files()
    new = {f"db/objects/{digest}" for digest in set(after.values()) - set(before.values())}
    written = store.written(bucket)
    assert (set(written[:-1]), written[-1]) == (new, f"db/{MANIFEST}")
    assert objects_of(store, bucket, "db") == set(after.values())
    expected = built_here(rooms, tmp_path / "here", FAST)
    assert files_below(fetch_database(url)) == expected


def test_an_interrupted_build_leaves_the_former_database(
    store: Store,
    bucket: str,
    rooms: Path,
    monkeypatch: pytest.MonkeyPatch,
    machine: Callable[[], Path],
) -> None:
    url = f"s3://{bucket}/db"
    build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    before = manifest_of(store, bucket, "db")
    (rooms.parent / "floor.png").write_bytes(png_bytes(np.zeros((8, 8, 3), np.uint8)))
    monkeypatch.setattr(
        store, "refuse", lambda request: request.method == "PUT" and MANIFEST in request.path
    )
    with pytest.raises(OutputError, match="PTM-O012"):
        build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    assert manifest_of(store, bucket, "db") == before
    assert set(before.outputs().values()) <= objects_of(store, bucket, "db")
    monkeypatch.setattr(store, "refuse", lambda request: False)
    # A reader sees the former state, and leaves the copy of the build alone.
    former = DatabaseFolder.open(fetch_database(url))
    assert former.manifest == before
    assert former.first_damage(before.files()) is None
    store.requests.clear()
    report = build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    # The copy was ahead: nothing is computed or sent again.
    assert not any(stage.ran for stage in report.stages)
    assert store.written(bucket) == [f"db/{MANIFEST}"]
    machine()
    assert MANIFEST in files_below(fetch_database(url))


def test_two_machines_alternate(
    store: Store,
    bucket: str,
    rooms: Path,
    tmp_path: Path,
    machine: Callable[[], Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The copy of one has older textures than the URL."""
    few_in_lists(monkeypatch)
    url, others = f"s3://{bucket}/db", EmitOptions(format="vrml,interlace")
    one, other = machine(), machine()

    def build(at: Path, *options: Any) -> None:
        monkeypatch.setenv("XDG_CACHE_HOME", str(at))
        build_scene(rooms, url, EMBREE, DIM, FAST, *options, workers=1)

    build(one)
    painted(rooms, "floor.png", 80)
    build(other)
    painted(rooms, "room_a.png", 160)
    build(one)
    build(one, others)
    machine()
    assert files_below(fetch_database(url)) == built_here(rooms, tmp_path / "here", FAST, others)


def test_local_processes_encode_images_of_the_url(
    store: Store, bucket: str, tmp_path: Path, machine: Callable[[], Path]
) -> None:
    model, url = make_museum(tmp_path / "model", size=64), f"s3://{bucket}/db"
    build_scene(model, url, EMBREE, DIM, FAST, workers=1)
    machine()
    other = TextureOptions(fallback=False, max_side=32)
    build_scene(model, url, EMBREE, DIM, other, SubdivideOptions(wall_area=1.5), workers=3)
    machine()
    here = tmp_path / "here"
    build_scene(model, here, EMBREE, DIM, other, SubdivideOptions(wall_area=1.5), workers=1)
    assert files_below(fetch_database(url)) == files_below(here)


def test_later_stages_read_what_they_need(
    store: Store, bucket: str, rooms: Path, tmp_path: Path, machine: Callable[[], Path]
) -> None:
    """On another machine, with served files that need the heads and bytes of textures."""
    url = f"s3://{bucket}/db"
    build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    machine()
    store.requests.clear()
    (rooms.parent / "floor.png").write_bytes(png_bytes(np.zeros((8, 8, 3), np.uint8)))
    options = EmitOptions(format="vrml,gltf,interlace")
    build_scene(rooms, url, EMBREE, DIM, FAST, options, workers=1)
    outputs = manifest_of(store, bucket, "db").outputs()
    read = {r.path.rpartition("/")[2] for r in store.requests if r.method == "GET"}
    cells = {digest for name, digest in outputs.items() if name.startswith("www/cells/")}
    assert cells
    assert not read & cells
    expected = built_here(rooms, tmp_path / "here", FAST, options)
    assert files_below(fetch_database(url)) == expected


@pytest.mark.parametrize("checked_by", ["listing", "store"])
def test_two_builds_at_a_time(
    store: Store,
    bucket: str,
    rooms: Path,
    machine: Callable[[], Path],
    monkeypatch: pytest.MonkeyPatch,
    checked_by: str,
) -> None:
    """The later one refuses; by itself, or because the store does."""
    url = f"s3://{bucket}/db"
    slow = RemoteDatabase(url)
    slow.fetch(new=True)
    build_scene(rooms, slow.folder, EMBREE, DIM, FAST, workers=1)
    machine()
    build_scene(rooms, url, EMBREE, DIM, TextureOptions(), workers=1)
    first = manifest_of(store, bucket, "db")
    if checked_by == "store":
        info = Objects.info
        stale = [None]

        def late(self: Objects, name: str) -> Any:
            return stale.pop() if stale else info(self, name)

        monkeypatch.setattr(Objects, "info", late)
    with pytest.raises(DatabaseError, match="PTM-D007"):
        slow.commit()
    assert manifest_of(store, bucket, "db") == first
    assert set(first.outputs().values()) <= objects_of(store, bucket, "db")
