"""Works of art, and images of emission, are shown in the colours of their files, whatever light
their room has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.coverage.options import AchOptions
from ptmtools.light.options import LightOptions
from ptmtools.output import EmitOptions
from ptmtools.output.gltf_reader import read_glb
from ptmtools.output.served import read_served
from ptmtools.pipeline.build import build_scene
from ptmtools.rendering.drawing import ViewOptions, draw_view
from tests.light.glowing import HEIGHT, SIDE, sides
from tests.scene.conftest import GltfModel, png

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

QUICK = AchOptions(samples=1, face=16, backend="embree")
#: The colours of the quarters of the painting, from its upper left.
QUARTERS = np.uint8([[[200, 30, 40], [240, 240, 235]], [[20, 90, 160], [120, 120, 120]]])
LAMPS = "KHR_lights_punctual"


def add_rectangle(doc: GltfModel, name: str, corner: Floats, material: int) -> None:
    """(4, 3) corners from the lower left one."""
    coords = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    primitive = {
        "attributes": {
            "POSITION": doc.add(np.asarray(corner, np.float32)),
            "TEXCOORD_0": doc.add(coords),
        },
        "indices": doc.add(np.array([0, 1, 2, 0, 2, 3], np.uint16)),
        "material": material,
    }
    doc.place(primitive, name=name)


def add_white_room(doc: GltfModel, material: int) -> None:
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    for k, (origin, edges) in enumerate(sides()):
        add_rectangle(doc, f"side {k}", origin + unit @ edges, material)


def upright(x: float, z: float) -> Floats:
    """2 m by 1 m."""
    return np.array([[x, 1, z], [x + 2, 1, z], [x + 2, 2, z], [x, 2, z]])


def write_red_gallery(folder: Path) -> Path:
    """A white room with a red lamp, a painting, whose image the far wall has, too, and a screen
    that emits it."""
    doc = GltfModel()
    image = doc.view(png(np.kron(QUARTERS, np.ones((32, 32, 1), np.uint8))))
    doc.tree["images"] = [{"bufferView": image, "mimeType": "image/png"}]
    doc.tree["textures"] = [{"source": 0}]
    rough = {"metallicFactor": 0}
    doc.tree["materials"] = [
        {"name": "white", "doubleSided": True, "pbrMetallicRoughness": rough},
        {"name": "painting", "pbrMetallicRoughness": rough | {"baseColorTexture": {"index": 0}}},
        {
            "name": "screen",
            "pbrMetallicRoughness": rough | {"baseColorFactor": [0, 0, 0, 1]},
            "emissiveTexture": {"index": 0},
            "emissiveFactor": [1, 1, 1],
        },
    ]
    add_white_room(doc, 0)
    add_rectangle(doc, "painting", upright(0.5, 0.02), 1)
    add_rectangle(doc, "screen", upright(3.5, 0.02), 2)
    far = np.array([[SIDE, 0, 5.98], [0, 0, 5.98], [0, HEIGHT, 5.98], [SIDE, HEIGHT, 5.98]])
    add_rectangle(doc, "wallpaper", far, 1)
    light = {"type": "point", "color": [1, 0.05, 0.05], "intensity": 200}
    doc.tree["extensions"] = {LAMPS: {"lights": [light]}}
    doc.tree["extensionsUsed"] = [LAMPS]
    doc.tree["nodes"].append({"translation": [3, 2.5, 3], "extensions": {LAMPS: {"light": 0}}})
    doc.tree["scenes"][0]["nodes"].append(len(doc.tree["nodes"]) - 1)
    folder.mkdir()
    (folder / "red.glb").write_bytes(doc.glb())
    return folder / "red.glb"


def build(model: Path, db: Path, **options: Any) -> Path:
    light = LightOptions("bake", light_samples=4, light_density=4, **options)
    build_scene(model, db, QUICK, light, EmitOptions(format="gltf"), workers=1)
    return db


def quarters(db: Path, eye: Floats, point: Floats) -> Floats:
    """(2, 2, 3) what a visitor sees in the middles of the quarters of a rectangle."""
    view = ViewOptions(eye=(*eye,), look=(*point,), field_of_view=30, width=256, height=128)
    picture = draw_view(read_served(db), view).astype(float)
    middle, away = np.array([64, 128]), np.array([16, 32])
    return np.array(
        [[picture[tuple(middle + away * (row, column))] for column in (-1, 1)] for row in (-1, 1)]
    )


def lit_materials(db: Path) -> dict[str, set[bool]]:
    """Object → whether its shapes have light."""
    lit: dict[str, set[bool]] = {}
    for file in (db / "www/gltf").glob("c*.glb"):
        for shape in read_glb(file.read_bytes()).primitives:
            lit.setdefault(shape.object, set()).add(shape.material.white is not None)
    return lit


def test_a_painting_in_red_light(tmp_path: Path) -> None:
    model = write_red_gallery(tmp_path / "model")
    db = build(model, tmp_path / "db")
    eye, point = np.array([-1.5, 1.5, 1.0]), np.array([-1.5, 1.5, -2.98])
    aside = np.array([3.0, 0, 0])
    lit = lit_materials(db)
    assert lit.pop("painting") == lit.pop("screen") == {False}
    assert set().union(*lit.values()) == {True}, "so is wallpaper of the same image"
    for way in (0 * aside, aside):
        assert np.abs(quarters(db, eye + way, point + way) - QUARTERS).max() <= 1
    build(model, db, true_colours="none")
    assert [name for name, has in lit_materials(db).items() if has != {True}] == ["screen"]
    assert np.abs(quarters(db, eye + aside, point + aside) - QUARTERS).max() <= 1
    shown = quarters(db, eye, point)
    assert (np.abs(shown - QUARTERS).max(axis=2) > 20).all(), "red light"
