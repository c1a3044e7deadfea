"""The experiments of clients and of other forms of a model."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.coverage.options import AchOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.model import Scene, SourceImage
from ptmtools.texture import EncodeOptions
from ptmtools_lab.tradeoff import FURTHER
from ptmtools_lab.tradeoff.experiment import Experiment, Measurement, Setting, decibels
from ptmtools_lab.tradeoff.forms import (
    ViewerRays,
    coarse_experiment,
    corners_of,
    distances_between,
    interlaced_experiment,
    jpeg_experiment,
    light_experiment,
    look,
    octree_experiment,
    only,
    outline,
)
from ptmtools_lab.tradeoff.stages import textures_experiment
from ptmtools_systems.campus.objects import parts_of
from tests.systems.campus.models import level, write_obj

TWO_ROOMS = Path(__file__).resolve().parents[3] / "sample_data/two_rooms/two_rooms.obj"
SMOOTH = np.broadcast_to(np.arange(256, dtype=np.uint8)[:, None, None], (256, 256, 3)).copy()
NOISE = np.random.default_rng(1).integers(0, 256, (256, 256, 3), np.uint8)


def dome(steps: int) -> np.ndarray:
    """(n, 5) corners of the quads of a hemisphere of 1 m."""
    turn = np.linspace(0, 2 * np.pi, 4 * steps + 1)
    height = np.linspace(0.02, 0.98, steps + 1) * np.pi / 2
    h, t = np.meshgrid(height, turn, indexing="ij")
    point = np.stack([np.cos(h) * np.sin(t), np.sin(h), np.cos(h) * np.cos(t)], axis=-1)
    corner = [point[:-1, :-1], point[:-1, 1:], point[1:, 1:], point[1:, :-1]]
    quads = np.stack(corner, axis=2).reshape(-1, 3)
    return np.concatenate([quads, np.zeros((len(quads), 2))], axis=1)


@pytest.fixture(scope="module")
def alone(scene: Scene) -> Scene:
    """The dome without the floor."""
    return only(scene, scene.triangle_object == 0)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """A dome of 3,200 triangles over a floor."""
    folder = tmp_path_factory.mktemp("dome")
    (folder / "campus.mtl").write_text("newmtl plain\nKd 1 1 1\n")
    objects = [("Dome", {"plain": dome(20)}), ("Floor", {"plain": level((-30, -30), (30, 30), 0)})]
    write_obj(folder / "dome.obj", objects)
    return ingest(folder / "dome.obj", IngestOptions(unit="m", up="y"))


def measured(experiment: Experiment, *names: str) -> Mapping[str, Measurement]:
    settings = {setting.name: setting for setting in experiment.settings}
    return {name: experiment.measure(settings[name]) for name in names or settings}


def test_rays_meet_what_is_there() -> None:
    cube = np.array([[x, y, z] for x in (0, 2) for y in (0, 2) for z in (0, 2)], np.float64)
    square = np.array([[0, 1, 3], [0, 3, 2]], np.int32)  # x = 0
    rays = ViewerRays.from_points(cube)
    seen = look(rays, cube, square)
    place = (rays.start + seen.distance[:, None] * rays.along)[seen.met]
    assert np.abs(place[:, 0]).max() < 1e-5
    corner = cube[square[seen.triangle[seen.met]]]
    assert np.allclose(np.einsum("nk,nkx->nx", seen.weight[seen.met], corner), place, atol=1e-5)
    moved = look(rays, cube + [0.1, 0, 0], square)
    ahead = rays.along[seen.met & moved.met, 0]
    assert np.allclose(distances_between(seen, moved) * np.abs(ahead), 0.1, atol=1e-5)
    assert outline(seen, seen) == 0
    assert outline(seen, look(rays, cube + [9, 0, 0], square)) > 0.9


def test_finer_octrees_have_truer_normals(alone: Scene) -> None:
    rows = measured(octree_experiment(alone), "--depth 5", "--depth 9", "--error 0.4")
    coarse, fine, rough = rows.values()
    assert fine.error < coarse.error < rough.error
    assert rough.work < fine.work
    assert fine.more["memory"] > rough.more["memory"] > 0
    assert fine.error < 3 < fine.worst + 3


def test_fewer_faces_change_the_outline(alone: Scene) -> None:
    experiment = octree_experiment(alone)
    few = experiment.measure(Setting("", {"faces": 40}))
    many = experiment.measure(Setting("", {"faces": 1600}))
    assert few.more["outline"] > 2 * many.more["outline"]


def test_larger_first_files_show_more() -> None:
    rows = list(measured(interlaced_experiment([SMOOTH, NOISE])).values())
    assert [row.error for row in rows] == sorted(row.error for row in rows)
    assert [row.work for row in rows] == sorted((row.work for row in rows), reverse=True)
    whole = rows[0]  # --min 256
    assert whole.error == 0
    assert whole.more["files"] == 2
    assert math.isinf(whole.more["PSNR"])
    # Of a ramp, every second row stands for the next: half of the texels are off by one.
    half = measured(interlaced_experiment([SMOOTH]), "--min 128")["--min 128"]
    assert half.error == pytest.approx(math.sqrt(0.5))
    assert half.more["PSNR"] == pytest.approx(decibels(math.sqrt(0.5)))


def test_jpeg_files_against_their_sources() -> None:
    rows = list(measured(jpeg_experiment([SMOOTH, NOISE])).values())
    assert [row.error for row in rows] == sorted((row.error for row in rows), reverse=True)
    assert [row.work for row in rows] == sorted(row.work for row in rows)
    grey = jpeg_experiment([SMOOTH[:, :, :1], NOISE[:, :, :2], NOISE[:100, :70]])
    assert measured(grey, "--quality 95")["--quality 95"].error > 0


def test_coarse_meshes_against_the_model(scene: Scene) -> None:
    experiment = coarse_experiment(scene, parts_of(scene, 0.0)[:1])
    rows = measured(experiment, "--ratio 0.3", "--ratio 0.1", "--error 0.1")
    many, few, rough = rows.values()
    assert many.work > few.work
    assert 0 < many.error < few.error <= rough.error < 0.2
    same = experiment.measure(Setting("", {"ratio": 1.0}))
    assert (same.error, same.more["outline"]) == (0, 0)


def test_more_rays_are_nearer_to_the_light(scene: Scene) -> None:
    experiment = light_experiment(scene, parts_of(scene, 0.0), limit=512)
    rows = measured(experiment, "--samples 1", "--samples 16", "--samples 256")
    one, some, many = (row.error for row in rows.values())
    assert many < some / 2 < one / 4
    assert 0 < experiment.reference_error < many
    assert "--samples 1024" not in {setting.name for setting in experiment.settings}


def test_textures_are_compared_at_a_prefix() -> None:
    image = io.BytesIO()
    Image.fromarray(SMOOTH).save(image, "png")
    source = SourceImage("ramp.png", "0" * 64, image.getvalue)
    rows = measured(
        textures_experiment([source], EncodeOptions()), "--profile raw", "--profile fast"
    )
    raw, fast = rows.values()
    # Raw, the prefix has 64² of 256²; compressed, a ramp is there whole.
    assert raw.error == pytest.approx(np.sqrt(np.square(np.arange(4) - 1).mean()))
    assert (fast.error, fast.more["inexact"], raw.more["inexact"]) == (0, 0, 0)
    assert math.isinf(fast.more["PSNR"])
    assert fast.more["ratio"] < raw.more["ratio"]
    image = io.BytesIO()
    Image.fromarray(NOISE).save(image, "png")
    source = SourceImage("noise.png", "0" * 64, image.getvalue)
    lossy = textures_experiment([source], EncodeOptions(max_error=4))
    inexact = measured(lossy, "--profile fast")["--profile fast"]
    assert inexact.more["inexact"] > 0.5
    assert inexact.error > 50  # an eighth of noise is far from all of it


def test_corners_of_images() -> None:
    plain = io.BytesIO()
    Image.fromarray(NOISE[:40, :70]).save(plain, "png")
    (corner,) = corners_of([SourceImage("b", "1" * 64, plain.getvalue)])
    assert (corner == NOISE[:32, :64]).all()
    assert corners_of([]) == []
    assert interlaced_experiment([]).settings == jpeg_experiment([]).settings == []


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("trade") / "rooms.db"
    build_scene(TWO_ROOMS, path, AchOptions(preset="fast", backend="embree"))
    return path


@pytest.mark.parametrize("name", FURTHER)
def test_each_by_its_name(db: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tradeoff", str(db), "--stage", name, "--json"]) == 0
    (trade,) = json.loads(capsys.readouterr().out)
    assert trade["stage"] == name
    assert all(t["measured"]["work"] > 0 for t in trade["trials"])
    if name == "client":
        names = {t["setting"]["name"] for t in trade["trials"]}
        assert {"--delta-t 0.5", "--static-memory inf"} <= names
        received = {t["setting"]["name"]: t["measured"]["work"] for t in trade["trials"]}
        assert received["--delta-t-static 1.0"] <= received["--delta-t-static 80.0"]
