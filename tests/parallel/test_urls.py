"""Databases and models at a URL, in a real S3 server; and workers that share no folder."""

from __future__ import annotations

import json
import logging
import os
import pickle
import shutil
import signal
from collections.abc import Callable, Iterator, Mapping
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cells.options import SubdivideOptions
from ptmtools.cluster import Cluster
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import DatabaseError, InputError, OutputError
from ptmtools.output import EmitOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.encoding import TextureOptions
from ptmtools.pipeline.stages import STAGES
from ptmtools.store import lists
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import IMAGES, MANIFEST
from ptmtools.store.lists import read_list
from ptmtools.store.manifest import Manifest
from ptmtools.store.objects import Objects
from ptmtools.store.remote import RemoteDatabase, fetch_database, fetch_model
from ptmtools.texture.images.png import png_bytes
from tests.conftest import files_below
from tests.e2e.conftest import Ptm, make_museum, ptm
from tests.stores import CREDENTIALS, Store, gs_store, s3_store

__all__ = ["ptm"]

ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"
EMBREE = AchOptions(backend="embree")
FAST = TextureOptions(fallback=False)
_number = count()


@pytest.fixture(scope="module")
def running(require: Callable[[str, str], None]) -> Iterator[Store]:
    for module in ("s3fs", "moto", "flask", "distributed"):
        if not find_spec(module):
            require(module, "pip install -e '.[dev]'")
    with s3_store() as store:
        yield store


@pytest.fixture
def store(running: Store, monkeypatch: pytest.MonkeyPatch, machine: Callable[[], Path]) -> Store:
    for name, value in CREDENTIALS.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("AWS_ENDPOINT_URL", running.url)
    running.requests.clear()
    monkeypatch.setattr(running, "refuse", lambda request: False)
    machine()
    return running


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], Path]:
    """From the call on, this process has another cache folder, as on another machine."""

    def another() -> Path:
        folder = tmp_path / f"machine-{next(_number)}"
        monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
        return folder

    return another


@pytest.fixture
def bucket(store: Store) -> str:
    name = f"builds-{next(_number)}"
    store.make_bucket(name)
    return name


@pytest.fixture
def rooms(tmp_path: Path) -> Path:
    """A model of two rooms, to be changed."""
    return Path(shutil.copytree(ROOMS, tmp_path / "rooms")) / "two_rooms.obj"


def built_here(model: Path, folder: Path, *options: Any) -> dict[str, bytes]:
    build_scene(model, folder, EMBREE, *options, workers=1)
    return files_below(folder)


def manifest_of(store: Store, bucket: str, prefix: str) -> Manifest:
    body = store.client().get_object(Bucket=bucket, Key=f"{prefix}/{MANIFEST}")["Body"]

    def read(digest: str) -> Mapping[str, str]:
        key = f"{prefix}/objects/{digest}"
        return read_list(store.client().get_object(Bucket=bucket, Key=key)["Body"].read(), file=key)

    return Manifest.from_bytes(body.read(), file=MANIFEST, lists=read)


def objects_of(store: Store, bucket: str, prefix: str) -> set[str]:
    rows = store.client().list_objects_v2(Bucket=bucket, Prefix=f"{prefix}/objects/")
    return {row["Key"].rpartition("/")[2] for row in rows.get("Contents", ())}


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
    monkeypatch.setattr("ptmtools.pipeline.stages.textures.IMAGES_PER_MESSAGE", 1)
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
    # No image is sent, and no texture fetched.
    others = {r.path.removeprefix(begin) for r in requests if r not in by_workers}
    assert not others & (images | textures)
    # Names and digests alone passed through the scheduler.
    assert {name for name, _ in asked if name.startswith("encoded")} == {"encoded_at_url"}
    assert max(size for name, size in asked if name.startswith("encoded")) < 2000
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
    report = build_scene(rooms, url, EMBREE, FAST, workers=1)
    assert report.database == url
    before = manifest_of(store, bucket, "db").files()
    assert objects_of(store, bucket, "db") == set(before.values())
    store.requests.clear()
    build_scene(rooms, url, EMBREE, FAST, workers=1)
    assert store.written(bucket) == []
    machine()  # which has no copy yet
    (rooms.parent / "floor.png").write_bytes(png_bytes(np.zeros((8, 8, 3), np.uint8)))
    store.requests.clear()
    build_scene(rooms, url, EMBREE, FAST, workers=1)
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
    build_scene(rooms, url, EMBREE, FAST, workers=1)
    before = manifest_of(store, bucket, "db")
    (rooms.parent / "floor.png").write_bytes(png_bytes(np.zeros((8, 8, 3), np.uint8)))
    monkeypatch.setattr(
        store, "refuse", lambda request: request.method == "PUT" and MANIFEST in request.path
    )
    with pytest.raises(OutputError, match="PTM-O012"):
        build_scene(rooms, url, EMBREE, FAST, workers=1)
    assert manifest_of(store, bucket, "db") == before
    assert set(before.outputs().values()) <= objects_of(store, bucket, "db")
    monkeypatch.setattr(store, "refuse", lambda request: False)
    # A reader sees the former state, and leaves the copy of the build alone.
    former = DatabaseFolder.open(fetch_database(url))
    assert former.manifest == before
    assert former.damaged(before.files()) is None
    store.requests.clear()
    report = build_scene(rooms, url, EMBREE, FAST, workers=1)
    # The copy was ahead: nothing is computed or sent again.
    assert not any(stage.ran for stage in report.stages)
    assert store.written(bucket) == [f"db/{MANIFEST}"]
    machine()
    assert MANIFEST in files_below(fetch_database(url))


def painted(rooms: Path, name: str, color: int) -> None:
    (rooms.parent / name).write_bytes(png_bytes(np.full((24, 24, 3), color, np.uint8)))


def few_in_lists(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lists, "INLINE", 4)
    monkeypatch.setattr(lists, "MEAN", 4)


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
    url, looks = f"s3://{bucket}/db", EmitOptions(first_look=16)
    one, other = machine(), machine()

    def build(at: Path, *options: Any) -> None:
        monkeypatch.setenv("XDG_CACHE_HOME", str(at))
        build_scene(rooms, url, EMBREE, FAST, *options, workers=1)

    build(one)
    painted(rooms, "floor.png", 80)
    build(other)
    painted(rooms, "room_a.png", 160)
    build(one)
    build(one, looks)
    machine()
    assert files_below(fetch_database(url)) == built_here(rooms, tmp_path / "here", FAST, looks)


@pytest.mark.parametrize("first", [True, False])
def test_a_refused_manifest_with_lists(
    store: Store,
    bucket: str,
    rooms: Path,
    tmp_path: Path,
    machine: Callable[[], Path],
    monkeypatch: pytest.MonkeyPatch,
    first: bool,
) -> None:
    """The lists of the refused one are at the URL; the next manifest, or machine, needs them."""
    few_in_lists(monkeypatch)
    url = f"s3://{bucket}/db"
    plain = (rooms.parent / "floor.png").read_bytes()

    def refused(request: Any) -> bool:
        return bool(request.method == "PUT" and MANIFEST in request.path)

    if not first:
        build_scene(rooms, url, EMBREE, FAST, workers=1)
        painted(rooms, "floor.png", 80)
    with monkeypatch.context() as patch:
        patch.setattr(store, "refuse", refused)
        with pytest.raises(OutputError, match="PTM-O012"):
            build_scene(rooms, url, EMBREE, FAST, workers=1)
    (rooms.parent / "floor.png").write_bytes(plain)
    if first:
        machine()
    build_scene(rooms, url, EMBREE, FAST, workers=1)
    machine()
    assert files_below(fetch_database(url)) == built_here(rooms, tmp_path / "here", FAST)


def test_local_processes_encode_images_of_the_url(
    store: Store, bucket: str, tmp_path: Path, machine: Callable[[], Path]
) -> None:
    model, url = make_museum(tmp_path / "model", size=64), f"s3://{bucket}/db"
    build_scene(model, url, EMBREE, FAST, workers=1)
    machine()
    other = TextureOptions(fallback=False, max_side=32)
    build_scene(model, url, EMBREE, other, SubdivideOptions(wall_area=1.5), workers=3)
    machine()
    here = tmp_path / "here"
    build_scene(model, here, EMBREE, other, SubdivideOptions(wall_area=1.5), workers=1)
    assert files_below(fetch_database(url)) == files_below(here)


@pytest.mark.parametrize("damage", ["lost", "damaged"])
def test_a_list_that_is_lost_at_the_url(
    store: Store,
    bucket: str,
    rooms: Path,
    tmp_path: Path,
    machine: Callable[[], Path],
    monkeypatch: pytest.MonkeyPatch,
    damage: str,
) -> None:
    few_in_lists(monkeypatch)
    url = f"s3://{bucket}/db"
    build_scene(rooms, url, EMBREE, FAST, workers=1)
    lists_of = {n: r.list_files() for n, r in manifest_of(store, bucket, "db").stages.items()}
    shared = {d for stage, own in lists_of.items() if stage != "emit" for d in own.values()}
    digest = min(set(lists_of["emit"].values()) - shared)
    key = {"Bucket": bucket, "Key": f"db/objects/{digest}"}
    if damage == "lost":
        store.client().delete_object(**key)
    else:
        store.client().put_object(**key, Body=b"{}")
    machine()
    with pytest.raises(DatabaseError, match=r"PTM-D00[56]") as raised:
        fetch_database(url)
    assert raised.value.file == f"{url}/objects/{digest}"
    store.client().delete_object(**key)
    report = build_scene(rooms, url, EMBREE, FAST, workers=1)
    assert [stage.stage for stage in report.stages if stage.ran] == ["emit"]
    machine()
    assert files_below(fetch_database(url)) == built_here(rooms, tmp_path / "here", FAST)


def test_a_model_with_folders_like_those_of_databases(
    store: Store, bucket: str, machine: Callable[[], Path]
) -> None:
    """And beside an unfinished database."""
    digest = "ab" * 32
    names = {"m.obj", "tex/manifest.json", "tex/objects/wood.png", "3d-objects/a.png"}
    others = {
        f"m.db/objects/{digest}",
        f"3d-objects/d/objects/{digest}",
        "3d-objects/d/manifest.json",
    }
    for name in names | others:
        store.client().put_object(Bucket=bucket, Key=f"m/{name}", Body=b"x")
    assert set(files_below(fetch_model(f"s3://{bucket}/m/m.obj").parent)) == names


def test_later_stages_read_what_they_need(
    store: Store, bucket: str, rooms: Path, tmp_path: Path, machine: Callable[[], Path]
) -> None:
    """On another machine, with served files that need the heads and bytes of textures."""
    url = f"s3://{bucket}/db"
    build_scene(rooms, url, EMBREE, FAST, workers=1)
    machine()
    store.requests.clear()
    (rooms.parent / "floor.png").write_bytes(png_bytes(np.zeros((8, 8, 3), np.uint8)))
    options = EmitOptions(format="vrml,gltf,interlace", first_look=16)
    build_scene(rooms, url, EMBREE, FAST, options, workers=1)
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
    build_scene(rooms, slow.folder, EMBREE, FAST, workers=1)
    machine()
    build_scene(rooms, url, EMBREE, TextureOptions(), workers=1)
    first = manifest_of(store, bucket, "db")
    if checked_by == "store":
        held = Objects.held
        stale = [None]

        def late(self: Objects, name: str) -> Any:
            return stale.pop() if stale else held(self, name)

        monkeypatch.setattr(Objects, "held", late)
    with pytest.raises(DatabaseError, match="PTM-D007"):
        slow.commit()
    assert manifest_of(store, bucket, "db") == first
    assert set(first.outputs().values()) <= objects_of(store, bucket, "db")


@pytest.mark.parametrize("protocol", ["gs", "memory"])
def test_other_stores(
    protocol: str,
    rooms: Path,
    tmp_path: Path,
    machine: Callable[[], Path],
    monkeypatch: pytest.MonkeyPatch,
    require: Callable[[str, str], None],
) -> None:
    for module in ("gcsfs", "gcp_storage_emulator"):
        if not find_spec(module):
            require(module, "pip install -e '.[dev]'")
    url = f"{protocol}://bucket/{next(_number)}"
    with gs_store("bucket") as running:
        monkeypatch.setenv("STORAGE_EMULATOR_HOST", running)
        for size in (8, 16):
            image = png_bytes(np.zeros((size, size, 3), np.uint8))
            (rooms.parent / "floor.png").write_bytes(image)
            machine()
            build_scene(rooms, url, EMBREE, FAST, workers=1)
        machine()
        actual = files_below(fetch_database(url))
    assert actual == built_here(rooms, tmp_path / "here", FAST)


def test_a_model_is_fetched_once(
    store: Store, bucket: str, rooms: Path, machine: Callable[[], Path]
) -> None:
    def put(name: str) -> None:
        data = (rooms.parent / name).read_bytes()
        store.client().put_object(Bucket=bucket, Key=f"m/{name}", Body=data)

    def fetched() -> set[str]:
        store.requests.clear()
        copy = fetch_model(f"s3://{bucket}/m/two_rooms.obj")
        assert files_below(copy.parent) == files_below(rooms.parent)
        begin = f"/{bucket}/m/"
        return {r.path.removeprefix(begin) for r in store.requests if r.path.startswith(begin)}

    names = set(files_below(rooms.parent))
    for name in names:
        put(name)
    assert fetched() == names
    assert fetched() == set()
    (rooms.parent / "floor.png").write_bytes(b"another")
    put("floor.png")
    (rooms.parent / "room_a.png").unlink()
    store.client().delete_object(Bucket=bucket, Key="m/room_a.png")
    assert fetched() == {"floor.png"}


def test_urls_of_files_are_paths(rooms: Path, tmp_path: Path, ptm: Ptm) -> None:
    url = f"file://{tmp_path}/a.db"
    build_scene(f"file://{rooms}", url, EMBREE, FAST, workers=1)
    assert files_below(tmp_path / "a.db") == built_here(rooms, tmp_path / "here", FAST)
    assert ptm("validate", url).status == 0


@pytest.mark.parametrize("target", ["museum.db", "museum.obj"])
def test_a_web_server_is_no_store(target: str, ptm: Ptm) -> None:
    done = ptm("info", f"http://127.0.0.1:9/{target}")
    assert (done.status, "PTM-I111" in done.err) == (3, True)


def test_what_is_no_database_or_model(store: Store, bucket: str, rooms: Path, ptm: Ptm) -> None:
    store.client().put_object(Bucket=bucket, Key="site/index.html", Body=b"mine")
    with pytest.raises(OutputError, match="PTM-O010"):
        build_scene(rooms, f"s3://{bucket}/site", EMBREE)
    with pytest.raises(InputError, match="PTM-I122"):
        build_scene(f"s3://{bucket}/none.obj", f"s3://{bucket}/db", EMBREE)
    with pytest.raises(InputError, match="PTM-I122"):
        build_scene("s3://no-such-bucket/a.obj", f"s3://{bucket}/db", EMBREE)
    store.client().put_object(Bucket=bucket, Key="m/bad.obj", Body=b"nothing")
    with pytest.raises(InputError) as raised:
        build_scene(f"s3://{bucket}/m/bad.obj", f"s3://{bucket}/db", EMBREE)
    assert raised.value.file == f"s3://{bucket}/m/bad.obj"
    done = ptm("validate", f"s3://{bucket}/none.db")
    assert (done.status, "PTM-D001" in done.err) == (5, True)
    done = ptm("pvs", f"s3://{bucket}/none.db")
    assert (done.status, "PTM-D001" in done.err) == (5, True)


def test_a_damaged_object_is_an_error(
    store: Store, bucket: str, rooms: Path, machine: Callable[[], Path]
) -> None:
    url = f"s3://{bucket}/db"
    build_scene(rooms, url, EMBREE, FAST, workers=1)
    digest = min(objects_of(store, bucket, "db"))
    store.client().put_object(Bucket=bucket, Key=f"db/objects/{digest}", Body=b"x")
    machine()
    with pytest.raises(DatabaseError, match="PTM-D006") as raised:
        fetch_database(url)
    assert raised.value.file == f"{url}/objects/{digest}"


def test_the_commands(
    store: Store, bucket: str, rooms: Path, ptm: Ptm, machine: Callable[[], Path]
) -> None:
    for name, data in files_below(rooms.parent).items():
        store.client().put_object(Bucket=bucket, Key=f"m/{name}", Body=data)
    done = ptm("build-scene", f"s3://{bucket}/m/two_rooms.obj", "-j", "1")
    assert (done.status, done.err) == (0, "")
    url = f"s3://{bucket}/m/two_rooms.db"
    assert f"ptm publish {url} -o site" in done.out
    machine()
    done = ptm("validate", url)
    assert (done.status, done.out.startswith(f"{url}: ")) == (0, True), done.err
    done = ptm("info", url)
    assert (done.status, done.out.startswith(f"{url}: database of two_rooms.obj")) == (0, True)
    done = ptm("info", f"s3://{bucket}/m/two_rooms.obj")
    assert (done.status, ": Wavefront OBJ, " in done.out.splitlines()[0]) == (0, True), done.err
    copy = fetch_model(f"s3://{bucket}/m/two_rooms.obj").parent
    assert files_below(copy) == files_below(rooms.parent)
    build = ("build-scene", f"s3://{bucket}/m/two_rooms.obj", "-o", url)
    store.requests.clear()
    done = ptm(*build, "--dry-run", "--samples", "8", "--json")
    assert done.status == 0, done.err
    plans = {plan["stage"]: plan["plan"] for plan in json.loads(done.out)["stages"]}
    assert [stage for stage, plan in plans.items() if plan != "current"] == ["ach", "emit"]
    assert store.written(bucket) == []
    done = ptm("pvs", url, "--report", "--json")
    assert (done.status, "cells" in json.loads(done.out)) == (0, True), done.err
    assert store.written(bucket) == []
    done = ptm("status", url)
    assert (done.status, done.out.count("done")) == (0, len(STAGES)), done.err
    done = ptm("emit", url, "--format", "gltf", "-j", "1")
    assert (done.status, f"ptm publish {url}" in done.out) == (0, True), done.err
    assert not any(n.endswith(".wrl") for n in manifest_of(store, bucket, "m/two_rooms.db").files())
    done = ptm("ach", url, "--samples", "8", "--backend", "embree", "-v")
    assert (done.status, "PTM" in done.err) == (0, False), done.err
    (fetch_database(url) / "manifest.json").unlink()
    done = ptm("validate", url)  # emission is out of date
    assert (done.status, f"-o {url}" in done.err) == (8, True), done.err
    done = ptm("publish", url, f"s3://{bucket}/site", "--no-pictures", "--json")
    assert done.status == 0, done.err
    assert "index.html" in json.loads(done.out)["written"]
