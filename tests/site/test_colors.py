"""Colours of vertices, and texels that are not drawn, from the model to the screen."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.glb import glb_chunks
from ptmtools.output import validate_database
from ptmtools.output.gltf_reader import ReadPrimitive, read_glb
from ptmtools.scene.colors import to_linear, to_srgb
from ptmtools.site.content import Site, SiteOptions, site_of
from tests.output.agreement import kinds
from tests.scene.conftest import Gltf, png

from .conftest import build

#: A room, seen from within, with a panel across its middle; metres.
SIZE = np.array([6.0, 3.0, 5.0])
PANEL = 2.0
EYE, FIELD = np.array([3.0, 1.6, 4.5]), 1.1
#: Of the panel's left and right half; what is less than this is not drawn.
ALPHA, CUTOFF = (76, 180), 0.5


def color_at(point: np.ndarray) -> np.ndarray:
    """(..., 3) sRGB at places of the room's walls, 0 to 1: it changes evenly along each axis."""
    return 0.1 + 0.8 * point / SIZE


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The room's walls white with colours of their own, the panel with an alpha that is tested."""
    doc = Gltf()
    doc.tree["images"] = [
        {"bufferView": doc.view(png(np.full((8, 8, 3), 255, np.uint8))), "mimeType": "image/png"},
        {"bufferView": doc.view(png(halves())), "mimeType": "image/png"},
    ]
    doc.tree["textures"] = [{"source": 0}, {"source": 1}]
    doc.tree["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
        {
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}},
            "alphaMode": "MASK",
            "alphaCutoff": CUTOFF,
            "doubleSided": True,
        },
    ]
    x, y, z = SIZE
    corners = np.array([(i * x, j * y, k * z) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    walls = [primitive(doc, corners[quad], 0, to_linear(color_at(corners[quad]))) for quad in quads]
    across = np.array([[1.5, 0.6, PANEL], [4.5, 0.6, PANEL], [4.5, 2.4, PANEL], [1.5, 2.4, PANEL]])
    doc.place(*walls)
    doc.place(primitive(doc, across, 1))
    doc.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": FIELD, "znear": 0.1}}]
    doc.tree["nodes"].append({"camera": 0, "translation": EYE.tolist(), "name": "door"})
    doc.tree["scenes"] = [{"nodes": [0, 1, 2]}]
    folder = tmp_path_factory.mktemp("colors")
    (folder / "room.glb").write_bytes(doc.glb())
    return build(folder / "room.glb", folder / "room.db")


def halves() -> np.ndarray:
    texels = np.full((8, 8, 4), 255, np.uint8)
    texels[:, :4, 3], texels[:, 4:, 3] = ALPHA
    return texels


def primitive(
    doc: Gltf, corners: np.ndarray, material: int, light: np.ndarray | None = None
) -> dict[str, Any]:
    attributes = {
        "POSITION": doc.add(corners.astype(np.float32)),
        "TEXCOORD_0": doc.add(np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)),
    }
    if light is not None:
        attributes["COLOR_0"] = doc.add(light.astype(np.float32))
    index = doc.add(np.array([0, 1, 2, 0, 2, 3], np.uint16))
    return {"attributes": attributes, "indices": index, "material": material}


@pytest.fixture(scope="module")
def colored(database: Path) -> Site:
    return site_of(database, SiteOptions(pictures=False))


def origin_of(primitives: list[ReadPrimitive]) -> np.ndarray:
    """Where the room's corner is in the world."""
    return np.min([p.point.min(axis=0) for p in primitives], axis=0).astype(np.float64)


def test_each_corner_has_its_color(database: Path) -> None:
    """Those that cutting has made, too."""
    cells = [read_glb(file.read_bytes()) for file in sorted(database.glob("www/gltf/*.glb"))]
    primitives = [p for cell in cells for p in cell.primitives]
    origin = origin_of(primitives)
    assert {p.material.cutoff for p in primitives} == {None, CUTOFF}
    for p in primitives:
        if p.material.cutoff is not None:
            assert p.color is None
            continue
        assert p.color is not None
        assert np.abs(255 * (to_srgb(p.color) - color_at(p.point - origin))).max() <= 1.01


def test_the_vrml_files_have_the_same(database: Path, tmp_path: Path, ptm: Any) -> None:
    database = build(database.parent / "room.glb", tmp_path / "both.db")
    ptm("emit", database, "--format", "vrml,gltf", "--plain-gltf")
    assert validate_database(database).errors == ()
    text = "".join(file.read_text() for file in database.glob("www/cells/*.wrl"))
    assert "color Color { color [ " in text
    assert "colorPerVertex" not in text
    # And is told where they differ.
    glb = database / "www" / "gltf" / "c0000.glb"
    (_, _, tree), (_, at, _) = glb_chunks(glb.read_bytes())
    document = json.loads(tree)
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    accessor = document["accessors"][attributes["COLOR_0"]]
    at += document["bufferViews"][accessor["bufferView"]]["byteOffset"]
    data = bytearray(glb.read_bytes())
    data[at : at + 2] = b"\0\0"
    glb.write_bytes(data)
    assert "material" in kinds(database / "www")


def test_the_page_shows_them(visit: Callable[..., Any], colored: Site) -> None:
    width, height = 320, 240
    (place,) = [v for v in colored.index["viewpoints"] if v.get("description") == "door"]
    with visit(colored, width=width, height=height, reduced_motion="reduce") as visitor:
        visitor.go(colored.index["viewpoints"].index(place))
        shown = visitor.picture().astype(np.float64)
    assert visitor.messages == []
    expected, sure = seen(place, width, height)
    apart = np.abs(shown[..., :3] - expected)[sure]
    assert sure.mean() > 0.7
    assert np.percentile(apart, 99.9) <= 2
    assert apart.max() <= 4


def seen(place: dict[str, Any], width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 3) what rays from a viewpoint see, 0 to 255, and (h, w) where that is no edge."""
    eye, along = np.array(place["position"]), np.array(place["direction"])
    assert np.allclose(along, [0, 0, -1], atol=1e-6)
    eye = eye - place["position"] + EYE  # in the room's own coordinates
    half = np.tan(place["fieldOfView"] / 2)
    y, x = np.mgrid[0:height, 0:width]
    across = (2 * (x + 0.5) / width - 1) * half * width / height
    up = (1 - 2 * (y + 0.5) / height) * half
    ray = np.stack([across, up, -np.ones_like(across)], axis=2)
    with np.errstate(divide="ignore"):
        far = np.where(ray > 0, (SIZE - eye) / ray, -eye / ray)
    distance = far.min(axis=2)
    color = 255 * color_at(eye + distance[..., None] * ray)
    nearest = np.sort(far, axis=2)
    sure = nearest[..., 1] - nearest[..., 0] > 0.03 * nearest[..., 0]
    at = eye + (eye[2] - PANEL) * ray
    inside = (np.abs(at[..., 0] - 3) < 1.5) & (np.abs(at[..., 1] - 1.5) < 0.9)
    color[inside & (at[..., 0] > 3)] = 255
    # Beside the panel's edges, and where its halves blend: the page filters texels.
    edge = (np.abs(np.abs(at[..., 0] - 3) - 1.5) < 0.05) | (
        np.abs(np.abs(at[..., 1] - 1.5) - 0.9) < 0.05
    )
    sure &= ~edge & ~(inside & (np.abs(at[..., 0] - 3) < 0.5))
    return color, sure
