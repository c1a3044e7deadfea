"""Objects, names, textures by size and channel, meshes of levels of detail."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from PIL import Image

from ptmtools.errors import LimitError
from ptmtools.pipeline.validation import validate
from ptmtools.simplification import Mesh
from ptmtools_systems.campus import Campus, CampusOptions, make_campus, read_campus
from ptmtools_systems.campus.making import level_faces, levels
from ptmtools_systems.campus.meshes import Corners, mesh_bytes, read_mesh
from ptmtools_systems.campus.model import FORM, CampusMaterial, Names, mesh_file, texture_file
from ptmtools_systems.campus.objects import notes_on, parts_of
from ptmtools_systems.campus.textures import jpeg, square_image, weight_colors
from tests.conftest import scene_of
from tests.systems.campus.models import TILE, texture, wall, write_obj


@given(st.lists(st.text(max_size=80), max_size=30))
def test_names_are_safe_and_unique(texts: list[str]) -> None:
    names = Names()
    given = [names.take(text, "object") for text in texts]
    assert len({name.lower() for name in given}) == len(given)
    for name in given:
        assert FORM.owns(mesh_file(name, 1))
        assert FORM.owns(texture_file(name, 512, "d"))


def test_names_say_what_they_can() -> None:
    names = Names()
    assert names.take("Große Halle/2", "object") == "Groe_Halle_2"
    assert names.take("grOe halle 2", "object") == "grOe_halle_2-2"
    assert names.take("../../etc", "object") == "etc"
    assert names.take("图书馆", "object") == "object"
    assert names.take("con", "object") == "object_con"


def boxes(count: int, side: float, apart: float) -> np.ndarray:
    """(count, 4, 3) quads in a row along x."""
    quad = side * np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]])
    return quad + apart * np.arange(count)[:, None, None] * [1.0, 0, 0]


def test_small_objects_are_joined_by_squares() -> None:
    scene = scene_of(np.concatenate([boxes(10, 1, 5), boxes(2, 100, 200)]))
    parts = parts_of(scene, 5)
    assert [len(p.parts) for p in parts] == [4, 4, 2, 1, 1]
    assert parts[0].label == "quad0 and 3 more"
    every = np.sort(np.concatenate([p.triangles for p in parts]))
    assert np.array_equal(every, np.arange(len(scene.triangles)))
    assert "small" in notes_on(parts)[0]
    assert [len(p.parts) for p in parts_of(scene, 0)] == [1] * 12


def test_one_object_that_is_all_is_spoken_of() -> None:
    scene = scene_of(boxes(20, 1, 50), objects=["all"] * 20)
    (note,) = notes_on(parts_of(scene_of(boxes(1, 9, 1)), 5))
    assert "100%" in note
    assert notes_on(parts_of(scene, 0)) == ()


def test_too_many_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ptmtools_systems.campus.objects.MAX_OBJECTS", 9)
    with pytest.raises(LimitError, match="PTM-L400"):
        parts_of(scene_of(boxes(10, 1, 5)), 0)


def test_every_texture_has_all_sizes_and_its_channels(made: Path, index: Campus) -> None:
    by_base: dict[str, set[tuple[int, str]]] = {}
    for t in index.textures:
        by_base.setdefault(t.base, set()).add((t.size, t.channel))
        assert t.file == f"textures/{t.base}_{t.size}_{t.channel}.jpg"
        with Image.open(made / t.file) as image:
            assert image.size == (t.size, t.size)
            assert image.mode == ("RGB" if t.channel == "d" else "L")
    sizes = (128, 256, 512)
    assert by_base["wall"] == {(s, c) for s in sizes for c in "dm"}
    assert by_base["lawn"] == {(s, "d") for s in sizes}
    assert by_base["fence"] == {(s, c) for s in sizes for c in "da"}
    assert by_base["House_1"] == {(s, "l") for s in (512, 1024, 2048)}


def test_a_shared_image_is_written_once(index: Campus) -> None:
    houses = [o for o in index.objects if o.label.startswith(("House", "bin"))]
    assert len(houses) == 3
    used = [{index.materials[m].base for m in o.materials} for o in houses]
    assert used == [{"wall", None}] * 3
    assert len({o.lightmap for o in index.objects}) == len(index.objects)


def test_the_size_of_the_source_is_recorded(index: Campus) -> None:
    sources = {t.base: t.source for t in index.textures if t.channel == "d"}
    assert sources == {"wall": (200, 100), "lawn": (640, 640), "fence": (64, 64)}
    assert {t.source for t in index.textures if t.channel == "m"} == {(64, 64)}


def test_materials_say_what_a_client_must_do(index: Campus) -> None:
    actual = {m.name: m for m in index.materials}
    assert actual["facade"].channels == ("d", "m")
    assert actual["fence"].channels == ("d", "a")
    assert actual["fence"].alpha == "blend"
    assert actual["roof"].base is None
    assert actual["roof"].color == (0.5, 0.3, 0.3)


def test_smaller_textures_are_means(made: Path) -> None:
    source = np.asarray(texture(640, 640, 3), float)
    for size in (128, 256, 512):
        with Image.open(made / f"textures/lawn_{size}_d.jpg") as image:
            actual = np.asarray(image, float)
        assert np.abs(actual.mean(axis=(0, 1)) - source.mean(axis=(0, 1))).max() < 1
    exact = source.reshape(128, 5, 128, 5, 3).mean(axis=(1, 3))
    ours = np.asarray(square_image(texture(640, 640, 3), 128), float)
    assert np.abs(ours - exact).max() <= 1


def test_larger_textures_are_not_blocks() -> None:
    ramp = Image.fromarray(np.tile(np.linspace(0, 255, 16).astype(np.uint8), (16, 1)))
    large = np.asarray(square_image(ramp, 128), float)
    assert (np.diff(large[64]) >= -1).all()
    assert np.abs(np.diff(large[64])).max() < 6


def test_an_alpha_channel_is_a_file_of_its_own(made: Path) -> None:
    with Image.open(made / "textures/fence_512_a.jpg") as image:
        through = np.asarray(image, float)
    assert through[16, 16] < 40
    assert through[16, 96] > 215


@pytest.mark.parametrize("size", [16, 128])
def test_what_is_not_seen_does_not_fringe_what_is(size: int) -> None:
    """Red leaves on black that is clear, made smaller and larger."""
    texels = np.zeros((64, 64, 3), np.uint8)
    clear = np.arange(64) // 7 % 2 == 0
    texels[:, ~clear] = [200, 40, 0]
    alpha = np.where(clear, 0, 255).astype(np.uint8)[None].repeat(64, axis=0)
    actual = np.asarray(weight_colors(Image.fromarray(texels), Image.fromarray(alpha), size), int)
    share = np.asarray(square_image(Image.fromarray(alpha), size), int)
    assert (share > 8).any()
    assert np.abs(actual - [200, 40, 0])[share > 8].max() <= 1
    plain = np.asarray(square_image(Image.fromarray(texels), size), int)
    assert np.array_equal(actual[share == 0], plain[share == 0])


def test_an_opaque_material_has_no_alpha_channel(tmp_path: Path) -> None:
    """It shares its image with one that is cut out."""
    held = np.zeros((8, 8, 4), np.uint8)
    held[:, :4] = 255
    Image.fromarray(held).save(tmp_path / "leaf.png")
    (tmp_path / "campus.mtl").write_text(
        "newmtl whole\nmap_Kd leaf.png\nnewmtl cut\nmap_Kd leaf.png\n"
    )
    whole, cut = wall((0, 0), (20, 0), 12), wall((0, 5), (20, 5), 12)
    whole[:, 3:] = 0.1 + 0.2 * (whole[:, 3:] > 0)
    write_obj(tmp_path / "campus.obj", [("a", {"whole": whole}), ("b", {"cut": cut})])
    made = make_campus(tmp_path / "campus.obj", tmp_path / "c", CampusOptions(lightmaps="none"))
    actual = {m.name: m for m in made.campus.materials}
    assert actual["whole"].base == actual["cut"].base == "leaf"
    assert (actual["whole"].alpha, actual["whole"].channels) == ("opaque", ("d",))
    assert (actual["cut"].alpha, actual["cut"].channels) == ("blend", ("d", "a"))
    assert validate(tmp_path / "c").issues == ()


def test_a_jpeg_is_the_same_every_time() -> None:
    image = texture(64, 64, 9)
    assert jpeg(image, 85) == jpeg(image, 85)
    assert len(jpeg(image, 30)) < len(jpeg(image, 90))


def facade(steps: int) -> Mesh:
    """A wall of many quads, whose coordinates are those of its points."""
    rows = wall((0, 0), (20, 0), 12, steps)
    points, place = np.unique(rows[:, :3], axis=0, return_inverse=True)
    quads = place.reshape(-1, 4)
    corner = np.array([[0, 1, 2], [0, 2, 3]])
    uv = rows[:, 3:].reshape(-1, 4, 2)[:, corner].reshape(-1, 3, 2)
    triangles = quads[:, corner].reshape(-1, 3).astype(np.int32)
    return Mesh(points, triangles, np.zeros(len(triangles), np.int32), uv)


def test_a_facade_keeps_its_texture_through_the_levels() -> None:
    whole = facade(16)
    actual = levels(whole, 3, 0.25, 4, 0.01)
    faces = [len(level.source) for level in actual]
    assert faces == sorted(faces)
    assert faces[0] < 0.2 * len(whole.triangles)
    for level in actual:
        expected = level.mesh.points[level.mesh.triangles][..., :2] / TILE
        assert level.mesh.uv is not None
        assert np.abs(level.mesh.uv - expected).max() < 1e-6
    assert actual[-1].error == 0.0


@given(st.integers(1, 10**6), st.integers(1, 8), st.floats(0.01, 1), st.integers(1, 1000))
def test_how_many_faces_a_level_may_have(faces: int, lods: int, ratio: float, least: int) -> None:
    actual = level_faces(faces, lods, ratio, least)
    assert len(actual) == lods
    assert actual == sorted(actual)
    assert actual[-1] == faces
    assert min(actual) >= min(faces, least)


def test_a_mesh_comes_back_from_its_file() -> None:
    random = np.random.default_rng(3)
    materials = (CampusMaterial("a", "wall", ("d",)), CampusMaterial("b"))
    mesh = Corners(
        random.normal(0, 10, (40, 3, 3)),
        random.integers(0, 2, 40),
        random.random((40, 3, 2)),
        random.random((40, 3, 2)),
        random.random((40, 3, 3)),
    )
    first, second = read_mesh(mesh_bytes(mesh, materials))
    assert (first.material, second.material) == (0, 1)
    for part in (first, second):
        its = mesh.material == part.material
        assert np.allclose(part.point[part.triangle], mesh.point[its], atol=1e-5)
        assert part.light is not None
        assert part.color is not None
        lower_left = part.light[part.triangle] * [1, -1] + [0, 1]
        assert mesh.light is not None
        assert np.allclose(lower_left, mesh.light[its], atol=1e-6)
        assert mesh.color is not None
        assert np.allclose(part.color[part.triangle], mesh.color[its], atol=1e-4)
    assert first.uv is not None
    assert second.uv is None


def test_equal_corners_are_one_vertex() -> None:
    mesh = facade(4)
    assert mesh.uv is not None
    corners = Corners(mesh.points[mesh.triangles], np.zeros(32, np.int64), mesh.uv)
    (part,) = read_mesh(mesh_bytes(corners, (CampusMaterial("a", "wall", ("d",)),)))
    assert len(part.point) == 25
    assert len(part.triangle) == 32


@given(st.binary(max_size=200), st.integers(0, 400))
def test_any_bytes_are_a_mesh_or_an_error(noise: bytes, at: int) -> None:
    mesh = facade(2)
    assert mesh.uv is not None
    corners = Corners(mesh.points[mesh.triangles], np.zeros(8, np.int64), mesh.uv)
    data = mesh_bytes(corners, (CampusMaterial("a", "wall", ("d",)),))
    for damaged in (noise, data[:at] + noise + data[at + len(noise) :], data[:at]):
        try:
            read_mesh(damaged)
        except ValueError:
            continue


def test_only_the_finest_mesh_has_a_lightmap(made: Path, index: Campus) -> None:
    for each in index.objects:
        coarse, fine = (read_mesh((made / mesh.file).read_bytes()) for mesh in each.meshes)
        assert all(p.light is None and p.color is not None for p in coarse)
        assert all(p.light is not None and p.color is None for p in fine)


def test_without_lightmaps_there_are_none(plain: Path) -> None:
    campus = read_campus(plain)
    assert {t.channel for t in campus.textures} == {"d", "a", "m"}
    assert all(o.lightmap is None for o in campus.objects)
    for each in campus.objects:
        for mesh in each.meshes:
            parts = read_mesh((plain / mesh.file).read_bytes())
            assert all(p.light is None and p.color is None for p in parts)


def test_light_is_darker_where_a_wall_meets_the_lawn(made: Path, index: Campus) -> None:
    with Image.open(made / f"textures/{index.objects[0].lightmap}_512_l.jpg") as image:
        lawn = np.asarray(image, float)
    assert np.median(lawn) > 245
    assert lawn.min() < 200


def test_images_are_baseline_jpeg(made: Path) -> None:
    for file in sorted((made / "textures").iterdir()):
        data = file.read_bytes()
        assert data[:3] == b"\xff\xd8\xff"
        with Image.open(io.BytesIO(data)) as image:
            assert "progressive" not in image.info
