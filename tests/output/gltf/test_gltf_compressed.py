"""Compressed GLBs: beside the VRML files, beside each other, and damaged."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.output import validate_database
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.gltf_compressed import CompressedBuffer
from ptmtools.output.gltf_reader import read_glb
from ptmtools.output.gltf_shapes import Vertices
from tests.output.agreement import disagreements
from tests.output.damage import Damage, rewritten

EmitGltf = Callable[..., Path]
GLB = "gltf/c0001.glb"


@pytest.fixture(scope="module")
def compressed(emit_gltf: EmitGltf, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The served folder; not to be changed."""
    www = tmp_path_factory.mktemp("compressed") / "rooms" / "www"
    return emit_gltf(www, plain_gltf=False)


@pytest.fixture
def database(compressed: Path, tmp_path: Path, seal: Callable[[Path], None]) -> Path:
    db = tmp_path / "rooms"
    shutil.copytree(compressed.parent, db)
    seal(db)
    return db


def test_the_forms_agree(compressed: Path, database: Path) -> None:
    assert disagreements(compressed) == []
    assert validate_database(database).issues == ()


def test_extensions_are_required(compressed: Path) -> None:
    tree, _ = unpack((compressed / GLB).read_bytes())
    assert tree["extensionsUsed"] == tree["extensionsRequired"] == ["EXT_meshopt_compression"]
    assert tree["buffers"][1]["extensions"] == {"EXT_meshopt_compression": {"fallback": True}}
    assert all("extensions" in view for view in tree["bufferViews"])


def test_colours_have_arrays_of_their_own(
    artifacts: Any, emit_gltf: EmitGltf, tmp_path: Path
) -> None:
    random = np.random.default_rng(2)
    colors = random.integers(0, 256, (len(artifacts.scene.triangles), 3, 3), np.uint8)
    colors[::3] = 255
    white = tuple(replace(m, color=(1.0, 1.0, 1.0)) for m in artifacts.scene.materials)
    scene = replace(artifacts.scene, colors=colors, materials=white)
    www = emit_gltf(tmp_path / "www", scene=scene, plain_gltf=False)
    assert disagreements(www) == []
    tree, _ = unpack((www / GLB).read_bytes())
    assert {len(p["attributes"]) for m in tree["meshes"] for p in m["primitives"]} >= {2, 3}


def test_cells_meet_without_a_crack(artifacts: Any, emit_gltf: EmitGltf, tmp_path: Path) -> None:
    """Points that are equal in two cells are equal after decoding, wherever they lie: the walls
    between rooms, moved by an odd distance."""

    def moved(part: Any) -> Any:
        points = {"points": part.points} if hasattr(part, "points") else {"vertex": part.vertex}
        return replace(
            part, **{name: rows + [0.12345, 0.000321, 7.1] for name, rows in points.items()}
        )

    exact = emit_gltf(
        tmp_path / "exact", scene=moved(artifacts.scene), cells=moved(artifacts.cells)
    )
    www = emit_gltf(
        tmp_path / "www",
        scene=moved(artifacts.scene),
        cells=moved(artifacts.cells),
        plain_gltf=False,
    )
    shared = 0
    cells = [_points(www, cell) for cell in range(3)]
    plain = [_points(exact, cell) for cell in range(3)]
    for a in range(3):
        assert {point for point, _ in _nearest(plain[a], cells[a])} == set(plain[a])
        for b in range(a):
            both = set(plain[a]) & set(plain[b])
            shared += len(both)
            into = [dict(_nearest(plain[c], cells[c])) for c in (a, b)]
            assert all(into[0][point] == into[1][point] for point in both)
    assert shared >= 8


def _points(www: Path, cell: int) -> list[tuple[float, ...]]:
    glb = read_glb((www / f"gltf/c{cell:04d}.glb").read_bytes())
    rows = np.concatenate([primitive.point for primitive in glb.primitives])
    return [tuple(row) for row in np.unique(rows, axis=0).tolist()]


def _nearest(
    exact: list[tuple[float, ...]], given: list[tuple[float, ...]]
) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Each exact point with the point of the GLB less than a step away."""
    rows = np.array(given)
    pairs = []
    for point in exact:
        away = np.abs(rows - point).max(axis=1)
        if away.min() <= 2.0**-11:
            pairs.append((point, given[int(away.argmin())]))
    return pairs


def test_triangles_without_area_on_the_grid_are_left_out() -> None:
    buffer = CompressedBuffer(-10)
    point = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1.0001, 1, 0]], np.float32)
    thin = Vertices(point, None, None, np.array([[1, 2, 3]]))
    assert buffer.take(thin, 0, (None, None, None)) is None
    assert buffer.members() == {}
    both = Vertices(point, None, None, np.array([[0, 1, 2], [1, 3, 2]]))
    assert buffer.take(both, 0, (None, None, None)) is not None
    buffer.finish()
    (position, indices) = buffer.members()["accessors"]
    assert (position["count"], indices["count"]) == (3, 3)


@pytest.mark.parametrize(("vertices", "component"), [(65535, 5123), (65538, 5125)])
def test_indices_are_wide_where_they_must(vertices: int, component: int) -> None:
    buffer = CompressedBuffer(-10)
    point = np.zeros((vertices, 3), np.float32)
    point[:, 0] = np.arange(vertices) % 1000
    point[:, 1] = np.arange(vertices) // 1000
    point[1::3, 2] = 1
    triangle = np.arange(vertices).reshape(-1, 3)
    buffer.take(Vertices(point, None, None, triangle), 0, (None, None, None))
    buffer.finish()
    assert buffer.members()["accessors"][-1]["componentType"] == component


def of_view(number: int, member: str, value: Any) -> Damage:
    """Changes a member of the extension of a view."""

    def changed(data: bytes) -> bytes:
        tree, binary = unpack(data)
        row = tree["bufferViews"][number]["extensions"]["EXT_meshopt_compression"]
        row[member] = value(row.get(member)) if callable(value) else value
        return pack(tree, binary)

    return rewritten(GLB, changed)


def treed(change: Callable[[dict[str, Any]], object]) -> Damage:
    def changed(data: bytes) -> bytes:
        tree, binary = unpack(data)
        change(tree)
        return pack(tree, binary)

    return rewritten(GLB, changed)


def poked(at: int) -> Damage:
    """Changes a byte of the encoded arrays."""

    def changed(data: bytes) -> bytes:
        tree, binary = unpack(data)
        spoilt = bytearray(binary)
        spoilt[at] ^= 0x55
        return pack(tree, bytes(spoilt))

    return rewritten(GLB, changed)


FAULTS = {
    "count": of_view(0, "count", 10**9),
    "one element more": of_view(0, "count", lambda n: n + 1),
    "stride": of_view(0, "byteStride", 12),
    "length": of_view(0, "byteLength", lambda n: n - 1),
    "beyond the bytes": of_view(1, "byteOffset", 10**6),
    "mode": of_view(0, "mode", "TRIANGLES"),
    "no filter": of_view(0, "filter", None),
    "another filter": of_view(0, "filter", "OCTAHEDRAL"),
    "indices with a filter": of_view(1, "filter", "EXPONENTIAL"),
    "the fallback as the source": of_view(0, "buffer", 1),
    "head of the vertices": poked(0),
    "no view is compressed": treed(lambda t: [v.pop("extensions") for v in t["bufferViews"]]),
    "extension not required": treed(lambda t: t.pop("extensionsRequired")),
    "extension not listed": treed(
        lambda t: [t.pop(name) for name in ("extensionsUsed", "extensionsRequired")]
    ),
    "another extension": treed(lambda t: t.update(extensionsUsed=["KHR_mesh_quantization"])),
    "no fallback": treed(lambda t: t["buffers"].pop()),
    "a short fallback": treed(lambda t: t["buffers"][1].update(byteLength=8)),
    "bounds": treed(lambda t: t["accessors"][0].update(max=[1e3] * 3)),
    "more elements than the view": treed(lambda t: t["accessors"][0].update(count=10**6)),
}


@pytest.mark.parametrize("damage", FAULTS.values(), ids=FAULTS)
def test_each_planted_fault_is_found(database: Path, seal: Damage, damage: Damage) -> None:
    damage(database)
    seal(database)
    issues = validate_database(database).issues
    assert {issue.code for issue in issues} == {"PTM-D731"}
    assert all(issue.file == f"www/{GLB}" for issue in issues)
