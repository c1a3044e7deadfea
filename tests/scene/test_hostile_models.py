"""Models made to do harm: to read what is none of theirs, or to take memory and time without end.

Each of them is small. None may lead out of its folder, and each is read or refused at once.
"""

from __future__ import annotations

import io
import json
import os
import struct
import subprocess
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock, create_autospec

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import InputError, LimitError, PtmError
from ptmtools.scene import (
    IngestOptions,
    Scene,
    ingest,
    mtl as mtl_module,
    obj as materials_module,
    obj as obj_module,
)
from ptmtools.scene.gltf import document as gltf_document
from ptmtools.scene.images import ImageStore
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.obj import read_obj
from ptmtools.scene.source import FileRange
from tests.memory import little_memory

from .conftest import FACE, QUAD, GltfModel, Put, broken, noise, png, read_source

SECRET = png(noise(9))


@pytest.fixture
def house(put: Put, tmp_path: Path) -> Path:
    """A folder of a model, beside files that are none of its own; links in it lead out."""
    put("secret.png", SECRET)
    put("secret.mtl", "newmtl a\nKd 0 0 1\n")
    put("outside/secret.png", SECRET)
    put("house/maps/own.png", png(noise(1)))
    os.symlink("../secret.png", tmp_path / "house/link.png")
    os.symlink("../outside", tmp_path / "house/elsewhere")
    os.symlink("/", tmp_path / "house/root")
    os.symlink("round.png", tmp_path / "house/round.png")
    os.symlink("/proc/self/environ", tmp_path / "house/environ.png")
    os.symlink("/dev/zero", tmp_path / "house/zero.png")
    os.mkfifo(tmp_path / "house/fifo.png")
    os.mkfifo(tmp_path / "house/fifo.mtl")
    os.mkfifo(tmp_path / "house/fifo.bin")
    (tmp_path / "house/folder.png").mkdir()
    return tmp_path / "house"


#: Names that lead out of the folder, or to what is no file. {} is the folder above.
NAMES = [
    "../secret.png",
    "..\\secret.png",
    "maps/../../secret.png",
    "maps\\..\\..\\secret.png",
    "./.././secret.png",
    "....//secret.png",
    "{}/secret.png",
    "file://{}/secret.png",
    "FILE://{}/secret.png",
    "C:{}/secret.png",
    "C:..\\secret.png",
    "\\\\localhost{}\\secret.png",
    "\\\\?\\C:\\secret.png",
    '"../secret.png"',
    "link.png",
    "LINK.PNG",
    "elsewhere/secret.png",
    "root{}/secret.png",
    "environ.png",
    "/proc/self/environ",
    "/dev/stdin",
    "/dev/zero",
    "zero.png",
    "fifo.png",
    "round.png",
    "folder.png",
    "../secret.png\0.png",
    "~/secret.png",
    "$HOME/secret.png",
    "|cat ../secret.png",
    "http://localhost/secret.png",
    "con",
    "x" * 300,
    "x/" * 300 + "secret.png",
    "../" * 1000 + "secret.png",
    "x" * 100_000,
    "a/" * 100_000,
]


def no_image(scene: Scene) -> None:
    assert scene.images == ()
    assert all(material.image == -1 for material in scene.materials)


@pytest.mark.parametrize("name", NAMES)
def test_textures_do_not_lead_out(put: Put, house: Path, name: str) -> None:
    name = name.format(house.parent)
    put("house/a.mtl", f"newmtl a\nmap_Kd {name}\nmap_d {name}\n")
    path = put("house/a.obj", "mtllib a.mtl\n" + QUAD + "usemtl a\n" + FACE)
    scene = ingest(path)
    no_image(scene)
    assert any(note.code in ("PTM-N204", "PTM-N205") for note in scene.notes)
    assert all(".." not in file.split("/") for file in scene.files)
    with pytest.raises(InputError, match=r"PTM-I20[45]"):
        ingest(path, IngestOptions(strict=True))


@pytest.mark.parametrize("name", ["../secret.mtl", "{}/secret.mtl", "fifo.mtl", "x" * 100_000])
def test_libraries_do_not_lead_out(put: Put, house: Path, name: str) -> None:
    name = name.format(house.parent)
    scene = ingest(put("house/a.obj", f"mtllib {name}\n" + QUAD + "usemtl a\n" + FACE))
    assert scene.materials[0].color == (0.8, 0.8, 0.8)
    assert any(note.code in ("PTM-N203", "PTM-N205") for note in scene.notes)


#: As URIs have them besides.
ESCAPED = [
    "%2e%2e/secret.png",
    "%2e%2e%2fsecret.png",
    "..%5csecret.png",
    "%252e%252e/secret.png",
    "..%00/secret.png",
    "%c0%ae%c0%ae/secret.png",
    "file%3a//{}/secret.png",
    "\ud800../secret.png",
]


@pytest.mark.parametrize("name", [*NAMES, *ESCAPED])
@pytest.mark.parametrize("what", ["image", "buffer"])
def test_gltf_does_not_lead_out(put: Put, house: Path, name: str, what: str) -> None:
    name = name.format(house.parent)
    doc = GltfModel()
    doc.place(doc.quad(material=0))
    doc.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    doc.tree["textures"] = [{"source": 0}]
    doc.tree["images"] = [{"uri": name if what == "image" else "maps/own.png"}]
    path = put("house/a.gltf", doc.gltf(name if what == "buffer" else ""))
    if what == "image":
        scene = ingest(path)
        no_image(scene)
        assert all(".." not in file.split("/") for file in scene.files)
    else:
        with pytest.raises(InputError, match=r"PTM-I20[35]"):
            ingest(path)


#: Models with an image, and one with a file of its own.
OTHERS = {
    "dae": "<COLLADA><library_images><image id='i'><init_from>{}</init_from></image>"
    "</library_images><library_effects><effect id='e'><profile_COMMON><technique><lambert><diffuse>"
    "<texture texture='i'/></diffuse></lambert></technique></profile_COMMON></effect>"
    "</library_effects><library_materials><material id='m'><instance_effect url='#e'/></material>"
    "</library_materials><library_geometries><geometry id='g'><mesh><source id='p'><float_array "
    "id='a'>0 0 0 9 0 0 9 4 0</float_array><technique_common><accessor source='#a' count='3' "
    "stride='3'/></technique_common></source><vertices id='v'><input semantic='POSITION' "
    "source='#p'/></vertices><triangles material='m'><input semantic='VERTEX' source='#v'/>"
    "<p>0 1 2</p></triangles></mesh></geometry></library_geometries><library_visual_scenes>"
    "<visual_scene><node><instance_geometry url='#g'/></node></visual_scene>"
    "</library_visual_scenes></COLLADA>",
    "wrl": "#VRML V2.0 utf8\nShape {{ appearance Appearance {{ texture ImageTexture {{ url "
    '"{}" }} }} geometry Box {{ }} }}',
    "x3d": "<Scene><Inline url='{}'/><Shape><Box/></Shape></Scene>",
}


@pytest.mark.parametrize("name", [*NAMES, *ESCAPED[:-1]])
@pytest.mark.parametrize("suffix", OTHERS)
def test_other_formats_do_not_lead_out(put: Put, house: Path, name: str, suffix: str) -> None:
    """Backslashes, quotes and what a document cannot hold are written as its format has them."""
    name = name.format(house.parent).replace("\0", "%00")
    if suffix == "wrl":
        name = name.replace("\\", "\\\\").replace('"', '\\"')
    path = put(f"house/a.{suffix}", OTHERS[suffix].format(name))
    notes = IngestNotes(path)
    source = read_source(path, notes)
    assert all(material.texture is None for material in source.materials)
    assert [note.code for note in notes.entries if note.code in ("PTM-N204", "PTM-N205")]
    assert all(".." not in file.split("/") for file in notes.folder.sought)


def test_a_file_that_turns_into_a_pipe_is_not_waited_for(put: Put, tmp_path: Path) -> None:
    path = put("a.png", png(noise(1)))
    read = FileRange(path)
    assert read() == png(noise(1))
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(OSError, match="not a regular file"):
        read()


@pytest.mark.parametrize("letter", [chr(0xD800), chr(0xDFFF)])
def test_halves_of_characters_in_names(put: Put, letter: str) -> None:
    """JSON may hold what no text file can: it must not come out at the other end."""
    doc = GltfModel()
    doc.place(doc.quad(material=0), name=f"wall {letter}")
    doc.tree["materials"] = [{"name": f"paint {letter}", "extras": {letter: letter}}]
    scene = ingest(put("a.glb", doc.glb()))
    scene.to_arrays()
    assert scene.objects == ("wall ?",)
    assert scene.materials[0].name == "paint ?"


def huge(side: int = 60_000) -> bytes:
    """A PNG that declares so many texels a side."""
    data = bytearray(png(noise(1)))
    data[16:24] = side.to_bytes(4, "big") * 2
    data[29:33] = zlib.crc32(bytes(data[12:29])).to_bytes(4, "big")
    return bytes(data)


@pytest.mark.parametrize("statement", ["map_Kd", "map_d"])
def test_images_beyond_the_limit_end_the_ingest(
    textured: Callable[..., Path], statement: str
) -> None:
    path = textured(f"{statement} wall.png", {"wall.png": huge()})
    with pytest.raises(LimitError, match=r"wall\.png: room\.mtl:2: .*--limit.*PTM-L104"):
        ingest(path)
    path.with_name("wall.png").write_bytes(png(noise(1, 513)))
    with pytest.raises(LimitError, match=r"513 x 513 texels of 4 bytes.*PTM-L104"):
        ingest(path, IngestOptions(limit=1))
    path.with_name("wall.png").write_bytes(png(noise(1, 512)))
    ingest(path, IngestOptions(limit=1))


def test_a_sparse_file_of_a_terabyte_is_not_read(textured: Callable[..., Path]) -> None:
    path = textured("map_Kd wall.png", {"wall.png": png(noise(1))})
    os.truncate(path.with_name("wall.png"), 1 << 40)
    with pytest.raises(LimitError, match=r"wall\.png: room\.mtl:2: .*PTM-L104"):
        ingest(path)


POSTSCRIPT = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\n%%EndComments\nshowpage\n%%EOF\n"


def test_postscript_is_no_texture(
    textured: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("Popen", "check_call"):
        monkeypatch.setattr(subprocess, name, Mock(side_effect=AssertionError("was called")))
    scene = ingest(textured("map_Kd wall.png", {"wall.png": POSTSCRIPT}))
    no_image(scene)
    assert "PTM-N206" in {note.code for note in scene.notes}


def test_grey_of_16_bits_with_a_colour_for_holes(textured: Callable[..., Path]) -> None:
    """Pillow does not convert these; they are examined all the same."""
    stream = io.BytesIO()
    texels = np.arange(64, dtype=np.uint16).reshape(8, 8) * 1000
    Image.fromarray(texels).save(stream, "png", transparency=5000)
    for statement in ("map_Kd", "map_d"):
        scene = ingest(textured(f"{statement} wall.png", {"wall.png": stream.getvalue()}))
        assert scene.materials[0].transparent


def test_masks_are_kept_in_bits(textured: Callable[..., Path]) -> None:
    pixels = np.full((1024, 1023, 4), 255, np.uint8)
    pixels[700, 1000:, 3] = 0
    path = textured("map_Kd wall.png", {"wall.png": png(pixels)})
    texture = read_obj(path, IngestNotes(path), IngestOptions()).materials[0].texture
    assert texture is not None
    store = ImageStore(IngestNotes(path), 1 << 30)
    decoded = store.add(texture)
    assert decoded is not None
    index, holes = decoded
    assert index == 0
    assert holes is not None
    assert np.array_equal(holes, pixels[..., 3] < 255)
    (examined,) = store._examined.values()
    assert examined.bits is not None
    assert examined.bits.nbytes == 1024 * 1024 // 8


def test_an_image_that_many_materials_name_is_read_once(
    put: Put, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = create_autospec(FileRange.__call__, side_effect=FileRange.__call__)
    monkeypatch.setattr(FileRange, "__call__", read)
    put("wall.png", png(noise(1)))
    put("bad.png", b"no image")
    names = range(50)
    statements = "map_Kd wall.png\nmap_d wall.png\n", "map_Kd bad.png\nmap_d bad.png\n"
    put("a.mtl", "".join(f"newmtl m{i}\n{statements[i % 2]}" for i in names))
    faces = "".join(f"usemtl m{i}\nv {i} 0 9\nf 1/1 2/2 -1/3\n" for i in names)
    scene = ingest(put("a.obj", "mtllib a.mtl\n" + QUAD + faces))
    assert len(scene.images) == 1
    names = sorted(call.args[0].path.name for call in read.call_args_list)
    # As colours and as opacities: looked at, and made into the image with both.
    assert names == ["bad.png"] * 2 + ["wall.png"] * 4


def read(path: Path, max_triangles: int = 1 << 31) -> int:
    source = read_obj(path, IngestNotes(path), IngestOptions(max_triangles=max_triangles))
    return len(source.triangles)


def test_lines_that_are_joined_without_end(put: Put) -> None:
    """Half a million of them; joining them one by one would take minutes."""
    path = put("a.obj", QUAD + "f 1 2 3" + " \\\n" * 500_000 + " 4\n")
    assert read(path) == 2


def test_long_lines_are_refused(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(obj_module, "LONGEST_LINE", 1000)
    assert read(put("a.obj", QUAD + "f 1 2 3" + " " * 992 + "\n")) == 1
    for line in ("f 1 2 3" + " " * 1000, "\0" * 5000, "f 1 2 3" + " \\\n" * 800):
        with pytest.raises(LimitError, match=r"a\.obj: line 9: .*PTM-L204"):
            read(put("a.obj", QUAD + line + "\n"))


def test_a_face_of_a_million_corners(put: Put) -> None:
    path = put("a.obj", QUAD + "f" + " 1 2 3 4" * 250_000 + "\n")
    assert read(path) == 999_998
    with pytest.raises(LimitError, match="PTM-L203"):
        read(path, 999_997)


def test_vertices_are_counted_before_triangles_are_made(
    put: Put, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(obj_module, "MAX_VERTICES", 3)
    monkeypatch.setattr(obj_module, "triangulate", None)
    with pytest.raises(LimitError, match=r"more than 3 vertices.*split the model.*PTM-L203"):
        read(put("a.obj", QUAD + FACE))


def test_triangles_are_counted_before_they_are_made(put: Put) -> None:
    path = put("a.obj", QUAD + "f 1 2 3 4\n" * 50 + "f 1 2 3\n")
    assert read(path, 101) == 101
    with pytest.raises(LimitError, match=r"more than 100 triangles.*--max-triangles.*PTM-L203"):
        read(path, 100)
    with pytest.raises(LimitError, match="PTM-L203"):
        ingest(path, IngestOptions(max_triangles=100))


@pytest.mark.parametrize("options", [{"limit": 0}, {"max_triangles": 0}, {"limit": -1}])
def test_limits_below_one_are_refused(options: dict[str, int]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        IngestOptions(**options)


def test_limits_are_no_part_of_what_a_stage_was_told() -> None:
    assert IngestOptions(limit=1, max_triangles=1) == IngestOptions()
    assert replace(IngestOptions(), strict=True) != IngestOptions()


def test_a_library_is_read_once(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    read = Mock(wraps=materials_module.read_mtl)
    monkeypatch.setattr(materials_module, "read_mtl", read)
    put("a.mtl", "newmtl a\nKd 1 0 0\n")
    put("x/b.mtl", "newmtl b\n")
    names = ["a.mtl", "A.MTL", "./a.mtl", "x/../a.mtl", "/tmp/a.mtl"] * 200
    path = put("a.obj", "".join(f"mtllib {n}\n" for n in names) + QUAD + "usemtl a\n" + FACE)
    scene = ingest(path)
    assert scene.materials[0].color == (1, 0, 0)
    assert read.call_count == 1


def test_large_libraries_are_refused(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mtl_module, "LARGEST", 0)
    put("a.mtl", "newmtl a\nKd 1 0 0\n")
    with pytest.raises(LimitError, match=r"a\.mtl: .*PTM-L204"):
        ingest(put("a.obj", "mtllib a.mtl\n" + QUAD + "usemtl a\n" + FACE))


@pytest.mark.parametrize(
    "face",
    [
        "f 1 2 2147483648",
        "f 1 2 99999999999999999999",
        "f 1 2 -99999999999999999999",
        "f 1 2 " + "9" * 5000,
        "f 1/9999999999 2 3",
        "f 0 1 2",
        "f 1 2 -5",
        "f 1 2 1e3",
        "f 1 2 nan",
        "f 1// 2// 3/0",
    ],
)
def test_indices_out_of_range(put: Put, face: str) -> None:
    with pytest.raises(InputError, match="PTM-I245"):
        read(put("a.obj", QUAD + face + "\n"))


def placed(count: int) -> GltfModel:
    """One mesh at so many nodes."""
    doc = GltfModel.wall()
    doc.tree["nodes"] = [{"mesh": 0}] * count
    doc.tree["scenes"] = [{"nodes": list(range(count))}]
    return doc


def test_instances_are_counted_before_they_are_made(put: Put) -> None:
    assert len(ingest(put("a.glb", placed(5).glb()), IngestOptions(max_triangles=10)).points) == 4
    with pytest.raises(LimitError, match="PTM-L203"):
        ingest(put("a.glb", placed(6).glb()), IngestOptions(max_triangles=10))
    # Vertices that are shared are read for each.
    doc = GltfModel()
    quads = [doc.quad() for _ in range(9)]
    for quad in quads:
        quad["attributes"] = quads[0]["attributes"]
        quad["indices"] = doc.add(np.array([0, 1, 2], np.uint16))
    doc.tree["accessors"][0]["count"] = 4
    corners = doc.add(np.tile(np.eye(3, dtype=np.float32) * 9, (20, 1)))
    quads[0]["attributes"] = {"POSITION": corners}
    doc.place(*[{**quad, "attributes": {"POSITION": corners}} for quad in quads])
    assert len(ingest(put("a.glb", doc.glb()), IngestOptions(max_triangles=54)).triangles) == 1
    with pytest.raises(LimitError, match=r"more than 530 vertices.*PTM-L203"):
        ingest(put("a.glb", doc.glb()), IngestOptions(max_triangles=53))
    # A strip has nearly as many triangles as corners.
    doc = GltfModel()
    doc.place(doc.quad(mode=5))
    with pytest.raises(LimitError, match="PTM-L203"):
        ingest(put("a.glb", doc.glb()), IngestOptions(max_triangles=5))


def test_a_chain_of_nodes(put: Put) -> None:
    """Its matrices are multiplied once: a thousand nodes below each other are no trouble."""
    doc = placed(1000)
    for number, node in enumerate(doc.tree["nodes"]):
        children = [number + 1] if number < 999 else []
        doc.tree["nodes"][number] = {**node, "children": children, "translation": [0, 0, 1]}
    doc.tree["scenes"] = [{"nodes": [0]}]
    scene = ingest(put("a.glb", doc.glb()))
    assert len(scene.triangles) == 2000
    assert np.ptp(scene.points[:, 2]) == 999


def test_a_buffer_that_many_name_is_read_once(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    doc = GltfModel.wall()
    put("a.bin", doc.blob + bytes(1000))
    tree = json.loads(doc.gltf("a.bin"))
    (entry,) = tree["buffers"]
    tree["buffers"] = [{**entry, "uri": f"{'./' * i}a.bin"} for i in range(100)]
    opened = []
    original = gltf_document.open_regular

    class Counted:
        def __init__(self, path: Path) -> None:
            self.file = original(path)
            opened.append(path)

        def __enter__(self) -> Counted:
            return self

        def __exit__(self, *arguments: object) -> None:
            self.file.close()

        def fileno(self) -> int:
            return self.file.fileno()

        def read(self, length: int) -> bytes:
            assert length == len(doc.blob)
            return self.file.read(length)

    monkeypatch.setattr(gltf_document, "open_regular", Counted)
    assert len(ingest(put("a.gltf", json.dumps(tree))).triangles) == 2
    assert len(opened) == 1


@pytest.mark.parametrize("length", [2**31, 2**40, 2**62, 2**70])
def test_a_buffer_that_declares_more_than_its_file_has(put: Put, length: int) -> None:
    doc = GltfModel.wall()
    put("a.bin", doc.blob)
    tree = json.loads(doc.gltf("a.bin"))
    tree["buffers"][0]["byteLength"] = length
    path = put("a.gltf", json.dumps(tree))
    with little_memory(1 << 24), pytest.raises(InputError, match=r"PTM-I249"):
        ingest(path)


NAN = float("nan")
LIES: dict[str, bytes] = {
    "a length of the file": broken(lambda d: None)[:8] + struct.pack("<I", 2**32 - 1),
    "a length below what there is": broken(lambda d: None).replace(b"glTF", b"glTF\2\0\0\0", 1),
    "an offset below 0": broken(lambda d: d.tree["bufferViews"][0].update(byteOffset=-4)),
    "an offset that is a half": broken(lambda d: d.tree["bufferViews"][0].update(byteOffset=0.5)),
    "a view of a view": broken(lambda d: d.tree["bufferViews"][0].update(buffer=7)),
    "a stride of 0": broken(lambda d: d.tree["bufferViews"][0].update(byteStride=0)),
    "a stride below 0": broken(lambda d: d.tree["bufferViews"][0].update(byteStride=-12)),
    "a stride without end": broken(lambda d: d.tree["bufferViews"][0].update(byteStride=2**62)),
    "a count of a float": broken(lambda d: d.tree["accessors"][0].update(count=4.0)),
    "a count that is no number": broken(lambda d: d.tree["accessors"][0].update(count=NAN)),
    "a count without end": broken(lambda d: d.tree["accessors"][0].update(count=float("inf"))),
    "a count that is true": broken(lambda d: d.tree["accessors"][0].update(count=True)),
    "a count of indices": broken(lambda d: d.tree["accessors"][2].update(count=2**40)),
    "a sparse accessor": broken(lambda d: d.tree["accessors"][0].update(sparse={"count": 2**40})),
    "no view": broken(lambda d: d.tree["accessors"][0].pop("bufferView")),
    "a matrix": broken(lambda d: d.tree["accessors"][0].update(type="MAT4")),
    "a type of a list": broken(lambda d: d.tree["accessors"][0].update(componentType=[5126])),
    "a node in a list": broken(lambda d: d.tree["scenes"][0].update(nodes=[[0]])),
    "a tint that is no number": broken(
        lambda d: (
            d.tree.update(materials=[{"pbrMetallicRoughness": {"baseColorFactor": [NAN] * 4}}]),
            d.tree["meshes"][0]["primitives"][0].update(material=0),
        )
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", LIES)
def test_gltf_that_lies(put: Put, what: str) -> None:
    with pytest.raises(PtmError, match=r"PTM-(I24[79]|L203)"):
        ingest(put("a.glb", LIES[what]))


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a":' * 100_000, "9" * 10_000, '{"asset":NaN}'])
def test_json_that_is_made_to_be_costly(put: Put, text: str) -> None:
    with pytest.raises(InputError, match="PTM-I249"):
        ingest(put("a.gltf", text))
