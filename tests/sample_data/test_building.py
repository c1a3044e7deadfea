"""The museum's geometry: closed, furnished, hung."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

Model = Callable[..., Any]
DETAIL = ("painting_", "statue_", "bench_", "entrance_door")


@pytest.fixture(scope="module")
def shown(model: Model) -> Any:
    return model()


@pytest.fixture(scope="module")
def closed(model: Model) -> Any:
    return model(windows=False)


def is_shell(triangles: Any) -> Any:
    stairs = ("_flight", "_landing", "_guard", "_bars")
    return np.array(
        [
            not name.startswith(DETAIL) and not any(s in name for s in stairs) and mat != "glass"
            for name, mat in zip(triangles.objects, triangles.materials, strict=True)
        ]
    )


def inside(museum: ModuleType, n: int, windows: bool) -> tuple[Any, Any]:
    """n rays from random points in rooms and corridors, away from furniture's inside."""
    plan = museum.make_plan(12, museum.generator(1, 0), windows=windows)
    boxes = plan.of_kind("room", "corridor", "shaft", "entry")
    rng = np.random.default_rng(7)
    which = rng.integers(len(boxes), size=n)
    low, high = (np.array([getattr(b, k) for b in boxes])[which] / 1000 for k in ("low", "high"))
    rays = rng.normal(size=(n, 3))
    return low + (high - low) * (0.01 + 0.98 * rng.random((n, 3))), rays / np.linalg.norm(
        rays, axis=1, keepdims=True
    )


def test_default_has_twelve_rooms_on_two_floors(museum: ModuleType, shown: Any) -> None:
    names = set(shown.objects)
    assert {n for n in names if n.startswith("room") and n.endswith("_floor")} == {
        f"room{k:02d}_floor" for k in range(1, 13)
    }
    assert {"corridor0a_floor", "corridor1a_floor", "staira_flight0_up", "staira_shaft_floor"} <= (
        names
    )
    floors = shown.where(np.array([o.startswith("room") and "_floor" in o for o in shown.objects]))
    assert set(floors.corners[..., 1].ravel()) == {0.0, 4.5}
    assert sum(n.startswith("statue_") for n in names) >= 8
    assert sum(n.startswith("bench_") for n in names) >= 8


def test_statues_have_several_hundred_triangles(shown: Any) -> None:
    for name in {n for n in shown.objects if n.startswith("statue_")}:
        assert 200 <= np.count_nonzero(shown.objects == name) <= 1500


@pytest.mark.parametrize("windows", [True, False])
@pytest.mark.parametrize("rooms", [1, 2, 5, 12, 40])
def test_shell_encloses_exactly_the_solid(
    museum: ModuleType, model: Model, rooms: int, windows: bool
) -> None:
    """The divergence theorem finds a missing, doubled or turned face."""
    shell = model(rooms=rooms, windows=windows)
    shell = shell.where(is_shell(shell))
    plan = museum.make_plan(rooms, museum.generator(1, 0), windows=windows)

    def content(low: Any, high: Any) -> float:
        return float(np.prod((np.array(high) - np.array(low)) / 1000))

    air = sum(content(box.low, box.high) for box in plan.boxes)
    assert shell.volume() == pytest.approx(content(plan.low, plan.high) - air, rel=1e-9)
    assert np.abs(shell.normals.sum(axis=0)).max() < 1e-6
    assert shell.where(np.arange(len(shell.corners)) > 8).volume() != pytest.approx(
        shell.volume(), rel=1e-9
    )


def test_closed_museum_lets_no_ray_out(museum: ModuleType, closed: Any) -> None:
    origins, rays = inside(museum, 40_000, False)
    assert np.isfinite(closed.distances(origins, rays)).all()
    holed = closed.where(closed.objects != "room05_wall_east")
    outside = holed.where(holed.objects != "facade_east")
    assert np.isinf(outside.distances(origins, rays)).any()


def test_windows_are_closed_by_glass_alone(museum: ModuleType, shown: Any) -> None:
    origins, rays = inside(museum, 40_000, True)
    assert np.isfinite(shown.distances(origins, rays)).all()
    without = shown.where(shown.materials != "glass")
    assert np.isinf(without.distances(origins, rays)).any()


def test_pictures_hang_2_mm_to_2_cm_off_their_wall(shown: Any) -> None:
    walls = shown.where(np.array(["_wall_" in name for name in shown.objects]))
    seen = set()
    for name in sorted({n for n in shown.objects if n.startswith("painting_")}):
        picture = shown.where(shown.objects == name)
        canvas = picture.where(np.char.startswith(picture.materials, "painting_"))
        out = canvas.normals[0] / np.linalg.norm(canvas.normals[0])
        behind = picture.corners.reshape(-1, 3)
        depth = behind @ out
        back = behind[depth < depth.min() + 1e-4]
        gap = walls.distances(back, np.tile(-out, (len(back), 1)))
        assert (gap >= 0.002 - 1e-5).all(), name
        assert (gap <= 0.020 + 1e-5).all(), name
        seen.add(round(float(gap[0]) * 1000))
        assert np.ptp(depth) == pytest.approx(0.025, abs=1e-4)
    assert min(seen) <= 4
    assert max(seen) >= 18


def test_pictures_are_upright_and_unmirrored(shown: Any) -> None:
    canvas = shown.where(np.char.startswith(shown.materials, "painting_"))
    for corners, uv, normal in zip(canvas.corners, canvas.uv, canvas.normals, strict=True):
        edges, change = corners[1:] - corners[0], uv[1:] - uv[0]
        right, up = np.linalg.lstsq(change, edges, rcond=None)[0]
        assert np.cross(right, up) @ normal > 0
        assert up @ [0, 1, 0] > 0
        assert abs(right @ [0, 1, 0]) < 1e-6


@settings(max_examples=40, deadline=None)
@given(rooms=st.integers(1, 400), seed=st.integers(0, 2**32))
def test_every_room_can_be_walked_to(museum: ModuleType, rooms: int, seed: int) -> None:
    plan = museum.make_plan(rooms, museum.generator(seed, 0))
    low, high = (np.array([getattr(b, k) for b in plan.boxes]) for k in ("low", "high"))
    assert (low < high).all()
    meets = np.maximum(low[:, None], low) <= np.minimum(high[:, None], high)
    overlap = np.maximum(low[:, None], low) < np.minimum(high[:, None], high)
    assert not (overlap.all(axis=2) & ~np.eye(len(low), dtype=bool)).any()
    # Open to each other: they touch in a rectangle, not in an edge or a corner.
    joined = meets.all(axis=2) & (overlap.sum(axis=2) == 2)
    kinds = np.array([b.kind for b in plan.boxes])
    joined[kinds == "window"] = joined[:, kinds == "window"] = False
    reached = np.zeros(len(low), dtype=bool)
    reached[0] = True
    for _ in plan.boxes:
        grown = reached | joined[reached].any(axis=0)
        if (grown == reached).all():
            break
        reached = grown
    assert reached[kinds != "window"].all()
    assert np.count_nonzero(kinds == "room") == rooms
    # Nothing but walls and slabs is solid.
    block = np.prod(np.subtract(plan.high, plan.low) / 1000)
    assert np.prod((high - low) / 1000, axis=1).sum() > 0.75 * block
    assert (low >= plan.low).all()
    assert (high <= plan.high).all()


#: A beginning and an end after it, 0 to 9.
SPAN = st.integers(0, 8).flatmap(lambda low: st.tuples(st.just(low), st.integers(low + 1, 9)))


@given(
    holes=st.lists(
        st.tuples(SPAN, SPAN).map(lambda s: (s[0][0], s[1][0], s[0][1], s[1][1])),
        max_size=4,
    )
)
def test_rectangles_cover_the_rest_once(
    museum: ModuleType, holes: list[tuple[int, int, int, int]]
) -> None:
    from ptmtools_samples.shell import rectangles

    expected = np.ones((8, 8), dtype=int)
    for a, b, c, d in holes:
        expected[a:c, b:d] = 0
    actual = np.zeros((8, 8), dtype=int)
    clipped = [(a, b, min(c, 8), min(d, 8)) for a, b, c, d in holes if a < 8 and b < 8]
    for a, b, c, d in rectangles((0, 0, 8, 8), clipped):
        assert a < c
        assert b < d
        actual[a:c, b:d] += 1
    assert (actual == expected).all()
