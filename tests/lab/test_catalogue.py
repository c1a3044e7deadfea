"""Facts about textures come from the hints if these have them, otherwise from the textures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.output.served import Served, read_served
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.site.client import LEAST_DIFFERENCE
from ptmtools.texture import read_header
from ptmtools_lab.catalogue import catalogue_of

TOLD = ("differences", "color", "gpuTexelBytes")


def without(served: Served, *names: str) -> None:
    for name in names:
        served.index["textures"][0].pop(name)


def test_hints_and_textures_say_the_same(two_rooms: Path) -> None:
    reported, silent = read_served(two_rooms), read_served(two_rooms)
    without(silent, *TOLD)
    pyramids = read_pyramids(reported)
    one, other = (catalogue_of(s, pyramids.differences, pyramids.mean) for s in (reported, silent))
    assert one.differences.max() > 1
    assert one.differences == pytest.approx(other.differences, rel=5.1e-3)
    assert one.colors == pytest.approx(other.colors, abs=0.5)
    assert (one.memory == other.memory).all()
    for row, ends, memory in zip(reported.index["textures"], one.ends, one.memory, strict=True):
        header = read_header((two_rooms / "www" / row["file"]).read_bytes())
        texels = np.cumsum([level.width * level.height for level in header.levels])
        assert (ends[1 : len(texels) + 1] == [level.end for level in header.levels]).all()
        assert (memory[1 : len(texels) + 1] == texels * row["gpuTexelBytes"]).all()


def test_what_hints_say_counts_only_if_they_say_it_of_every_texture(two_rooms: Path) -> None:
    pyramids = read_pyramids(read_served(two_rooms))
    made_up = pyramids.differences + 1, pyramids.mean * 0
    served = read_served(two_rooms)
    first = catalogue_of(served, *made_up)
    row = served.index["textures"][0]
    printed = [max(LEAST_DIFFERENCE, value) for value in row["differences"]]
    assert first.differences[0, 1 : len(row["ends"]) + 1].tolist() == printed
    assert first.colors.max() > 0
    without(served, "differences")
    assert (catalogue_of(served, *made_up).differences[:, 1:] == made_up[0]).all()
    without(served, "color")
    assert (catalogue_of(served, *made_up).colors == 0).all()


def test_the_only_level_of_a_texture_is_worth_something(two_rooms: Path) -> None:
    served, pyramids = (read_served(two_rooms), read_pyramids(read_served(two_rooms)))
    stock = catalogue_of(served, pyramids.differences * 0, pyramids.mean)
    assert (stock.differences[np.arange(stock.texture_count), 1] >= LEAST_DIFFERENCE).all()


def test_how_large_an_image_is_on_a_shape(two_rooms: Path) -> None:
    """Of the walls of the two rooms: 4 m wide and 3 m high, floors once a metre; in the doorway
    once a metre both ways, across its sides and floor alike. Cells lie on a grid."""
    served = read_served(two_rooms)
    pyramids = read_pyramids(served)
    stock = catalogue_of(served, pyramids.differences, pyramids.mean)
    painted = stock.shapes.texture >= 0
    actual = {tuple(np.round(side, 1).tolist()) for side in stock.shapes.side[painted]}
    assert actual == {(4, 3), (1, 1)}
    assert (stock.size[:, -1] == 64).all()
    assert (stock.size[:, 1] == 1).all()
