"""Meshes of many handles: how many there are, and that they do not stand in the way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from ptmtools.simplification import Mesh, SimplifyOptions, simplify
from ptmtools.simplification.surface import surface_of
from ptmtools.simplification.topology import Topology, topology
from tests.simplification.shapes import (
    box,
    cylinder,
    edge_faces,
    euler,
    grid,
    normals,
    sphere,
    torus,
)


def voxels(filled: NDArray[np.bool_]) -> Mesh:
    """The surface of unit cubes."""
    inside = np.pad(filled, 1)
    corner = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    quads = []
    for axis in range(3):
        across = [(axis + 1) % 3, (axis + 2) % 3]
        for side in (0, 1):
            out = inside & ~np.roll(inside, 1 - 2 * side, axis)
            at = np.argwhere(out)
            quad = np.repeat(at[:, None], 4, axis=1)
            quad[:, :, across] += corner if side else corner[::-1]
            quad[:, :, axis] += side
            quads.append(quad)
    points, index = np.unique(np.concatenate(quads).reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    triangles = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
    return Mesh(points.astype(np.float64), triangles.astype(np.int32))


def plate(holes: int, wide: int = 3, thick: int = 2) -> Mesh:
    """A plate with ``holes`` by ``holes`` holes of one cube."""
    filled = np.ones((wide * holes + 2, wide * holes + 2, thick), bool)
    filled[2::wide, 2::wide][:holes, :holes] = False
    return voxels(filled)


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (sphere(12), 0),
        (torus(20, 12), 1),
        (plate(1), 1),
        (plate(5), 25),
        (cylinder(12, 4), 0),
        (box(3), 0),
    ],
    ids=["sphere", "torus", "plate", "plate of 25", "cylinder without ends", "box"],
)
def test_how_many_there_are(mesh: Mesh, expected: int) -> None:
    assert topology(surface_of(mesh)).handles == expected
    two = Mesh(
        np.concatenate([mesh.points, mesh.points + 100]),
        np.concatenate([mesh.triangles, mesh.triangles + len(mesh.points)]),
    )
    assert topology(surface_of(two)).handles == 2 * expected


def touching_holes(count: int, every: int) -> Mesh:
    """A sheet of squares of which one diagonal in ``every`` is missing, ``count`` squares long at
    most: the holes touch."""
    sheet = grid(count + 2, count + 2)
    x, y = np.meshgrid(np.arange(count + 3.0), np.arange(count + 3.0))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    middle = points[sheet].mean(axis=1).astype(int)
    inside = ((middle > 0) & (middle <= count))[:, :2].all(axis=1)
    hole = (middle[:, 0] - middle[:, 1]) % every == 0
    return Mesh(points, sheet[~(hole & inside)])


def chained(count: int) -> Mesh:
    """Tori, each of which touches the next in a vertex."""
    one = torus(12, 8)
    first, last = one.points[:, 0].argmin(), one.points[:, 0].argmax()
    step = one.points[last] - one.points[first]
    return Mesh(
        np.concatenate([one.points + i * step for i in range(count)]),
        np.concatenate([one.triangles + i * len(one.points) for i in range(count)]),
    )


def test_what_touches_in_a_vertex_is_no_handle() -> None:
    assert topology(surface_of(touching_holes(4, 9))) == Topology(0, 0, 1)
    assert topology(surface_of(touching_holes(30, 3))).handles == 0
    # In a line, so that the sums for the last end where those for the next begin.
    chain = chained(8)
    corners = np.unique(np.round(chain.points, 9), axis=0, return_inverse=True)[1]
    welded = Mesh(np.unique(np.round(chain.points, 9), axis=0), corners[chain.triangles])
    assert len(welded.points) == len(chain.points) - 7
    assert topology(surface_of(welded)) == Topology(8, 8, 0)


def test_holes_that_touch_take_no_part_away() -> None:
    """They are no handles, so nothing closes, and small closed parts stay with a sheet."""
    sheet, chips = touching_holes(40, 3), box(1)
    points = [sheet.points, *(0.05 * chips.points + [i, 0, 5] for i in range(5))]
    triangles = [sheet.triangles]
    for i in range(5):
        triangles.append(chips.triangles + len(sheet.points) + i * len(chips.points))
    given = Mesh(np.concatenate(points), np.concatenate(triangles).astype(np.int32))
    actual = simplify(given, SimplifyOptions(300, keep_parts=True))
    whose = np.searchsorted(np.cumsum([len(part) for part in triangles]), actual.source, "right")
    assert np.unique(whose).tolist() == [0, 1, 2, 3, 4, 5]


def test_the_note_counts_parts_of_which_nothing_is_left() -> None:
    rng = np.random.default_rng(5)
    many = [0.01 * box(1).points + rng.random(3) for _ in range(200)]
    step = len(box(1).points)
    chips = np.concatenate([box(1).triangles + i * step for i in range(200)])
    big = sphere(20)
    given = Mesh(
        np.concatenate([*many, big.points]), np.concatenate([chips, big.triangles + 200 * step])
    )
    actual = simplify(given, SimplifyOptions(100))
    part = np.minimum(actual.source // len(box(1).triangles), 200)
    gone = 201 - len(np.unique(part))
    assert gone > 100
    assert actual.notes[0].startswith(f"{gone} of 201 parts are gone")


def test_nobody_can_say_where_three_faces_meet() -> None:
    fan = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]], dtype=np.int32)
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]], dtype=np.float64)
    assert topology(surface_of(Mesh(points, fan))).handles == 0
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert topology(surface_of(nothing)).irreducible_faces == 0


def test_many_handles_are_closed_and_the_plate_stays() -> None:
    """400 holes hold 1,600 faces; of the plate's outline 200 are enough."""
    given = plate(20)
    actual = simplify(given, SimplifyOptions(faces=200))
    assert len(actual.mesh.triangles) <= 200
    assert actual.notes == ()
    # Nothing opens: every edge has an even number of faces.
    assert (edge_faces(actual.mesh) % 2 == 0).all()
    low, high = given.points.min(axis=0), given.points.max(axis=0)
    assert np.allclose(actual.mesh.points.min(axis=0), low, atol=0.5)
    assert np.allclose(actual.mesh.points.max(axis=0), high, atol=0.5)
    volume = (normals(actual.mesh) * actual.mesh.points[actual.mesh.triangles[:, 0]]).sum() / 6
    # Of whole cubes: each hole closes by some, or stays.
    assert 0.85 * np.prod(high - low) < volume < 1.1 * np.prod(high - low)


def test_few_handles_stay() -> None:
    """What holds a tenth of the faces at most is kept, as anything else that one sees."""
    given = plate(3)
    actual = simplify(given, SimplifyOptions(faces=360))
    assert euler(actual.mesh) == 2 - 2 * 9
    assert (edge_faces(actual.mesh) == 2).all()


def test_no_step_goes_beyond_the_error() -> None:
    given = plate(20)
    free = simplify(given, SimplifyOptions(faces=100))
    held = simplify(given, SimplifyOptions(faces=100, error=0.1))
    assert held.error <= 0.1 < free.error
    assert len(held.mesh.triangles) > len(free.mesh.triangles)
    assert (edge_faces(held.mesh) % 2 == 0).all()


def test_materials_stay_where_they_are() -> None:
    """The outlines of a material are as exact with handles closed as without: half of the plate."""
    given = plate(12)
    middle = (given.points[:, 0].max() + given.points[:, 0].min()) // 2
    material = (given.points[given.triangles].mean(axis=1)[:, 0] > middle).astype(np.int32)
    actual = simplify(replace(given, material=material), SimplifyOptions(faces=150)).mesh
    assert actual.material is not None
    assert (edge_faces(actual) % 2 == 0).all()
    corners = actual.points[actual.triangles][..., 0]
    assert corners[actual.material == 0].max() <= middle + 1e-9
    assert corners[actual.material == 1].min() >= middle - 1e-9


@given(st.integers(0, 2**32 - 1), st.integers(8, 200))
def test_noise_stays_closed_and_is_the_same_again(seed: int, faces: int) -> None:
    """Cubes at random: handles, islands, edges of four faces."""
    random = np.random.default_rng(seed)
    given = voxels(random.random((6, 6, 6)) < 0.6)
    actual, again = (simplify(given, SimplifyOptions(faces=faces)) for _ in range(2))
    assert (edge_faces(actual.mesh) % 2 == 0).all()
    assert actual.mesh.points.tobytes() == again.mesh.points.tobytes()
    assert actual.mesh.triangles.tobytes() == again.mesh.triangles.tobytes()
    assert (np.diff(np.sort(actual.mesh.triangles, axis=1), axis=1) > 0).all()
    assert np.isfinite(actual.mesh.points).all()


def beside(body: Mesh, chip: Mesh, count: int) -> Mesh:
    """A body with many chips around it, a hundredth as large."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    across = np.sqrt(1 - z**2)
    places = 1.5 * np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
    points = (places[:, None] + 0.01 * chip.points).reshape(-1, 3)
    step = len(chip.points) * np.arange(count)[:, None, None]
    triangles = (chip.triangles + step).reshape(-1, 3) + len(body.points)
    return Mesh(
        np.concatenate([body.points, points]),
        np.concatenate([body.triangles, triangles]).astype(np.int32),
    )


def sheet(steps: int) -> Mesh:
    """A square of 2 steps² faces."""
    x, y = (each.reshape(-1) for each in np.meshgrid(*[np.arange(steps + 1.0)] * 2))
    return Mesh(np.stack([x, y, 0 * x], axis=1), grid(steps, steps))


@pytest.mark.parametrize(
    ("chip", "closed"),
    [(sphere(2), True), (sheet(3), False)],
    ids=["closed", "open"],
)
def test_many_parts_give_way_to_the_body(chip: Mesh, closed: bool) -> None:
    """Two thousand chips hold more faces than there are to be: without them the body, whose faces
    are dearest, would be a tetrahedron."""
    given = beside(sphere(40), chip, 2000)
    there = topology(surface_of(given))
    assert (there.parts, there.closed_parts) == (2001, 2001 if closed else 1)
    actual = simplify(given, SimplifyOptions(1000))
    assert len(actual.mesh.triangles) <= 1000
    assert any("parts are gone" in note for note in actual.notes)
    far = np.linalg.norm(actual.mesh.points[actual.mesh.triangles].mean(axis=1), axis=1)
    body = far < 1.2
    assert body.sum() > 400
    assert np.abs(far[body] - 1).max() < 0.05

    kept = simplify(given, SimplifyOptions(1000, keep_parts=True))
    assert topology(surface_of(kept.mesh)).parts == 2001


def test_few_parts_stay() -> None:
    given = beside(sphere(20), sphere(2), 5)
    actual = simplify(given, SimplifyOptions(1000))
    assert topology(surface_of(actual.mesh)).parts == 6
    assert actual.notes == ()


@pytest.mark.parametrize("mesh", [sphere(10), torus(20, 12), plate(5)])
def test_something_is_left(mesh: Mesh) -> None:
    for faces in (1, 2, 4):
        assert len(simplify(mesh, SimplifyOptions(faces)).mesh.triangles) > 0
    two = beside(mesh, mesh, 3)
    assert len(simplify(two, SimplifyOptions(1)).mesh.triangles) > 0
