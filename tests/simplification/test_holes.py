"""Small holes: which are filled, by what, and what stays open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from ptmtools.simplification import Mesh, SimplifyOptions, simplify
from ptmtools.simplification.surface import surface_of
from ptmtools.simplification.topology import fill_small_holes
from tests.simplification.shapes import edge_faces, euler, facade, grid, normals, sphere


def without(mesh: Mesh, gone: NDArray[np.bool_]) -> Mesh:
    """The same without some faces."""

    def left(values: NDArray[np.generic] | None) -> NDArray[np.generic] | None:
        return None if values is None else values[~gone]

    triangles, *painted = (left(v) for v in (mesh.triangles, mesh.material, mesh.uv, mesh.colors))
    return Mesh(mesh.points, triangles, *painted)  # type: ignore[arg-type]


def around(mesh: Mesh, places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(T,) the faces that meet in the points nearest to some places."""
    apart = np.linalg.norm(mesh.points[:, None] - places, axis=2)
    near = (mesh.points[:, None] == mesh.points[apart.argmin(axis=0)]).all(axis=2).any(axis=1)
    return np.asarray(near[mesh.triangles].any(axis=1))


def volume(mesh: Mesh) -> float:
    return float((normals(mesh) * mesh.points[mesh.triangles[:, 0]]).sum() / 6)


def spread(count: int) -> NDArray[np.float64]:
    """Places on the unit sphere, as far apart as may be."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    across = np.sqrt(1 - z**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


def fill(mesh: Mesh, faces: int) -> Mesh:
    actual = fill_small_holes(mesh, surface_of(mesh), faces)
    assert actual is not None
    assert len(actual.source) == len(actual.mesh.triangles)
    assert actual.source.max() < len(mesh.triangles)
    assert (actual.mesh.triangles[: len(mesh.triangles)] == mesh.triangles).all()
    return actual.mesh


def test_what_fills_a_hole_looks_the_way_the_mesh_does() -> None:
    """Holes of six and more corners, each where a point was."""
    whole = sphere(40)
    holed = without(whole, around(whole, spread(100)))
    actual = fill(holed, 1000)
    assert (edge_faces(actual) == 2).all()
    assert euler(actual) == 2
    assert len(actual.triangles) == len(whole.triangles) - 200
    assert volume(actual) == pytest.approx(volume(whole), rel=1e-3)
    inwards = (normals(actual) * actual.points[actual.triangles].mean(axis=1)).sum(axis=1)
    assert (inwards > 0).all()


def test_holes_hold_no_faces_then() -> None:
    """Every tenth face is missing, so that holes touch each other."""
    whole = sphere(40)
    random = np.random.default_rng(1)
    holed = without(whole, random.random(len(whole.triangles)) < 0.1)
    actual = simplify(holed, SimplifyOptions(1000))
    assert len(actual.mesh.triangles) <= 1000
    assert [note.endswith("they would hold many of the faces") for note in actual.notes] == [True]
    assert np.abs(np.linalg.norm(actual.mesh.points, axis=1) - 1).max() < 0.02
    assert volume(actual.mesh) == pytest.approx(volume(whole), rel=0.02)
    # What each face is like lies where it is.
    middle = actual.mesh.points[actual.mesh.triangles].mean(axis=1)
    like = holed.points[holed.triangles[actual.source]].mean(axis=1)
    assert np.linalg.norm(middle - like, axis=1).max() < 0.3

    kept = simplify(holed, SimplifyOptions(1000, keep_parts=True))
    assert len(kept.mesh.triangles) > 3000


def test_few_holes_stay() -> None:
    """Holes that hold no tenth of the faces are kept, as anything else that one sees."""
    whole = sphere(40)
    holed = without(whole, around(whole, spread(10)))
    assert fill_small_holes(holed, surface_of(holed), 1000) is None
    assert euler(simplify(holed, SimplifyOptions(1000)).mesh) == 2 - 10


def test_large_holes_stay() -> None:
    """Of a hundred windows none is small beside the faces that are left, or in its wall."""
    whole = sphere(40)
    far = np.linalg.norm(whole.points[whole.triangles].mean(axis=1)[:, None] - spread(30), axis=2)
    holed = without(whole, (far < 0.15).any(axis=1))
    assert fill_small_holes(holed, surface_of(holed), 1000) is None


@pytest.mark.parametrize("sheets", [1, 400])
def test_sheets_are_not_closed_by_their_outlines(sheets: int) -> None:
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float64)
    points = (corner + 2 * np.arange(sheets)[:, None, None] * [1, 0, 0]).reshape(-1, 3)
    pair = np.array([[0, 1, 2], [0, 2, 3]])
    triangles = (pair + 4 * np.arange(sheets)[:, None, None]).reshape(-1, 3).astype(np.int32)
    given = Mesh(points, triangles)
    assert fill_small_holes(given, surface_of(given), 1) is None


def test_a_hole_takes_over_what_is_painted_around_it() -> None:
    """Of bricks with windows: texture coordinates go on, and nothing new is a seam."""
    whole = facade(3, 2, 8)
    assert whole.material is not None
    random = np.random.default_rng(2)
    bricks = whole.material == 0
    holed = without(whole, bricks & (random.random(len(bricks)) < 0.02))
    actual = fill(holed, 100)
    assert actual.uv is not None
    assert actual.material is not None
    new = np.arange(len(actual.triangles)) >= len(holed.triangles)
    assert new.sum() > 20
    at = actual.points[actual.triangles[new]][..., :2]
    on_bricks = actual.material[new] == 0
    assert on_bricks.any()
    wanted = at[on_bricks] * [4.0, 8.0] + 0.25
    whole_bricks = np.abs(actual.uv[new][on_bricks] - wanted).max(axis=(1, 2)) < 1e-9
    # But at windows, where the bricks' holes have corners of theirs.
    assert whole_bricks.mean() > 0.9


def test_tangled_borders_are_left_alone() -> None:
    """Faces that disagree on their front, and edges of three."""
    whole = sphere(12)
    triangles = whole.triangles.copy()
    triangles[::3] = triangles[::3, ::-1]
    fins = triangles[5::40].copy()
    fins[:, 2] = fins[::-1, 2]
    given = replace(whole, triangles=np.concatenate([triangles[::2], fins]))
    actual = simplify(given, SimplifyOptions(20))
    assert np.isfinite(actual.mesh.points).all()


@given(st.integers(0, 2**32 - 1), st.floats(0, 0.9), st.integers(1, 300))
def test_whatever_is_missing(seed: int, share: float, faces: int) -> None:
    """No new edge has more than two faces, no face is there twice, and it is the same again."""
    whole = sphere(8)
    random = np.random.default_rng(seed)
    gone = random.random(len(whole.triangles)) < share
    gone[0] = False
    holed = without(whole, gone)
    options = SimplifyOptions(faces)
    actual, again = (simplify(holed, options) for _ in range(2))
    assert actual.mesh.triangles.tobytes() == again.mesh.triangles.tobytes()
    assert actual.mesh.points.tobytes() == again.mesh.points.tobytes()
    assert len(actual.mesh.triangles) > 0
    assert (np.diff(np.sort(actual.mesh.triangles, axis=1), axis=1) > 0).all()
    assert 0 <= actual.source.min() <= actual.source.max() < len(holed.triangles)
    more = fill_small_holes(holed, surface_of(holed), faces)
    if more is not None:
        assert edge_faces(more.mesh).max() <= 2
        assert len(np.unique(np.sort(more.mesh.triangles, axis=1), axis=0)) == len(more.source)


def test_nothing_to_fill() -> None:
    given = Mesh(np.zeros((3, 3)), grid(1, 1)[:1] * 0)
    assert fill_small_holes(given, surface_of(given), 1) is None
