"""From the file to the scene: materials, images, space, notes, strictness, bad input."""

from __future__ import annotations

import contextlib
import io
import os
import pickle
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import InputError, LimitError, PtmError
from ptmtools.scene import IngestOptions, Scene, ingest
from tests.conftest import ROOT

from .conftest import FACE, QUAD, Put, noise, png

Textured = Callable[..., Path]


def rgba(alpha: int, where: tuple[slice, slice] = (slice(None), slice(None))) -> bytes:
    pixels = noise(3, 8, 4)
    pixels[..., 3] = 255
    pixels[(*where, 3)] = alpha
    return png(pixels)


def said(scene: Scene) -> list[tuple[str, str]]:
    """Codes and places of the notes, but for the guesses that every model brings."""
    guesses = ("PTM-N201", "PTM-N202", "PTM-N232", "PTM-N238")
    return [(note.code, note.place) for note in scene.notes if note.code not in guesses]


def test_a_room(textured: Textured) -> None:
    data = png(noise(1))
    path = textured("Kd 0.5 1 1\nmap_Kd wall.png", {"wall.png": data})
    scene = ingest(path, IngestOptions(up="y"))
    assert (scene.points.dtype, scene.triangles.dtype) == (np.float64, np.int32)
    assert scene.points.min(axis=0).tolist() == [-5, 0, 0]
    assert scene.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert scene.uv.tolist() == [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]
    assert scene.two_sided.all()
    assert scene.opaque.all()
    assert scene.objects == ("room",)
    (material,) = scene.materials
    assert (material.name, material.color, material.image) == ("wall", (0.5, 1, 1), 0)
    assert scene.images[0].name == "wall.png"
    assert scene.images[0].load() == data
    assert scene.files == ("room.mtl", "wall.png")
    assert said(scene) == []


def test_the_same_file_gives_the_same_scene(textured: Textured) -> None:
    path = textured("map_Kd wall.png", {"wall.png": png(noise(1))})
    first, second = (ingest(path).to_arrays() for _ in range(2))
    assert {k: v.tobytes() for k, v in first.items()} == {k: v.tobytes() for k, v in second.items()}
    assert str(path.parent).encode() not in first["about"].tobytes()


def test_a_scene_goes_to_another_process(textured: Textured) -> None:
    data = png(noise(1))
    scene = ingest(textured("map_Kd wall.png", {"wall.png": data}))
    assert pickle.loads(pickle.dumps(scene)).images[0].load() == data


@pytest.mark.parametrize(
    ("options", "size", "low"),
    [
        (IngestOptions(), [10, 4, 6], [-5, 0, -3]),
        (IngestOptions(unit="ft", up="y"), [3.048, 1.2192, 1.8288], [-1.524, 0, -0.9144]),
        (IngestOptions(unit=2, up="z"), [20, 12, 8], [-10, 0, -4]),
    ],
)
def test_space(put: Put, options: IngestOptions, size: list[float], low: list[float]) -> None:
    """A floor and two walls, far from the origin."""
    corners = [(0, 0, 0), (10, 0, 0), (10, 0, 6), (0, 0, 6), (0, 4, 0), (10, 4, 0), (10, 4, 6)]
    text = "".join(f"v {x + 5e6} {y - 70} {z + 1e6}\n" for x, y, z in corners)
    scene = ingest(put("a.obj", text + "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\n"), options)
    assert np.ptp(scene.points, axis=0) == pytest.approx(size, rel=1e-12)
    assert scene.points.min(axis=0) == pytest.approx(low, rel=1e-12)
    assert scene.space.unit_guessed is (options.unit is None)
    model = {tuple(p) for p in (np.array(corners) + [5e6, -70, 1e6]).tolist()}
    world = scene.points / scene.space.metres
    if scene.space.up == "z":
        world = np.stack([world[:, 0], -world[:, 2], world[:, 1]], axis=1)
    assert {tuple(p) for p in np.round(world + scene.space.origin, 6).tolist()} == model
    # The floor's first face looks up (or to the side) as it did in the model.
    a, b, c = scene.corners[0]
    facing = np.cross(b - a, c - a)
    assert facing[1 if scene.space.up == "y" else 2] * (1 if scene.space.up == "y" else -1) > 0


def test_guesses_are_told(put: Put) -> None:
    scene = ingest(put("a.obj", QUAD + FACE))
    messages = {note.code: note.message for note in scene.notes}
    assert messages["PTM-N201"].startswith("unit guessed: m (")
    assert messages["PTM-N201"].endswith("use --unit to override")
    guess = "up axis guessed: Z, 10 m wide and 0 m high (reasons: more level"
    assert messages["PTM-N202"].startswith(guess)
    assert not ingest(put("a.obj", QUAD + FACE), IngestOptions(unit="m", up="y")).notes


def test_tints_where_the_model_says_nothing(textured: Textured) -> None:
    image = {"a.png": png(noise(1))}
    assert ingest(textured("map_Kd a.png", image)).materials[0].color == (1, 1, 1)
    assert ingest(textured("")).materials[0].color == (0.8, 0.8, 0.8)


@pytest.mark.parametrize(
    ("mtl", "alpha", "transparent"),
    [
        ("d 0.5", 255, True),
        ("Tr 0.5", 255, True),
        ("d 1\nTr 0", 255, False),
        ("map_Kd a.png", 255, False),
        ("map_Kd a.png", 254, True),
        ("map_d a.png", 255, False),
        ("map_d a.png", 0, True),
        ("map_d gone.png", 255, True),
        ("map_d -imfchan l a.png", 255, True),
    ],
)
def test_what_never_occludes(textured: Textured, mtl: str, alpha: int, transparent: bool) -> None:
    scene = ingest(textured(mtl, {"a.png": rgba(alpha)}))
    assert scene.materials[0].transparent is transparent
    assert scene.opaque.all() != transparent


def test_only_used_texels_count(textured: Textured) -> None:
    """The hole is at the right; the face uses the left, or, moved by the material, the right."""
    image = {"a.png": rgba(0, (slice(None), slice(6, 8)))}
    face = "vt 0.2 0\nvt 0.6 0\nvt 0.6 1\nvt 0.2 1\nf 1/5 2/6 3/7 4/8\n"
    assert not ingest(textured("map_Kd a.png", image, face)).materials[0].transparent
    moved = ingest(textured("map_Kd -o 0.3 a.png", image, face))
    assert moved.materials[0].transparent
    assert said(moved) == [("PTM-N215", "room.mtl:2")]
    assert moved.uv[0, :, 0] == pytest.approx([0.5, 0.9, 0.9])


@pytest.mark.parametrize("mode", ["P", "LA", "RGBA", "L"])
def test_transparency_of_every_kind(textured: Textured, mode: str) -> None:
    stream = io.BytesIO()
    if mode == "P":
        image = Image.fromarray(np.arange(64, dtype=np.uint8).reshape(8, 8) % 4).convert("P")
        image.save(stream, "png", transparency=2)
    elif mode == "L":
        Image.new("L", (8, 8), 5).save(stream, "png", transparency=5)
    else:
        Image.new("LA", (8, 8), (5, 200)).convert(mode).save(
            stream, "tga" if mode == "RGBA" else "png"
        )
    scene = ingest(textured("map_Kd a.png", {"a.png": stream.getvalue()}))
    assert scene.materials[0].transparent


def test_clamp_and_scale(textured: Textured) -> None:
    scene = ingest(textured("map_Kd -clamp on -s 2 3 1 -o .5 a.png", {"a.png": png(noise(1))}))
    assert (scene.materials[0].wrap_s, scene.materials[0].wrap_t) == ("clamp", "clamp")
    assert scene.uv[0].tolist() == [[0.5, 0], [2.5, 0], [2.5, 3]]


def test_backslashes_case_and_ends_of_lines(put: Put) -> None:
    put("maps/Big Wall.PNG", png(noise(1)))
    put("Room.MTL", "newmtl a\r\nKd 1 1 1\r\nmap_Kd -bm 1 maps\\big wall.png\r\n")
    text = "mtllib .\\room.mtl\n" + QUAD + "usemtl a\n" + FACE
    scene = ingest(put("a.obj", text.replace("\n", "\r\n")))
    assert scene.images[0].name == "Big_Wall.png"
    assert said(scene) == []


def test_a_path_with_umlauts_and_blanks(put: Put) -> None:
    put("Große Halle/wände/Tür 1.png", png(noise(1)))
    put("Große Halle/halle.mtl", "newmtl a\nmap_Kd wände/Tür 1.png\n")
    path = put("Große Halle/Halle ä.obj", "mtllib halle.mtl\n" + QUAD + "usemtl a\n" + FACE)
    scene = ingest(str(path))
    assert scene.objects == ("Halle ä",)
    assert scene.images[0].name == "Tur_1.png"
    assert len(scene.images[0].load()) > 0


def test_names_of_images(put: Put) -> None:
    """Equal bytes are one image; names differ without regard to case or suffix."""
    names = ["a/wall.png", "b/Wall.png", "c/wall.tga", "d/same.png", "CON.png", "ä ö.png", "é.png"]
    for i, name in enumerate(names):
        put(name, png(noise(0 if name == "d/same.png" else i)))
    put("a.mtl", "".join(f"newmtl m{i}\nmap_Kd {name}\n" for i, name in enumerate(names)))
    uses = "".join(f"usemtl m{i}\nv 0 0 {i + 1}\nf 1/1 2/2 {5 + i}/3\n" for i in range(len(names)))
    scene = ingest(put("a.obj", "mtllib a.mtl\n" + QUAD + uses))
    assert [i.name for i in scene.images] == [
        "wall.png",
        "Wall_2.png",
        "wall_3.png",
        "image_CON.png",
        "a_o.png",
        "e.png",
    ]
    assert scene.materials[3].image == scene.materials[0].image == 0


def test_no_material_and_no_image_that_no_face_uses(put: Put) -> None:
    put("a.png", png(noise(1)))
    put("b.png", png(noise(2)))
    put("a.mtl", "newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\nnewmtl c\nmap_Kd no.png\n")
    text = QUAD + "o x\nusemtl a\nf 1/1 2/2 1/1\no y\nusemtl b\n" + FACE
    scene = ingest(put("a.obj", "mtllib a.mtl\n" + text))
    assert [m.name for m in scene.materials] == ["b"]
    assert [i.name for i in scene.images] == ["b.png"]
    assert scene.objects == ("y",)
    assert said(scene) == [("PTM-N214", "")]


MISSES = {
    "library": ("", "mtllib gone.mtl\n", "PTM-N203", "a.obj:1"),
    "library outside": ("", "mtllib ../../out.mtl\n", "PTM-N205", "a.obj:1"),
    "material": ("newmtl b\n", "mtllib a.mtl\n", "PTM-N207", "a.obj:10"),
    "texture": ("newmtl a\n\nmap_Kd gone.png\n", "mtllib a.mtl\n", "PTM-N204", "a.mtl:3"),
    "outside": ("newmtl a\nmap_Kd ../../out.png\n", "mtllib a.mtl\n", "PTM-N205", "a.mtl:2"),
    "not an image": ("newmtl a\nmap_Kd a.obj\n", "mtllib a.mtl\n", "PTM-N206", "a.mtl:2"),
    "empty image": ("newmtl a\nmap_Kd empty.png\n", "mtllib a.mtl\n", "PTM-N206", "a.mtl:2"),
    "cut image": ("newmtl a\nmap_Kd cut.png\n", "mtllib a.mtl\n", "PTM-N206", "a.mtl:2"),
    "line": ("newmtl a\nKd red\n", "mtllib a.mtl\n", "PTM-N214", "a.mtl:2"),
}


@pytest.mark.parametrize("name", MISSES)
def test_misses_are_told_with_their_line_and_strict_refuses_them(put: Put, name: str) -> None:
    mtl, head, code, place = MISSES[name]
    put("out.mtl", "newmtl a\n")
    put("out.png", png(noise(1)))
    put("in/deep/empty.png", b"")
    whole = png(noise(1, 64))
    put("in/deep/cut.png", whole[: len(whole) // 2])
    put("in/deep/a.mtl", mtl)
    path = put("in/deep/a.obj", head + QUAD + "usemtl a\n" + FACE)
    scene = ingest(path)
    actual = said(scene)
    assert actual[0] == (code, place)
    assert scene.images == ()
    assert scene.materials[0].image == -1
    with pytest.raises(InputError) as caught:
        ingest(path, IngestOptions(strict=True))
    assert (caught.value.code, caught.value.place) == (code.replace("N", "I"), place)
    if "outside" in name:
        assert not said(ingest(path, IngestOptions(allow_outside=True)))


def test_strict_names_the_rest(put: Put) -> None:
    put("a.mtl", "newmtl a\nmap_Kd x.png\nnewmtl b\nmap_Kd y.png\n")
    text = QUAD + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nf 1 1 1\n"
    with pytest.raises(InputError, match=r"x\.png: not found; .* y\.png: not found \[.*; degen"):
        ingest(put("a.obj", "mtllib a.mtl\n" + text), IngestOptions(strict=True))
    clean = ingest(put("b.obj", QUAD + FACE), IngestOptions(strict=True))
    assert len(clean.triangles) == 2


def test_faces_that_go_and_faces_that_stay(put: Put) -> None:
    text = QUAD + (
        "v nan 0 0\nusemtl a\nf 1 2 3\nf 2 3 1\nf 3 2 1\nf 1 2 2\nf 1 2 5\nf 1 3 4\n"
        "usemtl b\nf 1 2 3\n"
    )
    scene = ingest(put("a.obj", text))
    counts = {(note.code, note.message.split()[0]): note.count for note in scene.notes}
    assert (counts["PTM-N214", "degenerate"], counts["PTM-N210", "faces"]) == (1, 1)
    assert [note.count for note in scene.notes if note.code == "PTM-N211"] == [1, 1, 1]
    assert scene.triangles.tolist() == [[0, 1, 2], [2, 1, 0], [0, 2, 3]]
    assert scene.two_sided.tolist() == [False, False, True]
    assert [m.name for m in scene.materials] == ["a"]


@pytest.mark.parametrize("far", ["1e5", "1e7", "1e308"])
def test_a_stray_face_is_left_out_and_told(put: Put, far: str) -> None:
    """The rest of the scene, and so each cell, is that of the model without it."""
    text = (ROOT / "sample_data/two_rooms/two_rooms.obj").read_text("utf-8")
    clean = ingest(put("a.obj", text), IngestOptions(unit="m", up="y"))
    stray = f"\nv {far} 0 0\nv {far} 1 0\nv {far} 0 1\nf -1 -2 -3\n"
    scene = ingest(put("b.obj", text + stray), IngestOptions(unit="m", up="y"))
    assert np.array_equal(scene.corners, clean.corners)
    assert scene.tolerance == clean.tolerance
    [note] = [note for note in scene.notes if note.code == "PTM-N210"]
    assert note.count == 1
    assert f"one with a corner at {float(far):.6g}, 0, " in note.message
    assert f"{100 / (len(clean.triangles) + 1):.2g}% of all" in note.message


def test_coordinates_that_are_not_finite(put: Put) -> None:
    scene = ingest(put("a.obj", QUAD + "vt nan 0\nvt inf 1\nf 1/1 2/5 3/6\n"))
    assert np.isfinite(scene.uv).all()
    assert any("texture coordinates" in note.message for note in scene.notes)


def test_coordinates_far_away_come_near_where_the_texture_repeats(textured: Textured) -> None:
    """As of map projections: single precision has no texels there."""
    image = {"a.png": png(noise(1))}
    scene = ingest(textured("map_Kd -o 5400000.25 -7654321.5 0 a.png", image))
    assert scene.uv[0].tolist() == [[0.25, 0.5], [1.25, 0.5], [1.25, 1.5]]
    held = ingest(textured("map_Kd -clamp on -o 5400000.25 3 0 a.png", image))
    assert held.uv[0].tolist() == [[5400000.25, 3], [5400001.25, 3], [5400001.25, 4]]


def test_coordinates_beyond_all_precision(put: Put) -> None:
    scene = ingest(put("a.obj", QUAD + "vt 0 1e300\nf 1/1 2/5 3/3\nf 1/1 3/3 4/4\n"))
    assert scene.uv.tolist() == [[[0, 0]] * 3, [[0, 0], [1, 1], [0, 1]]]
    assert any("texture coordinates" in note.message for note in scene.notes)


def test_one_triangle(put: Put) -> None:
    assert len(ingest(put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")).triangles) == 1


@pytest.mark.parametrize("scale", ["1e-30", "1e-3", "1", "1e6"])
def test_tiny_and_huge_models_come_out_alike(put: Put, scale: str) -> None:
    factor = float(scale)
    corners = [(0, 0, 0), (10, 0, 0), (10, 0, 8), (0, 0, 8), (0, 3, 0), (10, 3, 0)]
    text = "".join(f"v {x * factor!r} {y * factor!r} {z * factor!r}\n" for x, y, z in corners)
    path = put("a.obj", text + "f 4 3 2 1\nf 1 2 6 5\n")
    scene = ingest(path, IngestOptions(unit=1 / factor))
    assert np.ptp(scene.points, axis=0) == pytest.approx([10, 3, 8], rel=1e-9)
    assert scene.space.up == "y"


BAD: dict[str, tuple[str, str, bytes]] = {
    "empty": ("a.obj", "PTM-I243", b""),
    "nothing in it": ("a.obj", "PTM-I247", b"\n\n# nothing\n"),
    "binary": ("a.obj", "PTM-I245", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(64)),
    "prose": ("a.obj", "PTM-I247", b"Dear Sir or Madam,\n"),
    "utf-16": ("a.obj", "PTM-I245", "v 0 0 0\nv 1 0 0\n".encode("utf-16")),
    "no faces": ("a.obj", "PTM-I247", QUAD.encode()),
    "only nan": ("a.obj", "PTM-I247", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    "only a line": ("a.obj", "PTM-I247", b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n"),
    "only a point": ("a.obj", "PTM-I247", b"v 1 1 1\nf 1 1 1\n"),
    "too large": ("a.obj", "PTM-L204", b"v 0 0 0\nv 1e300 0 0\nv 0 1e300 0\nf 1 2 3\n"),
    "beyond float64": ("a.obj", "PTM-L204", b"v -1e308 0 0\nv 1e308 0 0\nv 0 1 0\nf 1 2 3\n"),
    "too small": ("a.obj", "PTM-L204", b"v 0 0 0\nv 1e-30 0 0\nv 0 1e-30 0\nf 1 2 3\n"),
    "unknown": ("a.dwg", "PTM-I243", b"AC1032"),
    "no suffix": ("a", "PTM-I243", b"?"),
    "bad ply": ("a.ply", "PTM-I254", b"ply\nformat ascii 1.0\nelement vertex 3\n"),
    "bad stl": ("a.stl", "PTM-I", b"solid nothing\nendsolid\n"),
    "bad gltf": ("a.gltf", "PTM-I249", b"{"),
    "bad glb": ("a.glb", "PTM-I249", b"glTF"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files(put: Put, name: str) -> None:
    file, code, data = BAD[name]
    path = put(file, data)
    with pytest.raises(InputError) as caught:
        ingest(path)
    assert caught.value.code.startswith(code)
    assert caught.value.file == str(path)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, LimitError) == ("L" in code[4])


def test_supported_formats_are_listed(put: Put) -> None:
    with pytest.raises(InputError, match=r"\.obj \.glb \.gltf \.ply"):
        ingest(put("a.dwg", b"x"))


def test_bad_places_and_options(put: Put, tmp_path: Path) -> None:
    path, circle, listening = put("a.obj", QUAD + FACE), tmp_path / "b.obj", tmp_path / "c.obj"
    circle.symlink_to(circle)
    # The name of a socket may have about a hundred characters.
    with contextlib.closing(socket.socket(socket.AF_UNIX)) as unheard:
        unheard.bind(os.path.relpath(listening))
    cases: list[tuple[Path | str, dict[str, Any], str]] = [
        (tmp_path, {}, "PTM-I122"),
        (tmp_path / "gone.obj", {}, "PTM-I120"),
        ("a\0.obj", {}, "PTM-I120"),
        (circle, {}, r"no such file.*PTM-I120"),
        (listening, {}, r"not a regular file.*PTM-I120"),
        (path, {"unit": "mile"}, "PTM-I111"),
        (path, {"up": "x"}, "PTM-I111"),
    ]
    for place, options, code in cases:
        with pytest.raises(PtmError, match=code):
            ingest(place, IngestOptions(**options))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read all")
def test_a_folder_that_may_not_be_read(tmp_path: Path) -> None:
    (tmp_path / "a.obj").mkdir(0o300)
    with pytest.raises(InputError, match="PTM-I122"):
        ingest(tmp_path / "a.obj")


def test_progress_ends_at_its_total(textured: Textured) -> None:
    steps: list[tuple[int, int, str]] = []
    ingest(textured(""), progress=lambda *step: steps.append(step))
    assert {what for _, _, what in steps} == {"reading", "images", "materials"}
    last = {what: (done, total) for done, total, what in steps}
    assert all(done == total for done, total in last.values())
