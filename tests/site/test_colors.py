"""Colours of vertices, and textures with alpha, from the model to the screen and to pictures."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.glb import glb_chunks
from ptmtools.output import validate_database
from ptmtools.output.gltf_reader import ReadPrimitive, read_glb
from ptmtools.output.served import Served, read_served
from ptmtools.rendering import pyramids
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.rendering.light import light_on
from ptmtools.rendering.painting import SurfacePainter
from ptmtools.rendering.records import Sight
from ptmtools.scene.colors import to_linear, to_srgb
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.pictures import PictureKind, pictures_of
from tests.output.agreement import kinds
from tests.scene.conftest import GltfModel, png

from .conftest import build

#: A room, seen from within, with a panel across its middle, and a pane behind that; metres.
SIZE = np.array([6.0, 3.0, 5.0])
PANEL, PANE = 2.0, 1.0
EYE, FIELD = np.array([3.0, 1.6, 4.5]), 1.1
#: Of the left and right half of both; of the panel what is less than this is not drawn.
ALPHA, CUTOFF = (76, 180), 0.5
#: Colour of the pane, sRGB, and opacity.
TINT, OPACITY = (1.0, 0.25, 0.5), 0.8
#: Leaves of a plant, at the right behind this ratio of x to z from the eye; texels of its image.
LEAVES, BESIDE, SIDE = 60, 0.52, 128
SHOWN = 320, 240


def color_at(point: np.ndarray) -> np.ndarray:
    """(..., 3) sRGB at places of the room's walls, 0 to 1: it changes evenly along each axis."""
    return 0.1 + 0.8 * point / SIZE


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The room's walls white with colours of their own, the panel and leaves with an alpha that is
    tested, and the pane blended. The finest levels of the leaves are in a preview."""
    doc = GltfModel()
    tested = {"alphaMode": "MASK", "alphaCutoff": CUTOFF, "doubleSided": True}
    doc.tree["images"] = [
        {"bufferView": doc.view(png(np.full((8, 8, 3), 255, np.uint8))), "mimeType": "image/png"},
        {"bufferView": doc.view(png(halves())), "mimeType": "image/png"},
        {"bufferView": doc.view(png(leaf())), "mimeType": "image/png"},
    ]
    doc.tree["textures"] = [{"source": 0}, {"source": 1}, {"source": 2}]
    doc.tree["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
        {
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 1},
                "baseColorFactor": [*to_linear(np.array(TINT)).tolist(), OPACITY],
            },
            "alphaMode": "BLEND",
            "doubleSided": True,
        },
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}} | tested,
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 2}}} | tested,
    ]
    x, y, z = SIZE
    corners = np.array([(i * x, j * y, k * z) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    walls = [primitive(doc, corners[quad], 0, to_linear(color_at(corners[quad]))) for quad in quads]
    doc.place(*walls)
    for material, far in ((1, PANE), (2, PANEL)):
        across = np.array([[1.5, 0.6], [4.5, 0.6], [4.5, 2.4], [1.5, 2.4]])
        doc.place(primitive(doc, np.insert(across, 2, far, axis=1), material))
    random = np.random.default_rng(1)
    quad = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 0.15
    turns = np.linalg.qr(random.normal(size=(LEAVES, 3, 3)))[0]
    middles = random.uniform([5.05, 0.4, 1.0], [5.5, 2.6, 1.8], (LEAVES, 3))
    # One so near that its finest level is seen.
    turns[0], middles[0] = 3 * np.eye(3), (5.0, 1.5, 1.6)
    leaves = quad @ turns + middles[:, None]
    doc.place(*(primitive(doc, corners, 3) for corners in leaves))
    doc.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": FIELD, "znear": 0.1}}]
    doc.tree["nodes"].append({"camera": 0, "translation": EYE.tolist(), "name": "door"})
    doc.tree["scenes"] = [{"nodes": list(range(len(doc.tree["nodes"])))}]
    folder = tmp_path_factory.mktemp("colors")
    (folder / "room.glb").write_bytes(doc.glb())
    return build(folder / "room.glb", folder / "room.db", "--exact", "never")


def leaf() -> np.ndarray:
    """A green disc with soft edges on red, which is not to be seen."""
    y, x = (np.mgrid[:SIDE, :SIDE] + 0.5) / SIDE * 2 - 1
    alpha = np.clip(3 * (0.9 - np.hypot(x, y)), 0, 1)
    green = [np.full_like(x, 40), 80 + 60 * np.sin(20 * x), np.full_like(x, 30), 255 * alpha]
    texels = np.rint(np.stack(green, axis=2)).astype(np.uint8)
    texels[alpha == 0] = 255, 0, 0, 0
    return texels


def halves() -> np.ndarray:
    texels = np.full((8, 8, 4), 255, np.uint8)
    texels[:, :4, 3], texels[:, 4:, 3] = ALPHA
    return texels


def primitive(
    doc: GltfModel, corners: np.ndarray, material: int, light: np.ndarray | None = None
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
        if p.material.blends:
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


def test_the_page_shows_them(visit: Callable[..., Any], colored: Site, database: Path) -> None:
    place, (width, height) = place_of(colored.index), SHOWN
    with visit(colored, width=width, height=height, reduced_motion="reduce") as visitor:
        visitor.go(colored.index["viewpoints"].index(place))
        shown = visitor.picture().astype(np.float64)
    assert visitor.messages == []
    check(shown, place)
    # The leaves, too, as pictures show them, on average: the page dithers their edges.
    served = read_served(database)
    apart = shown - render(served)
    assert np.abs(apart).mean() < 1
    blocks = apart[:, -width // 8 :].reshape(height // 4, 4, width // 32, 4, 3).mean(axis=(1, 3))
    assert np.percentile(np.abs(blocks).mean(axis=2), 90) < 3
    # As a poster, or in the catalogue.
    (poster,) = pictures_of(served, [(PictureKind(SHOWN, 1 << 20), place)])
    with Image.open(io.BytesIO(poster)) as image:
        assert np.abs(shown - np.asarray(image)).mean() < 3


@pytest.mark.parametrize("lit", [False, True])
def test_renders_show_them(database: Path, lit: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """No texture is decoded twice, and alpha is not in memory while colours are."""
    served, real, decoded = read_served(database), pyramids._levels, list[int]()
    colors = SurfacePainter.colors

    def painted(self: SurfacePainter, sight: Sight) -> np.ndarray:
        assert not self._alpha
        return colors(self, sight)

    monkeypatch.setattr(SurfacePainter, "colors", painted)

    def levels(served: Served, texture: int) -> list[Any]:
        decoded.append(texture)
        return real(served, texture)

    monkeypatch.setattr(pyramids, "_levels", levels)
    check(render(served, lit), place_of(served.index), lit)
    assert sorted(decoded) == [0, 1, 2, 3]


def place_of(index: Mapping[str, Any]) -> dict[str, Any]:
    (place,) = [v for v in index["viewpoints"] if v.get("description") == "door"]
    return place


def render(served: Served, lit: bool = False) -> np.ndarray:
    number = served.index["viewpoints"].index(place_of(served.index))
    view = ViewOptions(viewpoint=number, width=SHOWN[0], height=SHOWN[1], lit=lit)
    return draw_view(served, view).astype(np.float64)


def check(shown: np.ndarray, place: dict[str, Any], lit: bool = False) -> None:
    expected, sure = seen(place, *SHOWN, lit)
    apart = np.abs(shown - expected)[sure]
    assert sure.mean() > 0.45
    assert np.percentile(apart, 99.9) <= 2
    assert apart.max() <= 4


def seen(
    place: dict[str, Any], width: int, height: int, lit: bool
) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 3) what rays from a viewpoint see, 0 to 255, and (h, w) where that is no edge; if
    ``lit``, of surfaces under a lamp."""
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
    front = 1.0
    if lit:
        # A wall faces the room: against the ray, along the axis on which that meets it.
        axis = far.argmin(axis=2)[..., None]
        normal = np.where(np.arange(3) == axis, -np.sign(ray), 0)
        color *= light_on(normal.reshape(-1, 3)).reshape(height, width, 1)
        front = float(light_on(np.array([[0.0, 0, 1]]))[0])
    for z in (PANE, PANEL):
        at = eye + (eye[2] - z) * ray
        aside, above = np.abs(at[..., 0] - 3), np.abs(at[..., 1] - 1.5)
        inside, right = (aside < 1.5) & (above < 0.9), at[..., 0] > 3
        if z == PANEL:
            color[inside & right] = 255 * front
        else:
            share = (OPACITY * np.where(right, ALPHA[1], ALPHA[0]) / 255 * inside)[..., None]
            color = (1 - share) * color + share * 255 * front * np.array(TINT)
        # Where the halves meet, at the sides as well: the page filters texels.
        sure &= (aside > 1.55) | (above > 0.95) | ((aside > 0.5) & (aside < 1.2) & (above < 0.85))
    return color, sure & (across < BESIDE)
