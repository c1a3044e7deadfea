"""Validation finds whatever is done to a campus, each kind by its code."""

from __future__ import annotations

import json
import re
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.diagnostics import FOLDER_CODES
from ptmtools.glb import BINARY, JSON, glb, glb_chunks
from ptmtools.pipeline.validation import validate
from tests.systems.campus.agreement import disagreements, kinds

Document = dict[str, Any]


def codes(folder: Path) -> set[str]:
    return {issue.code for issue in validate(folder).issues}


@pytest.fixture
def copy(made: Path, tmp_path: Path) -> Path:
    """A campus to be damaged."""
    shutil.copytree(made, tmp_path / "c")
    return tmp_path / "c"


def change(folder: Path, alter: Callable[[Document], object]) -> None:
    file = folder / "campus.json"
    document = json.loads(file.read_text())
    alter(document)
    file.write_text(json.dumps(document))


def rewrite(folder: Path, name: str, data: bytes) -> None:
    """Another file, which the index knows of."""
    (folder / name).write_bytes(data)

    def alter(document: Document) -> None:
        records = [m for o in document["objects"] for m in o["meshes"]] + document["textures"]
        for record in records:
            if record["file"] == name:
                record["bytes"], record["crc32"] = len(data), zlib.crc32(data)

    change(folder, alter)


def put(*path: str | int, value: object) -> Callable[[Document], None]:
    """Puts a value into a document."""

    def alter(document: Document) -> None:
        at: Any = document
        for step in path[:-1]:
            at = at[step]
        at[path[-1]] = value

    return alter


#: Kinds of findings: the code, and a pattern of their messages.
KINDS = {
    "schema": ("PTM-D800", ""),
    "missing": ("PTM-D803", ""),
    "recorded": ("PTM-D804", "bytes|CRC-32"),
    "mesh": ("PTM-D804", "bounding box|faces|materials|coordinates"),
    "texture": ("PTM-D800", "is not listed"),
    "material": ("PTM-D800", "material .* does not exist"),
    "levels": ("PTM-D800", "has [0-9]+ items"),
    "unused": ("PTM-D806", "is not used"),
}
#: What is changed in the index, and the kind of the finding.
CHANGES: list[tuple[str, Callable[[Document], object]]] = [
    ("schema", lambda d: d.pop("objects")),
    ("schema", put("schema", value=2)),
    ("schema", put("objects", 0, "meshes", 0, "file", value="../../etc/passwd")),
    ("schema", put("textures", 0, "file", value="/etc/passwd")),
    ("schema", put("objects", 0, "box", value=[0, 0, 0])),
    ("missing", put("objects", 0, "meshes", 0, "file", value="meshes/gone_0.glb")),
    ("recorded", put("objects", 0, "meshes", 0, "bytes", value=7)),
    ("recorded", put("textures", 0, "crc32", value=7)),
    ("mesh", put("objects", 0, "meshes", 1, "faces", value=1)),
    ("mesh", lambda d: d["materials"].reverse()),
    ("mesh", put("objects", 0, "box", 3, value=-1e3)),
    ("texture", put("materials", 0, "channels", value=["d", "a"])),
    ("texture", lambda d: d["textures"].pop()),
    ("material", put("objects", 0, "materials", value=[99])),
    ("levels", put("lods", value=3)),
    ("unused", lambda d: [m.update(base=None, channels=[]) for m in d["materials"]]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "alter"), CHANGES, ids=[f"{kind}-{i}" for i, (kind, _) in enumerate(CHANGES)]
)
def test_a_changed_index(copy: Path, kind: str, alter: Callable[[Document], object]) -> None:
    change(copy, alter)
    code, pattern = KINDS[kind]
    issues = [str(issue) for issue in validate(copy).issues if issue.code == code]
    assert any(re.search(pattern, issue.removesuffix(f" [{code}]")) for issue in issues), issues


#: Changes that only the writer could make, and the kind of the disagreement.
DIFFERENCES: list[tuple[str, Callable[[Document], object]]] = [
    ("name", lambda d: d["objects"][1].update(name=d["objects"][0]["name"].upper())),
    ("name", put("textures", 0, "size", value=64)),
    ("mesh", put("objects", 0, "box", 0, value=-1e3)),
    ("texture", put("materials", 0, "base", value=None)),
    ("lightmap", put("objects", 0, "lightmap", value=None)),
    ("sum", put("start", value=1)),
    ("sum", put("presets", 2, "bytes", value=1)),
    ("sum", put("presets", 4, "download", value=1)),
    ("sum", lambda d: d["presets"].pop()),
    ("viewpoint", put("objects", 1, "viewpoint", "position", value=[-9, 4, -1])),
    ("viewpoint", put("objects", 1, "viewpoint", "direction", value=[1, 1, 0])),
    ("box", put("objects", 1, "barycentre", value=[1e6, 0, 0])),
    ("box", lambda d: d["objects"][1]["box"].reverse()),
    ("lightmap", lambda d: d["objects"][1].update(lightmap=d["objects"][0]["lightmap"])),
    ("levels", lambda d: d["objects"][1]["meshes"].reverse()),
]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "alter"), DIFFERENCES, ids=[f"{kind}-{i}" for i, (kind, _) in enumerate(DIFFERENCES)]
)
def test_an_index_that_contradicts_itself(
    copy: Path, kind: str, alter: Callable[[Document], object]
) -> None:
    assert disagreements(copy) == []
    change(copy, alter)
    assert kind in kinds(copy)


def test_every_code_is_found_by_some_test() -> None:
    assert {kind for kind, _ in CHANGES} == set(KINDS)
    of_images = {"PTM-D713", "PTM-D808"}
    assert {code for code, _ in KINDS.values()} | of_images == set(FOLDER_CODES)


def test_a_flipped_bit_in_any_file(copy: Path) -> None:
    for file in sorted(copy.rglob("*.*")):
        if file.name == "campus.json":
            continue
        data = bytearray(file.read_bytes())
        data[len(data) // 2] ^= 4
        file.write_bytes(data)
        actual = [i for i in validate(copy).issues if i.file == file.relative_to(copy).as_posix()]
        assert [i.code for i in actual] == ["PTM-D804"]
        data[len(data) // 2] ^= 4
        file.write_bytes(data)
        if file.suffix == ".jpg" and "512_d" in file.name:
            break


def test_files_that_are_missing_cut_or_too_many(copy: Path) -> None:
    names = sorted((copy / "meshes").iterdir())
    names[0].unlink()
    names[1].write_bytes(names[1].read_bytes()[:-4])
    (copy / "textures" / "more.txt").write_text("")
    report = validate(copy)
    assert {(i.code, Path(i.file).name) for i in report.issues} == {
        ("PTM-D803", names[0].name),
        ("PTM-D804", names[1].name),
        ("PTM-D806", "more.txt"),
    }
    assert len(report.errors) == 2


def test_links_are_not_followed(copy: Path, tmp_path: Path) -> None:
    file = next((copy / "textures").iterdir())
    (tmp_path / "elsewhere").write_bytes(file.read_bytes())
    file.unlink()
    file.symlink_to(tmp_path / "elsewhere")
    assert codes(copy) == {"PTM-D803"}


@pytest.mark.parametrize(
    "alter",
    [
        lambda data: b"glTF" + data[8:],
        lambda data: data.replace(b'"indices":', b'"indicez":'),
        lambda data: data.replace(b'"POSITION"', b'"LOCATION"'),
        lambda data: data.replace(b'"count":', b'"cound":', 1),
    ],
)
def test_a_mesh_that_is_none(copy: Path, alter: Callable[[bytes], bytes]) -> None:
    name = "meshes/House_1_1.glb"
    rewrite(copy, name, alter((copy / name).read_bytes()))
    assert "PTM-D804" in codes(copy)


def with_json(data: bytes, alter: Callable[[Document], object]) -> bytes:
    """A GLB whose JSON is changed."""
    (_, _, text), (_, _, binary) = glb_chunks(data)
    document = json.loads(text)
    alter(document)
    return glb([(JSON, json.dumps(document).encode()), (BINARY, binary)])


@pytest.mark.parametrize(
    ("alter", "what"),
    [
        (lambda d: d["bufferViews"][0].update(byteLength=10**12), "views of 1000000"),
        (lambda d: d["bufferViews"].append({"byteLength": 10**30}), "views of 1000000"),
        (lambda d: d["bufferViews"].append({"byteLength": -5}), "-5"),
        (lambda d: d["bufferViews"].append({}), "byteLength"),
    ],
)
def test_a_mesh_that_says_it_is_larger_than_it_is(
    copy: Path, alter: Callable[[Document], object], what: str
) -> None:
    name = "meshes/House_1_1.glb"
    rewrite(copy, name, with_json((copy / name).read_bytes(), alter))
    (issue,) = (i for i in validate(copy).issues if i.code == "PTM-D804")
    assert what in issue.message


@pytest.mark.parametrize(
    ("lod", "attribute", "kind"),
    [(1, "TEXCOORD_0", "SCALAR"), (1, "TEXCOORD_1", "SCALAR"), (1, "POSITION", "VEC2"),
     (0, "COLOR_0", "VEC3")],
)  # fmt: skip
def test_attributes_of_other_components(copy: Path, lod: int, attribute: str, kind: str) -> None:
    """Fewer, so that all are there."""

    def alter(document: Document) -> None:
        for primitive in document["meshes"][0]["primitives"]:
            if attribute in primitive["attributes"]:
                document["accessors"][primitive["attributes"][attribute]]["type"] = kind

    name = f"meshes/House_1_{lod}.glb"
    rewrite(copy, name, with_json((copy / name).read_bytes(), alter))
    (issue,) = (i for i in validate(copy).issues if i.code == "PTM-D804")
    assert "components" in issue.message


def test_an_image_of_another_size_or_format(copy: Path) -> None:
    name = "textures/wall_256_d.jpg"
    with Image.open(copy / "textures/wall_128_d.jpg") as image:
        image.save(copy / "other.png")
    (copy / "other.png").rename(copy / name)
    rewrite(copy, name, (copy / name).read_bytes())
    assert "PTM-D804" in codes(copy)
    rewrite(copy, name, (copy / "textures/wall_128_d.jpg").read_bytes())
    assert "PTM-D804" in codes(copy)
    rewrite(copy, name, (copy / "textures/wall_128_d.jpg").read_bytes()[:500])
    assert "PTM-D804" in codes(copy)


def test_an_index_that_is_none(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (copy / "campus.json").write_bytes(b"\xff\xfe")
    assert codes(copy) == {"PTM-D800"}
    assert main(["validate", str(copy)]) == 8
    assert "ptm campus MODEL" in capsys.readouterr().err
    assert main(["info", str(copy)]) == 3
    assert "PTM-I821" in capsys.readouterr().err


def test_an_object_of_fewer_meshes_is_no_surprise(
    copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change(copy, lambda d: d["objects"][1]["meshes"].pop())
    assert main(["info", str(copy)]) == 3
    reported = capsys.readouterr().err
    assert "objects[1].meshes: has 1 items, not 2" in reported
    assert "PTM-I821" in reported


def test_an_index_that_cannot_be_read(copy: Path, tmp_path: Path) -> None:
    from ptmtools.texture.model import Limits
    from ptmtools_systems.campus.validation import check_campus

    report = check_campus(tmp_path, Limits())
    assert [i.code for i in report.issues] == ["PTM-D800"]


def mesh_with(folder: Path, alter: Callable[[Document], object]) -> None:
    """A mesh gets another document, and is recorded so."""
    name = sorted((folder / "meshes").iterdir())[0].name
    (_, _, text), (_, _, binary) = glb_chunks((folder / "meshes" / name).read_bytes())
    document = json.loads(text)
    alter(document)
    data = glb([(JSON, json.dumps(document).encode()), (BINARY, binary)])
    rewrite(folder, f"meshes/{name}", data)


def primitives(document: Document) -> list[Document]:
    actual: list[Document] = document["meshes"][0]["primitives"]
    return actual


@pytest.mark.parametrize(
    "alter",
    [
        lambda d: primitives(d)[0]["attributes"].update(POSITION=None),
        lambda d: primitives(d)[0].update(indices=None),
        lambda d: primitives(d).clear(),
        lambda d: primitives(d).extend(primitives(d) * 300),
    ],
    ids=["no positions", "no indices", "no primitives", "the same arrays many times"],
)
def test_meshes_of_strangers(copy: Path, alter: Callable[[Document], object]) -> None:
    mesh_with(copy, alter)
    assert "PTM-D804" in codes(copy)


def test_sizes_that_no_file_has(copy: Path) -> None:
    change(copy, put("textures", 0, "bytes", value=10**30))
    assert codes(copy) == {"PTM-D800"}
