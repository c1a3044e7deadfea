"""The GLBs of a site draw what those of the database draw."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.glb import COMPONENTS
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.gltf_compressed import CompressedBuffer
from ptmtools.output.gltf_shapes import Vertices
from ptmtools.scene.colors import to_linear
from ptmtools.site.conversion import lean_glb
from tests.e2e.conftest import make_museum
from tests.web import node

HERE = Path(__file__).parent

UNREAD = ("name", "metallicFactor", "roughnessFactor", "ptm")
UNREAD += ("baseColorTexture", "occlusionTexture")


@pytest.fixture(scope="module")
def cells(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[bytes]]:
    """Of each form all GLBs of a small museum, emitted from the same database."""
    folder = tmp_path_factory.mktemp("lean")
    model, db = make_museum(folder / "model", rooms=2), folder / "museum.db"
    words = ["-q", "build-scene", str(model), "-o", str(db), "-j", "1", "--light-samples", "4"]
    result = {}
    for form, options in {"compressed": [], "plain": ["--plain-gltf"]}.items():
        assert main([*words, *options]) == 0
        result[form] = [path.read_bytes() for path in sorted((db / "www/gltf").iterdir())]
    return result


def drawn(data: bytes) -> Counter[tuple[str, str, int, int]]:
    """The bytes of indices that are drawn, with the look and the vertices of each."""
    tree, _ = unpack(data)
    counter: Counter[tuple[str, str, int, int]] = Counter()
    for mesh in tree["meshes"]:
        for primitive in mesh["primitives"]:
            material = bare(tree["materials"][primitive["material"]])
            attributes = {n: tree["accessors"][a] for n, a in primitive["attributes"].items()}
            index = tree["accessors"][primitive["indices"]]
            size = int(COMPONENTS[index["componentType"]][-1])
            first = index.get("byteOffset", 0)
            for place in range(first, first + size * index["count"], size):
                vertices = json.dumps(attributes, sort_keys=True)
                counter[json.dumps(material), vertices, index["bufferView"], place] += 1
    return counter


def bare(value: Any) -> Any:
    """Without what the page does not read, nor empty objects."""
    if not isinstance(value, dict):
        return value
    kept = {name: bare(value[name]) for name in sorted(value) if name not in UNREAD}
    return {name: part for name, part in kept.items() if part != {}}


@pytest.mark.parametrize("form", ["compressed", "plain"])
def test_the_same_triangles_with_the_same_looks(cells: dict[str, list[bytes]], form: str) -> None:
    fewer = 0
    for data in cells[form]:
        lean = lean_glb(data)
        assert len(lean) < len(data)
        assert drawn(lean) == drawn(data)
        (before, binary), (tree, same) = unpack(data), unpack(lean)
        assert same == binary
        assert tree["scenes"][0]["extras"] == before["scenes"][0]["extras"]
        assert b"uri" not in lean
        count = [sum(len(m["primitives"]) for m in t["meshes"]) for t in (before, tree)]
        fewer += count[1] < count[0]
    assert (fewer > 0) == (form == "compressed")


def painted_glb() -> tuple[bytes, int]:
    """A compressed GLB of three shapes of one look: two with all codes at their vertices, one of
    them with texture coordinates, and a white one; the number of vertices of each."""
    code = np.random.default_rng(3).permutation(np.arange(768) % 256).reshape(-1, 3)
    color = np.full((len(code), 4), 65535, np.uint16)
    color[:, :3] = np.rint(65535 * to_linear(code / 255))
    point = np.arange(3 * len(code), dtype=np.float32).reshape(-1, 3) ** 2 % 97
    corner = np.arange(len(code) - 1).reshape(-1, 3)
    buffer = CompressedBuffer(-10)
    forms = (point[:, :2], color), (None, color), (None, None)
    shapes = [Vertices(point, uv, rows, corner) for uv, rows in forms]
    primitives = [buffer.take(shape, 0, (None, None, None)) for shape in shapes]
    buffer.finish()
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0], "extras": {"cell": 0}}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [{"pbrMetallicRoughness": {}}],
    } | buffer.members()
    return pack(tree, buffer.bytes()), corner.size


def test_the_page_reads_the_same_colours(tmp_path: Path) -> None:
    """All codes, and white."""
    whole, count = painted_glb()
    lean = lean_glb(whole)
    assert b"COLOR_0" in whole
    assert b"COLOR_0" not in lean
    for name, data in (("whole", whole), ("lean", lean)):
        (tmp_path / f"{name}.glb").write_bytes(data)
    files = tmp_path / "whole.glb", tmp_path / "lean.glb"
    before, after = json.loads(node.run(HERE / "painted.mjs", *files))
    assert sorted(before, key=str) == sorted(after, key=str)
    assert sorted(len(shape["colors"] or ()) for shape in after) == [0, 4 * count, 4 * count]


def test_bytes_are_colours_only_where_they_are_named_so(tmp_path: Path) -> None:
    point = np.eye(3, dtype="<f4")
    corner = np.array([0, 1, 2, 0], np.uint8)
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0], "extras": {"cell": 0}}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 3},
        ],
        "buffers": [{"byteLength": 40}],
    }
    (tmp_path / "bytes.glb").write_bytes(pack(tree, point.tobytes() + corner.tobytes()))
    ((shape,),) = json.loads(node.run(HERE / "painted.mjs", tmp_path / "bytes.glb"))
    assert shape["indices"] == [0, 1, 2]


def test_an_empty_cell() -> None:
    tree = {
        "asset": {"version": "2.0", "generator": "ptmtools"},
        "scene": 0,
        "scenes": [{"name": "c0003", "extras": {"cell": 3}}],
    }
    lean, binary = unpack(lean_glb(pack(tree, b"")))
    assert lean == {"asset": {"version": "2.0"}, "scenes": [{"extras": {"cell": 3}}]}
    assert binary == b""
