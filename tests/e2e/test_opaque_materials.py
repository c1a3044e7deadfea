"""Alpha that a material ignores has no effect in any stage: glTF 2.0, section 3.9.6."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.output.gltf import unpack
from ptmtools.texture.images.png import png_bytes
from tests.e2e.conftest import Ptm
from tests.scene.buildings import house, welded, y_up
from tests.scene.conftest import GltfModel

COLORS = np.random.default_rng(3).integers(0, 255, (16, 16, 3), dtype=np.uint8)
CLEAR = np.concatenate([COLORS, np.full((16, 16, 1), 40, np.uint8)], axis=2)


def model(pixels: np.ndarray, mode: str | None) -> bytes:
    """A house of several rooms, all of one material."""
    points, faces = welded(y_up(house()))
    doc = GltfModel()
    doc.tree["images"] = [
        {"bufferView": doc.view(png_bytes(pixels)), "mimeType": "image/png", "name": "wall"}
    ]
    doc.tree["textures"] = [{"source": 0}]
    paint = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "doubleSided": True}
    doc.tree["materials"] = [paint | ({"alphaMode": mode} if mode else {})]
    primitive = {
        "attributes": {
            "POSITION": doc.add(points.astype(np.float32)),
            "TEXCOORD_0": doc.add((points[:, :2] / 3).astype(np.float32)),
        },
        "indices": doc.add(faces.reshape(-1).astype(np.uint16)),
        "material": 0,
    }
    doc.place(primitive)
    return doc.glb()


def served(db: Path) -> dict[str, bytes]:
    www = db / "www"
    return {p.relative_to(www).as_posix(): p.read_bytes() for p in www.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Databases with light; few rays show whether one surface is lit otherwise."""
    folder, made = tmp_path_factory.mktemp("built"), {}
    for name, pixels, mode in (
        ("plain", COLORS, None),
        ("opaque", CLEAR, "OPAQUE"),
        ("default", CLEAR, None),
        ("blend", CLEAR, "BLEND"),
    ):
        path = folder / name / "house.glb"
        path.parent.mkdir()
        path.write_bytes(model(pixels, mode))
        made[name] = path.with_name("house.db")
        options = ["-o", str(made[name]), "--light-samples", "4"]
        assert main(["-q", "build-scene", str(path), *options]) == 0
    return made


def test_opaque_materials_with_alpha(ptm: Ptm, built: dict[str, Path]) -> None:
    """Every file that is served is that of the model whose image has no alpha: cells, VRML, GLB,
    textures and hints."""
    plain, opaque = served(built["plain"]), served(built["opaque"])
    assert opaque.keys() == plain.keys()
    assert [name for name in plain if opaque[name] != plain[name]] == []
    assert served(built["default"]) == opaque
    assert ptm("validate", built["opaque"]).status == 0

    hints = json.loads(opaque["hints.json"])
    assert len(hints["cells"]) > 1
    (texture,) = (built["opaque"] / "www" / "textures").glob("*.png")
    with Image.open(texture) as image:
        assert image.mode == "RGB"
    assert json.loads(ptm("info", texture.with_suffix(".ptm"), "--json").out)["components"] == 3
    for name in (name for name in opaque if name.endswith(".glb")):
        assert all("alphaMode" not in each for each in unpack(opaque[name])[0]["materials"])


def test_blended_materials_still_block_nothing(built: dict[str, Path]) -> None:
    cells = {
        name: len(json.loads((db / "www" / "hints.json").read_text())["cells"])
        for name, db in built.items()
    }
    assert cells["opaque"] == cells["plain"] > cells["blend"]
    (texture,) = (built["blend"] / "www" / "textures").glob("*.png")
    with Image.open(texture) as image:
        assert image.mode == "RGBA"
    cell = next((built["blend"] / "www" / "gltf").glob("*.glb"))
    assert unpack(cell.read_bytes())[0]["materials"][0]["alphaMode"] == "BLEND"
