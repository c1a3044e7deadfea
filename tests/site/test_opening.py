"""The opening holds the first view: whole files and beginnings, the worthiest first."""

from __future__ import annotations

import gzip
import json
import re
import struct
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.output.served import Served, read_served
from ptmtools.site import opening
from ptmtools.site.client import OVERHEAD
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.files import DATA
from ptmtools.site.opening import (
    FEW,
    SMALL,
    NeedFinder,
    Needs,
    OpeningStep,
    ordered_steps,
    other_rooms,
    packed_opening,
    texture_steps,
)
from ptmtools.site.program import address_of
from ptmtools.site.publishing import weight_of


@pytest.fixture(scope="module")
def served(two_rooms: Path) -> Served:
    return read_served(two_rooms)


@pytest.fixture(scope="module")
def site(two_rooms: Path) -> Site:
    return site_of(two_rooms, SiteOptions(pictures=False))


def parts_of(opening: bytes) -> Iterator[tuple[str, int, bytes]]:
    data = gzip.decompress(opening)
    (length,) = struct.unpack_from("<I", data)
    at = 4 + length
    for kind, number, size in json.loads(data[4:at])["parts"]:
        yield kind, number, data[at : at + size]
        at += size
    assert at == len(data)


def names_of(site: Site) -> list[str]:
    return [name for name in site.entries if name.startswith(f"{DATA}/opening-")]


def opening_of(site: Site) -> bytes:
    return site.entries[names_of(site)[0]].read()


def read(site: Site, kind: str, number: int) -> bytes:
    index = site.index
    if kind == "preview":
        names = [p["file"] for row in index["textures"] for p in row.get("previews", ())]
        name = names[number]
    elif kind == "texture":
        name = index["textures"][number]["file"]
    else:
        name = index["cells"][number][kind]
    return site.entries[f"{DATA}/{name}"].read()


def test_parts_are_the_files_or_their_beginnings(site: Site) -> None:
    parts = [*parts_of(opening_of(site))]
    cell = site.index["viewpoints"][0]["cell"]
    assert [part[:2] for part in parts[:2]] == [("record", cell), ("geometry", cell)]
    assert len({part[:2] for part in parts}) == len(parts)
    for kind, number, data in parts:
        whole = read(site, kind, number)
        if kind == "texture":
            assert whole.startswith(data)
            assert len(data) in site.index["textures"][number]["ends"]
        elif kind == "preview":
            assert data == whole
            assert len(data) <= SMALL
        else:
            assert data == whole


def test_the_page_names_it(site: Site) -> None:
    page = site.entries["index.html"].read().decode()
    assert names_of(site)[0] in page


def test_the_first_views_have_one_each_while_they_repeat_little(
    two_rooms: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are numbered, and the page has their addresses."""
    monkeypatch.setattr(opening, "WHOLE", 0)
    first = opening_of(site_of(two_rooms, SiteOptions(pictures=False)))
    monkeypatch.setattr(opening, "REPEATED", 1.0)
    every = site_of(two_rooms, SiteOptions(pictures=False))
    views = every.index["viewpoints"]
    assert len(views) > 1
    names = names_of(every)
    assert [name.rpartition("-")[2] for name in names] == [f"{n}.bin" for n in range(len(views))]
    assert every.entries[names[0]].read() == first
    for name, view in zip(names, views, strict=True):
        parts = [*parts_of(every.entries[name].read())]
        assert [part[:2] for part in parts[:2]] == [
            ("record", view["cell"]),
            ("geometry", view["cell"]),
        ]
    (listed,) = re.findall(r'data-views="([^"]+)"', every.entries["index.html"].read().decode())
    assert json.loads(listed) == [address_of(view) for view in views]
    second = len(every.entries[names[1]].read())
    other = [name for name in every.entries if name.startswith(f"{DATA}/") and name not in names]
    # The sizes that count when openings are made: those of the index and icons are not known yet.
    own = [name for name in other if "/index-" not in name and "/icon-" not in name]
    size = sum(len(every.entries[name].read()) for name in own)
    monkeypatch.setattr(opening, "REPEATED", 1.01 * second / size)
    assert len(names_of(site_of(two_rooms, SiteOptions(pictures=False)))) == 2
    monkeypatch.setattr(opening, "REPEATED", 0.0)
    (alone,) = names_of(site_of(two_rooms, SiteOptions(pictures=False)))
    assert alone.endswith("-0.bin")


def test_that_of_a_small_site_has_all_rooms(
    two_rooms: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes fewer bytes than its files, and is for all views."""
    cells, textures = (range(len(site.index[name])) for name in ("cells", "textures"))
    assert len(names_of(site)) == 1
    parts = {(kind, number): data for kind, number, data in parts_of(opening_of(site))}
    for kind, numbers in (("record", cells), ("geometry", cells), ("texture", textures)):
        for number in numbers:
            assert parts[kind, number] == read(site, kind, number)[: len(parts[kind, number])]
    (listed,) = re.findall(r'data-views="([^"]+)"', site.entries["index.html"].read().decode())
    assert json.loads(listed) == [[*address_of(site.index["viewpoints"][0]), 1]]
    separate = site_of(two_rooms, SiteOptions(pictures=False, opening=False))
    assert weight_of(site).whole < weight_of(separate).whole
    size = sum(row["recordBytes"] + row["geometryBytes"] for row in site.index["cells"])
    size += sum(row["ends"][-1] for row in site.index["textures"])
    size += sum(p["bytes"] for row in site.index["textures"] for p in row.get("previews", ()))
    for most, expected in ((size, len(cells)), (size - 1, 1)):
        monkeypatch.setattr(opening, "WHOLE", most)
        data = opening_of(site_of(two_rooms, SiteOptions(pictures=False)))
        assert sum(kind == "record" for kind, *_ in parts_of(data)) == expected


def test_what_the_view_lacks_comes_as_visitors_of_other_rooms_need_it() -> None:
    row = {"ends": [10, 100], "previews": [{"bytes": 30}, {"bytes": 40}]}
    sizes = {(kind, number): 50 for number in range(3) for kind in ("record", "geometry")}
    view = [OpeningStep("record", 1, 50, 50, 1.0), OpeningStep("preview", 0, 30, 30, 1.0)]
    rest = other_rooms({"textures": [row, row, row | {"ends": [SMALL]}]}, view, sizes)
    assert rest is not None
    assert [(step.kind, step.number) for step in rest] == [
        *(("record", number) for number in (0, 2)),
        *(("geometry", number) for number in (0, 1, 2)),
        *(("texture", number) for number in (0, 1)),
        *(("preview", number) for number in (1, 2, 3)),
    ]


@pytest.mark.parametrize(
    ("direction", "expected"),
    [
        ((0, 0, -1), 0),
        ((-1, 0, 0), 90),
        ((1, 0, 0), 270),
        ((-(0.5**0.5), 0.5, -0.5), 54.7),
    ],
)
def test_addresses(direction: tuple[float, ...], expected: float) -> None:
    view = {"position": [1.234, 5.678, -9], "direction": direction}
    assert address_of(view) == [1.23, 5.68, -9, expected]


def test_needs_are_those_of_the_pixels(served: Served) -> None:
    viewpoint = served.index["viewpoints"][0]
    needs = NeedFinder(served).needs(viewpoint)
    assert 0 < sum(needs.cells.values()) <= 1 + 1e-9
    assert viewpoint["cell"] in needs.cells
    total = sum(share[0] for share in needs.textures.values())
    assert total <= sum(needs.cells.values()) + 1e-9
    for share in needs.textures.values():
        assert (np.diff(share) <= 1e-12).all()  # a pixel requires all coarser levels, too


def texture(levels: int, previews: list[tuple[int, int, float]], stored: int = 0) -> dict[str, Any]:
    side, stored = 1 << levels - 1, stored or levels
    return {
        "width": side >> levels - stored,
        "height": side >> levels - stored,
        "ends": [100 + 4**n for n in range(stored)],
        "differences": [0.0, *np.linspace(12, 6, levels - 1)],
        "previews": [
            {
                "level": level,
                "bytes": size,
                "difference": difference,
                "width": 1 << level,
                "height": 1 << level,
            }
            for level, size, difference in previews
        ],
    }


def test_a_texture_ends_with_what_the_view_needs() -> None:
    ladder = [(level, 30 * 3 ** (level - 6), 4.0) for level in range(6, 11)]
    row = texture(11, ladder)
    for needed in range(11):
        share = np.where(np.arange(11) <= needed, 0.3, FEW * 0.1)
        steps = texture_steps(7, row, share, first=100)
        previews = [step.number - 100 for step in steps if step.kind == "preview"]
        exact = [step for step in steps if step.kind == "texture"]
        assert all(step.number == 7 for step in exact)
        assert sum(step.bytes for step in exact) == max((s.end for s in exact), default=0)
        reached = max(
            [row["ends"].index(step.end) for step in exact] + [ladder[p][0] for p in previews]
        )
        assert reached >= needed
        if previews and previews[-1] > 0:
            assert ladder[previews[-1] - 1][0] < needed  # no finer one than that


def test_small_screens_need_less() -> None:
    """Half as many lines need one level less, unless not even the finest one is fine enough."""
    ladder = [(level, 3000 * 3 ** (level - 6), 4.0) for level in range(6, 11)]
    row, share = texture(11, ladder), np.full(11, 0.3)
    for detail in (0.0, 0.7, -2.0):
        steps = texture_steps(7, row, share, first=100, detail=detail)
        previews = [step for step in steps if step.kind == "preview"]
        for step, after in pairwise(previews):
            level = ladder[step.number - 100][0]
            assert after.lines == int(1080 * 2 ** (detail - (10 - level)))
            assert step.lines < after.lines
        assert len(previews) > 1


def test_without_previews_the_exact_levels_that_it_needs() -> None:
    share = np.where(np.arange(8) <= 5, 0.3, 0.0)
    row = texture(8, [])
    steps = texture_steps(0, row, share, first=0)
    assert {step.kind for step in steps} == {"texture"}
    assert steps[-1].end == row["ends"][5]


def test_levels_300_bytes_apart() -> None:
    """The overhead of a request does not cancel the bytes of a level that is left behind."""
    row = texture(3, []) | {"ends": [100, 100 + OVERHEAD, 100_000]}
    steps = texture_steps(0, row, np.full(3, 0.5), first=0)
    assert [step.end for step in steps] == row["ends"][1:]


def test_the_error_of_a_preview_halves_with_each_coarser_level() -> None:
    """Worth by hand, as in docs/formats/client.md: the sum over the levels of their shares times
    their differences less the errors."""
    row = texture(9, [(6, 300, 4.0)]) | {"ends": [10**9] * 9, "differences": [8.0] * 9}
    share = np.array([0.4, 0.4, 0.4, 0.4, 0.4, 0.3, 0.2, 0.0, 0.0])
    (step,) = texture_steps(0, row, share, first=0)
    error = [4.0 / 2**6, *(4.0 / 2 ** (7 - level) for level in range(1, 7))]
    worth = sum(part * (8.0 - off) for part, off in zip(share, error, strict=False))
    assert step.density == pytest.approx(worth / (300 + OVERHEAD), rel=1e-9)


def test_steps_come_by_worth_per_byte() -> None:
    row = texture(9, [(6, 300, 5.0), (7, 900, 4.0), (8, 5000, 3.0)])
    index = {"textures": [row, row], "cells": [{}, {}, {}]}
    share = np.full(9, 0.4)
    needs = Needs({0: 0.7, 2: 0.01}, {0: share, 1: share / 10}, {0: 0.5, 1: -1.0})
    sizes: Mapping[tuple[str, int], int] = {
        (kind, number): 1000 for kind in ("record", "geometry") for number in range(3)
    }
    steps = ordered_steps(index, needs, 0, sizes)
    assert [(step.kind, step.number) for step in steps[:2]] == [("record", 0), ("geometry", 0)]
    densities = [step.density for step in steps]
    assert all(one >= other for one, other in pairwise(densities))
    finest = {step.number for step in steps if step.kind == "preview"}
    assert {2, 5} <= finest  # that of the first texture, and of the second
    opening = packed_opening(steps, lambda kind, number, end: bytes(20_000))
    parts = [*parts_of(opening)]
    data = gzip.decompress(opening)
    (length,) = struct.unpack_from("<I", data)
    assert json.loads(data[4 : 4 + length])["next"] == [[2, 763], [5, 270]]
    assert not {("preview", 2), ("preview", 5)} & {part[:2] for part in parts}


def test_it_sees_as_the_client(two_rooms: Path) -> None:
    """The needs are those of the simulator's own screen."""
    from ptmtools.rendering.pyramids import read_pyramids
    from ptmtools.rendering.rays import RayCamera
    from ptmtools.site.opening import HEIGHT, WIDTH
    from ptmtools_lab.tables import look

    served = read_served(two_rooms)
    for viewpoint in served.index["viewpoints"]:
        eye, direction = (np.array([viewpoint[name]]) for name in ("position", "direction"))
        camera = RayCamera(WIDTH, HEIGHT, viewpoint["fieldOfView"], WIDTH / HEIGHT)
        (views,) = look(served.surfaces, read_pyramids(served), camera, eye, direction)
        needs = NeedFinder(served).needs(viewpoint)
        for texture, share in needs.textures.items():
            expected = views.need[views.texture == texture].sum(axis=0)[: len(share)]
            assert share == pytest.approx(expected, abs=2e-4)
        for cell, share_of_cell in needs.cells.items():
            assert share_of_cell == pytest.approx(views.need[views.cell == cell, 0].sum(), abs=2e-4)
