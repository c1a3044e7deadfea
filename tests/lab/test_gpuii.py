"""The client of interlaced images: what it asks for, in which order, and where it stops."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.link import Conditions
from ptmtools_lab.catalogue import Catalogue, Shapes
from ptmtools_lab.client import Client, FileKind, Range
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.policies.whole_files import RING, GpuiiClient
from ptmtools_lab.simulation import WalkRun, simulate
from ptmtools_lab.world import World
from tests.lab.worlds import (
    CAMERA,
    SEEDS,
    Texture,
    any_world,
    catalogue,
    for_policy,
    standing as stands,
)

EYE = np.array([1.0, 1.6, 2.0])
#: Three files, whose images have 8 × 8, 16 × 8 and 16 × 16 texels.
STEPS = Texture((100, 100, 200), (64, 64, 128))


def scene(*shapes: tuple[float, ...]) -> Catalogue:
    """One room; each texture on a shape so many metres ahead of the eye, behind it below 0, on
    which its image is so many metres wide and high."""
    stock = catalogue([STEPS] * len(shapes), [(0, t) for t in range(len(shapes))])
    far, side = np.array(shapes)[:, 0], np.array(shapes)[:, [1, -1]]
    low = EYE + np.outer(far, [1, 0, 0]) - [0, 0.1, 0.1]
    return replace(
        stock,
        size=np.tile([[0, 0], [8, 8], [16, 8], [16, 16]], (len(shapes), 1, 1)),
        shapes=Shapes(stock.shapes.cell, stock.shapes.texture, low, low + [0.0, 0.2, 0.2], side),
    )


def walked(
    stock: Catalogue, budget: int = 1 << 30, seconds: float = 20
) -> tuple[WalkRun, list[Range]]:
    """Who stands there; and the files asked for, in that order."""
    asked: list[Range] = []

    def make(world: World, link: FluidLink, budget: int) -> Client:
        ask = link.request

        def request(size: int, priority: float, tag: Any, *more: Any) -> Request:
            if tag.kind == FileKind.TEXTURE:
                asked.append(tag)
            return ask(size, priority, tag, *more)

        link.request = request  # type: ignore[method-assign]
        return GpuiiClient(world, link, budget)

    world = for_policy(stands(stock, seconds), "gpuii")
    run = simulate(world, replace(POLICIES["gpuii"], client=make), Conditions(20e3), budget)
    return run, asked


def steps_of(stock: Catalogue, asked: list[Range]) -> list[tuple[int, int]]:
    """Texture and step of each file."""
    return [
        (part.number, int(np.searchsorted(stock.ends[part.number], part.end))) for part in asked
    ]


def side(texels: float) -> float:
    """Metres on which so many texels are as large as pixels, at one metre."""
    return texels * CAMERA.pixel


def test_rings_then_steps_then_distance() -> None:
    """Two images in the first ring, one in the third; nothing that is behind."""
    fine = side(1e6)
    stock = scene((2.4 * RING, fine), (0.9 * RING, fine), (0.5 * RING, fine), (-1.0, fine))
    _, asked = walked(stock)
    near = [(t, step) for step in (1, 2, 3) for t in (2, 1)]
    assert steps_of(stock, asked) == [*near, (0, 1), (0, 2), (0, 3)]
    # Each file by itself, whole.
    for part in asked:
        ends = stock.ends[part.number].tolist()
        assert ends.index(part.end) == ends.index(part.begin) + 1


@pytest.mark.parametrize(
    ("wide", "high", "steps"),
    [(1, 1, 1), (7.9, 7.9, 1), (8.1, 7, 2), (16, 8, 2), (7, 8.1, 3), (16.1, 7, 3), (99, 99, 3),
     (0, 0, 1)],
)  # fmt: skip
def test_where_the_screen_needs_no_more(wide: float, high: float, steps: int) -> None:
    """Until texels are neither wider nor higher than pixels; of twice the size, twice as far."""
    for far in (1.0, 2.0):
        stock = scene((far, side(wide) * far, side(high) * far))
        run, asked = walked(stock)
        assert steps_of(stock, asked) == [(0, step + 1) for step in range(steps)]
        assert run.column[-1].tolist() == [steps]


def test_memory_goes_to_the_most_important_steps() -> None:
    """And what finds no room is not loaded."""
    fine = side(1e6)
    stock = scene((0.5, fine), (0.75, fine))
    # 64 + 64 for the first step of both, 64 more for the second, 128 for the third.
    for budget, columns in (
        (63, [0, 0]), (64, [1, 0]), (128, [1, 1]), (191, [1, 1]), (192, [2, 1]), (256, [2, 2]),
        (383, [2, 2]), (384, [3, 2]), (512, [3, 3]),
    ):  # fmt: skip
        run, asked = walked(stock, budget)
        assert run.column[-1].tolist() == columns
        assert len(asked) == sum(columns)
        assert (run.memory <= budget).all()


@settings(max_examples=40)
@given(SEEDS, st.integers(0, 3000), st.floats(1e3, 1e6))
def test_never_above_the_budget(seed: int, budget: int, bandwidth: float) -> None:
    """On walks that turn and come back, where images need fewer steps than were loaded."""
    world = any_world(seed, frames=40)
    stock = world.catalogue
    random = np.random.default_rng(seed)
    sides = side(1) * 10 ** random.uniform(-1, 2, (len(stock.shapes.cell), 2))
    stock = replace(stock, shapes=replace(stock.shapes, side=sides))
    world = for_policy(replace(world, catalogue=stock), "gpuii")
    run = simulate(world, POLICIES["gpuii"], Conditions(bandwidth), budget)
    assert (run.memory <= budget).all()
    assert run.overruns == 0


def test_what_was_loaded_stays_while_there_is_room() -> None:
    """Whoever turns away and back finds it."""
    stock = scene((1.0, side(1e6)))
    world = stands(stock, 20)
    away = (world.track.time > 10) & (world.track.time < 15)
    direction = np.where(away[:, None], [-1.0, 0, 0], world.track.direction)
    world = for_policy(replace(world, track=replace(world.track, direction=direction)), "gpuii")
    run = simulate(world, POLICIES["gpuii"], Conditions(20e3), 256)
    assert run.column[world.track.time > 9].ravel().tolist() == [3] * int(
        (world.track.time > 9).sum()
    )
    assert run.requests == 3 + 3
