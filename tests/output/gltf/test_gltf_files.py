"""The GLBs that `emit` writes, read back by trimesh and beside the VRML files."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
import trimesh
from hypothesis import given, strategies as st
from PIL import Image

from ptmtools.errors import InputError, LimitError, OutputError
from ptmtools.light.options import LightOptions
from ptmtools.output import EmitOptions, validate_database
from ptmtools.output.gltf import linear, pack, unpack
from ptmtools.output.gltf_reader import read_glb
from ptmtools.output.gltf_shapes import PlainBuffer
from ptmtools.pipeline.build import build_scene
from ptmtools.scene.model import Material
from tests.output.agreement import disagreements
from tests.output.vrml_reader import VrmlNode, parse

TWO_ROOMS = Path(__file__).parents[3] / "sample_data" / "two_rooms"

EmitGltf = Callable[..., Path]


class Beside(trimesh.resolvers.Resolver):
    """Reads what a GLB in ``folder`` refers to; trimesh's own does not leave the folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def get(self, name: str) -> bytes:
        return (self.folder / unquote(name)).read_bytes()

    def keys(self) -> list[str]:
        return []

    def namespaced(self, namespace: str) -> Beside:
        return self

    def write(self, name: str, data: bytes) -> None:
        raise NotImplementedError


def meshes(glb: Path) -> list[Any]:
    """What trimesh makes of the primitives, in their order."""
    data, resolver = io.BytesIO(glb.read_bytes()), Beside(glb.parent)
    scene = trimesh.load(data, file_type="glb", resolver=resolver, process=False)
    return list(scene.geometry.values())


def documents(www: Path) -> list[dict[str, Any]]:
    """The JSON of the three cells."""
    return [unpack((www / f"gltf/c{c:04d}.glb").read_bytes())[0] for c in range(3)]


def shapes(www: Path, cell: int) -> list[VrmlNode]:
    return parse((www / f"cells/c{cell:04d}.wrl").read_bytes()).of_type("Shape")


def corners(shape: VrmlNode, values: str, index: str) -> np.ndarray:
    """(m, 3, k) of the triangles of a VRML shape."""
    fields = shape.fields["geometry"].fields
    return fields[values].fields["point"][fields[index].reshape(-1, 4)[:, :3]]


def test_trimesh_finds_the_triangles_of_the_vrml_files(gltf_finished: Path) -> None:
    textured = 0
    for c in range(3):
        actual, wanted = meshes(gltf_finished / f"gltf/c{c:04d}.glb"), shapes(gltf_finished, c)
        assert len(actual) == len(wanted) > 3
        for mesh, shape in zip(actual, wanted, strict=True):
            np.testing.assert_array_equal(mesh.triangles, corners(shape, "coord", "coordIndex"))
            if "texCoord" in shape.fields["geometry"].fields:
                uv = corners(shape, "texCoord", "texCoordIndex")
                np.testing.assert_allclose(mesh.visual.uv[mesh.faces], uv, rtol=0, atol=2**-24)
                textured += 1
    assert textured > 5


def test_trimesh_finds_the_images(gltf_finished: Path) -> None:
    sizes = {
        mesh.visual.material.baseColorTexture.size
        for c in range(3)
        for mesh in meshes(gltf_finished / f"gltf/c{c:04d}.glb")
        if mesh.visual.material.baseColorTexture is not None
    }
    assert sizes == {(24, 16), (5, 9)}


def test_each_kind_of_material(gltf_finished: Path) -> None:
    """Colours are linear light; only what alpha shows through blends."""
    kinds = set()
    for tree in documents(gltf_finished):
        for material in tree["materials"]:
            surface = material["pbrMetallicRoughness"]
            texture = tree["textures"][surface.get("baseColorTexture", {"index": 0})["index"]]
            kinds.add(
                (
                    material["name"],
                    tuple(surface.get("baseColorFactor", ())),
                    tree["images"][texture["source"]]["uri"]
                    if "baseColorTexture" in surface
                    else "",
                    json.dumps(tree["samplers"][texture["sampler"]])
                    if "sampler" in texture and "baseColorTexture" in surface
                    else "",
                    material.get("alphaMode", "OPAQUE"),
                    json.dumps(material.get("extras")),
                )
            )
    a, b = ({"ptm": f"../textures/{n}.ptm", "texture": i} for i, n in enumerate("ab"))
    dim, half = linear(0.3), linear(0.5)
    assert linear(0.8) == pytest.approx(0.6038273)
    assert half == pytest.approx(0.2140411)
    assert kinds == {
        ("plain", (linear(0.8),) * 3 + (1.0,), "", "", "OPAQUE", "null"),
        ("picture", (), "../textures/a.png", "", "OPAQUE", json.dumps(a)),
        (
            "tinted",
            (1.0, dim, dim, 1.0),
            "../textures/a.png",
            '{"wrapS": 33071}',
            "OPAQUE",
            json.dumps(a | {"wrapS": 33071}),
        ),
        ("curtain", (1.0, 1.0, half, 0.25), "../textures/b.png", "", "BLEND", json.dumps(b)),
        ("glass", (0.0, 1.0, half, 0.5), "", "", "BLEND", "null"),
    }


def test_alpha_of_a_texture_blends_where_it_is_used(
    artifacts: Any, emit_gltf: EmitGltf, tmp_path: Path
) -> None:
    """Image 0 has no alpha; image 1 has, and its material decides whether that is seen."""
    looks = [
        Material(f"{i}{t}", (1.0,) * 3, image=i, transparent=t) for i in (0, 1) for t in (0, 1)
    ]
    quad = np.arange(len(artifacts.scene.triangles)) // 2
    scene = replace(
        artifacts.scene, materials=tuple(looks), triangle_material=(quad % 4).astype(np.int32)
    )
    www = emit_gltf(tmp_path / "www", scene=scene)
    modes = {
        material["name"]: material.get("alphaMode", "OPAQUE")
        for tree in documents(www)
        for material in tree["materials"]
    }
    assert modes == {"00": "OPAQUE", "01": "OPAQUE", "10": "OPAQUE", "11": "BLEND"}


def test_metallic_and_roughness_are_written(
    artifacts: Any, emit_gltf: EmitGltf, tmp_path: Path
) -> None:
    """Of materials that are alike in all else; a roughness of 1 is the default of the format."""
    matter = ((0.0, 1.0), (1.0, 0.25), (0.5, 1.0), (0.0, 0.0))
    looks = tuple(Material("steel", metallic=m, roughness=r) for m, r in matter)
    quad = np.arange(len(artifacts.scene.triangles)) // 2
    index = (quad % len(looks)).astype(np.int32)
    scene = replace(artifacts.scene, materials=looks, triangle_material=index)
    www = emit_gltf(tmp_path / "www", scene=scene)
    surfaces = [m["pbrMetallicRoughness"] for tree in documents(www) for m in tree["materials"]]
    written = {(s["metallicFactor"], s.get("roughnessFactor")) for s in surfaces}
    assert written == {(0, None), (1, 0.25), (0.5, None), (0, 0)}
    read = {
        (primitive.material.metallic, primitive.material.roughness)
        for glb in (www / "gltf").glob("*.glb")
        for primitive in read_glb(glb.read_bytes()).primitives
    }
    assert read == set(matter)


def test_sides_and_objects(artifacts: Any, gltf_finished: Path) -> None:
    """A node for each object with its own name; a primitive for each of its shapes."""
    sides = set()
    for c, tree in enumerate(documents(gltf_finished)):
        names = [node["name"] for node in tree["nodes"]]
        assert set(names) <= set(artifacts.scene.objects)
        assert len(names) == len(set(names))
        primitives = [p for mesh in tree["meshes"] for p in mesh["primitives"]]
        for primitive, shape in zip(primitives, shapes(gltf_finished, c), strict=True):
            solid = shape.fields["geometry"].fields.get("solid", True)
            two_sided = tree["materials"][primitive["material"]].get("doubleSided", False)
            assert two_sided != solid
            assert "NORMAL" not in primitive["attributes"]
            sides.add(two_sided)
        assert tree["scenes"] == [
            {"name": f"c{c:04d}", "extras": {"cell": c}, "nodes": list(range(len(names)))}
        ]
        assert not {"extensionsUsed", "extensionsRequired"} & set(tree)
    assert sides == {True, False}
    assert "Wände.001" in names or "Wände.001" in str(documents(gltf_finished)[0])


def test_without_fallback_only_the_ptm_is_named(
    artifacts: Any, emit_gltf: EmitGltf, tmp_path: Path, seal: Callable[[Path], None]
) -> None:
    www = emit_gltf(tmp_path / "db/www", fallback=False)
    wraps = []
    for tree in documents(www):
        assert not {"textures", "images", "samplers"} & set(tree)
        extras = [m["extras"] for m in tree["materials"] if "extras" in m]
        assert {e["ptm"] for e in extras} <= {"../textures/a.ptm", "../textures/b.ptm"}
        wraps += [e.get("wrapS") for e in extras]
    assert set(wraps) == {None, 33071}
    for png in (www / "textures").glob("*.png"):
        png.unlink()
    seal(tmp_path / "db")
    assert validate_database(tmp_path / "db").issues == ()
    assert disagreements(tmp_path / "db/www") == []


def test_a_good_database_has_no_issue(gltf_database: Path) -> None:
    report = validate_database(gltf_database)
    assert report.issues == ()
    assert report.files == 16


def test_same_bytes_again(emit_gltf: EmitGltf, gltf_finished: Path, tmp_path: Path) -> None:
    again = emit_gltf(tmp_path / "www")
    names = sorted(p.name for p in (gltf_finished / "gltf").iterdir())
    assert names == ["c0000.glb", "c0001.glb", "c0002.glb"]
    for name in names:
        assert (again / "gltf" / name).read_bytes() == (gltf_finished / "gltf" / name).read_bytes()


def test_an_empty_cell_is_a_file(
    artifacts: Any, emit_gltf: EmitGltf, tmp_path: Path, seal: Callable[[Path], None]
) -> None:
    nobody = np.where(artifacts.cells.triangle_cell == 1, -1, artifacts.cells.triangle_cell)
    www = emit_gltf(tmp_path / "db/www", cells=replace(artifacts.cells, triangle_cell=nobody))
    tree, binary = unpack((www / "gltf/c0001.glb").read_bytes())
    assert tree["scenes"] == [{"name": "c0001", "extras": {"cell": 1}}]
    assert binary == b""
    assert meshes(www / "gltf/c0001.glb") == []
    seal(tmp_path / "db")
    assert validate_database(tmp_path / "db").issues == ()
    assert disagreements(tmp_path / "db/www") == []


def test_the_index_names_them(gltf_finished: Path) -> None:
    index = json.loads((gltf_finished / "hints.json").read_text())
    files = {
        form: [template.replace("{name}", cell["name"]) for cell in index["cells"]]
        for form, template in index["geometry"].items()
    }
    there = {form: sorted(gltf_finished.glob(f"*/c*.{form}")) for form in ("wrl", "glb")}
    for form, suffix in {"vrml": "wrl", "gltf": "glb"}.items():
        assert [gltf_finished / file for file in files[form]] == there[suffix]


def test_names_are_percent_encoded(
    emit_gltf: EmitGltf, tmp_path: Path, seal: Callable[[Path], None]
) -> None:
    def rename(record: Any) -> Any:
        for suffix in ("ptm", "png"):
            old = tmp_path / f"db/www/textures/{'ab'[record.image]}.{suffix}"
            old.rename(old.with_name(f"{old.stem} ü#%41.{suffix}"))
        stem = f"textures/{'ab'[record.image]} ü#%41"
        place = tmp_path / f"db/www/{stem}.ptm"
        return replace(record, file=f"{stem}.ptm", fallback=f"{stem}.png", stored=place)

    www = emit_gltf(tmp_path / "db/www", rename=rename)
    uris = {i["uri"] for tree in documents(www) for i in tree["images"]}
    assert uris == {f"../textures/{n}%20%C3%BC%23%2541.png" for n in "ab"}
    seal(tmp_path / "db")
    assert validate_database(tmp_path / "db").issues == ()
    assert disagreements(tmp_path / "db/www") == []


def test_vrml_alone(artifacts: Any, tmp_path: Path, emit_gltf: EmitGltf) -> None:
    www = emit_gltf(tmp_path / "www", format="vrml")
    assert not (www / "gltf").exists()
    with pytest.raises(InputError, match="PTM-I111"):
        EmitOptions(format="usd")  # type: ignore[arg-type]
    (tmp_path / "other/gltf").mkdir(parents=True)
    with pytest.raises(OutputError, match=r"gltf.*PTM-O001"):
        emit_gltf(tmp_path / "other")


def test_same_arrays_have_one_accessor() -> None:
    buffer = PlainBuffer()
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    index = np.array([[0, 1, 2], [0, 2, 3]])
    assert [buffer.positions(square), buffer.positions(square * 2)] == [0, 1]
    assert [buffer.indices(index, 4), buffer.indices(index, 9)] == [2, 2]
    assert buffer.positions(square) == 0
    members, binary = buffer.members(), buffer.bytes()
    assert [view["byteLength"] for view in members["bufferViews"]] == [96, 12]
    assert [view.get("byteStride") for view in members["bufferViews"]] == [12, None]
    assert members["accessors"][1]["byteOffset"] == 48
    assert members["accessors"][1]["max"] == [2, 2, 0]
    assert len(binary) == 108


@pytest.mark.parametrize(("vertices", "component", "size"), [(65535, 5123, 2), (65536, 5125, 4)])
def test_indices_are_wide_where_they_must(vertices: int, component: int, size: int) -> None:
    """65535 restarts a primitive, so it is no index of 16 bits."""
    buffer = PlainBuffer()
    buffer.indices(np.array([[0, 1, vertices - 1]]), vertices)
    members, binary = buffer.members(), buffer.bytes()
    assert members["accessors"][0]["componentType"] == component
    assert np.frombuffer(binary, f"<u{size}").tolist() == [0, 1, vertices - 1]


def test_wide_and_narrow_indices_beside_each_other() -> None:
    """Wide ones go first, so that both are aligned whatever their number."""
    buffer = PlainBuffer()
    point = np.zeros((1, 3), np.float32)
    places = [
        buffer.positions(point),
        buffer.indices(np.array([[0, 0, 0]]), 1),
        buffer.indices(np.array([[1, 2, 70000]]), 70001),
    ]
    members, binary = buffer.members(), buffer.bytes()
    starts = [
        members["bufferViews"][members["accessors"][i]["bufferView"]].get("byteOffset", 0)
        for i in places
    ]
    assert starts == [0, 24, 12]
    assert members["buffers"] == [{"byteLength": len(binary)}]


@given(st.dictionaries(st.text(), st.integers() | st.text()), st.binary(max_size=20))
def test_the_container_reads_back(tree: dict[str, Any], binary: bytes) -> None:
    data = pack(tree, binary)
    read, held = unpack(data)
    assert read == tree
    assert held[: len(binary)] == binary
    assert len(data) % 4 == 0
    assert not held[len(binary) :].strip(b"\0")


def test_a_cell_beyond_the_format_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ptmtools.output.gltf._LARGEST", 100)
    with pytest.raises(LimitError, match="PTM-L400"):
        pack({"asset": {}}, bytes(100))


@pytest.mark.parametrize(
    ("name", "extension"), [("WEBP", "EXT_texture_webp"), ("AVIF", "EXT_texture_avif")]
)
def test_lossy_images_of_the_model_are_named_by_extensions(
    tmp_path: Path, name: str, extension: str
) -> None:
    model = shutil.copytree(TWO_ROOMS, tmp_path / "model")
    noise = np.random.default_rng(0).integers(0, 256, (8, 8, 3), np.uint8)
    image = Image.fromarray(noise).resize((128, 128))
    image.save(model / "floor.png", name, quality=60)
    build_scene(model / "two_rooms.obj", tmp_path / "db", LightOptions("none"))
    www = tmp_path / "db/www"
    (texture,) = (
        row
        for row in json.loads((www / "hints.json").read_text())["textures"]
        if "floor" in row["file"]
    )
    assert texture["fallback"] == f"textures/floor.{name.lower()}"
    used = 0
    for file in sorted((www / "gltf").iterdir()):
        tree, _ = unpack(file.read_bytes())
        rows = [row for row in tree.get("textures", ()) if "extensions" in row]
        assert tree["extensionsRequired"] == ["EXT_meshopt_compression"]
        assert (extension in tree["extensionsUsed"]) == bool(rows)
        for row in rows:
            (source,) = row["extensions"].values()
            assert tree["images"][source["source"]]["uri"] == f"../{texture['fallback']}"
            used += 1
    assert used
    assert not validate_database(tmp_path / "db").issues
