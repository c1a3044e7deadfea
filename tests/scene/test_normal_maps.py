"""Normal maps of materials: which are read, from where, and at which coordinates."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.scene import ingest
from ptmtools.scene.model import NormalImage, Scene
from ptmtools.scene.normal_maps import RISE, kind_of, normals_of
from ptmtools.scene.options import IngestOptions
from tests.scene.bumpy import heights, write_bumpy


def by_name(scene: Scene) -> dict[str, NormalImage | None]:
    return {material.name: material.normal for material in scene.materials}


def texels(scene: Scene, normal: NormalImage) -> np.ndarray:
    with Image.open(io.BytesIO(scene.images[normal.image].load())) as image:
        return np.asarray(image.convert("RGB"))


def noted(scene: Scene) -> str:
    return "\n".join(note.message for note in scene.notes)


def test_maps_of_an_obj(tmp_path: Path) -> None:
    scene = ingest(write_bumpy(tmp_path / "model"))
    maps = by_name(scene)
    a, b, floor, ceiling = (maps[name] for name in ("room_a", "room_b", "floor", "ceiling"))
    assert a
    assert b
    assert floor
    assert ceiling
    assert maps["doorway"] is None
    assert (a.scale, a.own) == (0.5, False)
    assert (b.scale, b.own) == (1, False)
    assert ceiling.own
    assert a.image == floor.image == ceiling.image  # one file
    assert scene.images[a.image].name == "waves.png"
    assert np.array_equal(texels(scene, a), normals_of(heights()))
    grey = np.rint((heights() + 3) * 255 / 6)
    assert np.array_equal(texels(scene, b), normals_of(grey * (0.5 * RISE / 255)))
    assert "bump waves.png: holds normals" in noted(scene)
    assert "map_bump heights.png: heights converted" in noted(scene)


def test_own_coordinates_are_those_of_the_faces(tmp_path: Path) -> None:
    scene = ingest(write_bumpy(tmp_path / "model"))
    assert scene.normal_uv is not None
    names = np.array([material.name for material in scene.materials])[scene.triangle_material]
    assert np.array_equal(scene.normal_uv[names == "ceiling"] % 2, scene.uv[names == "ceiling"] % 2)
    assert scene.normal_uv[names == "ceiling"].any()
    assert not scene.normal_uv[names != "ceiling"].any()


def test_none(tmp_path: Path) -> None:
    model = write_bumpy(tmp_path / "model")
    scene = ingest(model, IngestOptions(normal_maps="none"))
    assert set(by_name(scene).values()) == {None}
    assert scene.normal_uv is None
    assert "waves.png" not in {image.name for image in scene.images}
    plain = ingest(write_bumpy(tmp_path / "plain", {}))
    assert plain.to_arrays().keys() == scene.to_arrays().keys()


def test_a_scene_is_stored_and_read(tmp_path: Path) -> None:
    scene = ingest(write_bumpy(tmp_path / "model"))
    arrays = scene.to_arrays()
    again = Scene.from_arrays(arrays, scene.images)
    assert again.materials == scene.materials
    assert np.array_equal(again.normal_uv, scene.normal_uv)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="image"):
        Scene.from_arrays(arrays, scene.images[:1])
    with pytest.raises(KeyError):
        Scene.from_arrays({n: a for n, a in arrays.items() if n != "normal_uv"}, scene.images)


def test_norm_wins_over_bump(tmp_path: Path) -> None:
    both = {
        "room_a": "norm waves.png\nbump heights.png",
        "room_b": "bump heights.png\nnorm waves.png",
    }
    scene = ingest(write_bumpy(tmp_path / "model", both))
    names = [scene.images[m.image].name for m in by_name(scene).values() if m]
    assert names == ["waves.png", "waves.png"]


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("bump room_a.png", "neither heights nor normals"),
        ("norm gone.png", "not found"),
        ("norm two_rooms.obj", "norm two_rooms.obj"),
        ("bump two_rooms.obj", "bump two_rooms.obj"),
    ],
)
def test_what_cannot_be_used_is_noted(tmp_path: Path, statement: str, message: str) -> None:
    scene = ingest(write_bumpy(tmp_path / "model", {"room_b": statement}))
    assert set(by_name(scene).values()) == {None}
    assert message in noted(scene)


def test_alpha_is_dropped(tmp_path: Path) -> None:
    model = write_bumpy(tmp_path / "model", {"room_a": "norm waves.png"})
    rgba = np.concatenate([normals_of(heights()), np.full((64, 64, 1), 9, np.uint8)], axis=2)
    Image.fromarray(rgba).save(model.parent / "waves.png")
    scene = ingest(model)
    normal = by_name(scene)["room_a"]
    assert normal
    with Image.open(io.BytesIO(scene.images[normal.image].load())) as image:
        assert image.mode == "RGB"


def test_kinds() -> None:
    flat = np.full((4, 4, 3), (128, 128, 255), np.uint8)
    assert kind_of(flat) == "normals"
    assert kind_of(flat[..., :1]) == kind_of(flat[..., 2:].repeat(3, axis=2)) == "heights"
    assert kind_of(np.full((4, 4, 3), (200, 128, 255), np.uint8)) == ""
    assert kind_of(np.full((4, 4, 3), (128, 128, 90), np.uint8)) == ""
    assert kind_of(flat.astype(np.uint16) * 257) == "normals"


def test_normals_of_a_slope() -> None:
    """A rise of a texel for each texel to the right leans to the left, one upwards down."""
    steps = np.arange(16.0)
    right = normals_of(np.tile(steps, (16, 1)))[8, 8] / 127.5 - 1
    assert right == pytest.approx((-(0.5**0.5), 0, 0.5**0.5), abs=0.01)
    up = normals_of(np.tile(-steps[:, None], (1, 16)))[8, 8] / 127.5 - 1
    assert up == pytest.approx((0, -(0.5**0.5), 0.5**0.5), abs=0.01)


def write_gltf(folder: Path, normal: dict[str, Any], base: dict[str, Any] | None) -> Path:
    """A square of two triangles with two sets of coordinates."""
    folder.mkdir()
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    sets = [points[:, :2], 3 * points[:, :2] + 0.25]
    index = np.array([0, 1, 2, 0, 2, 3], np.uint16)
    data = [points.tobytes(), *(np.float32(uv).tobytes() for uv in sets), index.tobytes()]
    (folder / "square.bin").write_bytes(b"".join(data))
    for name, color in (("n", (128, 128, 255)), ("c", (9, 99, 199))):
        Image.new("RGB", (8, 8), color).save(folder / f"{name}.png")
    begins = np.cumsum([0, *map(len, data)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": begin, "byteLength": len(part)}
        for begin, part in zip(begins, data, strict=False)
    ]
    rows = [
        {
            "bufferView": 0,
            "componentType": 5126,
            "count": 4,
            "type": "VEC3",
            "min": [0, 0, 0],
            "max": [1, 1, 0],
        },
        {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
        {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"},
        {"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"},
    ]
    attributes = {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2}
    surface = {} if base is None else {"baseColorTexture": base}
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": surface, "normalTexture": normal}],
        "textures": [{"source": 0}, {"source": 1}, {"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071}],
        "images": [{"uri": "n.png"}, {"uri": "c.png"}],
        "accessors": rows,
        "bufferViews": views,
        "buffers": [{"uri": "square.bin", "byteLength": begins[-1]}],
    }
    file = folder / "square.gltf"
    file.write_text(json.dumps(tree))
    return file


MOVED = {"extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25]}}}


@pytest.mark.parametrize(
    ("normal", "base", "expected"),
    [
        ({"index": 0}, {"index": 1}, None),
        ({"index": 0, "scale": 2.5} | MOVED, {"index": 1} | MOVED, None),
        ({"index": 0, "texCoord": 1}, {"index": 1}, (3, 0.25)),
        ({"index": 0}, {"index": 1, "texCoord": 1}, (1, 0)),
        ({"index": 0}, None, (1, 0)),
        ({"index": 2}, {"index": 1}, (1, 0)),
    ],
    ids=["same", "moved alike", "own", "base", "alone", "wraps"],
)
def test_coordinates_of_a_gltf(
    tmp_path: Path, normal: Any, base: Any, expected: tuple[float, float] | None
) -> None:
    scene = ingest(write_gltf(tmp_path / "model", normal, base))
    use = scene.materials[0].normal
    assert use
    assert use.scale == normal.get("scale", 1)
    assert use.own == (expected is not None)
    assert use.wrap_s == ("clamp" if normal["index"] == 2 else "repeat")
    if expected is None:
        assert scene.normal_uv is None
    else:
        assert scene.normal_uv is not None
        corner = scene.corners[..., :2] - scene.corners[..., :2].min(axis=(0, 1))
        factor, begin = expected
        v = 1 - (factor * corner[..., 1] + begin)
        shown = scene.normal_uv
        assert np.allclose(shown[..., 0], factor * corner[..., 0] + begin, atol=1e-6)
        assert np.allclose(shown[..., 1], v, atol=1e-6)


def test_moved_apart(tmp_path: Path) -> None:
    scene = ingest(write_gltf(tmp_path / "model", {"index": 0} | MOVED, {"index": 1}))
    use = scene.materials[0].normal
    assert use
    assert use == replace(use, own=True)
    assert scene.normal_uv is not None
    assert np.allclose(scene.normal_uv - scene.uv, (0.5, -0.25))
