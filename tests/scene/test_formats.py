"""Formats that are read through trimesh and pymeshlab."""

from __future__ import annotations

import sys
from collections.abc import Callable
from ctypes.util import find_library
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from ptmtools.errors import InputError, LimitError, MissingComponentError
from ptmtools.scene import IngestOptions, ingest, sandbox as apart

from .conftest import Put, noise, png, read_source

CORNERS = "0 0 0\n10 0 0\n10 4 0\n0 4 0\n"
STL = "solid wall\n" + "".join(
    f"facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n"
    for corners in (
        "vertex 0 0 0\nvertex 10 0 0\nvertex 10 4 0\n",
        "vertex 0 0 0\nvertex 10 4 0\nvertex 0 4 0\n",
    )
)
PLY = (
    "ply\nformat ascii 1.0\n{more}element vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\n{coords}end_header\n"
)
MODELS = {
    "wall.stl": STL + "endsolid wall\n",
    "wall.off": f"OFF\n4 2 0\n{CORNERS}3 0 1 2\n3 0 2 3\n",
    "mixed.off": f"OFF\n4 2 0\n{CORNERS}4 0 1 2 3\n3 0 1 2\n",
    "wall.ply": PLY.format(more="", coords="") + CORNERS + "4 0 1 2 3\n",
}


@pytest.fixture
def pymeshlab(require: Callable[[str, str], None]) -> None:
    if "linux" in sys.platform and find_library("OpenGL") is None:
        require("OpenGL", "apt install libopengl0 libgl1")
    if find_spec("pymeshlab") is None:
        require("pymeshlab", "pip install pymeshlab")


@pytest.mark.parametrize("name", MODELS)
def test_a_wall(put: Put, pymeshlab: None, name: str) -> None:
    scene = ingest(put(name, MODELS[name]))
    assert len(scene.triangles) == 2
    assert scene.two_sided.all()
    assert np.ptp(scene.points, axis=0).max() == 10
    assert sorted(np.ptp(scene.points, axis=0)) == [0, 4, 10]
    assert scene.materials[0].name in ("default", "material_0")


def textured_ply(put: Put) -> Path:
    """Two faces with an image each."""
    put("maps/a.png", png(noise(1)))
    put("maps/b.png", png(noise(2)))
    header = PLY.format(
        more="comment TextureFile maps/a.png\ncomment TextureFile maps/b.png\n",
        coords="property list uchar float texcoord\nproperty int texnumber\n",
    ).replace("face 1", "face 2")
    faces = "3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 1 1 0 1 1\n"
    return put("wall.ply", header + CORNERS + faces)


def test_a_textured_ply_keeps_every_image(put: Put, pymeshlab: None) -> None:
    scene = ingest(textured_ply(put))
    assert [i.name for i in scene.images] == ["a.png", "b.png"]
    assert scene.materials[int(scene.triangle_material[1])].image == 1
    assert scene.uv[0].tolist() == [[0, 0], [1, 0], [1, 1]]


@pytest.mark.parametrize("names", ["s t", "u v", "texture_u texture_v"])
def test_a_ply_with_coordinates_of_vertices(
    put: Put, monkeypatch: pytest.MonkeyPatch, names: str
) -> None:
    """Its image is on all faces."""
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    put("maps/a b.png", png(noise(1)))
    more = "comment TextureFile maps/a b.png\n"
    first, second = names.split()
    axis = "property float z\n"
    more_axes = f"{axis}property float {first}\nproperty float {second}\n"
    head = PLY.format(more=more, coords="").replace(axis, more_axes)
    text = f"{head}0 0 0 0 0\n10 0 0 2 0\n10 4 0 2 1\n0 4 0 0 1\n4 0 1 2 3\n"
    scene = ingest(put("wall.ply", text), IngestOptions(unit="m", up="y"))
    assert [image.name for image in scene.images] == ["a_b.png"]
    assert scene.materials[0].image == 0
    places = (scene.corners - scene.points.min(axis=0)).reshape(-1, 3)
    assert scene.uv.reshape(-1, 2) == pytest.approx(places[:, :2] / [5, 4])
    missing = ingest(put("wall.ply", text.replace("a b.png", "c.png")))
    assert "PTM-N204" in {note.code for note in missing.notes}


def test_the_case_of_a_ply(shared: Path) -> None:
    scene = ingest(shared / "cases/ply-vertex-uv/m.ply")
    assert [image.name for image in scene.images] == ["a.png"]
    assert len(scene.triangles) == 12
    assert scene.uv.max() == 8


def test_without_pymeshlab(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(MissingComponentError, match=r"pip install pymeshlab.*PTM-M100"):
        ingest(put("a.3ds", "x"))


def test_plain_models_do_not_need_pymeshlab(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    assert len(ingest(put("wall.stl", MODELS["wall.stl"])).triangles) == 2


#: Heads that promise more than there is: of each format what its reader counts by.
LIARS = {
    "vertices.ply": PLY.format(more="", coords="")
    .replace("ascii", "binary_little_endian")
    .replace("vertex 4", "vertex 2000000000"),
    "faces.ply": PLY.format(more="", coords="")
    .replace("ascii", "binary_little_endian")
    .replace("face 1", "face 1000000000000000000"),
    "below zero.ply": PLY.format(more="", coords="")
    .replace("ascii", "binary_little_endian")
    .replace("vertex 4", "vertex -1"),
    "vertices.off": f"OFF\n2000000000 1 0\n{CORNERS}3 0 1 2\n",
    "triangles.stl": "x" * 80 + "\0\0\0\x7f" + "\0" * 50,
    "no.dae": "<COLLADA><",
    "bomb.dae": '<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY a{i} "{f"&a{i - 1 if i else chr(0)};" * 10}">' for i in range(9)).replace(
        "\0", ""
    )
    + "]><COLLADA>&a8;</COLLADA>",
}


@pytest.mark.parametrize("name", LIARS)
def test_heads_that_lie(put: Put, pymeshlab: None, name: str) -> None:
    with pytest.raises(InputError, match=r"PTM-I2(54|47)") as caught:
        ingest(put(name, LIARS[name]))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("import os; os.abort()", "it ended with status -6"),
        ("print('noise')", "it ended with status 0"),
        ("import time; time.sleep(60)", "it did not end in 1 s"),
        ('print(\'noise\\nptmtools answers: {"fault": "no"}\')', "cannot read it (no)"),
        (
            'print(\'ptmtools answers: {"error": ["InputError", {"code": "PTM-I254", \''
            '\'"message": "is no good", "file": "a.3ds"}]}\')',
            "a.3ds: is no good",
        ),
    ],
)
def test_a_reader_that_fails_does_no_harm(
    put: Put, pymeshlab: None, monkeypatch: pytest.MonkeyPatch, program: str, message: str
) -> None:
    path = put("a.3ds", "x")
    command = put("python", f"#!{sys.executable}\n{program}\n")
    command.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(command))
    monkeypatch.setattr(apart, "_SECONDS", 1.0)
    with pytest.raises(InputError, match=r"a\.3ds.*PTM-I254") as caught:
        ingest(path)
    assert message in str(caught.value)


def test_nothing_is_imported_from_the_present_folder(
    put: Put, pymeshlab: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = textured_ply(put)
    put("json.py", "raise SystemExit('from the folder of the model')")
    put("pymeshlab.py", "raise SystemExit('from the folder of the model')")
    monkeypatch.chdir(path.parent)
    assert len(ingest("wall.ply").triangles) == 2


@pytest.mark.filterwarnings("error")
def test_infinite_coordinates_are_told_of_by_their_code_alone(put: Put) -> None:
    head = (
        PLY.format(more="", coords="").replace("vertex 4", "vertex 5").replace("face 1", "face 2")
    )
    scene = ingest(put("wall.ply", f"{head}{CORNERS}1 inf 0\n4 0 1 2 3\n3 0 1 4\n"))
    assert len(scene.triangles) == 2
    assert "PTM-N210" in {note.code for note in scene.notes}


@pytest.mark.parametrize("name", ["wall.stl", "mixed.off"])
def test_triangles_are_counted(put: Put, pymeshlab: None, name: str) -> None:
    path = put(name, MODELS[name])
    assert len(read_source(path, max_triangles=3).triangles) in (2, 3)
    with pytest.raises(LimitError, match="PTM-L203"):
        read_source(path, max_triangles=1)
