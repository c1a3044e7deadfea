"""The artifacts of the stages, damaged under a hash that is right."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.coverage.model import Ach
from ptmtools.pipeline.stages import PVS, STAGES
from ptmtools.pipeline.validation import check_stages, validate
from ptmtools.store.archive import pack_arrays
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import sha256
from ptmtools.store.manifest import Manifest, StageRecord
from ptmtools.visibility.model import Pvs

Arrays = dict[str, dict[str, np.ndarray]]
Damage = Callable[[Arrays], object]


@pytest.fixture(scope="session")
def stages(room_row) -> Arrays:
    """Three rooms in a row; coverage values are made up."""
    scene, cells = room_row(3)
    pvs = Pvs.from_matrix(np.ones((3, 3), np.bool_))
    share, per_cell = np.full(9, 1 / 3), np.zeros(3)
    ach = Ach(
        start=pvs.start,
        value=share,
        pixels=100 * share,
        error=np.full(9, np.nan),
        p95=share,
        seen=share,
        views=np.tile(share[:, None], 6),
        missed=per_cell,
        samples=np.full(3, 8, np.int32),
        rejected=np.zeros(3, np.int32),
        uncertain=np.full(3, np.nan),
        unseen_below=per_cell,
        floor=per_cell,
        texture_start=np.arange(10),
        texture=np.zeros(9, np.int32),
        texture_value=share,
        backend="embree",
        renderer="by hand",
    )
    results = {"scene": scene, "cells": cells, "pvs": pvs, "ach": ach}
    return {name: result.to_arrays() for name, result in results.items()}


def written(db: Path, stages: Arrays, damage: Callable[[bytes], bytes] = bytes) -> Manifest:
    """A database of these stages; of the arrays of the PVS the bytes are changed."""
    (db / "stages/images").mkdir(parents=True)
    picture = b"a picture"
    rows = [
        {"name": "a.png", "sha256": sha256(picture), "files": ["a.png"], "plain": True, "bytes": 9}
    ]
    listed = json.dumps({"images": rows}).encode()
    images = {f"stages/images/{sha256(picture)}": picture, "stages/images.json": listed}
    records = {}
    for name, arrays in stages.items():
        data = pack_arrays(arrays)
        files = {f"stages/{name}.npz": damage(data) if name == "pvs" else data}
        if name == "scene":
            files |= images
        for file, content in files.items():
            (db / file).write_bytes(content)
        outputs = {file: sha256(content) for file, content in files.items()}
        recipe = STAGES[name].recipe
        records[name] = StageRecord(recipe, {}, {}, outputs, counts(name, stages))
    manifest = Manifest("rooms.obj", records)
    (db / "manifest.json").write_bytes(manifest.to_bytes())
    return manifest


def counts(name: str, stages: Arrays) -> dict[str, Any]:
    cells = stages["cells"]
    return {
        "scene": {"triangles": len(stages["scene"]["triangles"]), "images": 1, "up": "y"},
        "cells": {"cells": 3, "leaves": 3, "portals": 2, "pieces": len(cells["triangle"])},
        "pvs": {"average_share": 1.0},
        "ach": {"samples": 24, "rejected": 0},
    }[name]


def found(db: Path, manifest: Manifest, astray: Collection[str] = ()) -> set[tuple[str, str, str]]:
    issues = check_stages(DatabaseFolder(db, manifest), astray)
    return {(i.code, i.file, i.place) for i in issues}


def test_good_stages(stages: Arrays, tmp_path: Path) -> None:
    assert found(tmp_path, written(tmp_path, stages)) == set()


def test_shares_of_textures_are_no_must(stages: Arrays, tmp_path: Path) -> None:
    none = {name: stages["ach"][name][:0] for name in ("texture_start", "texture", "texture_value")}
    manifest = written(tmp_path, {**stages, "ach": {**stages["ach"], **none}})
    assert found(tmp_path, manifest) == set()


def with_array(stage: str, name: str, change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    return lambda stages: stages[stage].update({name: change(stages[stage][name].copy())})


def at(index: Any, value: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(array: np.ndarray) -> np.ndarray:
        array[index] = value
        return array

    return change


def as_type(kind: type) -> Callable[[np.ndarray], np.ndarray]:
    return lambda array: array.astype(kind)


def a_room_less(pvs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {**pvs, **Pvs.from_matrix(np.ones((2, 2), np.bool_)).to_arrays()}


@pytest.mark.parametrize(
    ("code", "stage", "array", "damage"),
    [
        ("D720", "scene", "uv", lambda s: s["scene"].pop("uv")),
        ("D720", "scene", "triangles", with_array("scene", "triangles", as_type(np.float64))),
        ("D720", "scene", "points", with_array("scene", "points", lambda a: a[:, :2])),
        ("D720", "scene", "points", with_array("scene", "points", at((0, 0), np.nan))),
        ("D720", "scene", "triangles", with_array("scene", "triangles", at((0, 0), 10**6))),
        ("D720", "scene", "uv", with_array("scene", "uv", lambda a: a[1:])),
        ("D720", "cells", "leaf_point_start", with_array("cells", "leaf_point_start", at(1, 99))),
        ("D720", "cells", "face_start", with_array("cells", "face_start", at(-1, 5))),
        ("D720", "cells", "portal_leaf", with_array("cells", "portal_leaf", at((0, 1), 3))),
        ("D720", "cells", "triangle_cell", with_array("cells", "triangle_cell", at(0, -2))),
        ("D720", "cells", "vertex_uv", with_array("cells", "vertex_uv", lambda a: a[1:])),
        ("D720", "cells", "portal_area", with_array("cells", "portal_area", at(0, np.inf))),
        ("D720", "pvs", "cell", with_array("pvs", "cell", at(0, 7))),
        ("D720", "pvs", "start", with_array("pvs", "start", at(1, -1))),
        ("D720", "ach", "texture_start", with_array("ach", "texture_start", at(0, 1))),
        ("D720", "ach", "value", with_array("ach", "value", at(0, np.nan))),
        ("D720", "ach", "missed", with_array("ach", "missed", lambda a: a[1:])),
        ("D720", "cells", "triangle", with_array("cells", "triangle_source", at(0, 10**6))),
        ("D720", "pvs", "cells", lambda s: s.update(pvs=a_room_less(s["pvs"]))),
        ("D720", "ach", "sets", with_array("ach", "start", at(1, 2))),
    ],
)
def test_planted_faults(
    stages: Arrays, tmp_path: Path, code: str, stage: str, array: str, damage: Damage
) -> None:
    changed = {name: dict(arrays) for name, arrays in stages.items()}
    damage(changed)
    manifest = written(tmp_path, changed)
    (issue,) = check_stages(DatabaseFolder(tmp_path, manifest))
    assert (issue.code, issue.file) == (f"PTM-{code}", f"stages/{stage}.npz")
    assert array in issue.message


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[:-1],
        lambda data: data[:100],
        lambda data: data.replace(b"<i8", b"<i4", 1),
        lambda data: b"PK" * 5000,
    ],
)
def test_no_archive(stages: Arrays, tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    manifest = written(tmp_path, stages, damage)
    assert found(tmp_path, manifest) == {("PTM-D720", "stages/pvs.npz", "")}


def test_mutations(stages: Arrays, tmp_path: Path) -> None:
    """Whatever the bytes are, they are noticed or harmless."""
    noticed = 0
    for round in range(300):
        rng = random.Random(round)

        def damage(data: bytes, rng: random.Random = rng) -> bytes:
            changed = bytearray(data)
            for _ in range(rng.choice((1, 2, 20))):
                changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
            at = rng.randrange(len(changed))
            return bytes(changed[:at] if rng.random() < 0.2 else changed)

        manifest = written(tmp_path / str(round), stages, damage)
        codes = {code for code, *_ in found(tmp_path / str(round), manifest)}
        assert codes <= {"PTM-D720", "PTM-D699"}
        noticed += bool(codes)
    assert noticed > 200


def test_what_the_hash_tells_is_not_told_again(stages: Arrays, tmp_path: Path) -> None:
    manifest = written(tmp_path, stages)
    (tmp_path / "stages/pvs.npz").write_bytes(b"")
    (tmp_path / "stages/ach.npz").unlink()
    assert found(tmp_path, manifest, {"stages/pvs.npz", "stages/ach.npz"}) == set()


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("D720", b""),
        ("D720", b"{}"),
        ("D720", b'{"images": [{"name": 3}]}'),
        ("D720", b"[" * 100_000),
        (
            "D720",
            b'{"images": [{"name": "b.png", "sha256": "%s", "files": [], "plain": true,'
            b' "bytes": 1}]}' % (b"0" * 64),
        ),
        ("D699 D720", b'{"images": []}'),
    ],
)
def test_a_list_of_images(stages: Arrays, tmp_path: Path, code: str, text: bytes) -> None:
    manifest = written(tmp_path, stages)
    (tmp_path / "stages/images.json").write_bytes(text)
    manifest.stages["scene"].outputs["stages/images.json"] = sha256(text)  # type: ignore[index]
    assert {c for c, *_ in found(tmp_path, manifest)} == {f"PTM-{c}" for c in code.split()}


@pytest.mark.parametrize(
    ("stage", "name", "value"),
    [
        ("scene", "triangles", 1),
        ("scene", "images", 2),
        ("cells", "cells", 4),
        ("cells", "pieces", "many"),
        ("ach", "samples", None),
    ],
)
def test_counts(stages: Arrays, tmp_path: Path, stage: str, name: str, value: object) -> None:
    manifest = written(tmp_path, stages)
    manifest.stages[stage].counts[name] = value  # type: ignore[index]
    place = f"stages.{stage}.counts.{name}"
    assert found(tmp_path, manifest) == {("PTM-D699", "manifest.json", place)}


def test_a_stage_that_lists_no_arrays(stages: Arrays, tmp_path: Path) -> None:
    manifest = written(tmp_path, stages).with_stages({"pvs": StageRecord(PVS.recipe, {}, {}, {})})
    assert ("PTM-D720", "manifest.json", "") in found(tmp_path, manifest)


def test_all_in_one_report(stages: Arrays, tmp_path: Path) -> None:
    changed = {**stages, "pvs": {**stages["pvs"], "cell": stages["pvs"]["cell"] + 1}}
    written(tmp_path, changed)
    report = validate(tmp_path)
    assert {i.code for i in report.issues} == {"PTM-D655", "PTM-D720"}
    assert [i.file for i in report.issues] == sorted(i.file for i in report.issues)
    assert not report.ok
