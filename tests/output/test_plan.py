"""The floor plan: drawn, deterministic, and different where the input is."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import InputError, MissingComponentError, OutputError
from ptmtools.output import PlotOptions, plot_plan
from ptmtools.output.plan import WAY
from ptmtools.output.plan_marks import LEAK, LEFT_OUT, VIEW_ONLY
from ptmtools.scene.model import Storey

SMALL = PlotOptions(width=6, dpi=60)


def draw(artifacts, out: Path, options: PlotOptions = SMALL, **known) -> np.ndarray:
    a = artifacts
    known = {"pvs": a.pvs, "ach": a.ach} | known
    plot_plan(a.scene, a.cells, known["pvs"], known["ach"], out, options, force=True)
    with Image.open(out) as image:
        assert image.info.keys() <= {"dpi"}, "no date, no software"
        return np.asarray(image.convert("RGB")).astype(int)


def pixels(picture: np.ndarray, colour: str) -> int:
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((abs(picture - wanted).sum(axis=2) < 12).sum())


def test_same_bytes_again(artifacts, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        draw(artifacts, tmp_path / name, PlotOptions(cell=0, width=6, dpi=60))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_what_is_drawn(artifacts, tmp_path: Path) -> None:
    plain = draw(artifacts, tmp_path / "plain.png")
    chosen = draw(artifacts, tmp_path / "chosen.png", PlotOptions(cell=1, width=6, dpi=60))
    assert plain.shape[1] == 360
    assert pixels(plain, "#f0562d") > 15, "portals"
    assert pixels(plain, "#1c2733") > 300, "walls"
    assert pixels(plain, "#eaf0f4") > 10_000, "cells"
    assert pixels(chosen, "#eaf0f4") < 500, "every cell is shaded"
    assert pixels(plain, "#b0125b") == 0
    assert pixels(chosen, "#b0125b") > 200, "the chosen cell's outline"


@pytest.mark.parametrize("name", ["Obergeschoß", "$2^{nd", r"\frac{1}{0}$"])
def test_storeys_have_their_names(
    artifacts, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Those of the model that are near; whatever is in them, it is no formula."""
    from matplotlib.axes import Axes

    titles: list[str] = []
    plain = Axes.set_title

    def overheard(self: Axes, text: str, **style: object) -> object:
        titles.append(text)
        return plain(self, text, **style)

    monkeypatch.setattr(Axes, "set_title", overheard)
    for height in (0.5, 0.9):
        scene = replace(artifacts.scene, storeys=(Storey("Cellar", -3.0), Storey(name, height)))
        draw(replace(artifacts, scene=scene), tmp_path / f"{height}.png")
    draw(artifacts, tmp_path / "unnamed.png")
    first = "floor +0.00 m, cut at +1.20 m: 3 cells"
    assert titles == [f"{name}: {first}", first, first]
    plain_bytes = (tmp_path / "unnamed.png").read_bytes()
    assert (tmp_path / "0.9.png").read_bytes() == plain_bytes
    assert (tmp_path / "0.5.png").read_bytes() != plain_bytes


def test_rooms_have_their_names(artifacts, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once for a room of two cells, below the number of one, if there is space for it."""
    from matplotlib.axes import Axes

    texts: list[str] = []
    plain = Axes.text

    def overheard(self: Axes, x: float, y: float, text: str, **style: object) -> object:
        texts.append(text)
        return plain(self, x, y, text, **style)

    monkeypatch.setattr(Axes, "text", overheard)
    of = np.array([0, 0, 1], dtype=np.int32)
    for number, names in enumerate((("$Hall", "Lab"), ("x" * 500, "Lab"))):
        cells = replace(artifacts.cells, rooms=names, cell_room=of)
        draw(replace(artifacts, cells=cells), tmp_path / f"{number}.png")
    marks = [text for text in texts if text[0].isdigit()]
    assert sorted(marks[:3]) == ["0\n$Hall", "1", "2\nLab"]
    assert sorted(marks[3:]) == ["0", "1", "2\nLab"]


@pytest.mark.parametrize("width", [5, 8, 12])
def test_heading_and_legend_do_not_overlap(
    artifacts, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: float
) -> None:
    from matplotlib.figure import Figure

    figures: list[Figure] = []
    save = Figure.savefig

    def kept(self: Figure, *place: Any, **style: Any) -> None:
        save(self, *place, **style)
        figures.append(self)

    monkeypatch.setattr(Figure, "savefig", kept)
    options = PlotOptions(cell=1, width=width, dpi=60)
    draw(artifacts, tmp_path / "a.png", options, ach=None)
    (figure,) = figures
    caption = figure.axes[0]._left_title  # type: ignore[attr-defined]
    parts = [*figure.texts, *figure.legends, caption]
    boxes = [part.get_window_extent() for part in parts]
    assert all(box.x0 >= 0 and box.x1 <= figure.bbox.x1 for box in boxes)
    assert all(box.y0 >= 0 and box.y1 <= figure.bbox.y1 for box in boxes)
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_a_walk_is_drawn(artifacts, tmp_path: Path) -> None:
    """Its line; and an arrow where the eye rests, beside the line."""
    sharp = PlotOptions(width=6, dpi=200)
    low, high = artifacts.cells.root_box
    eye = np.linspace(low, high, 40)
    eye[:, 1] = low[1] + 1.6
    ahead = np.tile([1.0, 0.0, 0.0], (60, 1))
    moving, resting = eye, np.append(eye, np.tile(eye[20], (20, 1)), axis=0)
    counts = []
    for name, points in (("moving", moving), ("resting", resting)):
        out = tmp_path / f"{name}.png"
        way = points, ahead[: len(points)]
        plot_plan(artifacts.scene, artifacts.cells, None, None, out, sharp, way=way)
        with Image.open(out) as image:
            counts.append(pixels(np.asarray(image.convert("RGB")).astype(int), WAY))
    plain = pixels(draw(artifacts, tmp_path / "plain.png", sharp), WAY)
    assert plain == 0
    assert counts[0] > 100
    assert counts[1] > counts[0] + 5


def test_shades_follow_the_coverage(artifacts, tmp_path: Path) -> None:
    """Cell 0's row is 0.7, 0.2, 0.1: the farther, the brighter."""
    picture = draw(artifacts, tmp_path / "a.png", PlotOptions(cell=0, width=12, dpi=60))
    middle = picture[picture.shape[0] // 2 - 25].sum(axis=1)
    width = 12 * 60 - 0.9 * 60
    shades = [middle[int(width * share)] for share in (0.08, 0.42, 0.75)]
    assert shades[0] < shades[1] < shades[2] < 3 * 200


def test_before_the_later_stages(artifacts, tmp_path: Path) -> None:
    draw(artifacts, tmp_path / "a.png", pvs=None, ach=None)
    draw(artifacts, tmp_path / "b.png", PlotOptions(cell=0, width=6, dpi=60), ach=None)
    with pytest.raises(InputError, match="PTM-I111"):
        draw(artifacts, tmp_path / "c.png", PlotOptions(cell=0), pvs=None, ach=None)
    assert not (tmp_path / "c.png").exists()


def test_faults(artifacts, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    a = artifacts
    for cell in (-1, 3):
        with pytest.raises(InputError, match="PTM-I111"):
            draw(a, tmp_path / "a.png", PlotOptions(cell=cell))
    (tmp_path / "a.png").write_text("mine")
    with pytest.raises(OutputError, match="PTM-O001"):
        plot_plan(a.scene, a.cells, a.pvs, a.ach, tmp_path / "a.png", SMALL)
    monkeypatch.setitem(sys.modules, "matplotlib.backends.backend_agg", None)
    with pytest.raises(MissingComponentError, match=r"pip install 'ptmtools\[plot\]'.*PTM-M100"):
        draw(a, tmp_path / "b.png")


FINE = PlotOptions(width=6, dpi=240)


def test_what_was_left_out_is_hatched(artifacts, tmp_path: Path) -> None:
    """A floor beside the row of rooms, and one that makes a storey of its own."""
    low, high = artifacts.cells.leaf_point.min(axis=0), artifacts.cells.leaf_point.max(axis=0)
    beside = np.array([[1, 0, 0], [1, 0, 3], [4, 0, 3]]) + [high[0], low[1], low[2]]
    above = np.array([[0, 2.2, 0], [0, 2.2, 4], [12, 2.2, 4]]) + low
    cells, hatched = artifacts.cells, []
    for left_out in (np.zeros((0, 3, 3)), beside[None], above[None]):
        changed = replace(artifacts, cells=replace(cells, left_out=left_out))
        hatched.append(draw(changed, tmp_path / "a.png", FINE))
    plain, wide, tall = ([pixels(p, LEFT_OUT[0]), p.shape[0] / p.shape[1]] for p in hatched)
    assert plain[0] == 0
    assert min(wide[0], tall[0]) > 500
    assert wide[1] < plain[1] < tall[1], "they are on the paper"


def test_view_only_cells_are_dotted(artifacts, tmp_path: Path) -> None:
    cells = artifacts.cells
    actual = []
    for standing in ([True] * 3, [True, False, True], [False] * 3):
        changed = replace(cells, leaf_standing=np.array(standing)[cells.leaf_cell])
        picture = draw(replace(artifacts, cells=changed), tmp_path / "a.png", FINE)
        actual.append(pixels(picture, VIEW_ONLY[0]))
    assert actual[0] == 0
    assert 300 < actual[1] < 0.6 * actual[2]


def test_leaks_are_ringed(artifacts, tmp_path: Path) -> None:
    leaking = replace(artifacts.pvs, leak=np.array([[0, 3, 0, 2]], np.int32))
    plain, ringed = (
        draw(artifacts, tmp_path / f"{i}.png", pvs=pvs)
        for i, pvs in enumerate((artifacts.pvs, leaking))
    )
    assert pixels(plain, LEAK) == 0
    assert pixels(ringed, LEAK) > 60
    # The ring is around the first door: that end of the row, not the other.
    at = np.argwhere(abs(ringed - [0xE0, 0x94, 0x00]).sum(axis=2) < 12)
    in_plan = at[at[:, 0] > 40]  # below the legend
    assert in_plan[:, 1].max() < 0.6 * ringed.shape[1]


@pytest.mark.parametrize("height", [0.0, -1.0, float("nan"), float("inf")])
def test_a_cut_is_above_the_floor(height: float) -> None:
    with pytest.raises(InputError, match="above 0"):
        PlotOptions(height=height)
