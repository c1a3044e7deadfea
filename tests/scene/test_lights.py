"""Lamps, emission and lightmaps of models."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.errors import InputError
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.lighting import _placed
from ptmtools.scene.lights import Lamp, Lights
from ptmtools.scene.model import Space
from tests.scene.conftest import Gltf, Put, png

GREEN = 0.7152


def lights(scene: Scene) -> Lights:
    assert scene.lights is not None
    again = Lights.from_arrays(scene.lights.to_arrays())
    assert (again.lamps, again.maps) == (scene.lights.lamps, scene.lights.maps)
    return again


def with_lamp(put: Put, light: dict[str, Any], **node: Any) -> Lights:
    def change(doc: Gltf) -> None:
        doc.tree["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
        use = {"KHR_lights_punctual": {"light": 0}}
        doc.tree["nodes"].append({"extensions": use, **node})
        doc.tree["nodes"].append({"children": [1], "translation": [1, 2, 3]})
        doc.tree["scenes"][0]["nodes"] = [0, 2]

    return lights(ingest(put("lamp.glb", Gltf.wall(change).glb())))


def test_lamps_of_gltf(put: Put) -> None:
    (point,) = with_lamp(put, {"type": "point", "intensity": 40, "color": [0, 1, 0]}).lamps
    # The middle of the wall's floor, (5, 0, 0), is the origin.
    assert point.position == pytest.approx((-4, 2, 3))
    assert (point.kind, point.intensity) == ("point", pytest.approx(40 * GREEN))
    down = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
    spot = {"type": "spot", "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}}
    (lamp,) = with_lamp(put, spot, rotation=down, scale=[3, 3, 3], translation=[0, 1, 0]).lamps
    assert lamp.kind == "spot"
    assert lamp.position == pytest.approx((-4, 3, 3))
    assert lamp.direction == pytest.approx((0, -1, 0), abs=1e-9)
    assert lamp.cone == pytest.approx((math.cos(0.2), math.cos(0.6)))
    (sun,) = with_lamp(put, {"type": "directional"}).lamps
    assert (sun.kind, sun.intensity) == ("sun", pytest.approx(1))
    assert sun.direction == pytest.approx((0, 0, -1))
    assert with_lamp(put, {"type": "point", "intensity": 0}).lamps == ()
    assert with_lamp(put, {"type": "point"}, scale=[0, 0, 0]).lamps == ()


@pytest.mark.parametrize(
    "light",
    [{"type": "laser"}, {"type": "point", "intensity": "9"}, {"type": "spot", "spot": [1]}, []],
    ids=["kind", "text", "list", "no object"],
)
def test_lamps_that_are_none(put: Put, light: Any) -> None:
    with pytest.raises(InputError) as refused:
        with_lamp(put, light)
    assert refused.value.code == "PTM-I249"


def emitting(put: Put, **material: Any) -> Scene:
    def change(doc: Gltf) -> None:
        half = np.zeros((8, 8, 3), np.uint8)
        half[:, :4] = 255
        doc.tree["images"] = [{"bufferView": doc.view(png(half)), "mimeType": "image/png"}]
        doc.tree["textures"] = [{"source": 0}]
        doc.tree["materials"] = [material]
        doc.tree["meshes"][0]["primitives"][0]["material"] = 0

    return ingest(put("glow.glb", Gltf.wall(change).glb()))


def test_emission_of_gltf(put: Put) -> None:
    strong = {"KHR_materials_emissive_strength": {"emissiveStrength": 20}}
    for material, expected in (
        ({}, 0.0),
        ({"emissiveFactor": [0, 0.5, 0]}, 0.5 * GREEN),
        ({"emissiveFactor": [0, 0.5, 0], "extensions": strong}, 10 * GREEN),
        ({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}, 0.5),
        ({"emissiveTexture": {"index": 0}}, 0.0),
    ):
        assert lights(emitting(put, **material)).glow.tolist() == pytest.approx([expected])
    assert not emitting(put).lights


def test_emission_of_obj(textured: Callable[..., Path]) -> None:
    mean = np.zeros((4, 4, 3), np.uint8)
    mean[:2] = 255
    for mtl, expected in (
        ("Ke 0 2 0", 2 * GREEN),
        ("Ke 0 0 0", 0.0),
        ("map_Ke glow.png", 0.5),
        ("Ke 4 4 4\nmap_Ke glow.png", 2.0),
        ("Ke 4 4 4\nmap_Ke gone.png", 4.0),
        ("Ke spectral x.rfl", 0.0),
        ("Ke nan 1 1\nmap_Ke -s", 0.0),
    ):
        model = textured(mtl, {"glow.png": png(mean)})
        scene = ingest(model, IngestOptions(unit="m", up="y", strict=True))
        assert lights(scene).glow.tolist() == pytest.approx([expected]), mtl
        assert ("glow.png" in scene.files) == ("glow.png" in mtl)


def test_a_texture_that_also_glows_is_not_plain(textured: Callable[..., Path]) -> None:
    """The model is read again when it is repainted."""
    white = {"glow.png": png(np.full((4, 4, 3), 255, np.uint8))}
    for mtl, plain in (("", True), ("Ke 1 1 1\nmap_Ke glow.png", False)):
        scene = ingest(textured(f"map_Kd glow.png\n{mtl}\n", white))
        assert scene.images[0].plain == plain


def test_a_lightmap_lies_on_its_surfaces_once(put: Put) -> None:
    use = {"index": 0, "strength": 0.5}
    own = lights(emitting(put, occlusionTexture=use))
    assert own.map.tolist() == [0]
    assert own.maps[0].strength == 0.5
    assert own.uv.shape == (2, 3, 2)
    tiled = {"KHR_texture_transform": {"scale": [2, 2]}}
    assert not emitting(put, occlusionTexture={**use, "extensions": tiled}).lights


def test_a_lightmap_that_is_missing(put: Put) -> None:
    def change(doc: Gltf) -> None:
        doc.tree["images"] = [{"uri": "gone.png"}]
        doc.tree["textures"] = [{"source": 0}]
        doc.tree["materials"] = [{"occlusionTexture": {"index": 0}}, 5]
        doc.tree["meshes"][0]["primitives"][0]["material"] = 0

    model = put("gone.gltf", Gltf.wall(change).gltf())
    scene = ingest(model)
    assert not scene.lights
    assert "gone.png" in scene.files
    assert ("PTM-N204", "gone.png: not found") in {(n.code, n.message) for n in scene.notes}


def test_units_and_axes_count(put: Put) -> None:
    lamp = Lamp("point", (1.0, 2.0, 3.0))
    placed = _placed(lamp, Space((1.0, 0.0, 1.0), 0.01, "z"))
    assert placed.position == pytest.approx((0, 0.02, -0.02))
    assert placed.direction == pytest.approx((0, 0, 1))
