"""Worlds in which nothing is seen, and those that only look like it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells import subdivide
from ptmtools.cells.subdivision import check_seen
from ptmtools.errors import InputError
from ptmtools.scene.model import Scene
from tests.conftest import scene_of
from tests.scene.buildings import box, house, inside_out, sheet, sheets, y_up

FLOOR = sheet((0, 0, 0), (10, 0, 0), (10, 8, 0), (0, 8, 0))
#: Faces without backs, of which none is seen from inside.
EMPTY = {
    "a cube seen from outside": box((0, 0, 0), (3, 3, 3)),
    "a shell seen from outside": sheets()[:8],
    "two blocks": np.concatenate([box((0, 0, 0), (3, 3, 3)), box((8, 0, 0), (11, 3, 3))]),
    "a house inside out": inside_out(house()),
    "a floor that faces down": inside_out(FLOOR),
}
SEEN = {
    "a cube seen from inside": inside_out(box((0, 0, 0), (3, 3, 3))),
    "a shell seen from inside": inside_out(sheets()[:8]),
    "a house": house(),
    "a floor that faces up": FLOOR,
}


def scene(triangles: np.ndarray, two_sided: bool) -> Scene:
    made = scene_of(y_up(triangles))
    return replace(made, two_sided=np.full(len(made.triangles), two_sided))


@pytest.mark.parametrize("name", EMPTY)
def test_nothing_is_seen(name: str) -> None:
    with pytest.raises(InputError, match="PTM-I304") as raised:
        subdivide(scene(EMPTY[name], two_sided=False))
    assert "--two-sided" in str(raised.value)
    cells = subdivide(scene(EMPTY[name], two_sided=True))
    assert cells.cell_count >= 1


@pytest.mark.parametrize("name", SEEN)
def test_something_is_seen(name: str) -> None:
    one_sided = scene(SEEN[name], two_sided=False)
    assert len(subdivide(one_sided).emitted(one_sided.two_sided)[0])


def test_cells_without_faces() -> None:
    """Where faces have backs, turning them helps nothing: another place to begin might."""
    both_sides = scene(house(), two_sided=True)
    cells = subdivide(both_sides)
    nobody = replace(cells, triangle_cell=np.full_like(cells.triangle_cell, -1))
    with pytest.raises(InputError, match=r"--viewpoint.*PTM-I304"):
        check_seen(both_sides, nobody)
