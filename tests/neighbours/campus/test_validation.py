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
from ptmtools.glb import BINARY, JSON, glb, glb_chunks
from ptmtools.neighbours.campus.validation import CODES
from ptmtools.pipeline.validation import validate

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


#: What is changed in the index, and the code of the finding.
CHANGES: list[tuple[str, Callable[[Document], object]]] = [
    ("PTM-D821", lambda d: d.pop("objects")),
    ("PTM-D821", put("schema", value=2)),
    ("PTM-D821", put("objects", 0, "meshes", 0, "file", value="../../etc/passwd")),
    ("PTM-D821", put("textures", 0, "file", value="/etc/passwd")),
    ("PTM-D821", put("objects", 0, "box", value=[0, 0, 0])),
    ("PTM-D822", put("objects", 0, "meshes", 0, "file", value="meshes/gone_0.glb")),
    ("PTM-D823", put("objects", 0, "meshes", 0, "bytes", value=7)),
    ("PTM-D823", put("textures", 0, "crc32", value=7)),
    ("PTM-D825", lambda d: d["objects"][1].update(name=d["objects"][0]["name"].upper())),
    ("PTM-D825", put("textures", 0, "size", value=64)),
    ("PTM-D827", put("objects", 0, "meshes", 1, "faces", value=1)),
    ("PTM-D827", put("objects", 0, "box", 0, value=-1e3)),
    ("PTM-D827", lambda d: d["materials"].reverse()),
    ("PTM-D829", put("materials", 0, "channels", value=["d", "a"])),
    ("PTM-D829", put("materials", 0, "base", value=None)),
    ("PTM-D829", put("objects", 0, "lightmap", value=None)),
    ("PTM-D829", lambda d: d["textures"].pop()),
    ("PTM-D830", put("objects", 0, "materials", value=[99])),
    ("PTM-D831", put("start", value=1)),
    ("PTM-D831", put("presets", 2, "bytes", value=1)),
    ("PTM-D831", put("presets", 4, "download", value=1)),
    ("PTM-D831", lambda d: d["presets"].pop()),
    ("PTM-D832", put("objects", 1, "viewpoint", "position", value=[-9, 4, -1])),
    ("PTM-D832", put("objects", 1, "viewpoint", "direction", value=[1, 1, 0])),
    ("PTM-D833", put("objects", 1, "barycentre", value=[1e6, 0, 0])),
    ("PTM-D833", lambda d: d["objects"][1]["box"].reverse()),
    ("PTM-D834", lambda d: d["objects"][1].update(lightmap=d["objects"][0]["lightmap"])),
    ("PTM-D835", lambda d: d["objects"][1]["meshes"].reverse()),
    ("PTM-D835", put("lods", value=3)),
    ("PTM-D836", lambda d: [m.update(base=None, channels=[]) for m in d["materials"]]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("code", "alter"), CHANGES, ids=[f"{c}-{i}" for i, (c, _) in enumerate(CHANGES)]
)
def test_a_changed_index(copy: Path, code: str, alter: Callable[[Document], object]) -> None:
    change(copy, alter)
    assert code in codes(copy)


def test_every_code_is_found_by_some_test() -> None:
    elsewhere = {"PTM-D820", "PTM-D824", "PTM-D826", "PTM-D828"}
    assert {code for code, _ in CHANGES} | elsewhere == set(CODES)


def test_a_flipped_bit_in_any_file(copy: Path) -> None:
    for file in sorted(copy.rglob("*.*")):
        if file.name == "campus.json":
            continue
        data = bytearray(file.read_bytes())
        data[len(data) // 2] ^= 4
        file.write_bytes(data)
        found = [i for i in validate(copy).issues if i.file == file.relative_to(copy).as_posix()]
        assert [i.code for i in found] == ["PTM-D823"]
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
        ("PTM-D822", names[0].name),
        ("PTM-D823", names[1].name),
        ("PTM-D824", "more.txt"),
    }
    assert len(report.errors) == 2


def test_links_are_not_followed(copy: Path, tmp_path: Path) -> None:
    file = next((copy / "textures").iterdir())
    (tmp_path / "elsewhere").write_bytes(file.read_bytes())
    file.unlink()
    file.symlink_to(tmp_path / "elsewhere")
    assert codes(copy) == {"PTM-D822"}


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
    assert "PTM-D826" in codes(copy)


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
    (issue,) = (i for i in validate(copy).issues if i.code == "PTM-D826")
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
    (issue,) = (i for i in validate(copy).issues if i.code == "PTM-D826")
    assert "components" in issue.message


def test_an_image_of_another_size_or_format(copy: Path) -> None:
    name = "textures/wall_256_d.jpg"
    with Image.open(copy / "textures/wall_128_d.jpg") as image:
        image.save(copy / "other.png")
    (copy / "other.png").rename(copy / name)
    rewrite(copy, name, (copy / name).read_bytes())
    assert "PTM-D828" in codes(copy)
    rewrite(copy, name, (copy / "textures/wall_128_d.jpg").read_bytes())
    assert "PTM-D828" in codes(copy)
    rewrite(copy, name, (copy / "textures/wall_128_d.jpg").read_bytes()[:500])
    assert "PTM-D828" in codes(copy)


def test_an_index_that_is_none(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (copy / "campus.json").write_bytes(b"\xff\xfe")
    assert codes(copy) == {"PTM-D821"}
    assert main(["validate", str(copy)]) == 8
    assert "ptm campus MODEL" in capsys.readouterr().err
    assert main(["info", str(copy)]) == 3
    assert "PTM-I833" in capsys.readouterr().err


def test_an_object_of_fewer_meshes_is_no_surprise(
    copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change(copy, lambda d: d["objects"][1]["meshes"].pop())
    assert main(["info", str(copy)]) == 3
    told = capsys.readouterr().err
    assert "objects[1].meshes: has 1 items, not 2" in told
    assert "PTM-I833" in told


def test_an_index_that_cannot_be_read(copy: Path, tmp_path: Path) -> None:
    from ptmtools.neighbours.campus.validation import check_campus
    from ptmtools.texture.model import Limits

    report = check_campus(tmp_path, Limits())
    assert [i.code for i in report.issues] == ["PTM-D820"]


def mesh_with(folder: Path, alter: Callable[[Document], object]) -> None:
    """A mesh gets another document, and is recorded so."""
    name = sorted((folder / "meshes").iterdir())[0].name
    (_, _, text), (_, _, binary) = glb_chunks((folder / "meshes" / name).read_bytes())
    document = json.loads(text)
    alter(document)
    data = glb([(JSON, json.dumps(document).encode()), (BINARY, binary)])
    rewrite(folder, f"meshes/{name}", data)


def primitives(document: Document) -> list[Document]:
    found: list[Document] = document["meshes"][0]["primitives"]
    return found


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
    assert "PTM-D826" in codes(copy)


def test_sizes_that_no_file_has(copy: Path) -> None:
    change(copy, put("textures", 0, "bytes", value=10**30))
    assert codes(copy) == {"PTM-D821"}


def test_the_page_lists_the_codes() -> None:
    page = Path(__file__).resolve().parents[3] / "docs/formats/campus.md"
    rows = re.findall(r"^\| (PTM-D\d+) \| (\w+) \| (.*) \|$", page.read_text("utf-8"), re.MULTILINE)
    assert {code: (severity, meaning) for code, severity, meaning in rows} == CODES
