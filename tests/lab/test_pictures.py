"""Pictures against the tables, and what they must show by themselves."""

from __future__ import annotations

import io
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import MissingComponentError
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.rays import RayCamera
from ptmtools.rendering.records import Pyramids
from ptmtools_lab import measures as flips
from ptmtools_lab.comparing import SimulateOptions, play
from ptmtools_lab.figures import frames, strip
from ptmtools_lab.lossy import no_previews
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.world import World

#: Corners of a texture, clockwise from the upper left.
CORNERS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0]], dtype=np.uint8)


@pytest.fixture
def card() -> Any:
    """A textured square of 2 m, 1 m in front of who looks along -z with a view of 90°, twice as
    wide as high."""
    point = np.array([[-1, 1, -1], [1, 1, -1], [1, -1, -1], [-1, -1, -1]], dtype=np.float64)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64)
    loop = [[0, 1, 2], [0, 2, 3]]
    surfaces = Surfaces(
        corner=point[loop],
        uv=uv[loop],
        cell=np.zeros(2, np.int32),
        shape=np.zeros(2, np.int32),
        texture=np.zeros(2, np.int32),
        color=np.ones((2, 3)),
        two_sided=np.ones(2, dtype=bool),
        glass=np.zeros(2, dtype=bool),
        clamped=np.ones((2, 2), dtype=bool),
        seen=np.array([[0, 0], [1, 1]]),
    )
    mean = CORNERS.mean(axis=0)
    texels = np.concatenate([np.rint(mean).astype(np.uint8), CORNERS[[0, 1, 3, 2]].ravel()])
    textures = Pyramids(
        texel=texels,
        start=np.array([[0, 3]]),
        size=np.array([[[1, 1], [2, 2]]]),
        levels=np.array([2]),
        mean=mean[None],
        differences=np.zeros((1, 2)),
    )
    return SimpleNamespace(
        served=SimpleNamespace(surfaces=surfaces, index={}),
        relief=None,
        pyramids=textures,
        lossy=no_previews(1),
        camera=RayCamera(2, 1, np.pi / 2, 2.0),
        catalogue=SimpleNamespace(cell_count=1, levels=np.array([2])),
        shows=None,
    )


def test_a_texture_is_the_right_way_up(card: Any) -> None:
    renderer = FrameRenderer(card, 40)
    sight = renderer.look(np.zeros(3), np.array([0.0, 0, -1]))
    full = renderer.full(sight)
    assert full.shape == (40, 80, 3)
    there = np.ones(1, dtype=bool)
    for corner, (row, column) in zip(CORNERS, [(2, 22), (2, 57), (37, 57), (37, 22)], strict=True):
        assert np.abs(full[row, column] - corner).max() < 1
    assert not full[:, np.r_[:20, 60:80]].any()  # nothing there
    coarse = renderer.colors(sight, there, np.array([1]))[:, 20:60]
    assert np.ptp(coarse.reshape(-1, 3), axis=0).max() == 0
    bare = renderer.colors(sight, there, np.array([0]))[:, 20:60]
    assert np.allclose(bare, CORNERS.mean(axis=0))
    grey = renderer.colors(sight, ~there, np.array([2]))[:, 20:60]
    assert (grey == 128).all()


def test_pictures_and_tables_agree(world: World) -> None:
    """With the same pixels, to the last digits that the tables keep."""
    renderer = FrameRenderer(world, world.camera.height, samples=1)
    assert renderer.width == world.camera.width
    stock, views = world.catalogue, world.views
    random = np.random.default_rng(1)
    for f in range(0, world.frames, 9):
        sight = renderer.look(world.track.eye[f], world.track.direction[f])
        column = random.integers(0, stock.levels + 1)
        there = random.random(stock.cell_count) < 0.8
        apart = renderer.colors(sight, there, column) - renderer.full(sight)
        rows = range(len(views.error))[views.rows(int(world.track.view[f]))]
        expected = sum(
            float(views.error[r, 0])
            if not there[views.cell[r]]
            else 0.0
            if views.texture[r] < 0
            else float(views.error[r, column[views.texture[r]] + 1])
            for r in rows
        )
        drawn = np.sqrt((apart**2).mean(axis=2)).mean()
        assert drawn == pytest.approx(expected, rel=1e-4, abs=1e-6)


def test_large_pictures_say_what_tables_do(world: World) -> None:
    (played,) = play(
        {"walk": world}, SimulateOptions(policy="paper", bandwidth="56k", memory="10%")
    )
    run = played.run
    renderer = FrameRenderer(world, 270)
    some = range(5, world.frames, 12)
    drawn = []
    for f in some:
        sight = renderer.look(world.track.eye[f], world.track.direction[f])
        apart = renderer.colors(sight, run.loaded[f], run.column[f]) - renderer.full(sight)
        drawn.append(np.sqrt((apart**2).mean(axis=2)).mean())
    table = run.error[list(some)]
    assert table.max() > 5
    assert np.corrcoef(drawn, table)[0, 1] > 0.99
    # Means of samples are less wrong than the samples.
    assert 0.8 < np.mean(drawn) / table.mean() < 1.02


def test_frames_and_strip(world: World) -> None:
    (played,) = play({"walk": world}, SimulateOptions(policy="ach", bandwidth="4M", memory="inf"))
    actual = dict(frames(world, played.run, 8.0))
    assert list(actual) == ["00000.0.png", "00008.0.png", "00016.0.png"]
    with Image.open(io.BytesIO(actual["00008.0.png"])) as picture:
        assert picture.size == (960, 540)
    first = strip(world, played)
    assert first == strip(world, played)
    with Image.open(io.BytesIO(first)) as picture:
        shown = np.asarray(picture)
    width = (shown.shape[1] - 6 * 6) // 5
    parts = [shown[52:-6, 6 + k * (width + 6) :][:, :width] for k in range(5)]
    # After 80 s everything is there, and after 3 s from a local server.
    assert np.array_equal(parts[2], parts[4])
    assert np.array_equal(parts[3], parts[4])
    assert parts[4].std() > 10


def test_a_local_server_is_faster_than_a_thin_link(world: World) -> None:
    options = SimulateOptions(policy="paper", bandwidth="4k", memory="inf")
    (played,) = play({"walk": world}, options)
    with Image.open(io.BytesIO(strip(world, played))) as picture:
        shown = np.asarray(picture).astype(int)
    width = (shown.shape[1] - 6 * 6) // 5
    parts = [shown[52:-6, 6 + k * (width + 6) :][:, :width] for k in range(5)]
    slow, local = (np.abs(parts[k] - parts[4]).mean() for k in (0, 3))
    assert local < slow / 2


def test_flip(world: World, require: Callable[[str, str], None]) -> None:
    try:
        flips.require()
    except MissingComponentError:
        require("flip-evaluator", "pip install 'ptmtools[measures]'")
    random = np.random.default_rng(1)
    picture = random.uniform(0, 255, (24, 32, 3))
    assert flips.flip(picture, picture) == 0
    near, far = (flips.flip(picture, picture * share) for share in (0.98, 0.5))
    assert 0 < near < far < 1
    seen = flips.Flip(world, 3)
    options = SimulateOptions(policy="paper", bandwidth="inf", memory="1%,inf")
    less, all_of_it = (seen.each(p.run) for p in play({"walk": world}, options))
    assert less.shape == (3,)
    assert less.mean() > 0
    assert not all_of_it.any()
