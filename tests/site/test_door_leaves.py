"""Visitors walk through door leaves that hide what is behind them: at every moment the page shows
the picture of a site whose doors hide nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ptmtools.site.content import Site, site_of
from tests.cells.buildings import carved, room, write
from tests.scene.buildings import box
from tests.site.conftest import PLAIN, build

ROOMS = [room(0, 0, 5, 4), room(5.2, 0, 9, 4)]
DOORWAY = ((5.0, 1.5, 0.0), (5.2, 2.5, 2.1))
LEAF = box((5.05, 1.5, 0), (5.1, 2.5, 2.1))
#: Places in front of the leaf, so near that the picture has none, in it, and behind it.
WAY = (3.0, 4.4, 4.8, 5.01, 5.03, 5.075, 5.12, 5.3, 5.75, 7.0)


@pytest.fixture(scope="module")
def sites(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Site]:
    """The same two rooms and door, with leaves that hide, and with leaves that do not."""
    folder = tmp_path_factory.mktemp("doors")
    cupboard = box((7, 0, 0), (7.5, 0.4, 1.2))
    parts = {"walls": carved(ROOMS, [DOORWAY]), "Door": LEAF, "cupboard": cupboard}
    model = write(folder / "house.obj", parts.items())
    return {
        doors: site_of(
            build(model, folder / f"{doors}.db", "--unit", "m", "--up", "z", "--doors", doors),
            PLAIN,
        )
        for doors in ("pass", "open")
    }


@pytest.mark.parametrize("yaw", [-np.pi / 2, np.pi / 2, 0.4], ids=["ahead", "back", "aside"])
def test_the_way_through_a_door(
    visit: Callable[..., Any], sites: dict[str, Site], yaw: float
) -> None:
    pictures: dict[str, list[Any]] = {}
    shown: dict[str, list[set[int]]] = {}
    for doors, site in sites.items():
        with visit(site, width=320, height=240, reduced_motion="reduce") as visitor:
            visitor.go(0)
            # World coordinates: the middle of the floor, 9.4 × 4.4 m with its walls, is the origin.
            for x in WAY:
                pose = {"eye": [x - 4.5, 1.6, 0], "yaw": yaw, "pitch": 0}
                visitor.page.evaluate("(pose) => window.ptm.goTo(pose)", pose)
                visitor.complete()
                visitor.page.wait_for_function(
                    "ptm.walk.visible.every((c) => ptm.walk.picture.renderer.cells.has(c))"
                )
                pictures.setdefault(doors, []).append(visitor.picture())
                visible = visitor.page.evaluate("window.ptm.walk.visible")
                shown.setdefault(doors, []).append(set(visible))
            assert visitor.messages == []
    for x, one, other in zip(WAY, pictures["pass"], pictures["open"], strict=True):
        # Surfaces are cut in other places, which moves their lighting and edges by a pixel.
        assert (np.abs(one.astype(int) - other) > 2).mean() < 0.01, f"at {x}"
    near = [abs(x - 5.075) < 0.5 for x in WAY]
    assert [len(cells) for cells in shown["pass"]] == [2 if both else 1 for both in near]
    assert all(len(cells) == 2 for cells in shown["open"])
