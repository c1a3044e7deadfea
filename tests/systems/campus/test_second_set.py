"""Lightmaps and masks from the model itself."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import InputError
from ptmtools.light.looks import LightImage
from ptmtools.scene import IngestOptions, ingest
from ptmtools_systems.campus import CampusOptions, make_campus
from ptmtools_systems.campus.making import _light_source
from ptmtools_systems.campus.second_set import ModelLight, model_light, model_masks
from tests.scene.conftest import GltfModel
from tests.scene.test_gltf import with_atlas
from tests.systems.campus.models import MTL, write_campus, write_gltf

METRES = IngestOptions(unit="m", up="y")


def edited(model: Path, change: Any) -> Path:
    document = json.loads(model.read_text())
    change(document)
    model.write_text(json.dumps(document))
    return model


def test_the_sampler_and_the_strength_count(tmp_path: Path) -> None:
    def change(document: dict[str, Any]) -> None:
        document["samplers"] = [{"wrapS": 33071, "wrapT": 33648}]
        document["textures"][1]["sampler"] = 0
        document["materials"][0]["occlusionTexture"]["strength"] = 0.5

    actual = model_light(edited(write_gltf(tmp_path), change), IngestOptions())
    (image,) = actual.images
    assert image.wrap == ("clamp", "mirror")
    assert image.strength == 0.5


def test_materials_share_the_texels_of_an_image(tmp_path: Path) -> None:
    def change(document: dict[str, Any]) -> None:
        first = document["materials"][0]
        weaker = {**first["occlusionTexture"], "strength": 0.5}
        document["materials"].append({**first, "occlusionTexture": weaker})
        document["meshes"][1]["primitives"][0]["material"] = 1

    actual = model_light(edited(write_gltf(tmp_path), change), IngestOptions())
    assert [image.strength for image in actual.images] == [1.0, 0.5]
    assert actual.images[0].texels is actual.images[1].texels
    assert set(actual.image.tolist()) == {0, 1}


@pytest.mark.parametrize("both", [True, False], ids=["of all", "of one"])
def test_a_lightmap_that_is_missing_is_named(tmp_path: Path, both: bool) -> None:
    def change(document: dict[str, Any]) -> None:
        if not both:
            document["textures"].append({"source": 3})
            document["images"].append({"uri": "other.png"})
            second = {**document["materials"][0], "name": "wood"}
            second["occlusionTexture"] = {"index": 3, "texCoord": 1}
            document["materials"].append(second)
            document["meshes"][1]["primitives"][0]["material"] = 1

    model = edited(write_gltf(tmp_path / "m"), change)
    if both:
        (tmp_path / "m" / "light.png").unlink()
    with pytest.raises(InputError) as fault:
        make_campus(model, tmp_path / "c", CampusOptions(lightmaps="model"))
    file, material = ("light.png", "stone") if both else ("other.png", "wood")
    for text in (str(model), file, material, "not found", "--lightmaps bake", "PTM-I701"):
        assert text in str(fault.value)


def test_a_lightmap_that_is_none_is_named(tmp_path: Path) -> None:
    model = write_gltf(tmp_path / "m")
    (tmp_path / "m" / "light.png").write_bytes(b"nothing")
    with pytest.raises(InputError) as fault:
        make_campus(model, tmp_path / "c", CampusOptions(lightmaps="model"))
    for text in ("light.png", "stone", "--lightmaps bake"):
        assert text in str(fault.value)


def masks(folder: Path, library: str, said: str = "mtllib campus.mtl") -> tuple[int, list[str]]:
    """How many masks the made campus has with another library, and notes on them."""
    model = write_campus(folder)
    (folder / "campus.mtl").write_text(library)
    model.write_text(model.read_text().replace("mtllib campus.mtl", said))
    actual, notes = model_masks(model, ingest(model, METRES), METRES)
    return len(actual), list(notes)


def test_a_statement_that_goes_on_in_the_next_line(tmp_path: Path) -> None:
    assert masks(tmp_path, MTL, "mtllib \\\ncampus.mtl") == (1, [])


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ("map_Ks -s", "-s lacks an argument"),
        ("map_Ks gone.png", "gone.png: not found"),
        ("map_Ks ../outside.png", "outside.png: lies outside the model's folder"),
        ("map_Ks -s 2 2 shine.png", "other texture coordinates"),
        ("map_Ks campus.obj", "campus.obj: "),
    ],
)
def test_why_a_mask_is_left_out(tmp_path: Path, said: str, why: str) -> None:
    Image.fromarray(np.zeros((2, 2), np.uint8)).save(tmp_path / "outside.png")
    count, notes = masks(tmp_path / "m", MTL.replace("map_Ks shine.png", said))
    assert count == 0
    (note,) = notes
    assert note.startswith("the mask of material facade is left out: ")
    assert why in note


def test_nobody_is_told_of_masks_that_few_ask_for(tmp_path: Path) -> None:
    """A database of the model has no use for them, not even under --strict."""
    model = write_campus(tmp_path)
    (tmp_path / "shine.png").unlink()
    scene = ingest(model, IngestOptions(unit="m", up="y", strict=True))
    assert "shine.png" not in scene.files


def test_the_source_of_a_lightmap_is_the_largest_image() -> None:
    """By its longer side: no client should leave out what has more texels than another source."""
    images = tuple(LightImage(np.zeros(shape, np.uint8)) for shape in ((101, 10), (100, 2000)))
    painted = ModelLight(np.zeros((2, 3, 2)), np.array([0, 1], np.int32), images)
    work = SimpleNamespace(painted=painted)
    assert _light_source(cast("Any", work), np.array([0, 1])) == (2000, 100)
    assert _light_source(cast("Any", work), np.array([0])) == (10, 101)


def test_both_parts_of_a_material_have_its_mask(tmp_path: Path) -> None:
    """Faces that use transparent texels are a material of their own."""
    model = tmp_path / "model.glb"
    model.write_bytes(with_atlas(GltfModel()).glb())
    scene = ingest(model)
    masks, notes = model_masks(model, scene, IngestOptions())
    assert [scene.materials[number].name for number in sorted(masks)] == ["atlas", "atlas"]
    assert notes == ()
