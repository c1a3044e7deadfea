"""Levels that no eye resolves, against the formula of graphics cards for eyes drawn at random."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells.model import Cells
from ptmtools.coverage.required_levels import (
    ALL,
    ANISOTROPY,
    ASPECT,
    VisitorScreen,
    unresolved_levels,
)
from ptmtools.scene.model import Material, Scene, SourceImage
from ptmtools.visibility.model import Pvs

ROOMS = 2
SCREEN = VisitorScreen(1080, 60.0, 0.25)
RoomRow = Callable[[int], tuple[Scene, Cells]]
#: Of a room's quadrilaterals.
FLOOR, CEILING = 0, 1


def standing(low: float = 0.25) -> np.ndarray:
    """Floors on which one can stand, of both rooms."""
    a, b = np.array([low, 0, low - 2]), np.array([4 * ROOMS - low, 0, 2 - low])
    corners = np.array([a, [a[0], 0, b[2]], b, [b[0], 0, a[2]]])
    return corners[[[0, 1, 2], [0, 2, 3]]]


def painted(room_row: RoomRow, quad: int, uv: np.ndarray) -> tuple[Scene, Cells]:
    """Rooms of which one quadrilateral has an image, with these (2, 2) texture coordinates to the
    metre of x and z."""
    scene, cells = room_row(ROOMS)
    material = np.zeros(len(scene.triangles), np.int32)
    material[2 * quad : 2 * quad + 2] = 1
    scene = replace(
        scene,
        uv=scene.corners[:, :, [0, 2]] @ uv.T,
        triangle_material=material,
        materials=(Material("plain"), Material("image", image=0)),
        images=(SourceImage("a.png", "a" * 64, bytes),),
    )
    return scene, replace(cells, eye_floor=standing())


def everything(cells: int = ROOMS) -> Pvs:
    return Pvs.from_matrix(np.ones((cells, cells), np.bool_))


def levels_of_detail(
    scene: Scene, cells: Cells, size: tuple[int, int], count: int = 400_000
) -> np.ndarray:
    """λ where eyes in the eye region see the ceiling, which is no further tested, in some pixel of
    a picture that is turned in some way, and held askew."""
    random = np.random.default_rng(7)
    low, high = cells.eye_floor.reshape(-1, 3).min(axis=0), cells.eye_floor.reshape(-1, 3).max(0)
    high = high + [0, cells.walker.reach, 0]
    eye = low + random.random((count, 3)) * (high - low)
    eye[::2, 1] = high[1]
    seen = np.column_stack([4 * random.random(count), np.full(count, 4.0), eye[:, 2]])
    seen[::3, [0, 2]] = eye[::3][:, [0, 2]]  # what is overhead
    seen[1::3, 2] = 4 * random.random(len(seen[1::3])) - 2
    seen[:, 0] = np.minimum(seen[:, 0], 4.0)
    ray = seen - eye
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    half = np.tan(np.radians(SCREEN.field_of_view) / 2)
    at = (2 * random.random((count, 2)) - 1) * half * [ASPECT, 1]
    at[::5] = np.sign(at[::5]) * half * [ASPECT, 1]  # corners
    # A frame in which the ray has the coordinates (x, y, 1), turned about it anyhow.
    local = np.column_stack([at, np.ones(count)])
    far = np.linalg.norm(local, axis=1)
    frame = np.einsum("nij,njk->nik", rotations(ray, random), turned_to(local / far[:, None]))
    right, up = frame[:, :, 0], frame[:, :, 1]
    whole = ray * far[:, None]  # its component ahead is 1
    depth = (4.0 - eye[:, 1]) / whole[:, 1]
    pixel = 2 * half / SCREEN.height
    gradient = (scene.uv[2 * CEILING, 1:] - scene.uv[2 * CEILING, 0]).T @ np.linalg.inv(
        (scene.corners[2 * CEILING, 1:] - scene.corners[2 * CEILING, 0])[:, [0, 2]].T
    )
    lengths = []
    for step in (right, up):
        moved = depth[:, None] * pixel * (step - whole * (step[:, 1] / whole[:, 1])[:, None])
        texels = moved[:, [0, 2]] @ gradient.T * size
        lengths.append(np.linalg.norm(texels, axis=1))
    most, least = np.maximum(*lengths), np.minimum(*lengths)
    samples = np.minimum(np.ceil(most / least), ANISOTROPY)
    return np.log2(most / samples)


def turned_to(way: np.ndarray) -> np.ndarray:
    """(n, 3, 3) rotations that bring unit vectors to the third axis."""
    return rotations(way, None).transpose(0, 2, 1)


def rotations(way: np.ndarray, random: np.random.Generator | None) -> np.ndarray:
    """(n, 3, 3) rotations that bring the third axis to unit vectors, turned at random if asked."""
    other = np.where(abs(way[:, :1]) < 0.5, [[1.0, 0, 0]], [[0, 1.0, 0]])
    x = np.cross(other, way)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(way, x)
    turn = random.random(len(way)) * 2 * np.pi if random else np.zeros(len(way))
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    return np.stack([c * x + s * y, c * y - s * x, way], axis=2)


@pytest.mark.parametrize(
    ("uv", "size"),
    [
        (np.diag([1.0, 1.0]), (12_000, 12_000)),
        (np.diag([1.0, 1.0]), (23_000, 46_000)),
        (np.diag([1.0, 3.0]), (11_000, 11_000)),
        (np.diag([40.0, 1.0]), (8_000, 8_000)),
        (np.array([[1.0, 0.8], [0.0, 1.0]]), (17_000, 17_000)),
    ],
)
def test_no_eye_needs_what_is_trimmed(
    room_row: RoomRow, uv: np.ndarray, size: tuple[int, int]
) -> None:
    scene, cells = painted(room_row, CEILING, uv)
    (levels,) = unresolved_levels(scene, cells, everything(), [size], SCREEN)
    needed = levels_of_detail(scene, cells, size)
    assert levels >= 1
    assert needed.min() >= levels, "no eye draws from a finer one"
    assert needed.min() < levels + 1.6, "and it is not far from that"


def test_one_level_more_is_too_much(room_row: RoomRow) -> None:
    """Where footprints come just to a power of two: the very next level is drawn from."""
    scene, cells = painted(room_row, CEILING, np.diag([1.0, 1.0]))
    (levels,) = unresolved_levels(scene, cells, everything(), [(10_200, 10_200)], SCREEN)
    needed = levels_of_detail(scene, cells, (10_200, 10_200))
    assert levels <= needed.min() < levels + 1


def test_a_picture_at_the_height_of_the_eye_keeps_all(room_row: RoomRow) -> None:
    """And a floor, on which one looks from 0.25 m as well; a screen of few lines trims both."""
    scene, cells = painted(room_row, FLOOR, np.diag([1.0, 1.0]))
    assert unresolved_levels(scene, cells, everything(), [(2048, 2048)], SCREEN).tolist() == [0]
    scene = replace(scene, uv=scene.corners[:, :, :2])
    wall = np.repeat(np.arange(len(scene.triangles) // 2) == 2, 2).astype(np.int32)
    scene = replace(scene, triangle_material=wall)
    assert unresolved_levels(scene, cells, everything(), [(2048, 2048)], SCREEN).tolist() == [0]
    coarse = replace(SCREEN, height=20)
    assert unresolved_levels(scene, cells, everything(), [(2048, 2048)], coarse)[0] > 0


def test_who_does_not_see_it_need_not_be_far(room_row: RoomRow) -> None:
    """The floor of the first room, in which nobody stands, is seen from the second one's door, or
    by nobody."""
    scene, cells = painted(room_row, FLOOR, np.diag([1.0, 1.0]))
    stands = replace(cells, leaf_standing=np.array([False, True]), eye_floor=standing() + [4, 0, 0])
    sizes = [(80_000, 80_000)]

    def levels(cells: Cells, pvs: Pvs) -> int:
        return int(unresolved_levels(scene, cells, pvs, sizes, SCREEN)[0])

    apart = Pvs.from_matrix(np.eye(2, dtype=np.bool_))
    assert levels(stands, apart) == ALL
    assert levels(stands, replace(apart, conservative=False)) == levels(stands, everything())
    far = replace(stands, eye_floor=standing() + [6, 0, 0])
    assert ALL > levels(far, everything()) > levels(stands, everything())
    assert levels(cells, apart) <= levels(stands, everything())


def test_textures_that_are_drawn_out(room_row: RoomRow) -> None:
    """One texel over the whole ceiling, and along one of its sides."""
    for uv in (np.zeros((2, 2)), np.diag([0.0, 1.0])):
        scene, cells = painted(room_row, CEILING, uv)
        (levels,) = unresolved_levels(scene, cells, everything(), [(64, 64)], SCREEN)
        assert levels == 0
    flat = replace(scene, points=scene.points * [1, 1, 0])
    assert unresolved_levels(flat, cells, everything(), [(64, 64)], SCREEN).tolist() == [ALL]
