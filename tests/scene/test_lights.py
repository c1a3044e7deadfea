"""Lamps, emission and lightmaps of models."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.scene import IngestOptions, Scene, ingest, lighting
from ptmtools.scene.colors import to_linear
from ptmtools.scene.lighting import _place
from ptmtools.scene.lights import MOST, Lamp, Lights, Radiance
from ptmtools.scene.model import Space
from ptmtools.texture.images.png import png_bytes
from tests.scene.conftest import GltfModel, Put, png

GREEN = 0.7152


def lights(scene: Scene) -> Lights:
    assert scene.lights is not None
    again = Lights.from_arrays(scene.lights.to_arrays())
    assert (again.lamps, again.maps) == (scene.lights.lamps, scene.lights.maps)
    return again


def noted(scene: Scene) -> set[tuple[str, str]]:
    return {(note.code, note.place) for note in scene.notes}


def scene_with_lamp(put: Put, light: Any, **node: Any) -> Scene:
    def change(doc: GltfModel) -> None:
        doc.tree["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
        use = {"KHR_lights_punctual": {"light": 0}}
        doc.tree["nodes"].append({"extensions": use, **node})
        doc.tree["nodes"].append({"children": [1], "translation": [1, 2, 3]})
        doc.tree["scenes"][0]["nodes"] = [0, 2]

    return ingest(put("lamp.glb", GltfModel.wall(change).glb()), IngestOptions(strict=True))


def with_lamp(put: Put, light: dict[str, Any], **node: Any) -> Lights:
    return lights(scene_with_lamp(put, light, **node))


def test_lamps_of_gltf(put: Put) -> None:
    (point,) = with_lamp(put, {"type": "point", "intensity": 40, "color": [0, 1, 0]}).lamps
    # The middle of the wall's floor, (5, 0, 0), is the origin.
    assert point.position == pytest.approx((-4, 2, 3))
    assert (point.kind, point.intensity) == ("point", pytest.approx(40 * GREEN))
    assert point.color == pytest.approx((0, 1 / GREEN, 0))
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
    assert sun.color == pytest.approx((1, 1, 1))
    amber = {"type": "spot", "color": [0.8, 0.4, 0]}
    (lamp,) = with_lamp(put, amber).lamps
    assert lamp.intensity == pytest.approx(0.4 * (2 * 0.2126 + GREEN))
    assert np.array(lamp.color) * lamp.intensity == pytest.approx([0.8, 0.4, 0])
    for dark in ({"intensity": 0}, {"color": [0, 0, 0]}):
        assert with_lamp(put, {"type": "point", **dark}).lamps == ()
    (flat,) = with_lamp(put, {"type": "point"}, scale=[1, 1, 0], translation=[0, 1, 0]).lamps
    assert flat.position == pytest.approx((-4, 3, 3))


@pytest.mark.parametrize(
    ("light", "node"),
    [
        ({"type": "laser"}, {}),
        ({"type": "point", "intensity": "9"}, {}),
        ({"type": "point", "intensity": None}, {}),
        ({"type": "spot", "spot": [1]}, {}),
        ([], {}),
        ({"type": "spot"}, {"scale": [1, 1, 0]}),
        ({"type": "point"}, {"translation": [0, 1e200, 0]}),
    ],
    ids=["kind", "text", "null", "list", "no object", "no direction", "far"],
)
def test_lamps_that_are_none(put: Put, light: Any, node: dict[str, Any]) -> None:
    scene = scene_with_lamp(put, light, **node)
    assert not scene.lights
    assert ("PTM-N215", "node 1") in noted(scene)


def test_a_lamp_that_the_model_does_not_define(put: Put) -> None:
    use = {"KHR_lights_punctual": {"light": 0}}
    scene = ingest(put("lamp.glb", GltfModel.wall(extensions=use).glb()))
    assert not scene.lights
    assert ("PTM-N215", "node wall") in noted(scene)


def test_large_numbers_are_clipped(put: Put, textured: Callable[..., Path]) -> None:
    bright = {"type": "point", "intensity": 1e308, "color": [1e9, 1e9, 1e9]}
    scene = scene_with_lamp(put, bright)
    assert [lamp.intensity for lamp in lights(scene).lamps] == [MOST]
    assert lights(scene).lamps[0].color == pytest.approx((1, 1, 1))
    assert ("PTM-N215", "node 1") in noted(scene)
    strong = {"KHR_materials_emissive_strength": {"emissiveStrength": 1e300}}
    white = [1, 1, 1]
    for scene, glow in (
        (emitting(put, emissiveFactor=white, extensions=strong), [MOST] * 3),
        (ingest(textured("Ke 1e300 0 1")), [MOST, 0, 1]),
    ):
        assert lights(scene).glow.tolist() == [glow]
        assert any("emission of" in note.message for note in scene.notes)


STRICT = IngestOptions(strict=True)
#: Left half white.
HALF = np.repeat([[255] * 4 + [0] * 4], 8, axis=0).astype(np.uint8)[..., None].repeat(3, axis=2)


def emitting(
    put: Put,
    *,
    image: bytes = png(HALF),
    options: IngestOptions = STRICT,
    uv: np.ndarray | None = None,
    **material: Any,
) -> Scene:
    def change(doc: GltfModel) -> None:
        doc.tree["images"] = [{"bufferView": doc.view(image), "mimeType": "image/png"}]
        doc.tree["textures"] = [{"source": 0}]
        doc.tree["materials"] = [material]
        primitive = doc.tree["meshes"][0]["primitives"][0]
        primitive["material"] = 0
        if uv is not None:
            primitive["attributes"]["TEXCOORD_1"] = doc.add(uv.astype(np.float32))

    return ingest(put("glow.glb", GltfModel.wall(change).glb()), options)


def test_emission_of_gltf(put: Put) -> None:
    strong = {"KHR_materials_emissive_strength": {"emissiveStrength": 20}}
    for material, expected in (
        ({}, [0, 0, 0]),
        ({"emissiveFactor": [0, 0.5, 0]}, [0, 0.5, 0]),
        ({"emissiveFactor": [0.1, 0.5, 0], "extensions": strong}, [2, 10, 0]),
        ({"emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": 0}}, [0.5, 0.25, 0]),
        ({"emissiveTexture": {"index": 0}}, [0, 0, 0]),
    ):
        assert lights(emitting(put, **material)).glow == pytest.approx(np.array([expected]))
    half_red = {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}
    red = emitting(put, image=png(HALF * np.uint8([1, 0, 0])), **half_red)
    assert lights(red).glow == pytest.approx(np.array([[0.5, 0, 0]]))
    unlit = {"KHR_materials_unlit": {}}
    assert not emitting(put).lights
    bare = emitting(put, emissiveFactor=[1, 1, 1], extensions=unlit).lights
    assert bare.unlit.all()
    assert not bare.glow.any()


#: 1.1 MiB of texels.
LARGE = png(np.full((1100, 1100), 255, np.uint8))


@pytest.mark.parametrize(
    ("material", "code"),
    [
        ({"emissiveFactor": None}, "PTM-N215"),
        ({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 9}}, "PTM-N215"),
        ({"occlusionTexture": {"index": 9}}, "PTM-N204"),
        ({"occlusionTexture": {"index": 0, "strength": "x"}}, "PTM-N204"),
        ({"occlusionTexture": [1]}, "PTM-N204"),
        ({"occlusionTexture": {"index": 0, "texCoord": 5}}, "PTM-N215"),
    ],
)
def test_damage_of_lights_is_a_note(put: Put, material: dict[str, Any], code: str) -> None:
    scene = emitting(put, **material)
    assert not scene.lights
    assert (code, "material 0") in noted(scene)


@pytest.mark.parametrize(
    ("image", "limit"), [(b"none", 1024), (LARGE, 1)], ids=["damaged", "too large"]
)
def test_an_image_without_effect_is_a_note(put: Put, image: bytes, limit: int) -> None:
    options = IngestOptions(strict=True, limit=limit)
    use = {"index": 0}
    for material, glow in (
        ({"emissiveFactor": [1, 1, 1], "emissiveTexture": use}, 1.0),
        ({"occlusionTexture": use}, 0.0),
    ):
        scene = emitting(put, image=image, options=options, **material)
        assert lights(scene).glow.tolist() == [[glow] * 3]
        assert not lights(scene).maps
        assert ("PTM-N206", "material 0") in noted(scene)


def test_missing_images_of_lights_are_no_misses(put: Put, textured: Callable[..., Path]) -> None:
    def change(doc: GltfModel) -> None:
        doc.tree["images"] = [{"uri": "gone.png"}]
        doc.tree["textures"] = [{"source": 0}]
        use = {"index": 0}
        material = {"emissiveFactor": [1, 1, 1], "emissiveTexture": use, "occlusionTexture": use}
        doc.tree["materials"] = [material]
        doc.tree["meshes"][0]["primitives"][0]["material"] = 0

    scene = ingest(put("gone.gltf", GltfModel.wall(change).gltf()), IngestOptions(strict=True))
    assert lights(scene).glow.tolist() == [[1, 1, 1]]
    assert ("PTM-N204", "material 0") in noted(scene)
    model = textured("Ke 1 1 1\nmap_Ke broken.png", {"broken.png": b"none"})
    scene = ingest(model, IngestOptions(unit="m", up="y", strict=True))
    assert ("PTM-N206", "room.mtl:3") in noted(scene)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("bands", [1, 3, 4])
def test_the_mean_of_an_image(
    dtype: type[np.unsignedinteger[Any]], bands: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    most = np.iinfo(dtype).max
    texels = np.random.default_rng(bands).integers(0, most, (37, 29, bands), dtype)
    monkeypatch.setattr(lighting, "_STRIP_TEXELS", 100)
    colors = texels[..., :3] if bands > 2 else texels.repeat(3, axis=2)
    expected = to_linear(colors / most).mean(axis=(0, 1))
    assert lighting._mean(png_bytes(texels), 1 << 20) == pytest.approx(expected)


def test_images_are_decoded_once(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    """Materials share the mean of an emission, and a lightmap."""
    uses: list[int] = []
    mean = lighting._mean

    def counted(data: bytes, limit: int) -> Radiance:
        uses.append(len(data))
        return mean(data, limit)

    monkeypatch.setattr(lighting, "_mean", counted)

    def change(doc: GltfModel) -> None:
        image = {"bufferView": doc.view(png(HALF)), "mimeType": "image/png"}
        doc.tree["images"] = [image, {**image, "bufferView": doc.view(png(HALF))}]
        doc.tree["textures"] = [{"source": 0}, {"source": 1}]
        white = {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}
        doc.tree["materials"] = [
            {**white, "occlusionTexture": {"index": number, "strength": strength}}
            for number, strength in ((0, 1), (0, 1), (1, 1), (0, 0.5))
        ]
        for number in range(4):
            doc.place(doc.quad(material=number), translation=[0, 0, -1 - number])
        doc.tree["meshes"][0]["primitives"][0]["material"] = 0

    own = lights(ingest(put("shared.glb", GltfModel.wall(change).glb())))
    assert own.glow == pytest.approx(np.full((4, 3), 0.5))
    assert len(uses) == 1
    assert own.map.tolist() == [0, 0, 0, 1]
    assert [each.strength for each in own.maps] == [1, 0.5]
    assert len(own.to_arrays()["image_start"]) == 2


def test_emission_of_obj(textured: Callable[..., Path]) -> None:
    mean = np.zeros((4, 4, 3), np.uint8)
    mean[:2] = 255, 255, 0
    for mtl, expected in (
        ("Ke 0 2 1", [0, 2, 1]),
        ("Ke 0 0 0", [0, 0, 0]),
        ("map_Ke glow.png", [0.5, 0.5, 0]),
        ("Ke 4 2 4\nmap_Ke glow.png", [2, 1, 0]),
        ("Ke 4 4 4\nmap_Ke gone.png", [4, 4, 4]),
        ("Ke spectral x.rfl", [0, 0, 0]),
        ("Ke nan 1 1\nmap_Ke -s", [0, 0, 0]),
    ):
        model = textured(mtl, {"glow.png": png(mean)})
        scene = ingest(model, IngestOptions(unit="m", up="y", strict=True))
        assert lights(scene).glow == pytest.approx(np.array([expected])), mtl
        assert ("glow.png" in scene.files) == ("glow.png" in mtl)


def test_what_transmits_light_tells_how_much(put: Put) -> None:
    for factor, extra, expected in (
        (0.5, {}, 0.5),
        (0.5, {"transmissionTexture": {"index": 0}}, 0),
    ):
        glass = {"KHR_materials_transmission": {"transmissionFactor": factor, **extra}}
        scene = emitting(put, extensions=glass)
        assert bool(scene.lights) == (expected > 0)
        assert lights(scene).transmits.tolist() == [expected]


BLACK = {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}
ALL = {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}


def reduced(scene: Scene) -> list[str]:
    return [note.message for note in scene.notes if "reduced to its mean" in note.message]


def test_dark_surfaces_show_the_image_of_their_emission(put: Put) -> None:
    turned = {"index": 0, "texCoord": 1}
    uv = np.array([[0, 0], [0.5, 0], [0.5, 0.5], [0, 0.5]])
    half = {"emissiveFactor": [0.5, 1, 1], "emissiveTexture": turned}
    scene = emitting(put, uv=uv, pbrMetallicRoughness=BLACK, **half)
    (material,) = scene.materials
    assert material.image == 0
    assert material.color == pytest.approx((0.735, 1, 1), abs=1e-3), "0.5 in sRGB"
    assert scene.uv.max(axis=(0, 1)).tolist() == [0.5, 1], "those of the emission"
    assert lights(scene).unlit.all()
    assert lights(scene).glow == pytest.approx(np.array([[0.25, 0.5, 0.5]]))
    assert reduced(scene) == []


def test_other_images_of_emission_are_reduced_to_their_mean(put: Put) -> None:
    (message,) = reduced(emitting(put, name="screen", **ALL))
    assert message == "screen: image of emission reduced to its mean, on 1 of all area"
    base = {"baseColorTexture": {"index": 0}, "metallicFactor": 0}
    scene = emitting(put, pbrMetallicRoughness=base, **ALL)
    assert reduced(scene) == [], "the texture shows it"
    scene = emitting(put, image=b"none", pbrMetallicRoughness=BLACK, **ALL)
    assert scene.materials[0].image == -1
    assert not lights(scene).unlit.any()


def test_dark_materials_of_obj_show_their_emission(textured: Callable[..., Path]) -> None:
    files = {"glow.png": png(HALF)}
    options = IngestOptions(unit="m", up="y")
    for mtl, image in (("Kd 0 0 0\nmap_Ke glow.png", 0), ("Kd 1 1 1\nmap_Ke glow.png", -1)):
        scene = ingest(textured(mtl, files), options)
        assert [m.image for m in scene.materials] == [image]
        assert len(reduced(scene)) == -image


def test_the_options_of_an_emission_of_obj_count_where_it_is_shown(
    textured: Callable[..., Path],
) -> None:
    files = {"glow.png": png(HALF)}
    options = IngestOptions(unit="m", up="y")
    sizes, wraps = [], []
    for mtl in ("Kd 0 0 0", "Kd 1 1 1"):
        scene = ingest(textured(f"{mtl}\nmap_Ke -s 0.25 3 1 -clamp on glow.png", files), options)
        sizes.append(np.ptp(scene.uv, axis=(0, 1)))
        wraps.append((scene.materials[0].wrap_s, scene.materials[0].wrap_t))
    assert sizes[0] == pytest.approx(sizes[1] * [0.25, 3])
    assert wraps == [("clamp", "clamp"), ("repeat", "repeat")]


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


def test_a_lightmap_of_surfaces_without_coordinates(put: Put) -> None:
    """It does not darken them."""
    square = np.array([[0, 1], [1, 1], [1, 0], [0, 0]])
    use = {"index": 0, "texCoord": 1}
    assert emitting(put, uv=square, occlusionTexture=use).lights
    for uv in (None, 0 * square, square[:3]):
        scene = emitting(put, uv=uv, occlusionTexture=use)
        assert not scene.lights
        assert ("PTM-N215", "material 0") in noted(scene)


def test_lightmaps_on_mirrored_nodes_and_instances(put: Put) -> None:
    """Each face has its own coordinates: u grows to the right in the mesh."""

    def change(doc: GltfModel) -> None:
        doc.tree["images"] = [{"bufferView": doc.view(png(HALF)), "mimeType": "image/png"}]
        doc.tree["textures"] = [{"source": 0}]
        doc.tree["materials"] = [{"occlusionTexture": {"index": 0}}]
        moves = np.array([[0, 0, -3], [0, 5, -3]], np.float32)
        instancing = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": doc.add(moves)}}}
        for node in (
            {"translation": [0, 0, -1]},
            {"translation": [0, 0, -2], "scale": [-1, 1, 1]},
            {"scale": [-1, 1, 1], "extensions": instancing},
        ):
            doc.place(doc.quad(material=0), **node)
        doc.tree["nodes"].pop(0)
        doc.tree["scenes"] = [{"nodes": [0, 1, 2]}]

    scene = ingest(put("mirrored.glb", GltfModel.wall(change).glb()))
    own = lights(scene)
    assert len(scene.triangles) == 8
    middle = scene.corners[..., 0] - (scene.points[:, 0].min() + scene.points[:, 0].max()) / 2
    assert set(np.round(own.uv[..., 0] - np.abs(middle) / 10, 6).ravel()) == {0}


def test_a_lightmap_that_is_missing(put: Put) -> None:
    def change(doc: GltfModel) -> None:
        doc.tree["images"] = [{"uri": "gone.png"}]
        doc.tree["textures"] = [{"source": 0}]
        doc.tree["materials"] = [{"occlusionTexture": {"index": 0}}, 5]
        doc.tree["meshes"][0]["primitives"][0]["material"] = 0

    model = put("gone.gltf", GltfModel.wall(change).gltf())
    scene = ingest(model)
    assert not scene.lights
    assert "gone.png" in scene.files
    assert ("PTM-N204", "gone.png: not found") in {(n.code, n.message) for n in scene.notes}


def test_units_and_axes_count(put: Put) -> None:
    lamp = Lamp("point", (1.0, 2.0, 3.0))
    placed = _place(lamp, Space((1.0, 0.0, 1.0), 0.01, "z"))
    assert placed.position == pytest.approx((0, 0.02, -0.02))
    assert placed.direction == pytest.approx((0, 0, 1))
