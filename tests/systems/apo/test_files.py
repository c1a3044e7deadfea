"""Folders of octree textures: prefixes, damage, bad input, the command, and files of before."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools import schemas
from ptmtools.cli.main import main
from ptmtools.diagnostics import FOLDER_CODES, ValidationReport
from ptmtools.errors import InputError, PtmError
from ptmtools.executor import Executor
from ptmtools.texture.model import Limits
from ptmtools_systems.apo.checking import check_folder, describe
from ptmtools_systems.apo.files import (
    COLORS,
    FORM,
    INDEX,
    MESH,
    NORMALS,
    OBJ,
    files_of,
    inflate_texels,
    read_index,
    read_mesh,
    read_octree,
)
from ptmtools_systems.apo.making import make_apo
from ptmtools_systems.apo.model import ApoOptions
from ptmtools_systems.apo.octree import fault_of
from ptmtools_systems.schemas import APO
from tests.systems.apo.building import nodes, octree_of
from tests.systems.apo.meshes import ply, scene_of, sphere

VECTORS = Path(__file__).resolve().parent / "vectors"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    points, triangles = sphere(4, 0.05)
    color = (points[triangles] * 100 + 128).astype(np.uint8)
    options = ApoOptions(faces=200, depth=6, error=0.2, color=True)
    made = make_apo(scene_of(points, triangles, color), options, Executor())
    folder = tmp_path_factory.mktemp("apo") / "ball.apo"
    FORM.write(folder, files_of(made))
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "ball.apo"))


def check(folder: Path) -> ValidationReport:
    return check_folder(folder, Limits())


# What was written can be read, whole, in part, and level by level.


def test_every_prefix_of_whole_levels_inflates_by_itself(written: Path) -> None:
    index, data = read_index(written), (written / NORMALS).read_bytes()
    whole = read_octree(written)
    assert index.normals["ends"][-1] == len(data)
    for k, end in enumerate(index.normals["ends"]):
        # By any inflater, which knows nothing of levels.
        assert (
            zlib.decompressobj().decompress(data[:end])
            == whole.texels[: index.start[k + 1]].tobytes()
        )
        part = read_octree(written, k + 1)
        assert np.array_equal(part.texels, whole.texels[: index.start[k + 1]])
        assert part.levels == k + 1


def test_every_level_inflates_without_those_before_it(written: Path) -> None:
    index, data = read_index(written), (written / NORMALS).read_bytes()
    texels = read_octree(written).texels
    for k, end in enumerate(index.normals["ends"]):
        begin = index.normals["ends"][k - 1] if k else 2  # behind the head of the stream
        raw = zlib.decompressobj(-zlib.MAX_WBITS).decompress(data[begin:end])
        assert raw == texels[index.start[k] : index.start[k + 1]].tobytes()


def test_any_truncation_decodes_to_the_levels_that_are_whole(written: Path) -> None:
    index, data = read_index(written), (written / NORMALS).read_bytes()
    for cut in range(len(data) + 1):
        there = sum(end <= cut for end in index.normals["ends"])
        if there:
            inflate_texels(data[:cut], index.start[: there + 1], index.normals)
        if there < index.levels:
            with pytest.raises(InputError, match=f"level {there}"):
                inflate_texels(data[:cut], index.start[: there + 2], index.normals)


def test_the_mesh_comes_back(written: Path) -> None:
    import trimesh

    mesh, index = read_mesh(written), read_index(written)
    assert len(mesh.triangles) == index.mesh["faces"] <= 200
    other = trimesh.load(written / MESH, force="mesh", process=False)
    np.testing.assert_allclose(other.vertices, mesh.points)
    assert np.array_equal(other.faces, mesh.triangles)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, rtol=1e-5)
    text = trimesh.load(written / OBJ, force="mesh", process=False)
    assert len(text.faces) == len(mesh.triangles)
    np.testing.assert_allclose(text.bounds, other.bounds)


def test_the_index_matches_its_schema_and_says_what_it_was_made_with(written: Path) -> None:
    document = schemas.read((written / INDEX).read_bytes(), APO)
    assert document["options"]["error"] == 0.2
    assert document["options"]["density"] == ApoOptions().density
    assert document["source"]["triangles"] == 5120
    assert sum(document["levels"]) == len(read_octree(written).texels)


@given(nodes(4))
def test_an_octree_written_by_hand_has_no_fault(root: Any) -> None:
    assert fault_of(octree_of(root)) is None


@settings(max_examples=300)
@given(st.data())
def test_a_flag_or_an_address_that_is_wrong_is_found(data: Any) -> None:
    octree = octree_of(data.draw(nodes(3)))
    texels = octree.texels
    # Which texels are pointers, in which all four bytes tell; of the others only A does.
    pointer = np.zeros(len(texels), bool)
    at = 0
    while at < len(texels):
        if texels[at, 3]:
            pointer[at + 1] = True
        at += 1 + int(texels[at, 3] > 0)
    k = data.draw(st.integers(0, len(texels) - 1))
    c = data.draw(st.integers(0, 3)) if pointer[k] else 3
    texels[k, c] ^= 1 << data.draw(st.integers(0, 7))
    assert fault_of(octree) is not None


# A check finds what is planted.


def test_a_folder_without_fault(written: Path) -> None:
    report = check(written)
    assert report.issues == ()
    assert report.files == 5
    assert report.bytes == sum(file.stat().st_size for file in written.iterdir())


def edit(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    document = json.loads((folder / INDEX).read_text())
    change(document)
    (folder / INDEX).write_text(json.dumps(document))


def flip(file: Path, at: int) -> None:
    data = bytearray(file.read_bytes())
    data[at] ^= 0x10
    file.write_bytes(data)


def rewritten(folder: Path, change: Callable[[np.ndarray], object]) -> None:
    """Other texels, in a stream that is in order."""
    octree = read_octree(folder)
    texels = octree.texels.copy()
    change(texels)
    from ptmtools_systems.apo.files import encode_stream

    data, levels = encode_stream(texels, octree)
    (folder / NORMALS).write_bytes(data)
    edit(folder, lambda d: d["normals"].update(levels))


def swap_child(texels: np.ndarray) -> None:
    texels[1, 0] += 1


#: Kinds of findings: the code, and a pattern of their messages.
KINDS = {
    "missing": ("PTM-D803", "is missing|cannot be read"),
    "index": ("PTM-D800", ""),
    "stream": ("PTM-D804", "is damaged|before it is whole|the last level"),
    "order": ("PTM-D804", "texels instead of|first child|a node is a leaf"),
    "mesh": ("PTM-D804", "than in apo.json|GLB|faces"),
    "outside": ("PTM-D804", "outside of the cube"),
    "stray": ("PTM-D806", "is not part of"),
}
PLANTED: dict[str, list[Callable[[Path], object]]] = {
    "missing": [
        lambda f: (f / NORMALS).unlink(),
        lambda f: (f / OBJ).unlink(),
        lambda f: ((f / MESH).unlink(), (f / MESH).mkdir()),
        lambda f: ((f / OBJ).unlink(), (f / OBJ).symlink_to("/etc/hostname")),
    ],
    "index": [
        lambda f: (f / INDEX).write_text("{"),
        lambda f: edit(f, lambda d: d["levels"].append(3)),
        lambda f: edit(f, lambda d: d.update(schema=2)),
        lambda f: edit(f, lambda d: d["cube"].update(side=0)),
        lambda f: edit(f, lambda d: d["cube"].update(side=1e-308)),
        lambda f: edit(f, lambda d: d["cube"]["low"].__setitem__(1, -1e308)),
        lambda f: edit(f, lambda d: d["normals"]["ends"].__setitem__(-1, 10**30)),
        lambda f: edit(f, lambda d: d["normals"]["ends"].__setitem__(-1, 4 * 10**9)),
    ],
    "stream": [
        lambda f: flip(f / NORMALS, -20),
        lambda f: flip(f / COLORS, 40),
        lambda f: (f / NORMALS).write_bytes((f / NORMALS).read_bytes() + b"\0"),
        lambda f: (f / NORMALS).write_bytes((f / NORMALS).read_bytes()[:-9]),
        lambda f: edit(f, lambda d: d["normals"]["crc32"].__setitem__(2, 7)),
    ],
    "order": [
        lambda f: rewritten(f, swap_child),
        lambda f: rewritten(f, lambda t: t.__setitem__((len(t) - 1, 3), 1)),
    ],
    "mesh": [
        lambda f: flip(f / MESH, -5),
        lambda f: edit(f, lambda d: d["mesh"].update(faces=7)),
    ],
    "outside": [lambda f: edit(f, lambda d: d["cube"].update(side=d["cube"]["side"] / 2))],
    "stray": [lambda f: (f / "notes.txt").write_text("mine")],
}


def test_every_code_is_planted() -> None:
    assert sorted(PLANTED) == sorted(KINDS)
    of_images = {"PTM-D713", "PTM-D808"}
    assert {code for code, _ in KINDS.values()} | of_images == set(FOLDER_CODES)


@pytest.mark.parametrize(
    ("kind", "number"), [(kind, k) for kind, ways in PLANTED.items() for k in range(len(ways))]
)
def test_damage_is_found(folder: Path, kind: str, number: int) -> None:
    PLANTED[kind][number](folder)
    code, pattern = KINDS[kind]
    messages = [issue.message for issue in check(folder).issues if issue.code == code]
    assert any(re.search(pattern, message) for message in messages), messages


def test_damaged_indices_of_any_kind(folder: Path) -> None:
    """No traceback, whatever the bytes of the index."""
    data = (folder / INDEX).read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(300):
        bad = bytearray(data)
        for at in rng.integers(0, len(bad), 3):
            bad[at] = rng.integers(0, 256)
        (folder / INDEX).write_bytes(bad)
        check(folder)


# The command.


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ply(tmp_path_factory.mktemp("model") / "ball.ply", *sphere(4, 0.05))


def test_from_a_mesh_to_a_picture(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "ball.apo"
    view = tmp_path / "view.png"
    options = ["--faces", 300, "--depth", 7, "--error", 0.2, "--up", "y", "--unit", "m"]
    assert run("apo", model, "-o", target, *options) == 0
    printed = capsys.readouterr()
    assert "5,120 triangles → 300 faces" in printed.out
    assert printed.err == ""
    assert run("validate", target) == 0
    assert run("info", target) == 0
    assert "octree texture" in capsys.readouterr().out
    small = ["--width", 64, "--height", 48, "--backend", "embree"]
    assert run("render", target, "-o", view, "--levels", 3, *small) == 0
    assert "3 of 5 levels" in capsys.readouterr().out
    from PIL import Image

    assert Image.open(view).size == (64, 48)
    assert run("render", target, "-o", view, *small) == 4  # it exists
    assert run("apo", model, "-o", target, *options) == 4
    before = {file.name: file.read_bytes() for file in target.iterdir()}
    assert run("apo", model, "-o", target, *options, "-j", 1, "--force") == 0
    assert before == {file.name: file.read_bytes() for file in target.iterdir()}


def test_a_mesh_whose_error_is_not_known(written: Path, tmp_path: Path) -> None:
    made = make_apo(scene_of(*sphere(3)), ApoOptions(faces=100, depth=4), Executor())
    FORM.write(tmp_path / "a.apo", files_of(replace(made, deviation=float("nan"))))
    assert check(tmp_path / "a.apo").ok
    assert "unknown" in describe(tmp_path / "a.apo")[0][0]
    space = read_index(tmp_path / "a.apo").document["space"]
    assert space == {"origin": [0, 0, 0], "unit": 1, "up": "y"}


def test_a_picture_and_the_record(
    written: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    view = tmp_path / "view.png"
    small = ["--width", 8, "--height", 8, "--backend", "embree"]
    assert run("render", written, "-o", view, "--json", *small) == 0
    printed = capsys.readouterr()
    assert (json.loads(printed.out)["file"], printed.err) == (str(view), "")
    drawn = view.read_bytes()
    assert run("apo", written, "--render", view, "--json", "--force", *small) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["picture"]["file"] == str(view)
    assert printed.err == "ptm: note: --render of `ptm apo` is now `ptm render DIR -o VIEW.png`\n"
    assert view.read_bytes() == drawn
    assert run("apo", written, "--render", view, "--force", "--faces", 9) == 2
    assert run("apo", tmp_path, "--render", view, "--force") == 3


def test_the_folder_lies_beside_the_mesh_unless_it_is_named(model: Path, tmp_path: Path) -> None:
    mesh = Path(shutil.copy(model, tmp_path))
    assert run("apo", mesh, "--faces", 100, "--depth", 3, "-q") == 0
    assert check(tmp_path / "ball.apo").ok


def bad_inputs(model: Path, folder: Path, tmp_path: Path) -> list[tuple[list[Any], str]]:
    text = tmp_path / "text.txt"
    text.write_text("no mesh")
    torn = tmp_path / "torn.ply"
    torn.write_bytes(model.read_bytes()[:-100])
    empty = tmp_path / "empty.obj"
    empty.write_text("# nothing\n")
    flat = tmp_path / "flat.obj"
    flat.write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    nan = tmp_path / "nan.obj"
    nan.write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    own = tmp_path / "own"
    own.mkdir()
    (own / "thesis.doc").write_text("mine")
    mixed = Path(shutil.copytree(folder, tmp_path / "mixed.apo"))
    (mixed / "thesis.doc").write_text("mine")
    view = tmp_path / "view.png"

    def damaged(name: str, change: Callable[[Path], object]) -> Path:
        copy = Path(shutil.copytree(folder, tmp_path / name))
        change(copy)
        return copy

    new = tmp_path / "new"
    return [
        (["apo", tmp_path / "absent.ply"], "PTM-I"),
        (["apo", text, "-o", new], "PTM-I"),
        (["apo", torn, "-o", new], "PTM-I"),
        (["apo", empty, "-o", new], "PTM-I"),
        (["apo", flat, "-o", new], "PTM-I247"),
        (["apo", nan, "-o", new], "PTM-I247"),
        (["apo", model, "-o", new, "--error", "-1"], "PTM-I111"),
        (["apo", model, "-o", new, "--depth", "0"], "PTM-I111"),
        (["apo", model, "-o", new, "--depth", "40"], "PTM-I111"),
        (["apo", model, "-o", new, "--density", "nan"], "PTM-I111"),
        (["apo", model, "-o", new, "--faces", "1"], "PTM-I111"),
        (["apo", model, "-o", own], "PTM-O010"),
        (["apo", model, "-o", own, "--force"], "PTM-O010"),
        (["apo", model, "-o", mixed, "--force"], "PTM-O010"),
        (["apo", model, "-o", model], "PTM-O010"),
        (["apo", model, "-o", tmp_path / "no" / "where"], "PTM-O002"),
        (["render", folder, "-o", view, "--levels", "99"], "PTM-I111"),
        (["render", folder, "-o", view, "--width", "0"], "PTM-I111"),
        (["render", folder, "-o", tmp_path / "no" / "view.png"], "PTM-O002"),
        (["render", damaged("a", PLANTED["index"][0]), "-o", view], "PTM-I821"),
        (["render", damaged("b", PLANTED["index"][1]), "-o", view], "PTM-I821"),
        (["render", damaged("c", PLANTED["stream"][0]), "-o", view], "PTM-I821"),
        (["render", damaged("d", PLANTED["missing"][0]), "-o", view], "PTM-I122"),
        (["render", damaged("e", lambda f: flip(f / MESH, 30)), "-o", view], "PTM-I821"),
        (["apo", ""], "PTM-"),
        (["apo", "."], "PTM-"),
        (["render", folder, "-o", tmp_path / "view.jpg"], "PTM-O"),
        (["render", folder, "-o", view, "--faces", "9"], ""),
        (["render", folder, "-o", view, "--eye", "0,0,0"], "PTM-U001"),
    ]


def test_bad_inputs_have_one_line_each(
    model: Path, written: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for arguments, code in bad_inputs(model, written, tmp_path):
        status = run(*arguments)
        printed = capsys.readouterr().err
        assert status in (2, 3, 4, 7), arguments
        assert printed.count("\n") == 1, (arguments, printed)
        assert not code or f"[{code}" in printed, (arguments, printed)
        assert "Traceback" not in printed
    assert not (tmp_path / "new").exists()
    assert (tmp_path / "own" / "thesis.doc").read_text() == "mine"
    assert not [name for name in tmp_path.iterdir() if ".part" in name.name]


# What was written by earlier versions is read for ever.


def test_frozen_folders() -> None:
    digests = json.loads((VECTORS / "digests.json").read_text())
    assert digests
    for name, expected in digests.items():
        octree = read_octree(VECTORS / name)
        assert hashlib.sha256(octree.texels.tobytes()).hexdigest() == expected["normals"]
        actual = octree.colors
        assert (actual is None) == ("colors" not in expected)
        if actual is not None:
            assert hashlib.sha256(actual.tobytes()).hexdigest() == expected["colors"]
        assert check(VECTORS / name).issues == ()
        with pytest.raises(PtmError):
            read_octree(VECTORS / name, octree.levels + 1)
