"""The lightmaps of a model in its database, and the choice between these and none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.light import looks
from ptmtools.light.looks import LightImage, lookup, red_texels
from ptmtools.light.model import coded_light
from ptmtools.light.occlusion import points_on
from ptmtools.light.options import LightOptions
from ptmtools.output.geometry import Geometry
from ptmtools.output.gltf_reader import read_glb
from ptmtools.output.served import read_served
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages import CELLS, LIGHT, SCENE, light as light_stage
from ptmtools.pipeline.status import plan_build
from ptmtools.pipeline.validation import validate
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import LIGHTS, arrays_of, sha256
from ptmtools.texture import load_image
from ptmtools_systems.apo.options import ReplaceOptions
from tests.light.glowing import BALL, light_at, write_lit_room
from tests.output.agreement import disagreements

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

QUICK = AchOptions(samples=4, backend="embree")


def built(model: Path, db: Path, *options: Any) -> dict[str, Any]:
    """The report of each stage that ran."""
    report = build_scene(model, db, QUICK, *options, workers=1)
    return {stage.stage: stage for stage in report.stages if stage.ran}


def seen(db: Path, count: int = 40) -> tuple[Floats, Floats]:
    """Points of surfaces with lightmaps, and the light that a client looks up there, of 255, in
    each colour."""
    artifacts, served = Artifacts(DatabaseFolder.open(db)), read_served(db)
    light, cells = artifacts.stored(LIGHT), artifacts[CELLS]
    assert light is not None
    geometry = Geometry(artifacts[SCENE], cells)
    points, values = [], []
    for row in (row for row in served.index["textures"] if "light" in row):
        cell, texels = row["light"], load_image(served.file(row["previews"][-1]["file"])).array()
        for s in range(*geometry.cell_start[cell : cell + 2].tolist()):
            if not light.mapped[s]:
                continue
            rows = slice(*geometry.triangle_start[s : s + 2].tolist())
            shape = geometry.shape(s)
            corner = geometry.point[shape.point[shape.triangle]].astype(np.float64)
            for face, uv in zip(corner, light.uv[rows].astype(np.float64), strict=True):
                number = np.arange(count)
                points.append(points_on(np.repeat(face[None], count, axis=0), number))
                flat = np.pad(uv, [(0, 0), (0, 1)])
                at = points_on(np.repeat(flat[None], count, axis=0), number)[:, :2]
                codes = [
                    255 * lookup(LightImage(channel, ("clamp", "clamp")), at)
                    for channel in np.moveaxis(texels, 2, 0)
                ]
                values.append(255 * coded_light(np.stack(codes, axis=1), light.white[cell]))
    return np.concatenate(points), np.concatenate(values)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the model, and its database with default options."""
    folder = tmp_path_factory.mktemp("model_light")
    assert built(write_lit_room(folder), folder / "db")["light"].counts["light"] == "model"
    return folder


def test_the_light_of_the_model_comes_back(made: Path) -> None:
    point, actual = seen(made / "db")
    expected = light_at(point + [3, 0, 3])[:, None]  # the middle of the floor is the origin
    off = np.abs(actual - expected)[np.isfinite(expected[:, 0])]
    assert len(off) > 400
    assert np.nanmax(expected) - np.nanmin(expected) > 60
    # Half a code is 1.4 %.
    assert off.mean() < 2
    assert off.max() < 10
    assert validate(made / "db").issues == ()
    assert disagreements(made / "db/www") == []


def test_lightmaps_have_no_more_texels_than_those_of_the_model(made: Path) -> None:
    light = Artifacts(DatabaseFolder.open(made / "db")).stored(LIGHT)
    assert light is not None
    assert (light.side**2).sum() < 2 * (144 * 96)
    fine = built(made / "lit.glb", made / "other", LightOptions("model", light_density=500))
    coarse = built(made / "lit.glb", made / "other", LightOptions("model", light_density=2))
    assert fine["light"].counts["texels"] == (light.side.astype(int) ** 2).sum()
    assert coarse["light"].counts["texels"] < fine["light"].counts["texels"]


def test_the_choice_follows_from_the_model(made: Path, tmp_path: Path) -> None:
    same = built(made / "lit.glb", tmp_path / "db", LightOptions("model"))
    assert same["light"].counts["light"] == "model"
    files = [
        {f.name: f.read_bytes() for f in (db / "www").rglob("*") if f.is_file()}
        for db in (made / "db", tmp_path / "db")
    ]
    assert files[0] == files[1]
    scaled = {"KHR_texture_transform": {"scale": [4, 4]}}
    tiled = {"index": 0, "texCoord": 1, "extensions": scaled}
    model = write_lit_room(tmp_path, occlusionTexture=tiled)
    assert built(model, tmp_path / "tiled")["light"].counts["light"] == "bake"
    with pytest.raises(InputError, match="no lightmaps") as refused:
        built(model, tmp_path / "tiled", LightOptions("model"))
    assert refused.value.code == "PTM-I701"
    with pytest.raises(InputError, match="no lightmaps"):
        built(model, tmp_path / "new", LightOptions("model"))
    assert not (tmp_path / "new").exists(), "refused before any stage was done"
    assert "light" not in built(made / "lit.glb", tmp_path / "none", LightOptions("none"))


def test_the_model_has_been_read_once(made: Path) -> None:
    """A second build does nothing, and a plan says so."""
    assert built(made / "lit.glb", made / "db") == {}
    plans = {p.stage: p.plan for p in plan_build(made / "lit.glb", made / "db", QUICK)}
    assert plans[LIGHT.name] == "current"
    assert main(["light", "-q", str(made / "db"), "-j", "1"]) == 0
    assert built(made / "lit.glb", made / "db") == {}


def test_the_light_of_replaced_objects(tmp_path: Path) -> None:
    """Their triangles have other numbers than in the model."""
    model = write_lit_room(tmp_path, ball=4)
    built(model, tmp_path / "db", ReplaceOptions(apo=("ball",), apo_faces=300, relief="normal-map"))
    point, actual = seen(tmp_path / "db")
    expected = light_at(point + [3, 0, 3])[:, None]
    assert np.nanmean(np.abs(actual - expected)) < 2
    cells = [read_glb(f.read_bytes()) for f in (tmp_path / "db/www/gltf").glob("*.glb")]
    shapes = [shape for cell in cells for shape in cell.primitives if shape.object == "ball"]
    assert shapes
    for shape in shapes:
        assert shape.color is not None
        assert 255 * shape.color == pytest.approx(BALL, abs=1)


def test_without_xatlas(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A default build goes on, and says what is left out."""

    def missing(*_: Any) -> None:
        remedy = "pip install 'ptmtools[light]'"
        raise MissingComponentError("PTM-M100", "lightmaps need xatlas", remedy=remedy)

    model, db = made / "lit.glb", tmp_path / "db"
    with monkeypatch.context() as without:
        without.setattr(light_stage, "component", missing)
        stage = built(model, db)["light"]
        assert (stage.counts["lightmaps"], stage.counts["light"]) == (0, "none")
        for text in ("xatlas", "pip install 'ptmtools[light]', then build again"):
            assert text in stage.warnings[0]
        assert built(model, db) == {}
        assert validate(db).issues == ()
        with pytest.raises(MissingComponentError):
            built(model, db, LightOptions("model"))
    assert {p.stage: p.plan for p in plan_build(model, db, QUICK)}[LIGHT.name] != "current"
    assert built(model, db)["light"].counts["lightmaps"] > 0
    monkeypatch.setattr(light_stage, "component", missing)
    assert built(model, db) == {}  # lightmaps are kept


def test_an_image_is_decoded_once(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lengths = []

    def counted(data: bytes, *rest: Any) -> Any:
        lengths.append(len(data))
        return red_texels(data, *rest)

    monkeypatch.setattr(looks, "red_texels", counted)
    artifacts = Artifacts(DatabaseFolder.open(made / "db"))
    lights = light_stage.lights_of(artifacts)
    assert lights is not None
    maps = [replace(lights.maps[0], strength=share) for share in (1, 0.5, 0.25)]
    painted = light_stage._paint(cast("Any", artifacts), replace(lights, maps=tuple(maps)))
    assert [image.strength for image in painted.images] == [1, 0.5, 0.25]
    assert len(lengths) == 1


@pytest.mark.parametrize("array", ["uv", "map", "glow", "image", "lamp"])
def test_damaged_lights(made: Path, tmp_path: Path, array: str) -> None:
    built(made / "lit.glb", tmp_path / "db")
    name = arrays_of(LIGHTS)
    file = tmp_path / "db" / name
    data = file.read_bytes()
    arrays = dict(unpack_arrays(data, file=file))
    arrays[array] = np.ones((1, 12)) if array == "lamp" else arrays[array][:-1]
    changed = pack_arrays(arrays)
    manifest = tmp_path / "db/manifest.json"
    manifest.write_text(manifest.read_text().replace(sha256(data), sha256(changed)))
    file.write_bytes(changed)
    assert ("PTM-D720", name) in {(i.code, i.file) for i in validate(tmp_path / "db").issues}
