"""Arrays that are read back: whatever counts what is not there is refused, before anything counts.

The checksums of a database may have been made with it, so each change stands in a sound archive.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.errors import DatabaseError
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.stages import ACH, CELLS, PVS, SCENE
from ptmtools.pipeline.stages.scene import images_of
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import IMAGE_LIST, arrays_of, sha256

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"
Arrays = dict[str, Any]
Change = Callable[[Arrays], object]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("artifacts")
    shutil.copytree(TWO_ROOMS, folder / "model")
    model = folder / "model" / "two_rooms.obj"
    options = ["--samples", "16", "--backend", "embree", "-j", "1"]
    assert main(["-q", "build-scene", str(model), "-o", str(folder / "db"), *options]) == 0
    return folder / "db"


@pytest.fixture
def database(built: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(built, tmp_path / "db"))


def replaced(db: Path, name: str, data: bytes) -> None:
    """Another file of the database, and the manifest says that it is the right one."""
    manifest = db / "manifest.json"
    before = sha256((db / name).read_bytes())
    manifest.write_text(manifest.read_text().replace(before, sha256(data)))
    (db / name).write_bytes(data)


def opened(db: Path) -> list[object]:
    artifacts = Artifacts(DatabaseFolder.open(db))
    return [artifacts[stage] for stage in (SCENE, CELLS, PVS, ACH)]


def first(name: str, value: object, at: int = 0) -> Change:
    """The first element of an array, or another one, is another."""

    def change(arrays: Arrays) -> None:
        arrays[name] = arrays[name].copy()
        arrays[name].flat[at] = value

    return change


def fallen(name: str) -> Change:
    """Two starts the wrong way round."""
    return lambda arrays: first(name, arrays[name][-1] + 1, at=1)(arrays)


def shorter(name: str) -> Change:
    return lambda arrays: arrays.update({name: arrays[name][:-1]})


def typed(name: str, dtype: str) -> Change:
    return lambda arrays: arrays.update({name: arrays[name].astype(dtype)})


def flat(name: str) -> Change:
    return lambda arrays: arrays.update({name: arrays[name].reshape(-1)})


def without(name: str) -> Change:
    return lambda arrays: arrays.pop(name)


def about(change: Callable[[Any], object]) -> Change:
    """Another text beside the arrays."""

    def edit(arrays: Arrays) -> None:
        document = json.loads(arrays["about"].tobytes())
        change(document)
        arrays["about"] = np.frombuffer(json.dumps(document).encode(), np.uint8)

    return edit


def raw(data: bytes) -> Change:
    return lambda arrays: arrays.update(about=np.frombuffer(data, np.uint8))


CHANGES: dict[str, list[Change]] = {
    "scene": [
        first("points", np.nan),
        first("points", np.inf),
        flat("points"),
        typed("points", "<i8"),
        without("points"),
        shorter("points"),
        first("triangles", -1),
        first("triangles", 2**31 - 1),
        first("triangle_object", 99),
        first("triangle_object", -1),
        first("triangle_material", 99),
        shorter("triangle_material"),
        shorter("uv"),
        first("uv", np.nan),
        typed("two_sided", "|u1"),
        raw(b""),
        raw(b"[]"),
        raw(b"\xff\xfe"),
        raw(b"[" * 100_000),
        raw(b"{}"),
        about(lambda d: d.update(objects=5)),
        about(lambda d: d.update(objects=[5] * 9)),
        about(lambda d: d["materials"].pop()),
        about(lambda d: d["materials"][0].update(image=99)),
        about(lambda d: d["materials"][0].update(image=-2)),
        about(lambda d: d["materials"][0].update(image=0.5)),
        about(lambda d: d["materials"][0].update(image=True)),
        about(lambda d: d["materials"][0].update(color=[0, 0])),
        about(lambda d: d["materials"][0].update(color="red")),
        about(lambda d: d["materials"][0].update(color=[2, 0, 0])),
        about(lambda d: d["materials"][0].update(color=[float("nan"), 0, 0])),
        about(lambda d: d["materials"][0].update(opacity="1")),
        about(lambda d: d["materials"][0].update(wrap_s="mirror")),
        about(lambda d: d["materials"][0].update(name=None)),
        about(lambda d: d["space"].update(up="x")),
        about(lambda d: d["space"].update(metres=0)),
        about(lambda d: d["space"].update(origin=[0, 0, 10**400])),
        about(lambda d: d.update(cameras=[{"name": "a"}])),
        about(lambda d: d.update(notes=[{"code": 1}])),
        about(lambda d: d.update(materials=None)),
    ],
    "cells": [
        *(
            first(name, 1, at=1)
            for name in ("face_start", "leaf_face_start", "leaf_point_start", "portal_start")
        ),
        first("leaf_cell", 99),
        first("leaf_cell", -2),
        first("face_index", 10**6),
        first("face_start", 1),
        fallen("face_start"),
        fallen("leaf_point_start"),
        fallen("leaf_face_start"),
        fallen("portal_start"),
        first("node_child", 0),
        first("node_child", -(10**6)),
        first("node_child", 10**6),
        first("node_plane", np.nan),
        first("leaf_point", np.inf),
        first("portal_leaf", -1),
        first("portal_leaf", 10**6),
        shorter("portal_plane"),
        shorter("portal_area"),
        first("portal_point", np.nan),
        first("triangle", -1),
        first("triangle", 10**6),
        first("triangle_cell", 10**6),
        first("triangle_cell", -2),
        first("triangle_source", -1),
        first("triangle_source", 10**6),
        shorter("triangle_source"),
        shorter("vertex"),
        shorter("vertex_uv"),
        flat("root_box"),
        typed("vertex", "<i4"),
        without("leaf_point"),
        without("left_out"),
        lambda arrays: arrays.update(left_out=np.full((1, 3, 3), np.nan)),
        lambda arrays: arrays.update(left_out=np.zeros((1, 3, 2))),
        about(lambda d: d.update(notes=5)),
    ],
    "pvs": [
        first("cell", -1),
        first("cell", 99),
        first("cell", 1),
        first("start", 1),
        fallen("start"),
        shorter("start"),
        shorter("cell"),
        typed("cut", "<i4"),
        typed("conservative", "<f8"),
        without("conservative"),
        lambda arrays: arrays.update(conservative=np.zeros(0, bool)),
        lambda arrays: arrays.update(leak=np.full((1, 4), 99, np.int32)),
        lambda arrays: arrays.update(leak=np.zeros(4, np.int32)),
        first("volume", np.nan),
        first("volume", -1.0),
        shorter("volume"),
        without("volume"),
        # A sound one, of another subdivision.
        lambda arrays: arrays.update(
            start=np.array([0, 1]), cell=np.zeros(1, np.int32), volume=np.ones(1)
        ),
    ],
    "ach": [
        first("start", 1),
        fallen("start"),
        shorter("value"),
        shorter("views"),
        shorter("missed"),
        shorter("samples"),
        first("value", np.nan),
        first("texture_start", 1),
        first("texture", -2),
        first("texture", 99),
        typed("samples", "<f8"),
        without("floor"),
        about(lambda d: d.update(backend=None)),
    ],
}


@pytest.mark.parametrize(
    ("stage", "number"), [(stage, i) for stage, all_ in CHANGES.items() for i in range(len(all_))]
)
def test_what_is_not_there_is_not_counted(database: Path, stage: str, number: int) -> None:
    name = arrays_of(stage)
    arrays: Arrays = dict(unpack_arrays((database / name).read_bytes(), file=name))
    if stage == "ach" and number in (7, 8, 9):  # shares of textures, which were not measured
        n = len(arrays["value"])
        arrays["texture_start"] = np.arange(n + 1)
        arrays["texture"] = np.zeros(n, np.int32)
        arrays["texture_value"] = arrays["value"]
        replaced(database, name, pack_arrays(arrays))
        opened(database)
    CHANGES[stage][number](arrays)
    replaced(database, name, pack_arrays(arrays))
    with pytest.raises(DatabaseError, match=rf"stages/{stage}\.npz: damaged.*PTM-D006"):
        opened(database)


def test_as_it_was_built(database: Path) -> None:
    opened(database)
    for stage in CHANGES:
        name = arrays_of(stage)
        arrays = unpack_arrays((database / name).read_bytes(), file=name)
        replaced(database, name, pack_arrays(arrays))
    opened(database)


ROW = {"name": "a.png", "sha256": "ab" * 32, "files": ["a.png"], "plain": True, "bytes": 3}


@pytest.mark.parametrize(
    "row",
    [
        {"name": "../a.png"},
        {"name": "/a.png"},
        {"name": "a/b.png"},
        {"name": "a\\b.png"},
        {"name": "C:a.png"},
        {"name": "a\0.png"},
        {"name": ".."},
        {"name": ""},
        {"name": 5},
        {"name": "\ud800.png"},
        {"sha256": "../../manifest.json"},
        {"sha256": "AB" * 32},
        {"sha256": "ab"},
        {"sha256": None},
        {"files": "a.png"},
        {"files": [5]},
        {"plain": 1},
        {"bytes": -1},
        {"bytes": "3"},
    ],
)
def test_names_and_digests_of_images(database: Path, row: dict[str, Any]) -> None:
    for there, refused in ((ROW, False), ({**ROW, **row}, True)):
        replaced(database, IMAGE_LIST, json.dumps({"images": [there]}).encode())
        artifacts = Artifacts(DatabaseFolder.open(database))
        if refused:
            with pytest.raises(DatabaseError, match="PTM-D006"):
                images_of(artifacts)
        else:
            assert len(images_of(artifacts)) == 1


def test_images_whose_textures_would_have_one_name(database: Path) -> None:
    rows = [ROW, {**ROW, "name": "A.jpg"}]
    replaced(database, IMAGE_LIST, json.dumps({"images": rows}).encode())
    with pytest.raises(DatabaseError, match="PTM-D006"):
        images_of(Artifacts(DatabaseFolder.open(database)))


@pytest.mark.parametrize("place", ["manifest.json", "stages/scene.npz", "stages/images.json"])
def test_pipes_in_place_of_files_are_not_waited_for(database: Path, place: str) -> None:
    (database / place).unlink()
    os.mkfifo(database / place)
    with pytest.raises(DatabaseError, match=r"PTM-D00[15]"):
        opened(database)
    assert main(["-q", "status", str(database)]) in (0, 5)


def test_limits_change_nothing_that_is_built(built: Path, tmp_path: Path) -> None:
    db = Path(shutil.copytree(built, tmp_path / "db"))
    model = built.parent / "model" / "two_rooms.obj"
    before = (db / "manifest.json").read_bytes()
    options = ["--samples", "16", "--backend", "embree", "-j", "1", "--limit", "7"]
    assert main(["-q", "build-scene", str(model), "-o", str(db), *options]) == 0
    assert (db / "manifest.json").read_bytes() == before
    assert b'"limit"' not in before


COMMANDS = {
    "info": [],
    "status": [],
    "pvs": ["-j", "1"],
    "ach": ["-j", "1", "--samples", "8", "--backend", "embree"],
    "textures": ["-j", "1"],
    "emit": ["--format", "gltf"],
    "plot": ["--force", "-o", "plan.png"],
    "validate": ["--segments", "20"],
}
#: What a manifest may say of a stage, with sound names and hashes otherwise.
SAID: list[tuple[str, dict[str, Any]]] = [
    *((stage, {"outputs": {}}) for stage in ("scene", "cells", "pvs", "ach", "textures")),
    *((stage, {"inputs": {}}) for stage in ("scene", "cells", "textures", "emit")),
    *((stage, {"parameters": {}}) for stage in ("scene", "cells", "textures", "emit")),
    *((stage, {"counts": {}}) for stage in ("scene", "cells", "pvs", "ach", "textures", "emit")),
    ("scene", {"counts": {"triangles": "x", "metres": [], "images": None}}),
    ("textures", {"counts": {"textures": {}, "raw_bytes": "x", "ptm_bytes": 10**400}}),
    ("cells", {"parameters": {"structural": 5, "detail": None}}),
    ("cells", {"parameters": {"structural": [5], "detail": []}}),
    ("textures", {"parameters": {"fallback_size": "x", "fallback": None}}),
    ("cells", {"recipe": 10**400}),
    ("apo", {"inputs": {"stages/scene.npz": "0" * 64}}),
    ("apo", {"parameters": {"apo": 5, "apo_faces": "many"}}),
    ("apo", {"counts": {"octrees": "x", "source": None}}),
    ("apo", {"recipe": 10**400}),
    ("apo", {"outputs": {"stages/apo.npz": "0" * 64, "stages/octrees.json": "0" * 64}}),
]


@pytest.mark.parametrize("number", range(len(SAID)))
def test_commands_of_a_manifest_that_lies(
    built: Path,
    tmp_path: Path,
    number: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    stage, printed = SAID[number]
    document = json.loads((built / "manifest.json").read_bytes())
    document["stages"][stage].update(printed)
    for command, options in COMMANDS.items():
        database = shutil.copytree(built, tmp_path / command)
        (database / "manifest.json").write_text(json.dumps(document))
        assert main([command, str(database), *options]) in (0, 5, 8), command
        assert "internal error" not in capsys.readouterr().err


def test_a_sparse_texture_of_a_terabyte_is_not_read(tmp_path: Path) -> None:
    texture = tmp_path / "a.ptm"
    texture.write_bytes(b"\x89PTM\r\n\x1a\n")
    os.truncate(texture, 1 << 40)
    assert main(["validate", str(texture)]) == 0  # a warning: it was not looked into
    assert main(["info", str(texture)]) == 3
    assert main(["decode", str(texture), "-o", str(tmp_path / "a.png")]) == 3
