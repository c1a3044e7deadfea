"""Whole folders: sums, viewpoints, the same bytes, what is replaced and what is not."""

from __future__ import annotations

import json
import zlib
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from PIL import Image

from ptmtools import schemas
from ptmtools.cli.main import main
from ptmtools.diagnostics import ValidationReport
from ptmtools.errors import InputError, MissingComponentError, OutputError
from ptmtools.folder_kinds import folder_kind
from ptmtools.parallel import open_executor
from ptmtools.pipeline.validation import validate
from ptmtools.scene import IngestOptions
from ptmtools_systems.campus import Campus, CampusOptions, distances, make_campus, read_campus
from ptmtools_systems.campus.meshes import read_mesh
from ptmtools_systems.schemas import CAMPUS
from tests.conftest import files_below
from tests.systems.campus.models import write_gltf

METRES = IngestOptions(unit="m", up="y")
NONE = CampusOptions(lightmaps="none", faces=20)


def valid(folder: Path) -> ValidationReport:
    report = validate(folder)
    assert not report.issues, report.issues
    return report


def test_it_is_valid(made: Path, plain: Path) -> None:
    assert valid(made).files == len(read_campus(made).files()) + 1
    valid(plain)
    kind = folder_kind(made)
    assert kind is not None
    lines, record = kind.describe.load()(made)
    assert any("wall" in line or "diffuse" in line for line in lines)
    json.dumps(record)


def test_the_schema_is_a_schema_and_the_index_satisfies_it(made: Path) -> None:
    schema = json.loads(schemas.schema_text(CAMPUS))
    jsonschema.Draft202012Validator.check_schema(schema)
    document = json.loads((made / "campus.json").read_text())
    jsonschema.Draft202012Validator(schema).validate(document)
    # Others may have been added.
    document["later"] = document["objects"][0]["later"] = document["materials"][0]["later"] = 1
    schemas.check(document, CAMPUS)
    assert Campus.from_document(document) == read_campus(made)


def test_bytes_add_up(made: Path, index: Campus) -> None:
    """By the files themselves, not by the records."""
    there = files_below(made)
    assert {name: (len(data), zlib.crc32(data)) for name, data in there.items()} == {
        **index.files(),
        "campus.json": (len(there["campus.json"]), zlib.crc32(there["campus.json"])),
    }
    meshes = sum(len(data) for name, data in there.items() if name.endswith(".glb"))

    def held(size: int, channels: str) -> int:
        ends = tuple(f"_{size}_{channel}.jpg" for channel in channels)
        return sum(len(data) for name, data in there.items() if name.endswith(ends))

    actual = {preset.name: preset for preset in index.presets}
    assert list(actual) == ["Low", "Medium", "High", "Ultra", "Ultra cached"]
    assert actual["Low"].bytes == meshes + held(128, "dam") + held(512, "l")
    assert actual["High"].bytes == meshes + held(128, "dam") + held(256, "dam") + held(2048, "l")
    assert actual["Ultra"].bytes == actual["Ultra cached"].bytes
    assert actual["Ultra cached"].download == 0
    first = sum(len(data) for name, data in there.items() if name.endswith("_0.glb"))
    assert index.start == first + held(128, "dam")


def test_boxes_and_viewpoints(made: Path, index: Campus) -> None:
    boxes = np.array([o.box for o in index.objects])
    middles = np.array([o.barycentre for o in index.objects])
    for k, each in enumerate(index.objects):
        eye, way = map(np.array, each.viewpoint)
        assert distances(eye, boxes[k : k + 1], middles[k : k + 1])[0] > 1
        assert np.linalg.norm(way) == pytest.approx(1, abs=1e-12)
        middle = (boxes[k, :3] + boxes[k, 3:]) / 2
        assert way @ (middle - eye) == pytest.approx(np.linalg.norm(middle - eye))
        assert np.linalg.norm(middle - eye) < 200
        points = [p.point for m in each.meshes for p in read_mesh((made / m.file).read_bytes())]
        every = np.concatenate(points)
        assert np.array_equal(np.concatenate([every.min(0), every.max(0)]), boxes[k])


def test_a_visitor_stands_on_the_ground_before_a_house(index: Campus) -> None:
    house = next(o for o in index.objects if o.label == "House 1")
    eye, _ = house.viewpoint
    assert eye[1] == pytest.approx(1.6, abs=1e-3)
    # The other house is to its right.
    other = next(o for o in index.objects if o.label == "House 2")
    low, high = np.array(other.box[:3]), np.array(other.box[3:])
    assert not ((low <= eye) & (np.array(eye) <= high)).all()


@pytest.mark.parametrize("workers", [2])
def test_the_same_bytes_from_any_number_of_workers(
    model: Path, made: Path, tmp_path: Path, workers: int
) -> None:
    with open_executor(workers) as executor:
        make_campus(
            model, tmp_path / "again", CampusOptions(samples=16, faces=20), METRES, executor
        )
    assert files_below(tmp_path / "again") == files_below(made)


def test_more_levels(model: Path, tmp_path: Path) -> None:
    options = CampusOptions(lods=3, ratio=0.3, faces=4, lightmaps="none", small=0)
    make_campus(model, tmp_path / "c", options, METRES)
    campus = read_campus(tmp_path / "c")
    valid(tmp_path / "c")
    assert len(campus.objects) == 7
    house = next(o for o in campus.objects if o.label == "House 1")
    faces = [mesh.faces for mesh in house.meshes]
    assert faces[0] < faces[1] < faces[2] == 4 * 36 * 2 + 2


def test_a_campus_is_replaced_only_with_force(model: Path, tmp_path: Path) -> None:
    folder = tmp_path / "c"
    make_campus(model, folder, NONE, METRES)
    before = files_below(folder)
    with pytest.raises(OutputError, match="PTM-O001"):
        make_campus(model, folder, NONE, METRES)
    assert files_below(folder) == before
    (folder / "campus.json").write_bytes(before["campus.json"][:600])  # damaged, and still ours
    make_campus(model, folder, NONE, METRES, force=True)
    assert files_below(folder) == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["c"]


def test_what_is_not_ours_is_never_replaced(model: Path, tmp_path: Path) -> None:
    folder = tmp_path / "c"
    make_campus(model, folder, NONE, METRES)
    (folder / "thesis.odt").write_text("years of work")
    with pytest.raises(OutputError, match="PTM-O010") as fault:
        make_campus(model, folder, NONE, METRES, force=True)
    assert "thesis.odt" in str(fault.value)
    other = tmp_path / "other"
    other.mkdir()
    (other / "campus.json").write_text("{}")
    with pytest.raises(OutputError, match="PTM-O010"):
        make_campus(model, other, NONE, METRES, force=True)
    assert (other / "campus.json").read_text() == "{}"


def test_a_failure_leaves_nothing(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    folder = tmp_path / "c"
    make_campus(model, folder, NONE, METRES)
    before = files_below(folder)
    monkeypatch.setattr("ptmtools.whole_folder._replace", fail)
    with pytest.raises(OutputError, match="PTM-O003"):
        make_campus(model, folder, NONE, METRES, force=True)
    assert files_below(folder) == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["c"]


def test_an_empty_folder_may_be_there(model: Path, tmp_path: Path) -> None:
    (tmp_path / "c").mkdir()
    make_campus(model, tmp_path / "c", NONE, METRES)
    valid(tmp_path / "c")


def test_lightmaps_of_the_model(tmp_path: Path) -> None:
    pytest.importorskip("xatlas", reason="pip install 'ptmtools[campus]'")
    model = write_gltf(tmp_path / "model")
    make_campus(model, tmp_path / "c", CampusOptions(lightmaps="model", small=0))
    valid(tmp_path / "c")
    campus = read_campus(tmp_path / "c")
    assert campus.lightmaps == "model"
    assert {t.source for t in campus.textures if t.channel == "l"} == {(64, 64)}
    for each in campus.objects:
        fine = read_mesh((tmp_path / "c" / each.meshes[-1].file).read_bytes())
        with Image.open(tmp_path / "c" / f"textures/{each.lightmap}_1024_l.jpg") as image:
            texels = np.asarray(image, float) / 255
        for part in fine:
            assert part.light is not None
            middle = part.light[part.triangle].mean(axis=1)
            x = part.point[part.triangle].mean(axis=1)[:, 0]
            seen = texels[(middle[:, 1] * 1024).astype(int), (middle[:, 0] * 1024).astype(int)]
            # 40 of 255 in linear light is 0.43 as sRGB.
            assert np.abs(seen - np.where(x < 0, 0.43, 1.0)).max() < 0.05
        (coarse,) = read_mesh((tmp_path / "c" / each.meshes[0].file).read_bytes())
        assert coarse.color is not None
        dark = coarse.color[coarse.point[:, 0] < 0].mean()
        assert dark < coarse.color[coarse.point[:, 0] > 0].mean() - 0.3


def test_a_model_without_lightmaps_says_so(model: Path, tmp_path: Path) -> None:
    plain = write_gltf(tmp_path, light=False)
    for each in (model, plain):
        with pytest.raises(InputError, match="PTM-I701"):
            make_campus(each, tmp_path / "c", CampusOptions(lightmaps="model"))
    assert not (tmp_path / "c").exists()


def test_masks_of_a_gltf(tmp_path: Path) -> None:
    """Smooth is bright: 1 − roughness."""
    model = write_gltf(tmp_path / "model")
    make_campus(model, tmp_path / "c", NONE)
    campus = read_campus(tmp_path / "c")
    assert campus.materials[0].channels == ("d", "m")
    with Image.open(tmp_path / "c/textures/base_128_m.jpg") as image:
        texels = np.asarray(image, float)
    assert texels[64, 20] > 240
    assert texels[64, 100] < 15


def test_a_mask_with_other_coordinates_is_left_out(tmp_path: Path) -> None:
    model = write_gltf(tmp_path / "model", moved=True)
    made = make_campus(model, tmp_path / "c", NONE)
    assert any("mask" in note for note in made.notes)
    assert made.campus.materials[0].channels == ("d",)


def test_without_xatlas(model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "xatlas", None)
    with pytest.raises(MissingComponentError, match=r"PTM-M100") as fault:
        make_campus(model, tmp_path / "c", CampusOptions(), METRES)
    assert "pip install" in str(fault.value)
    make_campus(model, tmp_path / "c", NONE, METRES)
    valid(tmp_path / "c")


def test_the_command_prints_what_the_paper_has(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "c"
    words = ["campus", str(model), "-o", str(folder), "--lightmaps", "none", "--unit", "m"]
    assert main([*words, "--up", "y", "-j", "1"]) == 0
    printed = capsys.readouterr()
    for text in ("diffuse", "3.09", "10.63", "78.81", "Ultra cached", "level 1", "mask"):
        assert text in printed.out
    assert "small objects" in printed.err
    assert main([*words, "--force", "--json", "-j", "1"]) == 0
    actual = json.loads(capsys.readouterr().out)
    assert actual["objects"] == 5
    assert len(actual["presets"]) == 5
    assert main(["info", str(folder)]) == 0
    assert ": campus" in capsys.readouterr().out
    assert main(["validate", str(folder)]) == 0
