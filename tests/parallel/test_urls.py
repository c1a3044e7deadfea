"""Databases and models at URLs: their lists of files, other stores, faults, and the commands."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.errors import DatabaseError, InputError, OutputError
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import STAGES
from ptmtools.store.layout import MANIFEST
from ptmtools.store.remote import fetch_database, fetch_model
from ptmtools.texture.images.png import png_bytes
from tests.conftest import files_below
from tests.e2e.conftest import Ptm, ptm
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
from tests.stores import Store, gs_store

__all__ = ["ptm"]


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
        build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
        painted(rooms, "floor.png", 80)
    with monkeypatch.context() as patch:
        patch.setattr(store, "refuse", refused)
        with pytest.raises(OutputError, match="PTM-O012"):
            build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    (rooms.parent / "floor.png").write_bytes(plain)
    if first:
        machine()
    build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
    machine()
    assert files_below(fetch_database(url)) == built_here(rooms, tmp_path / "here", FAST)


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
    build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
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
    report = build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
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
    url = f"{protocol}://bucket/{tmp_path.name}"
    with gs_store("bucket") as running:
        monkeypatch.setenv("STORAGE_EMULATOR_HOST", running)
        for size in (8, 16):
            image = png_bytes(np.zeros((size, size, 3), np.uint8))
            (rooms.parent / "floor.png").write_bytes(image)
            machine()
            build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
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
    build_scene(f"file://{rooms}", url, EMBREE, DIM, FAST, workers=1)
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
    build_scene(rooms, url, EMBREE, DIM, FAST, workers=1)
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
