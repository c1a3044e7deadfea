"""glTF: what trimesh alone would lose, and damaged files."""

from __future__ import annotations

import base64
import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import InputError, PtmError
from ptmtools.scene import IngestOptions, Scene, ingest

from .conftest import GltfModel, Put, broken, noise, png


def codes(scene: Scene) -> set[str]:
    return {note.code for note in scene.notes}


def says(scene: Scene, words: str) -> bool:
    """Whether a note about a part that is ignored or converted has these words."""
    return any(words in note.message for note in scene.notes if note.code == "PTM-N215")


def with_material(doc: GltfModel, material: dict[str, Any], **primitive: Any) -> GltfModel:
    doc.tree.setdefault("materials", []).append(material)
    doc.place(doc.quad(material=len(doc.tree["materials"]) - 1, **primitive))
    return doc


def with_image(
    doc: GltfModel, data: bytes, sampler: dict[str, int] | None = None
) -> dict[str, Any]:
    doc.tree["images"] = [
        {"bufferView": doc.view(data), "mimeType": "image/png", "name": "Brick.1"}
    ]
    doc.tree["textures"] = [{"source": 0, **({"sampler": 0} if sampler else {})}]
    if sampler:
        doc.tree["samplers"] = [sampler]
    return {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}


def test_a_quad(put: Put) -> None:
    scene = ingest(put("a.glb", GltfModel.wall().glb()))
    assert scene.objects == ("wall",)
    assert (scene.space.metres, scene.space.up) == (1.0, "y")
    assert (scene.space.unit_guessed, scene.space.up_guessed) == (False, False)
    assert scene.points.min(axis=0).tolist() == [-5, 0, 0]
    assert scene.points.max(axis=0).tolist() == [5, 4, 0]
    normal = np.cross(*(scene.corners[0][1:] - scene.corners[0][0]))
    assert normal[2] > 0
    at = {tuple(p): tuple(t) for p, t in zip(scene.corners[0], scene.uv[0], strict=True)}
    assert at == {(-5, 0, 0): (0, 0), (5, 0, 0): (1, 0), (5, 4, 0): (1, 1)}
    assert not scene.two_sided.any()


@pytest.mark.parametrize("kind", ["embedded", "beside"])
def test_gltf_with_buffers_of_its_own_or_beside_it(put: Put, kind: str) -> None:
    doc = GltfModel.wall()
    put("Büffer 1.bin", doc.blob)
    uri = "" if kind == "embedded" else "B%C3%BCffer%201.bin"
    scene = ingest(put("a.gltf", doc.gltf(uri)))
    assert len(scene.triangles) == 2
    assert scene.files == (() if kind == "embedded" else ("Büffer 1.bin",))


def test_nodes_move_turn_and_mirror(put: Put) -> None:
    doc = GltfModel.wall(scale=[-1, 1, 1], translation=[0, 0, 7])
    half = math.sqrt(0.5)
    doc.tree["nodes"] += [
        {"mesh": 0, "rotation": [0, half, 0, half]},
        {"children": [1], "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 100, 1]},
    ]
    doc.tree["scenes"] = [{"nodes": [0, 2]}]
    scene = ingest(put("a.glb", doc.glb()))
    assert scene.objects == ("wall", "quad")
    model = scene.corners + np.array(scene.space.origin)
    mirrored, turned = model[:2], model[2:]
    assert np.allclose(mirrored.reshape(-1, 3).min(axis=0), [-10, 0, 7])
    assert np.cross(mirrored[0, 1] - mirrored[0, 0], mirrored[0, 2] - mirrored[0, 0])[2] > 0
    assert np.allclose(turned.reshape(-1, 3).min(axis=0), [0, 0, 80])
    assert np.allclose(turned.reshape(-1, 3).max(axis=0), [0, 8, 100])


@pytest.mark.parametrize("side", [True, False])
def test_materials(put: Put, side: bool) -> None:
    material = {
        "name": "glass",
        "doubleSided": side,
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.0, 1.0, 0.25]},
    }
    scene = ingest(put("a.glb", with_material(GltfModel(), material).glb()))
    (made,) = scene.materials
    assert made.name == "glass"
    assert made.color == pytest.approx((0.735357, 0.0, 1.0), abs=1e-6)
    assert (made.opacity, made.transparent) == (0.25, True)
    assert scene.two_sided.tolist() == [side, side]
    assert says(scene, "colour factor converted")


@pytest.mark.parametrize(
    ("more", "transparent"),
    [
        ({}, False),
        ({"alphaMode": "OPAQUE"}, False),
        ({"alphaMode": "MASK"}, False),
        ({"alphaMode": "BLEND"}, False),
        ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}, True),
        ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0}}}, False),
    ],
)
def test_what_never_occludes(put: Put, more: dict[str, Any], transparent: bool) -> None:
    scene = ingest(put("a.glb", with_material(GltfModel(), more).glb()))
    assert [m.transparent for m in scene.materials] == [transparent]


def with_modes(doc: GltfModel, pixels: np.ndarray, *modes: str, coords: Any = None) -> GltfModel:
    """Quads side by side that show one image, each in another mode."""
    base = with_image(doc, png(pixels))
    for place, mode in enumerate(modes):
        doc.tree.setdefault("materials", []).append({**base, "alphaMode": mode, "name": mode})
        quad = doc.quad(material=place)
        if coords is not None:
            quad["attributes"]["TEXCOORD_0"] = doc.add(np.array(coords, np.float32))
        doc.place(quad, translation=[0, 0, 5 * place])
    return doc


def pixels_of(scene: Scene, material: int) -> np.ndarray:
    with Image.open(io.BytesIO(scene.images[scene.materials[material].image].load())) as image:
        return np.asarray(image)


@pytest.mark.parametrize("bands", [2, 4])
def test_an_opaque_material_ignores_the_alpha_of_its_texture(put: Put, bands: int) -> None:
    """glTF 2.0, section 3.9.6. Clients that know no modes see it opaque, too."""
    pixels = noise(1, bands=bands)
    scene = ingest(put("a.glb", with_modes(GltfModel(), pixels, "OPAQUE").glb()))
    assert not scene.materials[0].transparent
    assert scene.opaque.all()
    assert np.array_equal(pixels_of(scene, 0), pixels[..., :-1].squeeze())
    assert [image.name for image in scene.images] == ["Brick_1.png"]


def test_an_image_of_opaque_and_of_blended_materials_becomes_two(put: Put) -> None:
    pixels = noise(1, bands=4)
    doc = with_modes(GltfModel(), pixels, "OPAQUE", "BLEND", "OPAQUE", "MASK")
    scene = ingest(put("a.glb", doc.glb()))
    assert [m.transparent for m in scene.materials] == [False, True, False, True]
    assert [m.image for m in scene.materials] == [0, 1, 0, 1]
    assert np.array_equal(pixels_of(scene, 0), pixels[..., :3])
    assert np.array_equal(pixels_of(scene, 1), pixels)


@pytest.mark.parametrize("cutoff", [0.3, 0.6, 100 / 255, 1.0])
def test_soft_alpha_with_a_cutoff_becomes_steps(put: Put, cutoff: float) -> None:
    """Even alpha all or nothing, and a ramp a step where it crosses the cutoff; the image of
    blended materials stays as it is."""
    pixels = np.full((16, 64, 4), 255, np.uint8)
    ramp = np.linspace(0, 255, 64).round().astype(np.uint8)
    pixels[:4, :, 3], pixels[4:8, :, 3], pixels[8:, :, 3] = 100, 200, ramp
    doc = with_modes(GltfModel(), pixels, "BLEND", "MASK")
    doc.tree["materials"][1]["alphaCutoff"] = cutoff
    scene = ingest(put("a.glb", doc.glb()))
    assert np.array_equal(pixels_of(scene, 0), pixels)
    assert scene.materials[1].cutoff == 0.5
    stepped = pixels_of(scene, 1)[..., 3]
    assert (stepped[:3] == 255 * (cutoff * 255 <= 100)).all()
    assert (stepped[5:7] == 255 * (cutoff * 255 <= 200)).all()
    assert ((stepped[10:] >= 128) == (ramp >= cutoff * 255)).all()
    assert ((stepped[10:] > 0) & (stepped[10:] < 255)).sum(axis=1).max() <= 2
    assert says(scene, "soft alpha")


def test_an_image_stays_one_where_opaque_materials_use_opaque_texels(put: Put) -> None:
    """As of an atlas; its bytes are kept."""
    pixels = noise(1, bands=4)
    pixels[4:, :, 3] = 255  # the lower half
    coords = [(0, 0.9), (1, 0.9), (1, 0.7), (0, 0.7)]
    doc = with_modes(GltfModel(), pixels, "OPAQUE", "BLEND", coords=coords)
    scene = ingest(put("a.glb", doc.glb()))
    assert [m.transparent for m in scene.materials] == [False, False]
    assert [m.image for m in scene.materials] == [0, 0]
    assert scene.images[0].load() == png(pixels)


def with_atlas(doc: GltfModel) -> GltfModel:
    """Two quads that show tiles of one image, the second a tile of glass, and a plain one; all
    blend, glow and reflect by images."""
    pixels = noise(1, bands=4)
    pixels[..., 3] = 255
    pixels[:4, :4, 3] = 99  # the upper left tile
    material = {**with_image(doc, png(pixels)), "alphaMode": "BLEND", "name": "atlas"}
    doc.tree["images"].append({"bufferView": doc.view(png(noise(2))), "mimeType": "image/png"})
    doc.tree["textures"].append({"source": 1})
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {"index": 1}
    material |= {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 1}}
    doc.tree["materials"] = [material, {"name": "plain"}]
    for place, y in enumerate((0.5, 0)):
        tile = [(0, y), (0.5, y), (0.5, y + 0.5), (0, y + 0.5)]
        quad = doc.quad(material=0)
        quad["attributes"]["TEXCOORD_0"] = doc.add(np.array(tile, np.float32))
        doc.place(quad, translation=[0, 0, 5 * place])
    doc.place(doc.quad(material=1), translation=[0, 0, 20])
    return doc


def test_only_faces_that_use_transparent_texels_are_transparent(put: Put) -> None:
    """One tile of glass in the atlas of a building does not make its walls transparent."""
    scene = ingest(put("a.glb", with_atlas(GltfModel()).glb()))
    assert [m.name for m in scene.materials] == ["atlas", "plain", "atlas"]
    assert [m.transparent for m in scene.materials] == [True, False, False]
    assert len(scene.images) == 1
    assert scene.opaque.tolist() == [True, True, False, False, True, True]
    (note,) = [note for note in scene.notes if "emission" in note.message]
    assert note.message.endswith("on 0.67 of all area")
    assert note.count == 1
    assert scene.lights is not None
    assert np.array_equal(scene.lights.glow[0], scene.lights.glow[2])


def test_what_transmits_light_ignores_alpha_too(put: Put) -> None:
    doc = with_modes(GltfModel(), noise(1, bands=4), "OPAQUE")
    glass = {"KHR_materials_transmission": {"transmissionFactor": 1}}
    doc.tree["materials"][0]["extensions"] = glass
    scene = ingest(put("a.glb", doc.glb()))
    assert scene.materials[0].transparent
    assert pixels_of(scene, 0).shape[2] == 3


@pytest.mark.parametrize(
    ("sampler", "wraps", "noted"),
    [
        (None, ("repeat", "repeat"), False),
        ({"wrapS": 33071}, ("clamp", "repeat"), False),
        ({"wrapS": 10497, "wrapT": 33071}, ("repeat", "clamp"), False),
        ({"wrapS": 33648}, ("clamp", "repeat"), True),  # no face leaves the first repetition
    ],
)
def test_wrapping(put: Put, sampler: Any, wraps: tuple[str, str], noted: bool) -> None:
    doc = GltfModel()
    material = with_image(doc, png(noise(1)), sampler)
    scene = ingest(put("a.glb", with_material(doc, material).glb()))
    assert (scene.materials[0].wrap_s, scene.materials[0].wrap_t) == wraps
    assert says(scene, "mirrored repetition baked in") is noted


def test_the_bytes_of_images_are_kept(put: Put, tmp_path: Path) -> None:
    doc, data = GltfModel(), png(noise(1))
    material = with_image(doc, data)
    path = put("a.glb", with_material(doc, material).glb())
    (image,) = ingest(path).images
    assert image.name == "Brick_1.png"
    assert image.load() == data
    path.write_bytes(path.read_bytes().replace(data[40:44], b"!!!!"))
    with pytest.raises(InputError, match="PTM-I122"):
        image.load()
    path.unlink()
    with pytest.raises(InputError, match="PTM-I122"):
        image.load()


def test_images_as_files_and_data(put: Put) -> None:
    doc = GltfModel()
    material = with_image(doc, b"")
    doc.tree["images"] = [{"uri": "Tex%20one.png"}]
    data = png(noise(2))
    put("tex One.png", data)
    scene = ingest(put("a.glb", with_material(doc, material).glb()))
    assert scene.images[0].name == "tex_One.png"
    assert scene.images[0].load() == data

    doc.tree["images"] = [{"uri": "data:image/png;base64," + base64.b64encode(data).decode()}]
    scene = ingest(put("b.glb", doc.glb()))
    assert scene.images[0].load() == data

    doc.tree["images"] = [{"uri": "gone.png"}]
    scene = ingest(put("c.glb", doc.glb()))
    assert (scene.images, scene.materials[0].image) == ((), -1)
    assert [(n.code, n.message) for n in scene.notes] == [("PTM-N204", "gone.png: not found")]
    with pytest.raises(InputError, match="PTM-I204"):
        ingest(put("c.glb", doc.glb()), IngestOptions(strict=True))


def test_second_set_of_coordinates_normalised_and_transformed(put: Put) -> None:
    """All three are lost by trimesh alone."""
    doc = GltfModel()
    material = with_image(doc, png(noise(1)))
    use = material["pbrMetallicRoughness"]["baseColorTexture"]
    use["texCoord"] = 1
    use["extensions"] = {
        "KHR_texture_transform": {"offset": [0.25, 0], "scale": [2, 1], "rotation": math.pi / 2}
    }
    doc.tree["materials"] = [material]
    quad = doc.quad(material=0)
    second = np.array([[0, 0], [65535, 0], [65535, 65535], [0, 65535]], np.uint16)
    quad["attributes"]["TEXCOORD_1"] = doc.add(second, normalized=True)
    doc.place(quad)
    scene = ingest(put("a.glb", doc.glb()))
    assert says(scene, "KHR_texture_transform baked")
    # (s, t) → scaled (2s, t) → turned (t, -2s) → moved (t + 1/4, -2s), then upside down.
    given = [(0, 0), (1, 0), (1, 1)]
    assert np.allclose(scene.uv[0], [(t + 0.25, 1 + 2 * s) for s, t in given])


def test_quantised_positions(put: Put) -> None:
    doc = GltfModel()
    quad = doc.quad()
    steps = np.array([[0, 0, 0], [32767, 0, 0], [32767, 16384, 0], [-32768, 16384, 0]], np.int16)
    padded = np.zeros((4, 4), np.int16)
    padded[:, :3] = steps
    view = doc.view(padded.tobytes(), byteStride=8)
    doc.tree["accessors"].append(
        {
            "bufferView": view,
            "componentType": 5122,
            "count": 4,
            "type": "VEC3",
            "normalized": True,
        }
    )
    quad["attributes"]["POSITION"] = len(doc.tree["accessors"]) - 1
    doc.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    doc.place(quad, scale=[5, 8, 1])
    scene = ingest(put("a.glb", doc.glb()))
    assert np.ptp(scene.points, axis=0) == pytest.approx([10, 8 * 16384 / 32767, 0])


def test_strips_and_no_indices(put: Put) -> None:
    doc = GltfModel()
    strip = doc.quad(mode=5)
    strip["indices"] = doc.add(np.array([0, 1, 3, 2], np.uint8))
    doc.place(strip)
    bare = doc.quad()
    del bare["indices"]
    corners = np.array([[0, 0, 5], [1, 0, 5], [0, 1, 5]], np.float32)
    bare["attributes"] = {"POSITION": doc.add(corners)}
    points = doc.quad(mode=0)
    doc.place(bare, points)
    scene = ingest(put("a.glb", doc.glb()))
    assert len(scene.triangles) == 3
    assert (
        np.cross(
            scene.corners[:, 1] - scene.corners[:, 0], scene.corners[:, 2] - scene.corners[:, 0]
        )[:, 2]
        > 0
    ).all()
    assert says(scene, "points or lines")


def test_cameras_and_what_hangs_below_them(put: Put) -> None:
    doc = GltfModel.wall()
    doc.tree["cameras"] = [
        {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}},
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}},
    ]
    half = math.sqrt(0.5)
    doc.tree["nodes"] += [
        {"camera": 0, "name": "Eingang", "translation": [5, 1.6, 20], "children": [3]},
        {"camera": 1},
        {"mesh": 0, "translation": [0, 0, 1]},
        {"camera": 0, "rotation": [0, half, 0, half], "translation": [5, 0, 0]},
    ]
    doc.tree["scenes"] = [{"nodes": [0, 1, 2, 4]}]
    scene = ingest(put("a.glb", doc.glb()))
    assert len(scene.triangles) == 4
    first, second = scene.cameras
    assert first.name == "Eingang"
    origin = np.array(scene.space.origin)
    assert np.allclose(first.position + origin, [5, 1.6, 20])
    assert np.allclose(first.direction, [0, 0, -1])
    assert first.field_of_view == 1.0
    assert np.allclose(second.direction, [-1, 0, 0])
    assert says(scene, "has no perspective")


def test_space_may_be_given(put: Put) -> None:
    scene = ingest(put("a.glb", GltfModel.wall().glb()), IngestOptions(unit="cm", up="z"))
    assert np.ptp(scene.points, axis=0) == pytest.approx([0.1, 0, 0.04])
    assert (scene.space.metres, scene.space.up) == (0.01, "z")


def test_a_size_that_is_unlikely_is_told(put: Put) -> None:
    assert "PTM-N227" in codes(ingest(put("a.glb", GltfModel.wall(scale=[100, 100, 100]).glb())))


DAMAGED: dict[str, tuple[str, bytes]] = {
    "cut short": ("PTM-I249", broken(lambda d: None)[:-30]),
    "cut in the header": ("PTM-I249", broken(lambda d: None)[:10]),
    "not glTF": ("PTM-I249", b"PK\x03\x04" + bytes(100)),
    "version 1": ("PTM-I249", broken(lambda d: d.tree.update(asset={"version": "1.0"}))),
    "no asset": ("PTM-I249", broken(lambda d: d.tree.pop("asset"))),
    "no nodes": ("PTM-I247", broken(lambda d: d.tree.update(nodes=[], scenes=[{"nodes": []}]))),
    "no positions": (
        "PTM-I249",
        broken(lambda d: d.tree["meshes"][0]["primitives"][0]["attributes"].pop("POSITION")),
    ),
    "view too long": (
        "PTM-I249",
        broken(lambda d: d.tree["bufferViews"][0].update(byteLength=10**12)),
    ),
    "accessor too long": (
        "PTM-I249",
        broken(lambda d: d.tree["accessors"][0].update(count=100)),
    ),
    "too many vertices": (
        "PTM-L203",
        broken(lambda d: d.tree["accessors"][0].update(count=10**12)),
    ),
    "index out of range": ("PTM-I249", broken(lambda d: d.tree["accessors"][2].update(count=5))),
    "vertices too few": ("PTM-I249", broken(lambda d: d.tree["accessors"][0].update(count=3))),
    "no such mesh": ("PTM-I249", broken(lambda d: d.tree["nodes"][0].update(mesh=7))),
    "negative child": ("PTM-I249", broken(lambda d: d.tree["nodes"][0].update(children=[-1]))),
    "a ring of nodes": ("PTM-I249", broken(lambda d: d.tree["nodes"][0].update(children=[0]))),
    "a matrix of 3": ("PTM-I249", broken(lambda d: d.tree["nodes"][0].update(matrix=[1, 2, 3]))),
    "sparse": ("PTM-I249", broken(lambda d: d.tree["accessors"][0].update(sparse={"count": 1}))),
    "unknown": (
        "PTM-I243",
        broken(lambda d: d.tree.update(extensionsRequired=["EXT_texture_avif"])),
    ),
    "no instances": (
        "PTM-I249",
        broken(
            lambda d: (
                d.tree["accessors"].append({"count": 0, "type": "VEC3", "componentType": 5126}),
                d.tree["accessors"][0].update(count=3 * 10**9),
                d.tree["nodes"][0].update(
                    extensions={"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 3}}}
                ),
            )
        ),
    ),
    "a factor that is a word": (
        "PTM-I249",
        broken(
            lambda d: (
                d.tree.update(
                    materials=[{"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, "nan"]}}]
                ),
                d.tree["meshes"][0]["primitives"][0].update(material=0),
            )
        ),
    ),
    "types all wrong": ("PTM-I249", broken(lambda d: d.tree.update(meshes={"a": 1}))),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged(put: Put, name: str) -> None:
    code, data = DAMAGED[name]
    with pytest.raises(InputError) as caught:
        ingest(put("a.glb", data))
    assert caught.value.code == code
    assert "\n" not in str(caught.value)


def test_buffers_that_are_missing_or_outside(put: Put, tmp_path: Path) -> None:
    doc = GltfModel.wall()
    put("out.bin", doc.blob)
    (tmp_path / "in").mkdir()
    with pytest.raises(InputError, match="PTM-I203"):
        ingest(put("in/a.gltf", doc.gltf("gone.bin")))
    outside = put("in/b.gltf", doc.gltf("../out.bin"))
    with pytest.raises(InputError, match="PTM-I205"):
        ingest(outside)
    assert len(ingest(outside, IngestOptions(allow_outside=True)).triangles) == 2


def test_any_damaged_byte_gives_a_scene_or_one_line(put: Put) -> None:
    rng = np.random.default_rng(5)
    doc = GltfModel()
    material = with_image(doc, png(noise(1)))
    good = with_material(doc, material).glb()
    refused = 0
    for _ in range(300):
        data = bytearray(good)
        for _ in range(rng.integers(1, 4)):
            data[rng.integers(len(data))] = rng.integers(256)
        try:
            scene = ingest(put("a.glb", bytes(data)))
        except PtmError:
            refused += 1
        else:
            assert np.isfinite(scene.points).all()
    assert 100 < refused < 300


def test_the_gallery_as_glb_and_as_obj(shared: Path) -> None:
    folder = shared / "scenes" / "gallery"
    glb, obj = ingest(folder / "gallery.glb"), ingest(folder / "gallery.obj")
    assert len(glb.triangles) == len(obj.triangles) == 1930
    assert np.abs(glb.corners - obj.corners).max() < 2e-5
    assert np.abs(glb.uv - obj.uv).max() < 1e-5
    (ours,), (theirs,) = glb.images, obj.images
    assert ours.load().startswith(b"\x89PNG")
    assert len(ours.load()) == 1326653
    with Image.open(io.BytesIO(theirs.load())) as image:
        assert image.size == (1024, 1024)
    assert json.dumps([vars(n) for n in glb.notes]) == "[]"
