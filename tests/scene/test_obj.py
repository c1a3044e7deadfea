"""The OBJ reader: every form of statement, what is skipped, and errors that name the line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from ptmtools.errors import InputError
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.obj import read_obj
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.source import ModelSource

from .conftest import QUAD


def read(path: Path) -> ModelSource:
    return read_obj(path, IngestNotes(path), IngestOptions())


def codes(path: Path) -> dict[str, int]:
    findings = IngestNotes(path)
    read_obj(path, findings, IngestOptions())
    return {note.code: note.count for note in findings.entries}


@pytest.mark.parametrize(
    ("face", "textured"),
    [
        ("f 1 2 3", False),
        ("f 1/1 2/2 3/3", True),
        ("f 1//9 2//9 3//9", False),
        ("f 1/1/9 2/2/9 3/3/9", True),
        ("f -4/-4 -3/-3 -2/-2", True),
        ("f 1/1 \\\n 2/2 \\\n 3/3", True),
        ("f 1/1 2/2 3/3  # the first", True),
        ("\tf\t1/1\t2/2\t3/3", True),
    ],
)
def test_forms_of_a_face(put: Callable[..., Path], face: str, textured: bool) -> None:
    source = read(put("a.obj", QUAD + face + "\n"))
    assert source.triangles.tolist() == [[0, 1, 2]]
    expected = [[0, 0], [1, 0], [1, 1]] if textured else [[0, 0]] * 3
    assert source.uv[0].tolist() == expected


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
def test_line_ends(put: Callable[..., Path], ends: str) -> None:
    text = (QUAD + "usemtl a b\nf 1 2 3\nf 1 3 4").replace("\n", ends)
    source = read(put("a.obj", text.encode()))
    assert len(source.triangles) == 2
    assert source.materials[0].name == "a b"


def test_vertices_may_carry_colours_and_come_after_the_faces(put: Callable[..., Path]) -> None:
    source = read(put("a.obj", "f 1 2 3\nv 0 0 0 1 0 0\nv 1 0 0 1 .5 0\nv 0 1 0 1 1 1\n"))
    assert source.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_objects_and_groups(put: Callable[..., Path]) -> None:
    text = QUAD + (
        "f 1 2 3\no house\nf 1 2 3\ng wall\nf 1 2 3\ng roof\nf 1 2 3\n"
        "o garden\nf 1 2 3\no house\nf 1 2 3\n"
    )
    source = read(put("plot.obj", text))
    names = [source.objects[i] for i in source.triangle_object]
    assert names == ["plot", "house", "house/wall", "house/roof", "garden", "house"]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_names_with_umlauts(put: Callable[..., Path], encoding: str) -> None:
    """The last letter of 'à' ends in a byte that Latin-1 takes for a blank."""
    put("Möbel.mtl", "newmtl Tür à\nKd 1 0 0\n".encode("utf-8" if "u" in encoding else encoding))
    text = "mtllib Möbel.mtl\no Flügel à\n" + QUAD + "usemtl Tür à\nf 1 2 3\n"
    source = read(put("a.obj", text.encode(encoding)))
    assert source.objects == ("Flügel à",)
    assert [(m.name, m.color) for m in source.materials] == [("Tür à", (1.0, 0.0, 0.0))]


@pytest.mark.parametrize(
    ("line", "files"),
    [
        ("mtllib one.mtl two.mtl", ["one.mtl", "two.mtl"]),
        ("mtllib my walls.mtl", ["my walls.mtl"]),
        ("mtllib my walls.mtl two.mtl", ["my walls.mtl", "two.mtl"]),
        ("mtllib materials", ["materials"]),
    ],
)
def test_several_libraries_and_names_with_blanks(
    put: Callable[..., Path], line: str, files: list[str]
) -> None:
    for name in files:
        put(name, f"newmtl {name}\nKd 1 0 0\n")
    uses = "".join(f"usemtl {name}\nf 1 2 3\n" for name in files)
    source = read(put("a.obj", f"{line}\n{QUAD}{uses}"))
    assert [m.color for m in source.materials] == [(1.0, 0.0, 0.0)] * len(files)


def test_what_is_skipped_is_counted(put: Callable[..., Path]) -> None:
    path = put("a.obj", QUAD + "vn 0 0 1\ns off\nl 1 2\nl 2 3\nblah 1\nf 1 2\nf 1 2 3\n")
    findings = IngestNotes(path)
    read_obj(path, findings, IngestOptions())
    printed = {(n.code, n.place): n.count for n in findings.entries}
    assert printed == {
        ("PTM-N215", "a.obj:11"): 2,
        ("PTM-N215", "a.obj:13"): 1,
        ("PTM-N214", "a.obj:14"): 1,
    }


@pytest.mark.parametrize(
    ("text", "place", "code"),
    [
        ("v 0 0 0\nv 1 0\n", "line 2", "PTM-I245"),
        ("v 0 0 0\nv 1 0 O\n", "line 2", "PTM-I245"),
        ("v 1,5 0 0\n", "line 1", "PTM-I245"),
        ("vt\n", "line 1", "PTM-I245"),
        (QUAD + "f 1 2 x\n", "line 9", "PTM-I245"),
        (QUAD + "f 0 1 2\n", "line 9", "PTM-I245"),
        (QUAD + "f -1 -2 -5\n", "line 9", "PTM-I245"),
        (QUAD + "f 1 2 3\n\nf 1 2 5\n", "line 11", "PTM-I245"),
        (QUAD + "f 1/1 2/2 3/5\n", "line 9", "PTM-I245"),
        (QUAD + "f 1 2 99999999999999999999\n", "line 9", "PTM-I245"),
        (QUAD + "\0\0\0\0\n", "line 9", "PTM-I245"),
        (QUAD, None, "PTM-I247"),
        ("once upon a time\n", "line 1", "PTM-I247"),
    ],
)
def test_errors_name_the_line(
    put: Callable[..., Path], text: str, place: str | None, code: str
) -> None:
    with pytest.raises(InputError) as caught:
        read(put("a.obj", text))
    assert (caught.value.place, caught.value.code) == (place, code)


def test_textured_faces_without_coordinates_are_told(
    textured: Callable[..., Path],
) -> None:
    path = textured("map_Kd a.png", {"a.png": b"x"}, "f 1/1 2/2 3/3\nf 1 3 4\n")
    assert codes(path)["PTM-N229"] == 1


number = st.floats(-1e6, 1e6, allow_nan=False).map(lambda x: round(x, 6))


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_what_is_written_is_read(data: st.DataObject, tmp_path: Path) -> None:
    points = data.draw(st.lists(st.tuples(number, number, number), min_size=3, max_size=12))
    coords = data.draw(st.lists(st.tuples(number, number), min_size=1, max_size=12))
    corner = st.tuples(st.integers(0, len(points) - 1), st.none() | st.integers(0, len(coords) - 1))
    faces = data.draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=20))
    names = data.draw(
        st.lists(st.sampled_from(["a", "b c", "ü", "#1"]), min_size=len(faces), max_size=len(faces))
    )
    ends = data.draw(st.sampled_from(["\n", "\r\n", "  \n"]))
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points] + [f"vt {u!r} {v!r}" for u, v in coords]
    for name, face in zip(names, faces, strict=True):
        words = []
        for p, t in face:
            if data.draw(st.booleans()):
                words.append(f"{p + 1}" if t is None else f"{p + 1}/{t + 1}")
            else:
                back = p - len(points)
                words.append(f"{back}//1" if t is None else f"{back}/{t - len(coords)}/1")
        lines += [f"o {name}", f"usemtl {name}", "f " + " ".join(words)]
    path = tmp_path / "drawn.obj"
    path.write_bytes((ends.join(lines) + ends).encode())

    source = read(path)
    assert source.points.tolist() == [list(p) for p in points]
    assert source.triangles.tolist() == [[p for p, _ in face] for face in faces]
    expected = [[(0.0, 0.0) if t is None else coords[t] for _, t in face] for face in faces]
    assert np.array_equal(source.uv, np.array(expected, dtype=float))
    assert [source.objects[i] for i in source.triangle_object] == names
    assert [source.materials[i].name for i in source.triangle_material] == names
