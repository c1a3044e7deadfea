"""Metallic, roughness and transmission of materials."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.scene import IngestOptions, Scene, images, ingest
from ptmtools.scene.model import Material
from ptmtools.texture.images.png import png_bytes
from tests.scene.conftest import GltfModel, Put, png

STRICT = IngestOptions(strict=True)
#: Red, green, blue and alpha; the means of their shares are 0.4, 0.2, 0.6 and 0.8.
PACKED = np.tile(np.uint8([[0, 51, 255, 153], [204, 51, 51, 255]]), (4, 1)).reshape(2, 4, 4)


def matter(scene: Scene) -> tuple[float, float]:
    again = Scene.from_arrays(scene.to_arrays(), scene.images)
    assert again.materials == scene.materials
    (material,) = again.materials
    return material.metallic, material.roughness


def with_material(put: Put, material: Any, image: bytes = png(PACKED)) -> Scene:
    def change(doc: GltfModel) -> None:
        doc.tree["images"] = [{"bufferView": doc.view(image), "mimeType": "image/png"}]
        doc.tree["images"].append({"uri": "gone.png"})
        doc.tree["textures"] = [{"source": 0}, {"source": 1}]
        doc.tree["materials"] = [material]
        doc.tree["meshes"][0]["primitives"][0]["material"] = 0

    return ingest(put("matter.glb", GltfModel.wall(change).glb()), STRICT)


def metal(**surface: Any) -> dict[str, Any]:
    return {"pbrMetallicRoughness": surface}


def glossy(**members: Any) -> dict[str, Any]:
    return {"extensions": {"KHR_materials_pbrSpecularGlossiness": members}}


USE = {"index": 0}


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        ({}, (1, 1)),
        (metal(), (1, 1)),
        (metal(metallicFactor=0), (0, 1)),
        (metal(metallicFactor=0.25, roughnessFactor=0.5), (0.25, 0.5)),
        (metal(metallicRoughnessTexture=USE), (0.6, 0.2)),
        (metal(metallicFactor=0.5, roughnessFactor=0.5, metallicRoughnessTexture=USE), (0.3, 0.1)),
        (glossy(), (0, 0)),
        (glossy(glossinessFactor=0.75), (0, 0.25)),
        (glossy(glossinessFactor=0.5, specularGlossinessTexture=USE), (0, 0.6)),
        ({"extensions": {"KHR_materials_unlit": {}}}, (0, 1)),
    ],
)
def test_matter_of_gltf(put: Put, material: dict[str, Any], expected: tuple[float, float]) -> None:
    assert matter(with_material(put, material)) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("material", "expected", "code"),
    [
        (metal(metallicFactor=2, roughnessFactor=-1), (1, 0), "PTM-N215"),
        (metal(roughnessFactor="smooth"), (0, 1), "PTM-N215"),
        (metal(metallicRoughnessTexture=[1]), (0, 1), "PTM-N215"),
        (metal(metallicRoughnessTexture={"index": 1}), (0, 1), "PTM-N204"),
        (glossy(glossinessFactor=9), (0, 0), "PTM-N215"),
    ],
)
def test_damage_of_matter_is_a_note(
    put: Put, material: dict[str, Any], expected: tuple[float, float], code: str
) -> None:
    scene = with_material(put, material)
    assert matter(scene) == expected
    assert code in {note.code for note in scene.notes}


def test_an_image_that_cannot_be_decoded_is_matt(put: Put) -> None:
    scene = with_material(put, metal(metallicRoughnessTexture=USE), b"none")
    assert matter(scene) == (0, 1)
    assert "PTM-N206" in {note.code for note in scene.notes}


@pytest.mark.parametrize(
    ("material", "opacity"),
    [
        ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}, 0.1),
        ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}}, 0.55),
    ],
)
def test_what_transmits_light_is_glass(put: Put, material: dict[str, Any], opacity: float) -> None:
    for mode in ("OPAQUE", "BLEND"):
        (shown,) = with_material(put, {**material, "alphaMode": mode}).materials
        assert shown.opacity == pytest.approx(opacity)
        assert shown.transparent


def test_glass_that_is_blended_or_varies_keeps_its_opacity(put: Put) -> None:
    transmission = {"transmissionFactor": 1.0}
    glass = {"extensions": {"KHR_materials_transmission": transmission}, "alphaMode": "BLEND"}
    (thin,) = with_material(put, metal(baseColorFactor=[1, 1, 1, 0.3]) | glass).materials
    assert thin.opacity == 0.3
    (painted,) = with_material(put, metal(baseColorTexture=USE) | glass).materials
    assert painted.opacity == 1
    transmission["transmissionTexture"] = USE
    (varied,) = with_material(put, glass | {"alphaMode": "OPAQUE"}).materials
    assert (varied.opacity, varied.transparent) == (1, True)


MAPS = {"map.png": png(PACKED), "grey.png": png(PACKED[..., 1])}
SHINY = "Ks 0 0.5 0\nNs 250\n"


@pytest.mark.parametrize(
    ("mtl", "expected"),
    [
        ("", (0, 1)),
        ("Pm 0.5\nPr 0.25\nKs 1 1 1\nNs 900\nillum 2", (0.5, 0.25)),
        (SHINY + "illum 2", (0, 0.5)),
        (SHINY + "illum 1", (0, 1)),
        (SHINY, (0, 1)),
        ("Ks 0 0 0\nNs 250\nillum 2", (0, 1)),
        ("Ks 1 1 1\nillum 2", (0, 1)),
        ("Ks 1 1 1\nNs 4000\nillum 2", (0, 0)),
        ("Pm 0\nmap_Pm map.png\nmap_Pr -imfchan g map.png", (0.4, 0.2)),
        ("Pr 0\nmap_Pr grey.png", (0, 0.2)),
        ("Pm 1\nPr 0\nmap_Pm gone.png\nmap_Pr gone.png", (0, 1)),
    ],
)
def test_matter_of_obj(
    textured: Callable[..., Path], mtl: str, expected: tuple[float, float]
) -> None:
    scene = ingest(textured(mtl, MAPS), replace(STRICT, unit="m", up="y"))
    assert matter(scene) == pytest.approx(expected)
    assert {"map.png", "grey.png"} & {*scene.files} == {n for n in MAPS if n in mtl}


@pytest.mark.parametrize(
    ("mtl", "expected"),
    [
        ("Pm nan\nPr 0.5", (0, 0.5)),
        ("Pr -2\nPm 1e9", (1, 0)),
        ("Pr", (0, 1)),
        ("Ks spectral file.rfl", (0, 1)),
        ("map_Pr -s", (0, 1)),
    ],
)
def test_damage_of_matter_in_obj_is_a_note(
    textured: Callable[..., Path], mtl: str, expected: tuple[float, float]
) -> None:
    scene = ingest(textured(mtl), replace(STRICT, unit="m", up="y"))
    assert matter(scene) == expected
    assert "PTM-N215" in {note.code for note in scene.notes}


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("bands", [1, 2, 3, 4])
def test_the_mean_values_of_an_image(dtype: type[np.unsignedinteger[Any]], bands: int) -> None:
    largest = np.iinfo(dtype).max
    texels = np.random.default_rng(bands).integers(0, largest, (9, 7, bands), dtype)
    mean = texels.mean(axis=(0, 1)) / largest
    expected = [
        *(mean[:3] if bands > 2 else mean[:1].repeat(3)),
        mean[-1] if bands in (2, 4) else 1,
    ]
    assert images.mean_values(png_bytes(texels), 1 << 20) == pytest.approx(expected)


def test_images_are_read_once(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    """Metallic and roughness share an image, and so do materials."""
    lengths: list[int] = []
    integers = images.integers

    def counted(data: bytes, limit: int) -> Any:
        lengths.append(len(data))
        return integers(data, limit)

    monkeypatch.setattr(images, "integers", counted)

    def change(doc: GltfModel) -> None:
        doc.tree["images"] = [{"bufferView": doc.view(png(PACKED)), "mimeType": "image/png"}]
        doc.tree["textures"] = [{"source": 0}]
        factors = (1.0, 0.5)
        doc.tree["materials"] = [
            metal(roughnessFactor=factor, metallicRoughnessTexture=USE) for factor in factors
        ]
        for number in range(2):
            doc.place(doc.quad(material=number), translation=[0, 0, -1 - number])
        doc.tree["meshes"][0]["primitives"][0]["material"] = 0

    scene = ingest(put("shared.glb", GltfModel.wall(change).glb()))
    assert [m.roughness for m in scene.materials] == pytest.approx([0.2, 0.1])
    assert len(lengths) == 1


@pytest.mark.parametrize(
    ("metallic", "roughness", "glossy"), [(1, 1, False), (0, 0.79, True), (0, 0.8, False)]
)
def test_smooth_materials_are_glossy(metallic: float, roughness: float, glossy: bool) -> None:
    assert Material("brass", metallic=metallic, roughness=roughness).glossy == glossy
