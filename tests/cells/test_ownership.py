"""The compiled descent of whole triangles, against cutting all of them node by node."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.cells import Cells, SubdivideOptions, ownership, subdivide
from tests.conftest import scene_of


def rows(cells: Cells) -> set[tuple[float, ...]]:
    corners = np.concatenate([cells.vertex, cells.vertex_uv], axis=1)[cells.triangle]
    sides = np.column_stack([cells.triangle_cell, cells.triangle_source])
    return set(map(tuple, np.column_stack([corners.reshape(-1, 15), sides]).tolist()))


@pytest.mark.parametrize("kind", ["leaf", "room"])
def test_whole_triangles_end_where_cutting_them_ends(
    monkeypatch: pytest.MonkeyPatch, room_row, room_faces, kind: str
) -> None:
    rooms = room_row(4)[0].corners
    # A plank through all doors, a slanted one beside it, and a rug in the plane of the floor.
    plank = room_faces((1, 0.4, -0.2), (15, 0.5, 0.2))
    slanted = [[[0.5, 0.1, -0.9], [15.5, 2.4, -0.9], [15.5, 2.4, -0.3], [0.5, 0.1, -0.3]]]
    rug = [[[1, 0, -1], [1, 0, 1], [15, 0, 1], [15, 0, -1]]]
    scene = scene_of(np.concatenate([rooms, scene_of([*plank, *slanted, *rug]).corners]))
    options = SubdivideOptions(cells=kind, detail=("quad5*",))  # type: ignore[arg-type]
    compiled = subdivide(scene, options)
    assert compiled.leaf_count >= 4
    assert len(compiled.triangle) > len(scene.triangles)

    def stay(tree, corners, facing, tolerance):
        return np.zeros(len(corners), dtype=np.int64), np.zeros(len(corners), dtype=bool)

    monkeypatch.setattr(ownership, "_settle", stay)
    assert rows(subdivide(scene, options)) == rows(compiled)
