"""Dividing goes on where it saves visitors something, and stops where it saves nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, bsp, subdivide, subdivision
from ptmtools.scene import IngestOptions, ingest
from ptmtools.visibility import compute_pvs
from tests.cells.buildings import carved, room, write
from tests.cells.strangers import WALL, Parts, doorway
from tests.scene.buildings import box, turned_in_plan


@pytest.fixture(autouse=True)
def early(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small models are examined, too."""
    monkeypatch.setattr(bsp, "_FIRST_LOOK", 64)
    monkeypatch.setattr(bsp, "_LOOKS", 2)


def divided(parts: Parts, folder: Path, **options: object) -> Cells:
    model = write(folder / "model.obj", parts.items())
    scene = ingest(model, IngestOptions(unit="m", up="z"))
    return subdivide(scene, SubdivideOptions(ceiling="none", **options))


def scattered(count: int) -> Parts:
    """Solid kiosks of 3 m on open ground, each turned its own way."""
    rng = np.random.default_rng(2)
    parts: Parts = {"ground": box((-5, -5, -0.3), (65, 65, 0))}
    for k in range(count):
        kiosk = turned_in_plan(box((-1.5, -1.5, 0), (1.5, 1.5, rng.uniform(3, 6))), 37.0 * k)
        at = 10 * np.array(divmod(k, 6)) + rng.uniform(3, 7, 2)
        parts[f"kiosk_{k}"] = kiosk + [*at, 0]
    return parts


def kept(cells: Cells) -> bool:
    return any("division ended at" in note for note in cells.notes)


def test_open_ground_is_not_divided_by_every_kiosk(tmp_path: Path) -> None:
    kiosks = scattered(30)
    cells, every = (divided(kiosks, tmp_path, gain=gain) for gain in (0.1, 0.0))
    assert kept(cells)
    assert not kept(every)
    assert cells.leaf_count < every.leaf_count / 2
    assert cells.visible >= every.visible  # the bases of some kiosks, too
    # What the further division saves, leaf by leaf, is less than the threshold.
    assert compute_pvs(every).volume_at_hand[0] > 0.9


def house(rooms: int, *, doors: bool) -> Parts:
    """Rooms with windows off a corridor that is open at its end, on a plot of 200 m."""
    spaces, holes, parts = [room(0, 0, 4.2 * rooms, 2)], [((-0.2, 0.5, 0), (0, 1.5, 2.1))], {}
    for k in range(rooms):
        x = 4.2 * k
        spaces.append(room(x, 2 + WALL, x + 4, 7))
        hole, leaf = doorway(x + 1, 2.0, "x")
        holes += [hole, ((x + 1, 7, 1), (x + 3, 7.2, 2))]
        if doors:
            parts[f"Door_{k}"] = box(*leaf)
    plot = box((-100, -100, -0.5), (100, 100, -0.2))
    return {"walls": carved(spaces, holes), "plot": plot, **parts}


@pytest.mark.parametrize("doors", [False, True])
def test_a_house_on_a_plot_is_divided_to_the_end(doors: bool, tmp_path: Path) -> None:
    """Most floor is outside, and its visitors see everything; doors are the last to divide."""
    cells = divided(house(12, doors=doors), tmp_path)
    assert not kept(cells)
    assert cells.standing.sum() >= 13


def test_a_model_without_a_floor_is_divided_to_the_end(tmp_path: Path) -> None:
    kiosks = scattered(30)
    del kiosks["ground"]
    assert not kept(divided(kiosks, tmp_path, standing="anywhere"))


def test_a_division_into_single_leaves_is_never_stopped(tmp_path: Path) -> None:
    assert not kept(divided(scattered(30), tmp_path, cells="leaf"))


def test_a_model_with_too_many_portals_is_divided_less(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The visible sets of more portals would not fit into memory; none is refused for it."""
    kiosks = scattered(12)
    most = divided(kiosks, tmp_path, gain=0.0).portal_count
    monkeypatch.setattr(subdivision, "MOST_PORTALS", most // 2)
    cells = divided(kiosks, tmp_path, gain=0.0)
    assert 0 < cells.portal_count <= most // 2
    assert any("leaves for visible sets was reached" in note for note in cells.notes)
    compute_pvs(cells)
