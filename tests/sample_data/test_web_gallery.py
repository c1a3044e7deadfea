"""The web gallery: Draco and JPEG, read back as the closed building that was written."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from ptmtools_samples.mesh import Thing, block
from ptmtools_samples.options import WebGalleryOptions
from ptmtools_samples.web_gallery import SIDES, make_web_gallery, meshes_of, statues_of

from ptmtools.cells import subdivide
from ptmtools.glb import glb_chunks
from ptmtools.scene import ingest

SMALL = WebGalleryOptions(rooms=2, paintings=6, statue_triangles=400, scale=0.05)


@pytest.fixture(scope="module")
def data() -> bytes:
    ((_, load),) = make_web_gallery(SMALL)
    return load()


def test_the_file_is_compressed_as_it_says(data: bytes) -> None:
    (_, _, text), (_, _, binary) = glb_chunks(data)
    document = json.loads(text)
    assert document["extensionsRequired"] == ["KHR_draco_mesh_compression"]
    for mesh in document["meshes"]:
        (primitive,) = mesh["primitives"]
        assert "KHR_draco_mesh_compression" in primitive["extensions"]
    views = [document["bufferViews"][image["bufferView"]] for image in document["images"]]
    sizes = []
    for image, view in zip(document["images"], views, strict=True):
        with Image.open(io.BytesIO(binary[view["byteOffset"] :][: view["byteLength"]])) as opened:
            assert opened.format == "JPEG"
            if image["name"].startswith("painting"):
                sizes.append(max(opened.size))
    assert sizes == [round(SIDES[k % len(SIDES)] * SMALL.scale) for k in range(SMALL.paintings)]


def test_rounding_leaves_the_building_closed(data: bytes, tmp_path: Path) -> None:
    file = tmp_path / "gallery.glb"
    file.write_bytes(data)
    scene = ingest(file)
    assert subdivide(scene).closed
    assert {image.name.split(".")[-1] for image in scene.images} <= {"jpg", "jpeg"}
    textured = np.array([material.image >= 0 for material in scene.materials])
    assert textured[scene.triangle_material].mean() > 0.5


def test_statues_stand_in_their_places() -> None:
    place = Thing("statue_01", block("marble", (1, 0, 2), (1.6, 1.8, 2.6), 1.0))
    (mesh,) = statues_of([place], SMALL)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    assert low[1] == pytest.approx(0, abs=1e-5)
    assert (low >= np.array([1, 0, 2]) - 1e-5).all()
    assert (high <= np.array([1.6, 1.8, 2.6]) + 1e-5).all()
    assert len(mesh.triangles) == pytest.approx(SMALL.statue_triangles, rel=0.5)


def test_meshes_share_vertices() -> None:
    (mesh,) = meshes_of(block("marble", (0, 0, 0), (1, 1, 1), 1.0))
    assert len(mesh.triangles) == 12
    assert len(np.unique(mesh.points, axis=0)) == 8
    area = np.linalg.norm(
        np.cross(*np.diff(mesh.points[mesh.triangles], axis=1).transpose(1, 0, 2)), axis=1
    )
    assert area.sum() / 2 == pytest.approx(6)


def test_the_same_again(data: bytes) -> None:
    ((_, load),) = make_web_gallery(SMALL)
    assert load() == data
