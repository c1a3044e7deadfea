"""Textures in other forms: what can be fetched, what it shows, and by how much that is wrong."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError, InputError
from ptmtools.link import Conditions
from ptmtools.output.served import read_served
from ptmtools.rendering.kernels import GREY
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.records import Shows, own_levels
from ptmtools.texture import decode
from ptmtools_lab.comparing import SimulateOptions, apply_counting, budget_of, play
from ptmtools_lab.forms import PTM, mip_levels, mip_sizes
from ptmtools_lab.measures import Flip
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.report import table
from ptmtools_lab.simulation import simulate
from ptmtools_lab.tables import Drawing, look
from ptmtools_lab.world import World, read_forms
from ptmtools_systems.interlace import deinterlace, read_manifest
from tests.lab.conftest import Ptm
from tests.lab.test_view import (
    CAMERA,
    Room,
    at_point,
    bilinear,
    detail_at,
    first_surface,
    room,
)
from tests.lab.worlds import SEEDS

GPUII = POLICIES["gpuii"]


def pose(random: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    eye = random.uniform([1, 0.5, 1], [5, 2.5, 3])
    direction = random.normal(size=3) * [1, 0.3, 1]
    return eye[None], direction[None] / np.linalg.norm(direction)


@settings(max_examples=10)
@given(SEEDS)
def test_the_levels_of_a_ptm_as_a_form_of_their_own(seed: int) -> None:
    """To the last bit what the tables of levels say, whatever they are compared with."""
    random = np.random.default_rng(seed)
    made, eyes = room(random), pose(random)
    other = Room(made.surfaces, [[255 - level for level in rows] for rows in made.levels]).pyramids
    for full in (None, other):
        views, same = look(
            made.surfaces, made.pyramids, CAMERA, *eyes, 
            drawing=Drawing(forms={"own": own_levels(made.pyramids)}, full=full),
        )  # fmt: skip
        (alone,) = look(made.surfaces, made.pyramids, CAMERA, *eyes, drawing=Drawing(full=full))
        for name in ("start", "cell", "texture", "error", "square", "need", "sight"):
            assert getattr(views, name).tobytes() == getattr(same, name).tobytes(), name
            assert getattr(views, name).tobytes() == getattr(alone, name).tobytes(), name


@settings(max_examples=10)
@given(SEEDS)
def test_columns_against_slow_ones(seed: int) -> None:
    """Each with a pyramid of its own: here of three other rooms, of which some levels are left."""
    random = np.random.default_rng(seed)
    made = room(random)
    steps = [[random.integers(0, 256, (s << k, s, 3), dtype=np.uint8) for k in (0, 1)]
             for s in (4, 8, 16)]  # fmt: skip
    chains = [mip_levels(image) for rows in steps for image in rows]
    pyramids = Room(made.surfaces, chains).pyramids
    left = random.integers(1, pyramids.levels + 1)
    row = np.array([[0, 0, 1], [2, 2, 3], [4, 4, 5]])
    last = np.array([2, 1, 2])
    held = np.where(np.arange(3) > 0, left[row], 0)
    mean = random.uniform(0, 255, (3, 3))
    shows = Shows(pyramids, row, held, last, mean)
    eye, direction = pose(random)
    _, views = look(
        made.surfaces, made.pyramids, CAMERA, eye, direction, drawing=Drawing(forms={"": shows})
    )
    rays, axes = CAMERA.rays(direction)
    expected: dict[tuple[int, int], NDArray[np.float64]] = {}
    for ray in rays.reshape(-1, 3):
        f, point = first_surface(made.surfaces, eye[0], ray)
        if f < 0:
            continue
        surfaces, t = made.surfaces, int(made.surfaces.texture[f])
        sums = expected.setdefault((int(surfaces.cell[f]), t), np.zeros((2, 4)))
        if t < 0:
            wrong = [np.sqrt(((GREY - 255 * surfaces.color[f]) ** 2).mean())]
            wants = [1.0]
        else:
            at, tint, clamped = at_point(surfaces, f, point), surfaces.color[f], surfaces.clamped[f]

            def shown(
                levels: list[NDArray[np.uint8]], count: int, ray=ray, f=f, at=at, clamped=clamped
            ) -> tuple[NDArray[np.float64], float]:
                size = np.array(levels[-1].shape[1::-1])
                detail = detail_at(made.surfaces, f, eye[0], ray, axes[0], size)
                detail = min(max(detail, 0.0), len(levels) - 1.0)
                own = max(detail, float(len(levels) - count))
                sharp, part = len(levels) - 1 - int(own), own - int(own)
                each = [bilinear(levels[n], at, clamped) for n in (sharp, max(sharp - 1, 0))]
                want = np.clip(len(levels) - count + 1 - detail, 0, 1)
                return (1 - part) * each[0] + part * each[1], float(want)

            exact = shown(made.levels[t], len(made.levels[t]))[0] * tint
            colors, wants = [np.full(3, GREY), mean[t] * tint], []
            for k in range(1, last[t] + 1):
                color, want = shown(chains[row[t, k]], int(held[t, k]))
                colors.append(color * tint)
                wants.append(want if k > 1 else 1.0)
            wrong = [np.sqrt(((color - exact) ** 2).mean()) for color in colors]
        sums[0, : len(wrong)] += wrong
        sums[1, : len(wants)] += wants
    pairs = list(zip(views.cell.tolist(), views.texture.tolist(), strict=True))
    assert set(pairs) == set(expected)
    for r, pair in enumerate(pairs):
        sums = expected[pair] / len(rays.reshape(-1, 3))
        assert views.error[r] == pytest.approx(sums[0], rel=1e-3, abs=2e-3)
        assert views.need[r] == pytest.approx(sums[1, :2], rel=1e-3, abs=2e-3)


@pytest.mark.parametrize("shape", [(8, 8), (4, 16), (1, 1), (16, 1)])
def test_mip_levels_are_means_of_boxes(shape: tuple[int, int]) -> None:
    image = np.random.default_rng(3).integers(0, 256, (*shape, 3), dtype=np.uint8)
    levels = mip_levels(image)
    sizes = [level.shape[1::-1] for level in levels[::-1]]
    assert sizes == list(mip_sizes(*shape[::-1]))
    assert sizes[-1] == (1, 1)
    assert np.array_equal(levels[-1], image)
    for fine, coarse in zip(levels[:0:-1], levels[-2::-1], strict=True):
        tall, wide = (a // b for a, b in zip(fine.shape[:2], coarse.shape[:2], strict=True))
        boxes = fine.reshape(coarse.shape[0], tall, coarse.shape[1], wide, 3).astype(float)
        assert np.abs(boxes.mean(axis=(1, 3)) - coarse).max() <= 0.5


def test_what_can_be_fetched_of_interlaced_images(interlaced_world: World) -> None:
    world = interlaced_world.in_form("interlaced")
    stock, served = world.catalogue, world.served
    assert sorted(stock.levels.tolist()) == [1, 1, 3, 3]
    for t in range(stock.texture_count):
        folder = served.texture_set("interlace", t)
        parts = read_manifest(folder).parts
        files = [(folder / part.name).stat().st_size for part in parts]
        last = stock.levels[t]
        assert np.diff(stock.ends[t, : last + 1]).tolist() == files
        texels = [part.joined[0] * part.joined[1] for part in parts]
        assert stock.size[t, 1 : last + 1].tolist() == [list(part.joined) for part in parts]
        # Four bytes a texel, and a third more for mip levels.
        assert stock.memory[t, 1 : last + 1] == pytest.approx(np.array(texels) * 16 / 3, rel=1e-3)
    own = interlaced_world.catalogue
    assert (stock.record_bytes == own.record_bytes).all()
    assert stock.shapes is own.shapes
    papers = apply_counting(interlaced_world, SimulateOptions(paper_bytes=True))
    for form in (PTM, *interlaced_world.other_forms):
        whole = interlaced_world.in_form(form).catalogue.whole
        assert papers.in_form(form).catalogue.whole == pytest.approx(whole * 3 / 4)


def test_what_interlaced_images_show(interlaced_world: World) -> None:
    """Of each step the image that so many files make, and mip levels of that image."""
    world = interlaced_world.in_form("interlaced")
    shows, served = world.shows, world.served
    assert shows is not None
    for t in range(world.catalogue.texture_count):
        folder = served.texture_set("interlace", t)
        for k in range(1, int(shows.last[t]) + 1):
            r = shows.row[t, k]
            assert shows.held[t, k] == shows.pyramids.levels[r]
            for n, level in enumerate(mip_levels(deinterlace(folder, k)[:, :, :3])):
                begin = shows.pyramids.start[r, n]
                actual = shows.pyramids.texel[begin : begin + level.size]
                assert np.array_equal(actual, level.ravel())


def test_what_is_left_with_all_files_there(interlaced_world: World) -> None:
    """Levels of a `.ptm` are rounded down, mip levels to the nearest; else an image with sides that
    are powers of two is the texture. One that was scaled is another."""
    world = interlaced_world.in_form("interlaced")
    views, stock, index = world.views, world.catalogue, world.served.index
    used = views.texture >= 0
    rows = np.flatnonzero(used)
    left = views.error[rows, stock.levels[views.texture[rows]] + 1]
    covered = views.need[rows, 0]
    mean = {t: left[views.texture[rows] == t].sum() / covered[views.texture[rows] == t].sum()
            for t in set(views.texture[rows].tolist())}  # fmt: skip
    for t, wrong in mean.items():
        powers = index["textures"][t]["width"] & (index["textures"][t]["width"] - 1) == 0
        assert wrong < 2 if powers else 2 < wrong < 12
    assert len(mean) == 4
    again = decode(world.served.texture_file(0).read_bytes())
    assert again.shape[1] == index["textures"][0]["width"]


def test_pictures_and_tables_of_a_form_agree(interlaced_world: World) -> None:
    world = interlaced_world.in_form("interlaced")
    renderer = FrameRenderer(world, world.camera.height, samples=1)
    ours = FrameRenderer(interlaced_world, world.camera.height, samples=1)
    stock, views = world.catalogue, world.views
    random = np.random.default_rng(1)
    there = np.ones(stock.cell_count, dtype=bool)
    for f in range(0, world.frames, 9):
        sight = renderer.look(world.track.eye[f], world.track.direction[f])
        column = random.integers(0, stock.levels + 1)
        full = renderer.full(sight)
        assert (full == ours.full(sight)).all(), "both are compared with the same picture"
        apart = renderer.colors(sight, there, column) - full
        rows = np.arange(len(views.error))[views.rows(int(world.track.view[f]))]
        rows = rows[views.texture[rows] >= 0]
        expected = views.error[rows, column[views.texture[rows]] + 1].sum()
        drawn = np.sqrt((apart**2).mean(axis=2)).mean()
        assert drawn == pytest.approx(float(expected), rel=1e-4, abs=1e-6)


def test_one_walk_in_several_forms(interlaced_world: World) -> None:
    """Each policy walks in its own, with shares of the same memory; the others are as without."""
    options = SimulateOptions(policy="lru,gpuii", bandwidth="512k", memory="30%,inf")
    alone = SimulateOptions(policy="lru", bandwidth="512k", memory="30%,inf")
    played = play({"walk": interlaced_world}, options)
    assert [p.run.policy for p in played] == ["lru", "gpuii"] * 2
    before = play({"walk": interlaced_world.in_form(PTM)}, alone)
    assert [p.measures for p in played[::2]] == [p.measures for p in before]
    assert played[0].run.budget == played[1].run.budget
    wholes = [interlaced_world.in_form(form).catalogue.whole for form in ("ptm", "interlaced")]
    assert [p.run.budget for p in played[2:]] == wholes
    assert budget_of(interlaced_world, options.memories[1], "interlaced") == wholes[1]
    lines = table(played, {"walk": interlaced_world})
    assert sum(line.startswith("512 kbit/s") for line in lines) == 2
    assert not any(p.run.overruns for p in played)
    assert played[3].run.error[-1] < played[3].run.error[0] / 4


def test_flip_of_a_form(interlaced_world: World) -> None:
    pytest.importorskip("flip_evaluator")
    world = interlaced_world.in_form("interlaced")
    run = simulate(world, GPUII, Conditions(None), world.catalogue.whole)
    nothing = simulate(world, GPUII, Conditions(100.0), world.catalogue.whole)
    flip = Flip(world, count=2)
    assert flip.each(run).mean() < flip.each(nothing).mean()


def test_the_command(ptm: Ptm, interlaced_rooms: Path, walk_file: Path, tmp_path: Path) -> None:
    words = ["simulate", interlaced_rooms, "--walk", walk_file, "--policy", "gpuii,best"]
    words += ["--bandwidth", "4M", "--memory", "50%", "--json", "--strip", tmp_path / "strip.png"]
    words += ["--frames", tmp_path / "frames", "--every", "10"]
    done = ptm(*words)
    assert (done.status, done.err) == (0, "")
    first, second = json.loads(done.out)["runs"]
    assert (first["policy"], second["policy"]) == ("gpuii", "best")
    assert first["memory"] == second["memory"]
    assert (tmp_path / "strip.png").is_file()
    assert len(list((tmp_path / "frames").iterdir())) == 3


def test_a_world_that_was_not_made_ready(world: World) -> None:
    with pytest.raises(InputError, match="PTM-I701"):
        simulate(world, GPUII, Conditions(None), 1000)


def garbled(folder: Path) -> None:
    (folder / "1.png").write_bytes(b"x" * (folder / "1.png").stat().st_size)


def resized(folder: Path) -> None:
    file = folder / "interlace.json"
    document = json.loads(file.read_text())
    document["original"]["width"] += 1
    file.write_text(json.dumps(document))


@pytest.mark.parametrize(
    ("damage", "code"),
    [
        (lambda folder: shutil.rmtree(folder), "PTM-D005"),
        (lambda folder: (folder / "1.png").unlink(), "PTM-D005"),
        (garbled, "PTM-D006"),
        (lambda folder: (folder / "interlace.json").write_text("{"), "PTM-D006"),
        (resized, "PTM-D006"),
    ],
    ids=["gone", "file", "garbled", "json", "size"],
)
def test_sets_that_are_damaged(
    interlaced_rooms: Path, tmp_path: Path, damage: Callable[[Path], None], code: str
) -> None:
    copy = Path(shutil.copytree(interlaced_rooms / "www", tmp_path / "www"))
    served = read_served(copy)
    damage(served.texture_set("interlace", 1))
    with pytest.raises(DatabaseError, match=code):
        read_forms(served, read_pyramids(served), ["interlaced"])


def test_a_set_outside_the_served_folder(interlaced_rooms: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(interlaced_rooms / "www", tmp_path / "www"))
    file = copy / "hints.json"
    index = json.loads(file.read_text())
    index["textureSets"]["interlace"] = "../{name}/"
    file.write_text(json.dumps(index))
    with pytest.raises(DatabaseError, match="outside the served folder"):
        read_served(copy).texture_set("interlace", 0)
