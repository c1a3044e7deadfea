"""Visitors stand where a way leads from a room: not on roofs, in plenums or on terrain, which are
drawn; and visits begin in rooms."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.output.model import WriterOptions
from ptmtools.output.viewpoints import place_viewpoints
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.orientation.space import to_world
from tests.cells.buildings import AXES, Box, carved, room, write
from tests.cells.strangers import LINTEL, WALL, Parts, doorway, raised
from tests.cells.test_named_rooms import with_rooms
from tests.scene.buildings import box

#: Height of a storey, of its rooms, and where the plenum above the suspended ceiling begins.
STOREY, CLEAR, PLENUM = 4.85, 2.7, 2.75
STOREYS = 2


def office(
    entrance: bool = False, stairs: bool = False, plot: float = 2.0
) -> tuple[Parts, dict[str, Box]]:
    """Two storeys of six rooms off a corridor, each with a door and a window without glass, below
    plenums in which a body fits, on terrain and under a flat roof with a parapet; and its spaces.
    The ``entrance`` is a doorway, ``stairs`` lead from the terrain, which ends ``plot`` metres
    around the building, to the roof."""
    spaces: dict[str, Box] = {}
    holes: list[Box] = []
    parts: Parts = {}
    for storey in range(STOREYS):
        low = STOREY * storey
        spaces[f"Corridor {storey}"] = room(0, 0, 12.4, 2, low, low + CLEAR)
        for k in range(6):
            x, side = 4.2 * (k // 2), k % 2
            y = -WALL - 5 if side else 2 + WALL
            spaces[f"Office {storey}{k}"] = room(x, y, x + 4, y + 5, low, low + CLEAR)
            hole, leaf = doorway(x + 1, -WALL if side else 2.0, "x")
            holes.append(raised(hole, low))
            parts[f"Door_{storey}_{k}"] = box(*raised(leaf, low))
            outer = y - WALL if side else y + 5
            holes.append(((x + 1, outer, low + 0.9), (x + 3, outer + WALL, low + 2.2)))
            # A tile of the suspended ceiling is missing.
            holes.append(((x + 1, y + 1, low + CLEAR), (x + 1.6, y + 1.6, low + PLENUM)))
        holes.append(room(0, -5.2, 12.4, 7.2, low + PLENUM, low + STOREY - WALL))
    if entrance:
        holes.append(((-WALL, 0.4, 0), (0, 1.6, LINTEL)))
    top = STOREYS * STOREY
    parts["walls"] = carved(list(spaces.values()), holes)
    parts["roof"] = box((-WALL, -5.4, top - WALL), (12.6, 7.4, top))
    parts["parapet"] = np.concatenate(
        [
            box((-WALL, -5.4, top), (12.6, -5.2, top + 1.4)),
            box((-WALL, 7.2, top), (12.6, 7.4, top + 1.4)),
        ]
    )
    parts["terrain"] = box((-3 - plot, -6 - plot, -0.8), (13 + plot, 8 + plot, -0.2))
    if stairs:
        count = round((top + 0.2) / 0.25)
        steps = [
            box((12.6 + 0.3 * k, -2, -0.2), (12.9 + 0.3 * k, -0.5, top - 0.25 * k))
            for k in range(count)
        ]
        parts["stairs"] = np.concatenate(steps)
    return parts, spaces


KINDS = {
    "shut": {},
    "open": {"entrance": True},
    "large": {"plot": 60.0},
    "stairs": {"entrance": True, "stairs": True, "plot": 14.0},
}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Scene]:
    """``scene("open, unnamed")``: that of a kind, without its spaces if they are unnamed."""

    @cache
    def of(name: str) -> Scene:
        kind = name.partition(",")[0]
        parts, spaces = office(**KINDS[kind])  # type: ignore[arg-type]
        model = write(tmp_path_factory.mktemp("ways") / "model.obj", parts.items())
        scene = ingest(model, IngestOptions(**AXES))
        if name.endswith("unnamed"):
            return scene
        return with_rooms(scene, [(n, np.array(box(*s))) for n, s in spaces.items()])

    return of


def stands(scene: Scene, cells: Cells, *point: float) -> bool:
    leaf = int(cells.locate_leaf(to_world(np.array([point]), scene.space))[0])
    return leaf >= 0 and bool(cells.leaf_standing[leaf]) and bool(cells.leaf_cell[leaf] >= 0)


ROOF, GROUND, PLENA = (6, 1, 2 * STOREY + 0.9), (-2, -3, 0.9), (6, 1, PLENUM + 0.9)


@pytest.mark.parametrize(
    ("name", "ground", "roof"),
    [
        ("shut", False, False),
        ("shut, unnamed", False, False),
        ("open", True, False),
        ("open, unnamed", True, False),
        ("stairs", True, True),
        ("large, unnamed", True, True),  # rooms are a small part of the floors
    ],
)
def test_where_visitors_stand(
    scene: Callable[[str], Scene], name: str, ground: bool, roof: bool
) -> None:
    model = scene(name)
    cells = subdivide(model)
    assert not cells.closed
    for storey in range(STOREYS):
        assert stands(model, cells, 6, 1, STOREY * storey + 1.0)
        assert stands(model, cells, 6, 4, STOREY * storey + 1.0)
        assert not stands(model, cells, 6, 1, STOREY * storey + PLENUM + 0.9)
    assert stands(model, cells, *GROUND) == ground
    assert stands(model, cells, *ROOF) == roof
    assert any("no way leads" in note for note in cells.notes)
    # The rest is drawn; of the plenum, what the missing tiles show.
    terrain = model.objects.index("terrain")
    drawn = np.unique(model.triangle_object[np.unique(cells.triangle_source)])
    assert terrain in drawn


def test_every_floor(scene: Callable[[str], Scene]) -> None:
    model = scene("shut")
    cells = subdivide(model, SubdivideOptions(standing="floors"))
    for point in (ROOF, GROUND, PLENA):
        assert stands(model, cells, *point)


@pytest.mark.parametrize("name", ["open", "large, unnamed"])
def test_visits_begin_in_rooms(scene: Callable[[str], Scene], name: str) -> None:
    model = scene(name)
    cells = subdivide(model, SubdivideOptions(standing="floors"))
    viewpoints, _ = place_viewpoints(model, cells, WriterOptions(viewpoint_count=10))
    position = np.array([viewpoint.position for viewpoint in viewpoints])
    _, spaces = office()
    boxes = [np.sort(to_world(np.array(space), model.space), axis=0) for space in spaces.values()]
    inside = [any(((low <= p) & (p <= high)).all() for low, high in boxes) for p in position]
    assert len(inside) == 10
    assert all(inside)
