"""USD: kinds of files, units and axes, cameras, names, and the moment that is shown."""

from __future__ import annotations

import math
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.scene import ingest
from ptmtools.scene.notes import IngestNotes
from tests.scene.conftest import Put, noise, png, read_source

if find_spec("pxr") is not None:
    from pxr import Gf, Usd, UsdGeom, UsdSkel

    from tests.scene.usd import usd_models as made
from tests.scene.usd.reading import equal


def test_the_same_of_all_kinds_of_files(put: Put, tmp_path: Path) -> None:
    put("maps/brick.png", png(noise(1)))
    on = made.two_rooms(tmp_path / "a.usda")
    on.Export(str(tmp_path / "b.usdc"))
    on.Export(str(tmp_path / "c.usd"))
    made.package(tmp_path / "b.usdc", tmp_path / "d.usdz")
    sources, notes = [], []
    for name in ("a.usda", "b.usdc", "c.usd", "d.usdz"):
        findings = IngestNotes(tmp_path / name)
        sources.append(read_source(tmp_path / name, notes=findings))
        notes.append(findings.entries)
    assert len(sources[0].triangles) == 2 * (5 * 2 + 2 - 1) + 2
    assert all(equal(sources[0], other) for other in sources[1:])
    assert notes == [notes[0]] * 4
    assert {(s.metres, s.up, s.objects) for s in sources} == {(1.0, "y", sources[0].objects)}
    images = [s.materials[0].texture for s in sources]
    assert all(image is not None and image.read() == png(noise(1)) for image in images)
    assert [image.label.split("/")[-1] for image in images if image] == ["brick.png"] * 4


def test_a_quad(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    made.mesh(on, st=made.CORNERS)
    on.GetRootLayer().Save()
    scene = ingest(tmp_path / "a.usda")
    assert scene.objects == ("wall",)
    assert (scene.space.metres, scene.space.up) == (1.0, "y")
    assert (scene.space.unit_guessed, scene.space.up_guessed) == (False, False)
    assert scene.points.min(axis=0).tolist() == [-5, 0, 0]
    assert not scene.two_sided.any()
    assert scene.materials[0].color == (0.8, 0.8, 0.8)
    assert scene.colors is None


def test_the_same_each_time(put: Put, tmp_path: Path) -> None:
    put("maps/brick.png", png(noise(1)))
    made.two_rooms(tmp_path / "a.usda")
    first, second = (ingest(tmp_path / "a.usda").to_arrays() for _ in range(2))
    assert all(first[name].tobytes() == second[name].tobytes() for name in first)


@pytest.mark.parametrize(
    ("metres", "up", "expected"),
    [(0.01, "Z", (0.01, "z")), (0.3048, "Y", (0.3048, "y")), (None, None, (None, None))],
)
def test_unit_and_axis_where_they_are_said(
    read: Any, metres: float | None, up: str | None, expected: Any
) -> None:
    on = Usd.Stage.CreateInMemory()
    if metres is not None:
        UsdGeom.SetStageMetersPerUnit(on, metres)
    if up is not None:
        UsdGeom.SetStageUpAxis(on, up)
    made.mesh(on, "/wall")
    source = read(on).source
    assert (source.metres, source.up) == expected


@pytest.mark.parametrize("metres", [0.0, -1.0, math.inf, math.nan])
def test_a_unit_that_cannot_be_is_guessed(read: Any, metres: float) -> None:
    on = made.stage()
    UsdGeom.SetStageMetersPerUnit(on, metres)
    made.mesh(on)
    assert read(on).source.metres is None


def test_centimetres_with_z_up(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    UsdGeom.SetStageMetersPerUnit(on, 0.01)
    UsdGeom.SetStageUpAxis(on, "Z")
    made.box(on, "/World/hall", (0, 0, 0), (1000, 800, 300), inwards=True)
    on.GetRootLayer().Save()
    scene = ingest(tmp_path / "a.usda")
    assert np.allclose(np.ptp(scene.points, axis=0), [10, 3, 8])
    assert not {note.code for note in scene.notes} & {"PTM-N201", "PTM-N202", "PTM-N227"}


def test_a_unit_without_a_name_is_believed(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    UsdGeom.SetStageMetersPerUnit(on, 0.1)
    made.box(on, "/World/hall", (0, 0, 0), (100, 30, 80), inwards=True)
    on.GetRootLayer().Save()
    scene = ingest(tmp_path / "a.usda")
    assert np.allclose(np.ptp(scene.points, axis=0), [10, 3, 8])
    assert "PTM-N227" not in {note.code for note in scene.notes}


def test_cameras(read: Any) -> None:
    on = made.stage()
    made.mesh(on)
    eye = UsdGeom.Camera.Define(on, "/World/eyes/left")
    eye.AddTranslateOp().Set((1, 2, 3))
    eye.AddRotateYOp().Set(90)
    eye.CreateVerticalApertureAttr(24)
    eye.CreateFocalLengthAttr(12)
    flat = UsdGeom.Camera.Define(on, "/World/eyes/flat")
    flat.CreateProjectionAttr("orthographic")
    got = read(on)
    (camera,) = got.source.cameras
    assert (camera.name, camera.position) == ("eyes/left", (1, 2, 3))
    assert camera.direction == pytest.approx((-1, 0, 0))
    assert camera.field_of_view == pytest.approx(math.pi / 2)
    assert "flat" in got.says("PTM-N215")


@pytest.mark.parametrize(
    ("path", "default", "name"),
    [
        ("/World/Chair/legs", "/World", "Chair/legs"),
        ("/World/Chair", "/World", "Chair"),
        ("/Chair", "/World", "Chair"),
        ("/Worldly/Chair", "/World", "Worldly/Chair"),
        ("/Chair", "/Chair", "Chair"),
    ],
)
def test_names(read: Any, path: str, default: str, name: str) -> None:
    on = Usd.Stage.CreateInMemory()
    made.mesh(on, path)
    on.SetDefaultPrim(on.OverridePrim(default))
    assert read(on).source.objects == (name,)


def test_the_first_moment_is_shown(read: Any) -> None:
    on = made.stage()
    wall = made.mesh(on)
    move = wall.AddTranslateOp()
    move.Set((5, 0, 0), 10)
    move.Set((99, 0, 0), 20)
    points = wall.GetPointsAttr()
    points.Set([Gf.Vec3f(x, y, 1) for x, y, _ in made.QUAD], 10)
    points.Set([Gf.Vec3f(x, y, 2) for x, y, _ in made.QUAD], 20)
    got = read(on)
    assert got.source.points.min(axis=0).tolist() == [5, 0, 1]
    assert got.count("PTM-N215") == 2


def test_skins_are_shown_in_their_rest_pose(read: Any) -> None:
    on = made.stage()
    UsdSkel.Root.Define(on, "/World/body")
    wall = made.mesh(on, "/World/body/wall")
    binding = UsdSkel.BindingAPI.Apply(wall.GetPrim())
    binding.CreateJointIndicesPrimvar(False, 1).Set([0] * 4)
    binding.CreateBlendShapeTargetsRel()
    got = read(on)
    assert "rest pose" in got.says("PTM-N215")
    assert "blend shapes" in got.says("PTM-N215")
