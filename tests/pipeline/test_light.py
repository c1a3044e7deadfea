"""The light of a database: what it adds, when it is baked again, what is refused."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import DatabaseError, InputError
from ptmtools.light.model import HUE, coded_light, scale_hue
from ptmtools.light.options import LightOptions
from ptmtools.output.gltf_reader import read_glb
from ptmtools.output.options import EmitOptions
from ptmtools.output.served import read_served
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene, run_stage
from ptmtools.pipeline.encoding import TextureOptions
from ptmtools.pipeline.stages import LIGHT
from ptmtools.pipeline.status import database_status, plan_build
from ptmtools.pipeline.validation import validate
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import arrays_of, sha256
from ptmtools.texture import decode, load_image
from tests.output.agreement import disagreements
from tests.systems.apo.statues import write_rooms

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

QUICK = AchOptions(samples=4, backend="embree")
BAKE, PLAIN = LightOptions("bake", light_samples=16), LightOptions("none")


def built(model: Path, db: Path, *options: Any, workers: int = 1) -> list[str]:
    """The stages that a build runs."""
    report = build_scene(model, db, QUICK, *options, workers=workers)
    return [stage.stage for stage in report.stages if stage.ran]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the model, a database without light, and one with it."""
    folder = tmp_path_factory.mktemp("light")
    model = write_rooms(folder / "model", 4)
    built(model, folder / "plain.db", PLAIN)
    assert not list((folder / "plain.db/www").rglob("light~*"))
    assert LIGHT.name in built(model, folder / "lit.db", BAKE)
    shown = database_status(folder / "lit.db").stages
    (counts,) = (each.counts for each in shown if each.stage == LIGHT.name)
    files = [f for f in (folder / "lit.db/www").rglob("*") if "light~" in f.name]
    assert counts["bytes"] == sum(f.stat().st_size for f in files) > 2000
    assert "2 lightmaps of" in LIGHT.summarize(counts)
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "made"))


def contents(db: Path) -> dict[str, bytes]:
    return {p.relative_to(db).as_posix(): p.read_bytes() for p in db.rglob("*") if p.is_file()}


def test_the_rest_of_the_database_stays(made: Path) -> None:
    plain, lit = (contents(made / name) for name in ("plain.db", "lit.db"))
    vrml = {name for name in plain if name.endswith(".wrl")}
    textures = {name for name in plain if "/textures/" in name or "/previews/" in name}
    assert vrml
    assert textures
    assert {name for name in vrml | textures if lit[name] != plain[name]} == set()
    assert not any("light" in name for name in plain if not name.endswith(".json"))
    assert validate(made / "lit.db").issues == ()
    # The statues have a simplified mesh in GLBs.
    lines = [line for line in disagreements(made / "lit.db/www") if "positions" not in line]
    assert lines == []


def test_each_cell_has_a_lightmap(made: Path) -> None:
    db = made / "lit.db"
    light = Artifacts(DatabaseFolder.open(db)).stored(LIGHT)
    assert light is not None
    served = read_served(db)
    rows = {row["light"]: row for row in served.index["textures"] if "light" in row}
    assert list(rows) == np.flatnonzero(light.side).tolist()
    for cell, row in rows.items():
        *_, finest = row["previews"]
        assert finest["exact"]
        assert (finest["width"], finest["height"]) == (light.side[cell], light.side[cell])
        texels = load_image(served.file(finest["file"])).array()
        assert texels.shape == (light.side[cell], light.side[cell], 3)
        mean = decode(served.file(row["file"]))[0, 0]
        assert (mean + row["offsets"][0]).tolist() == row["color"]
        assert row["color"] == pytest.approx(texels.mean(axis=(0, 1)), abs=1)
    place = {cell: served.index["textures"].index(row) for cell, row in rows.items()}
    for record in served.records:
        for other, textures in zip(record["visible"], record["textures"], strict=True):
            assert place[other] in textures
        needs = {texture: (level, share) for texture, level, share, *_ in record["need"]}
        for other, share in zip(record["visible"], record["ach"], strict=True):
            if share:
                assert needs[place[other]] == (
                    rows[other]["previews"][-1]["level"],
                    pytest.approx(share, rel=0.01),
                )


def test_dense_objects_have_colours_and_the_others_coordinates(made: Path) -> None:
    glb = read_glb((made / "lit.db/www/gltf/c0000.glb").read_bytes())
    statues = [p for p in glb.primitives if p.object.startswith("statue")]
    others = [p for p in glb.primitives if not p.object.startswith("statue")]
    assert statues
    assert all(p.light is None and p.color is not None for p in statues)
    assert all(p.light is not None and p.color is None for p in others)
    served = read_served(made / "lit.db")
    (row,) = (row for row in served.index["textures"] if row.get("light") == 0)
    assert {p.material.lightmap for p in others} == {f"../{row['fallback']}"}
    light = Artifacts(DatabaseFolder.open(made / "lit.db")).stored(LIGHT)
    assert light is not None
    (white,) = {p.material.white for p in glb.primitives}
    assert white == pytest.approx(light.white[0], rel=1e-4)
    shade = np.concatenate([p.color for p in statues if p.color is not None])
    assert shade.max() > 2 * shade.min()


def test_any_number_of_workers_gives_the_same_bytes(made: Path, tmp_path: Path) -> None:
    built(made / "model/two_rooms.obj", tmp_path / "two.db", BAKE, workers=2)
    assert contents(tmp_path / "two.db") == contents(made / "lit.db")


def test_lamps_of_a_model(tmp_path: Path) -> None:
    """Any number of workers gives the same bytes; the lamps are bright, and nothing is black."""
    model = write_rooms(tmp_path / "model", 3)
    text = model.read_text()
    first = sum(line.startswith("v ") for line in text.splitlines()) + 1
    corners = ((1, 2.4, 1), (2, 2.4, 1), (2, 2.4, 2), (1, 2.4, 2))
    lines = ["o panel", "usemtl panel", *(f"v {x} {y} {z}" for x, y, z in corners)]
    lines.append("f " + " ".join(str(first + k) for k in range(4)))
    model.write_text(text + "\n".join(lines) + "\n")
    library = next(model.parent.glob("*.mtl"))
    library.write_text(library.read_text() + "\nnewmtl panel\nKd 1 1 1\nKe 5 5 5\n")
    for workers in (1, 2):
        report = build_scene(model, tmp_path / f"{workers}.db", QUICK, BAKE, workers=workers)
    (stage,) = (stage for stage in report.stages if stage.stage == LIGHT.name)
    assert stage.counts["lamps"] >= 25
    assert contents(tmp_path / "1.db") == contents(tmp_path / "2.db")
    light = Artifacts(DatabaseFolder.open(tmp_path / "1.db")).stored(LIGHT)
    assert light is not None
    served = read_served(tmp_path / "1.db")
    for row in (row for row in served.index["textures"] if "light" in row):
        codes = load_image(served.file(row["previews"][-1]["file"])).array()
        codes = scale_hue(codes.astype(float), 1 / HUE)
        shown = light.exposure[row["light"]] * coded_light(codes, light.white[row["light"]])
        assert 0.01 < shown.min() < 0.5
        assert shown.max() > 1
    glbs = [read_glb(f.read_bytes()) for f in (tmp_path / "1.db/www/gltf").glob("*.glb")]
    panels = [k for glb in glbs for k in glb.primitives if k.object == "panel"]
    assert panels
    assert all(panel.light is None and panel.color is None for panel in panels)


def test_baked_again_only_when_something_has_changed(made: Path, folder: Path) -> None:
    model, db = folder / "model/two_rooms.obj", folder / "lit.db"
    assert built(model, db, BAKE) == []
    (plan,) = (p for p in plan_build(model, db, QUICK, BAKE) if p.stage == LIGHT.name)
    assert plan.plan == "current"
    assert built(model, db, BAKE, TextureOptions(fallback=False)) == ["textures", "light", "emit"]
    assert not any(name.endswith(".png") for name in contents(db))
    assert built(model, db, BAKE) == ["textures", "light", "emit"]
    assert contents(db) == contents(made / "lit.db")


def test_plans_and_causes(folder: Path) -> None:
    """Options of textures are a reason to bake again, in plans and in the status, too."""
    model, db = folder / "model/two_rooms.obj", folder / "lit.db"
    coarse = TextureOptions(max_side=64)
    plans = {p.stage: p for p in plan_build(model, db, QUICK, BAKE, coarse)}
    assert plans[LIGHT.name].plan == "run"
    run_stage(db, coarse, workers=1)
    (light,) = (s for s in database_status(db).stages if s.stage == LIGHT.name)
    assert (light.state, light.why) == (
        "stale",
        "made from an earlier choice of options of textures",
    )
    run_stage(db, PLAIN, workers=1)
    messages = [issue.message for issue in validate(db).issues if issue.code == "PTM-D656"]
    assert any("which no stage has written" in message for message in messages)


def test_a_rebuild_leaves_nothing_to_do(folder: Path) -> None:
    model, db = folder / "model/two_rooms.obj", folder / "lit.db"
    build_scene(model, db, QUICK, BAKE, workers=1, rebuild=True)
    assert built(model, db, BAKE) == []


def test_light_comes_and_goes(folder: Path) -> None:
    model, db = folder / "model/two_rooms.obj", folder / "lit.db"
    assert built(model, db, PLAIN) == ["light", "emit"]
    assert contents(db) == contents(folder / "plain.db")
    run_stage(db, BAKE, workers=1)
    assert {s.stage: s.state for s in database_status(db).stages}["emit"] == "stale"
    assert built(model, db, BAKE) == ["emit"]
    assert validate(db).issues == ()


def test_a_database_of_an_earlier_release(folder: Path) -> None:
    db = folder / "plain.db"
    manifest = json.loads((db / "manifest.json").read_text())
    del manifest["stages"][LIGHT.name]
    (db / "manifest.json").write_text(json.dumps(manifest))
    assert {s.state for s in database_status(db).stages} == {"done"}
    assert validate(db).issues == ()
    assert built(folder / "model/two_rooms.obj", db, PLAIN) == []


@pytest.mark.parametrize("options", [{"light_density": 0.0}, {"light_samples": 0}])
def test_impossible_options(options: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="is not possible") as refused:
        LightOptions("bake", **options)
    assert refused.value.code == "PTM-I111"


def test_options_without_light(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build-scene", "x.obj", "--light", "none", "--light-samples", "9"]) == 3
    error = capsys.readouterr().err
    assert "--light-samples does nothing with --light none" in error
    assert "use --light auto or bake" in error


@pytest.mark.parametrize("light", ["auto", "model", "bake"])
def test_density_is_of_all_lightmaps(light: Any) -> None:
    assert LightOptions(light, light_density=4.0).light_density == 4.0


@pytest.mark.parametrize(
    ("light", "more"),
    [
        ("none", {"light_density": 4.0}),
        ("model", {"light_samples": 9}),
        ("none", {"light_samples": 9}),
        ("model", {"true_colours": "none"}),
    ],
)
def test_options_of_other_light(light: Any, more: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"does nothing with --light {light}") as refused:
        LightOptions(light, **more)
    assert refused.value.code == "PTM-I111"
    density = "light_density" in more
    remedy = "auto or bake or model" if density else "auto or bake"
    assert refused.value.remedy == f"leave it out, or use --light {remedy}"


def replaced(db: Path, **arrays: Any) -> None:
    """Changes arrays of the light, and their hash in the manifest."""
    file = db / arrays_of(LIGHT.name)
    held = unpack_arrays(file.read_bytes(), file=file)
    data = pack_arrays({**held, **{n: change(held[n]) for n, change in arrays.items()}})
    text = (db / "manifest.json").read_text()
    (db / "manifest.json").write_text(text.replace(sha256(file.read_bytes()), sha256(data)))
    file.write_bytes(data)


@pytest.mark.parametrize(
    ("array", "change"),
    [
        ("uv", lambda uv: uv + 1),
        ("uv", lambda uv: uv * np.nan),
        ("side", lambda side: -side),
        ("side", lambda side: side[1:]),
        ("vertex", lambda vertex: vertex[1:]),
        ("vertex", lambda vertex: vertex[..., 0]),
        ("white", lambda white: 0 * white),
        ("exposure", lambda exposure: exposure[1:]),
        ("horizon", lambda horizon: horizon[:1]),
        ("mapped", lambda mapped: mapped.astype(np.int8)),
    ],
)
def test_damaged_arrays(folder: Path, array: str, change: Any) -> None:
    db = folder / "lit.db"
    replaced(db, **{array: change})
    assert "PTM-D720" in {issue.code for issue in validate(db).issues}


def test_the_light_of_other_geometry(folder: Path) -> None:
    db = folder / "lit.db"
    replaced(db, uv=lambda uv: uv[1:], vertex=lambda vertex: vertex[1:])
    with pytest.raises(DatabaseError, match="light is that of other geometry") as refused:
        run_stage(db, EmitOptions(), workers=1, rebuild=True)
    assert refused.value.code == "PTM-D008"


def test_a_lightmap_of_another_cell(folder: Path) -> None:
    db = folder / "lit.db"
    text = (db / "www/hints.json").read_text()
    swapped = text.replace('"light":0', '"light":9').replace('"light":1', '"light":0')
    changed = swapped.replace('"light":9', '"light":1')
    assert changed != text
    (db / "www/hints.json").write_text(changed)
    messages = [issue.message for issue in validate(db).issues]
    assert sum("is not the lightmap of this cell" in message for message in messages) >= 2


def test_a_dark_cell_has_white_in_balance() -> None:
    """Of cells with red light, one is lit far less than the others: two stops, and their hue."""
    from ptmtools.pipeline.stages.light import _exposures

    hue = np.array([-0.4, 0.1, 0.3])
    lights: Any = [SimpleNamespace(exposure=x, balance=hue, area=1.0) for x in (0.0, 0.0, 9.0)]
    cells: Any = SimpleNamespace(standing=np.array([1, 1, 0]), adjacent=lambda: [[1], [0], []])
    factor, exposure = _exposures(lights, cells)
    assert factor == 1
    np.testing.assert_allclose(exposure, np.exp(hue) * [[1], [1], [4]])
