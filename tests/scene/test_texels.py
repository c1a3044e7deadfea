"""Used texels, against a dense sampling with the filter's own arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.scene.texels import near_holes, uses_holes


def sampled(holes: np.ndarray, uv: np.ndarray, wrap: tuple[str, str]) -> bool:
    """Whether a bilinear lookup at some of many points of the triangles meets a hole."""
    height, width = holes.shape
    grid = [(i / 40, j / 40) for i in range(41) for j in range(41 - i)]
    a, b = np.array(grid).T[:, :, None]
    for triangle in uv:
        point = triangle[0] * (1 - a - b) + triangle[1] * a + triangle[2] * b
        x, y = point[:, 0] * width - 0.5, (1 - point[:, 1]) * height - 0.5
        for dx in (0, 1):
            for dy in (0, 1):
                weight = np.abs(1 - dx - (x - np.floor(x))) * np.abs(1 - dy - (y - np.floor(y)))
                i, j = np.floor(x).astype(int) + dx, np.floor(y).astype(int) + dy
                i = i % width if wrap[0] == "repeat" else np.clip(i, 0, width - 1)
                j = j % height if wrap[1] == "repeat" else np.clip(j, 0, height - 1)
                if (holes[j, i] & (weight > 1e-9)).any():
                    return True
    return False


coordinate = st.floats(-1.5, 2.5, allow_nan=False, width=32)


@given(
    uv=st.lists(st.tuples(*[coordinate] * 6), min_size=1, max_size=3),
    hole=st.lists(st.tuples(st.integers(0, 6), st.integers(0, 4)), min_size=1, max_size=4),
    wrap=st.tuples(*[st.sampled_from(["repeat", "clamp"])] * 2),
)
def test_no_used_hole_is_missed(uv, hole, wrap) -> None:
    holes = np.zeros((5, 7), dtype=bool)
    for x, y in hole:
        holes[y, x] = True
    triangles = np.array(uv, dtype=float).reshape(-1, 3, 2)
    if sampled(holes, triangles, wrap):
        assert uses_holes(holes, triangles, *wrap)


def atlas() -> np.ndarray:
    """Opaque below the diagonal from the upper left to the lower right, holes above."""
    x, y = np.meshgrid(np.arange(64), np.arange(64))
    return x > y + 4


#: A texel and a half from the border, beyond which the filter wraps around.
LOWER = np.array([[[0.025, 0.025], [0.95, 0.025], [0.025, 0.95]]])
UPPER = 1 - LOWER


@pytest.mark.parametrize("shift", [0.0, 3.0, -1000.0])
@pytest.mark.parametrize("turn", [0, 1, 2])
def test_an_atlas_whose_holes_lie_within_the_box_of_a_face(shift: float, turn: int) -> None:
    for faces, used in ((LOWER, False), (UPPER, True)):
        for winding in (faces, faces[:, ::-1]):
            moved = np.roll(winding, turn, axis=1) + shift
            assert uses_holes(atlas(), moved, "repeat", "repeat") is used


def test_first_row_is_the_top_of_the_image() -> None:
    holes = np.zeros((8, 8), dtype=bool)
    holes[0] = True
    low, high = [[0.2, 0.2], [0.8, 0.2], [0.5, 0.4]], [[0.2, 0.8], [0.8, 0.8], [0.5, 0.99]]
    assert not uses_holes(holes, np.array([low]), "repeat", "repeat")
    assert uses_holes(holes, np.array([high]), "repeat", "repeat")


def test_wrapping_decides_at_the_border() -> None:
    holes = np.zeros((8, 8), dtype=bool)
    holes[:, 7] = True
    left = np.array([[[0.0, 0.1], [0.3, 0.1], [0.0, 0.9]]])
    assert uses_holes(holes, left, "repeat", "repeat")
    assert not uses_holes(holes, left, "clamp", "repeat")
    assert uses_holes(holes, left + [2.0, 0.0], "clamp", "repeat")


@pytest.mark.parametrize("uv", [1e30, 1e308])
def test_absurd_coordinates_err_to_the_safe_side(uv: float) -> None:
    triangle = np.array([[[0, 0], [uv, 0], [0, uv]]])
    assert uses_holes(atlas(), triangle, "repeat", "repeat")


def test_a_point_uses_the_texels_around_it() -> None:
    holes = np.zeros((8, 8), dtype=bool)
    holes[7, 0] = True
    assert uses_holes(holes, np.zeros((1, 3, 2)), "repeat", "repeat")
    assert not uses_holes(holes, np.full((1, 3, 2), 0.5), "repeat", "repeat")


def test_boxes_near_holes() -> None:
    """What filtering spreads from the next tile of an atlas does not count."""
    holes = np.zeros((8, 8), dtype=bool)
    holes[:4, 4:] = True  # the upper right tile
    tile = np.array([[[0.0, 0.0], [0.5, 0.0], [0.5, 0.5]]])
    tiles = np.concatenate([tile, tile + [0.5, 0.0], tile + [0.0, 0.5], tile + [0.5, 0.5]])
    assert near_holes(holes, tiles, "repeat", "repeat").tolist() == [False, False, False, True]
    assert near_holes(holes, tiles - 3.0, "repeat", "repeat").tolist() == [False] * 3 + [True]
    beyond = tiles + [0.5, 0.0]
    assert near_holes(holes, beyond, "repeat", "clamp").tolist() == [False, False, True, False]
    assert near_holes(holes, beyond, "clamp", "clamp").tolist() == [False, False, True, True]
