"""Images derived from a model's: with a mask as their alpha, beside their mirror image."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.baking import bake
from ptmtools.scene.images import ImageStore
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import FileRange, ModelSource, SourceMaterial, SourceTexture
from tests.scene.conftest import Put, noise, png

Textured = Callable[..., Path]
MASK = np.array([[0, 255], [255, 51]], np.uint8)


def texels(scene: Scene, image: int = 0) -> np.ndarray:
    with Image.open(io.BytesIO(scene.images[image].load())) as opened:
        return np.asarray(opened)


def tiff(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(array).save(stream, "tiff")
    return stream.getvalue()


@pytest.mark.parametrize("size", [(2, 2), (4, 6), (1, 1)])
def test_a_mask_of_another_size(textured: Textured, size: tuple[int, int]) -> None:
    wall = noise(1, 8)
    mask = np.zeros(size, np.uint8)
    scene = ingest(
        textured("map_Kd wall.png\nmap_d m.png", {"wall.png": png(wall), "m.png": png(mask)})
    )
    actual = texels(scene)
    assert np.array_equal(actual[..., :3], wall)
    assert not actual[..., 3].any()
    assert scene.materials[0].transparent


def test_a_mask_times_the_images_own_alpha(textured: Textured) -> None:
    wall = np.dstack([noise(1, 2), [[255, 128], [0, 255]]]).astype(np.uint8)
    files = {"wall.png": png(wall), "m.png": png(MASK)}
    actual = texels(ingest(textured("map_Kd wall.png\nmap_d m.png", files)))
    assert actual[..., 3].tolist() == [[0, 128], [0, 51]]


def test_of_16_bits_nothing_is_lost(textured: Textured) -> None:
    deep = np.array([[1000, 65535], [300, 7]], np.uint16)
    files = {"wall.png": png(deep), "m.png": png(MASK)}
    scene = ingest(textured("map_Kd wall.png\nmap_d m.png", files))
    from ptmtools.texture.images.files import load_image

    made = load_image(scene.images[0].load()).texels[0:2]
    assert made[..., 0].tolist() == deep.tolist()
    assert made[..., 1].tolist() == [[0, 65535], [65535, 13107]]


@pytest.mark.parametrize("name", ["the image", "the mask"])
def test_what_cannot_be_baked_costs_the_mask_only(textured: Textured, name: str) -> None:
    """Floats beside opacities; a mask in CMYK."""
    floats = tiff(np.linspace(0, 1, 4, dtype=np.float32).reshape(2, 2))
    stream = io.BytesIO()
    Image.new("CMYK", (2, 2), (9, 9, 9, 9)).save(stream, "jpeg")
    files = {"wall.tif": floats, "m.png": png(MASK)}
    if name == "the mask":
        files = {"wall.tif": tiff(noise(1, 2)), "m.png": stream.getvalue()}
    scene = ingest(textured("map_Kd wall.tif\nmap_d m.png", files))
    assert scene.materials[0].image == 0
    assert scene.images[0].load() == files["wall.tif"]
    assert scene.materials[0].transparent
    (note,) = [note for note in scene.notes if note.code == "PTM-N206"]
    assert note.message.startswith("map_d m.png: ")


def test_an_image_of_which_another_is_made_is_not_plain(textured: Textured) -> None:
    """It is of one material alone, but a change to its file changes the other material's, too."""
    files = {"wall.png": png(noise(1)), "m.png": png(MASK)}
    second = "map_Kd wall.png\nmap_d m.png\nnewmtl other\nmap_Kd wall.png"
    path = textured(second, files, faces="f 1/1 2/2 3/3\nusemtl other\nf 1/1 3/3 4/4\n")
    scene = ingest(path)
    assert [image.plain for image in scene.images] == [False, False]
    assert [image.files for image in scene.images] == [(), ("wall.png",)]
    alone = ingest(textured("map_Kd wall.png", files))
    assert [image.plain for image in alone.images] == [True]


def mirrored(
    put: Put, uv: list[list[float]], limit: int
) -> tuple[ModelSource, np.ndarray, IngestNotes]:
    put("a.obj", "")
    findings = IngestNotes(put("wall.png", png(noise(1, 8))))
    findings.folder.find("wall.png")
    texture = SourceTexture(FileRange(findings.model), "wall.png", "wall", "a", "mirror", "mirror")
    corners = np.array([uv])
    source = ModelSource(
        points=np.zeros((3, 3)),
        triangles=np.array([[0, 1, 2]]),
        uv=corners,
        triangle_object=np.zeros(1, np.int64),
        triangle_material=np.zeros(1, np.int64),
        objects=("a",),
        materials=(SourceMaterial("paint", texture=texture),),
    )
    store = ImageStore(findings, limit)
    materials, actual = bake(source.materials, [np.array([0])], corners, store, findings)
    return replace(source, uv=actual, materials=tuple(materials)), corners, findings


@pytest.mark.parametrize(
    ("uv", "expected"),
    [
        ([[0.1, 0.2], [0.9, 0.2], [0.9, 0.8]], [[0.1, 0.2], [0.9, 0.2], [0.9, 0.8]]),
        ([[1.1, 0.2], [1.9, 0.2], [1.9, 0.8]], [[0.9, 0.2], [0.1, 0.2], [0.1, 0.8]]),
        ([[-0.1, 2.2], [-0.9, 2.2], [-0.9, 2.8]], [[0.1, 0.2], [0.9, 0.2], [0.9, 0.8]]),
        ([[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]], [[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]),
    ],
)
def test_within_a_repetition_coordinates_are_mirrored(
    put: Put, uv: list[list[float]], expected: list[list[float]]
) -> None:
    source, given, _ = mirrored(put, uv, 1 << 30)
    assert np.allclose(source.uv[0], expected)
    assert given.tolist() == [uv]
    (texture,) = [material.texture for material in source.materials]
    assert texture is not None
    assert isinstance(texture.read, FileRange)
    assert (texture.wrap_s, texture.wrap_t) == ("clamp", "clamp")


def test_across_repetitions_the_image_is_made_larger(put: Put) -> None:
    source, _, _ = mirrored(put, [[0, 0], [3, 0], [3, 0.5]], 1 << 30)
    texture = source.materials[0].texture
    assert texture is not None
    assert (texture.wrap_s, texture.wrap_t) == ("repeat", "clamp")
    with Image.open(io.BytesIO(texture.read())) as opened:
        made = np.asarray(opened)
    assert np.array_equal(made, np.concatenate([noise(1, 8), noise(1, 8)[:, ::-1]], axis=1))
    assert source.uv[0].tolist() == [[0, 0], [1.5, 0], [1.5, 0.5]]


def test_what_would_be_too_large_repeats(put: Put) -> None:
    uv = [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0]]
    source, _, findings = mirrored(put, uv, 4 * 8 * 8 * 3)
    texture = source.materials[0].texture
    assert texture is not None
    assert (texture.wrap_s, texture.wrap_t) == ("repeat", "repeat")
    assert source.uv[0].tolist() == uv
    assert {note.code for note in findings.entries} == {"PTM-N206"}


def test_what_could_not_be_made_may_be_when_the_file_changes(textured: Textured) -> None:
    """So an image of which another was to be made is not plain, either."""
    floats = tiff(np.linspace(0, 1, 4, dtype=np.float32).reshape(2, 2))
    scene = ingest(textured("map_Kd w.tif\nmap_d m.png", {"w.tif": floats, "m.png": png(MASK)}))
    assert [image.plain for image in scene.images] == [False]


def test_floats_are_not_mirrored(put: Put) -> None:
    from tests.scene.conftest import GltfModel
    from tests.scene.features.gltf import repeating

    doc = GltfModel()
    doc.place(doc.quad(**repeating(doc, [2.5, 2])))
    (view,) = [image["bufferView"] for image in doc.tree["images"]]
    doc.tree["bufferViews"][view] = doc.tree["bufferViews"][
        doc.view(tiff(np.linspace(0, 1, 4, dtype=np.float32).reshape(2, 2)))
    ]
    scene = ingest(put("a.glb", doc.glb()))
    assert scene.materials[0].wrap_s == "repeat"
    (note,) = [note for note in scene.notes if note.code == "PTM-N206"]
    assert "floats" in note.message


def test_ktx2_without_its_library(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error: a scene without its textures would stay as it is when the library comes."""
    from ptmtools.errors import MissingComponentError
    from ptmtools.scene import sandbox
    from ptmtools.scene.gltf.compression import TranscodedBytes, transcode
    from tests.scene.features.gltf import KTX2

    monkeypatch.setattr(sandbox, "find_spec", lambda name: None)
    with pytest.raises(MissingComponentError, match=r"PTM-M100"):
        transcode(KTX2)
    assert TranscodedBytes(lambda: b"\x89PNG")() == b"\x89PNG"


def test_a_mask_counts_for_the_limit(textured: Textured) -> None:
    """A megabyte and a quarter of texels, where one is allowed."""
    from ptmtools.errors import LimitError

    large = np.zeros((512, 640), np.uint8)
    path = textured("map_d m.png", {"m.png": png(large)})
    with pytest.raises(LimitError, match="PTM-L104"):
        ingest(path, IngestOptions(limit=1))
