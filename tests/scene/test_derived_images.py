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
from ptmtools.scene.baking import MirroredBytes, OpaqueBytes, bake
from ptmtools.scene.images import ImageStore
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import FileRange, ModelSource, SourceMaterial, SourceTexture
from ptmtools.texture.images import load_image
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


def test_floats_and_16_bits_become_8_before_they_are_combined(textured: Textured) -> None:
    deep = np.array([[1000, 65535], [300, 7]], np.uint16)
    floats = tiff(np.array([[0, 1], [1, 0.2]], np.float32))
    scene = ingest(
        textured("map_Kd wall.png\nmap_d m.tif", {"wall.png": png(deep), "m.tif": floats})
    )
    assert texels(scene).tolist() == [[[4, 0], [255, 255]], [[1, 255], [0, 51]]]
    notes = [note.message.split(": ")[0] for note in scene.notes if note.code == "PTM-N126"]
    assert notes == ["map_Kd wall.png", "map_d m.tif"]


def test_a_damaged_mask_costs_the_mask_only(textured: Textured) -> None:
    files = {"wall.png": png(noise(1, 2)), "m.png": png(MASK)[:-9]}
    scene = ingest(textured("map_Kd wall.png\nmap_d m.png", files))
    assert scene.materials[0].image == 0
    assert scene.images[0].load() == files["wall.png"]
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


def lossy_bytes(scene: Scene) -> list[int]:
    """The bytes of the lossy source of each image, 0 if it has none."""
    sources = (load_image(image.load()).lossy for image in scene.images)
    return [source.bytes if source else 0 for source in sources]


def test_texels_of_a_lossy_image_are_known_as_such(textured: Textured) -> None:
    """Through a mask, CMYK and repetition, but for normals, whose colours previews would blur."""
    wall, mask = jpeg(noise(1, 16)), png(np.zeros((16, 16), np.uint8))
    scene = ingest(textured("map_Kd w.jpg\nmap_d m.png", {"w.jpg": wall, "m.png": mask}))
    assert lossy_bytes(scene) == [len(wall) + len(mask)]
    scene = ingest(textured("map_Kd m.png\nmap_d w.jpg"))
    assert lossy_bytes(scene) == [0]
    heights, inks = jpeg(noise(1, 16)[..., 0]), jpeg(noise(2, 16, 4))
    files = {"h.jpg": heights, "inks.jpg": inks}
    scene = ingest(textured("map_Kd inks.jpg\nmap_Bump h.jpg", files))
    assert lossy_bytes(scene) == [len(inks), 0]
    scene = ingest(textured("map_Kd inks.jpg\nnorm inks.jpg"))
    assert lossy_bytes(scene) == [len(inks), 0]
    assert load_image(MirroredBytes(lambda: wall, True, True, 1 << 30)()).lossy == (
        "lossy image in PNG",
        4 * len(wall),
    )


def jpeg(pixels: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels, "CMYK" if pixels.shape[2:] == (4,) else None).save(stream, "jpeg")
    return stream.getvalue()


@pytest.mark.parametrize("kind", ["webp", "avif"])
def test_a_lossy_image_whose_alpha_is_ignored_keeps_its_other_bytes(kind: str) -> None:
    stream = io.BytesIO()
    Image.fromarray(noise(1, 16, 4)).save(stream, kind, quality=70)
    data = stream.getvalue()
    opaque = OpaqueBytes(lambda: data, 1 << 30)()
    picture = load_image(opaque)
    assert picture.lossy == ({"webp": "WebP", "avif": "AVIF"}[kind], len(opaque))
    assert len(opaque) <= len(data)
    assert np.array_equal(picture.array(), load_image(data).array()[..., :3])


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


def test_floats_are_mirrored_in_8_bits(put: Put) -> None:
    from tests.scene.conftest import GltfModel
    from tests.scene.features.gltf import repeating

    doc = GltfModel()
    doc.place(doc.quad(**repeating(doc, [2.5, 2])))
    (view,) = [image["bufferView"] for image in doc.tree["images"]]
    doc.tree["bufferViews"][view] = doc.tree["bufferViews"][
        doc.view(tiff(np.linspace(0, 1, 4, dtype=np.float32).reshape(2, 2)))
    ]
    scene = ingest(put("a.glb", doc.glb()))
    rows = [[0, 85], [170, 255]]
    assert scene.materials[0].wrap_s == "repeat"
    assert texels(scene).tolist() == [row + row[::-1] for row in rows + rows[::-1]]
    assert "PTM-N126" in {note.code for note in scene.notes}


def test_ktx2_without_its_library(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error: a scene without its textures would stay as it is when the library comes."""
    from ptmtools.errors import MissingComponentError
    from ptmtools.scene import sandbox
    from ptmtools.scene.gltf.compression import TranscodedBytes, transcode
    from tests.scene.features.gltf import KTX2

    texels = load_image(transcode(KTX2))
    assert texels.lossy == ("lossy image in PNG", len(KTX2))
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
