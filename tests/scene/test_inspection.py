"""`ptm info MODEL`: what a model is, before anything is built."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cli.main import main
from tests.scene.conftest import FACE, QUAD, GltfModel, Put, noise, png


def info(path: Path, capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(["info", str(path), *words]) == 0
    return capsys.readouterr().out


def record(path: Path, capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    actual: dict[str, Any] = json.loads(info(path, capsys, "--json", *words))
    return actual


def rooms(doors: bool = True, roof: bool = True) -> str:
    """Two rooms of 4 × 4 × 2.6 m whose walls have no thickness, and a door leaf between them."""
    quads = {
        "floor": [(0, 0, 0), (8, 0, 0), (8, 0, 4), (0, 0, 4)],
        "south": [(0, 0, 0), (8, 0, 0), (8, 2.6, 0), (0, 2.6, 0)],
        "north": [(0, 0, 4), (8, 0, 4), (8, 2.6, 4), (0, 2.6, 4)],
        "west": [(0, 0, 0), (0, 0, 4), (0, 2.6, 4), (0, 2.6, 0)],
        "east": [(8, 0, 0), (8, 0, 4), (8, 2.6, 4), (8, 2.6, 0)],
        "left": [(4, 0, 0), (4, 0, 1.5), (4, 2.6, 1.5), (4, 2.6, 0)],
        "right": [(4, 0, 2.4), (4, 0, 4), (4, 2.6, 4), (4, 2.6, 2.4)],
        "lintel": [(4, 2.1, 1.5), (4, 2.1, 2.4), (4, 2.6, 2.4), (4, 2.6, 1.5)],
    }
    if doors:
        quads["Door_12"] = [(4, 0, 1.5), (4, 0, 2.4), (4, 2.1, 2.4), (4, 2.1, 1.5)]
    if roof:
        quads["ceiling"] = [(0, 2.6, 0), (8, 2.6, 0), (8, 2.6, 4), (0, 2.6, 4)]
    lines = []
    for n, (name, corners) in enumerate(quads.items()):
        lines += [f"o {name}", *(f"v {x} {y} {z}" for x, y, z in corners)]
        lines.append("f " + " ".join(str(4 * n + k) for k in (1, 2, 3, 4)))
    return "\n".join(lines) + "\n"


def test_what_is_said(put: Put, capsys: pytest.CaptureFixture[str]) -> None:
    text = info(put("house.obj", rooms()), capsys)
    rows = {line[:11].strip(): line[12:] for line in text.splitlines() if line[:11].strip()}
    assert "house.obj: Wavefront OBJ, " in text
    assert rows["triangles"] == "20 in 10 objects"
    assert rows["images"] == "none"
    assert rows["size"] == "8 x 4 m, 2.6 m high"
    assert rows["unit"] == "1 m (guessed)"
    assert rows["up axis"] == "Y (guessed)"
    assert "note        up axis guessed: Y, 8 m wide and 2.6 m high, " in text
    assert "note        unit guessed: m (8 m wide and 2.6 m high, " in text
    assert rows["closed"] == "probably; no sight line from a room leaves the building"
    assert rows["doors"] == "1 recognised: Door_12"


@pytest.mark.parametrize(
    ("given", "closed"), [({}, True), ({"doors": False}, True), ({"roof": False}, False)]
)
def test_whether_it_looks_closed(
    put: Put, capsys: pytest.CaptureFixture[str], given: dict[str, bool], closed: bool
) -> None:
    actual = record(put("house.obj", rooms(**given)), capsys)["enclosure"]
    assert actual["closed"] is closed
    assert bool(actual["rooms"]) is given.get("roof", True)
    assert actual["doors"] == (["Door_12"] if given.get("doors", True) else [])


def test_a_hole_in_the_roof_is_noticed(put: Put, capsys: pytest.CaptureFixture[str]) -> None:
    """A skylight of 1 m²."""
    text = rooms(roof=False)
    number = text.count("\nv ") + 1 + text.startswith("v ")
    edges = [(0, 3, 0, 4), (4, 8, 0, 4), (3, 4, 0, 1), (3, 4, 2, 4)]
    for x0, x1, z0, z1 in edges:
        for x, z in ((x0, z0), (x1, z0), (x1, z1), (x0, z1)):
            text += f"v {x} 2.6 {z}\n"
        text += "f " + " ".join(str(number + k) for k in range(4)) + "\n"
        number += 4
    actual = record(put("house.obj", text), capsys)["enclosure"]
    assert not actual["closed"]
    assert 0.001 < actual["leaving"] < 0.1


def test_of_a_gltf_model(put: Put, capsys: pytest.CaptureFixture[str]) -> None:
    doc = GltfModel()
    doc.tree["asset"]["generator"] = "a test"
    doc.tree["extensionsUsed"] = ["KHR_materials_unlit", "MSFT_lod", "KHR_materials_ior"]
    doc.tree["images"] = [{"bufferView": doc.view(png(noise(1))), "mimeType": "image/png"}]
    doc.tree["textures"] = [{"source": 0}, {}]
    doc.tree["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}} for index in (0, 1)
    ]
    doc.place(doc.quad(material=0))
    doc.place(doc.quad(material=1), name="chair", translation=[0, 0, 5])
    doc.place(doc.quad(material=1), name="chair", translation=[0, 0, 9])
    actual = record(put("a.glb", doc.glb()), capsys)
    assert actual["format"] == "glTF binary 2.0"
    assert actual["generator"] == "a test"
    assert actual["extensions"] == {
        "KHR_materials_ior": "does not change what is drawn",
        "KHR_materials_unlit": "read",
        "MSFT_lod": "not carried over",
    }
    assert actual["objects"] == {"chair": 4, "wall": 2}
    assert [image["width"] for image in actual["images"]] == [8]
    assert actual["space"]["metres"] == 1
    assert not actual["space"]["unit_guessed"]
    assert "PTM-N204" in {note["code"] for note in actual["notes"]}
    text = info(put("a.glb", doc.glb()), capsys)
    assert "warning     material 1: texture 1: has no image [PTM-N204]" in text


def test_options_count_as_in_a_build(put: Put, capsys: pytest.CaptureFixture[str]) -> None:
    actual = record(put("house.obj", rooms()), capsys, "--unit", "ft", "--up", "z")
    assert (actual["space"]["metres"], actual["space"]["up"]) == (0.3048, "z")
    assert np.allclose(actual["size"], [8 * 0.3048, 4 * 0.3048, 2.6 * 0.3048])
    assert "guessed" not in info(put("house.obj", rooms()), capsys, "--unit", "m", "--up", "y")


@pytest.mark.parametrize("name", ["gone.obj", "a.glb"])
def test_what_is_no_model_is_one_line(
    put: Put, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    path = put("a.glb", b"glTF").with_name(name)
    assert main(["info", str(path)]) == 3
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"ptm: {path}: ")


def test_the_library_beside_is_named(put: Put, capsys: pytest.CaptureFixture[str]) -> None:
    put("museum.mtl", "newmtl wall\n")
    text = info(put("a.obj", f"mtllib house.mtl\n{QUAD}usemtl wall\n{FACE}"), capsys)
    assert "if museum.mtl is the library of the model, rename it to house.mtl [PTM-N203]" in text
