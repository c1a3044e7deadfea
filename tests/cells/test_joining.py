"""Joined pieces: what they cover, and that nothing gapes between them."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import areas
from ptmtools.cells import SubdivideOptions, subdivide, subdivision
from ptmtools.cells.joining import CutMesh, join_pieces, patches
from ptmtools.cells.ownership import Pieces
from ptmtools.cells.planar import triangulate_rings
from ptmtools.cells.search import first_alike, weld
from ptmtools.scene import ingest
from ptmtools.scene.model import Material, Scene
from tests.builds import once

#: So many open edges are compared with the model's at a time.
CHUNK = 64


def taken_apart(monkeypatch: pytest.MonkeyPatch, scene: Scene, **options: Any) -> tuple[Any, ...]:
    """The arguments of `join_pieces` for a scene: all pieces, those without an owner too."""
    given: list[Any] = []

    def spy(*arguments: Any) -> CutMesh:
        given.append(arguments)
        return join_pieces(*arguments)

    monkeypatch.setattr(subdivision, "join_pieces", spy)
    subdivide(scene, SubdivideOptions(**options))
    return tuple(given[0])


def with_owner(owner: np.ndarray) -> np.ndarray:
    """The same owners, but what is nobody's belongs to one more cell."""
    return np.where((owner < 0).all(axis=1, keepdims=True), owner.max() + 1, owner)


def corners_of(mesh: CutMesh) -> np.ndarray:
    return mesh.vertex[mesh.triangle]


def open_edges(corners: np.ndarray) -> np.ndarray:
    """(k, 2, 3) the edges of (n, 3, 3) triangles that no other has, with the same two ends."""
    distinct, number = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    ends = np.sort(np.stack([number, np.roll(number, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    return distinct[edges[count == 1]]


def gaping(scene: Scene, corners: np.ndarray) -> np.ndarray:
    """The open edges of triangles that do not run along open edges of the model."""
    actual, model = open_edges(corners), open_edges(scene.corners)
    way = model[:, 1] - model[:, 0]
    length = np.linalg.norm(way, axis=1)
    way /= length[:, None]
    reach = 10 * scene.tolerance.rounding
    along = np.zeros(len(actual), dtype=bool)
    for first in range(0, len(actual), CHUNK):
        ahead = actual[first : first + CHUNK, :, None] - model[:, 0]
        place = np.einsum("neki,ki->nek", ahead, way)
        off = np.linalg.norm(ahead - place[..., None] * way, axis=3)
        on = (off <= reach) & (place >= -reach) & (place <= length + reach)
        along[first : first + CHUNK] = on.all(axis=1).any(axis=1)
    return actual[~along]


def halls(quads: Callable[..., Scene], room_faces: Any, partition: Any, **look: Any) -> Scene:
    """Two rooms that walls which end in mid-air cut into many leaves, and a bent banner through the
    door."""
    faces = room_faces((0, 0, -2), (8, 4, 2)) + partition(4, (0, 3, -1, 1))
    faces += [[[x, 0, -2], [x, 0, 0.3], [x, 3, 0.3], [x, 3, -2]] for x in (1.3, 2.9, 5.7)]
    faces += [[[1, 1, -0.9], [7, 1.2, 0.7], [7, 2.2, 0.7], [1, 2, -0.8]]]
    return quads(faces, **look)


@pytest.fixture(params=["halls", "hospital"])
def given(
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path_factory: pytest.TempPathFactory,
    shared: Path,
    quads: Any,
    room_faces: Any,
    partition: Any,
) -> tuple[Any, ...]:
    """The arguments of `join_pieces` for several scenes."""
    if request.param == "halls":
        return taken_apart(monkeypatch, halls(quads, room_faces, partition))
    file = shared / "scenes/hospital/hospital.obj"
    if not file.is_file():
        pytest.skip(f"there is no {file}")

    def divide(folder: Path) -> None:
        parts = taken_apart(monkeypatch, ingest(file))
        (folder / "parts").write_bytes(pickle.dumps(parts))

    parts = once(tmp_path_factory, "hospital_pieces", divide) / "parts"
    return tuple(pickle.loads(parts.read_bytes()))


def test_joined_pieces(given: tuple[Any, ...]) -> None:
    scene, pieces, owner, tolerance = given
    mesh = join_pieces(scene, pieces, owner, tolerance)
    owned = (owner >= 0).any(axis=1)
    assert len(mesh.triangle) < owned.sum()

    # Each owner has as much of each material as before.
    def held(material: np.ndarray, cells: np.ndarray, area: np.ndarray) -> np.ndarray:
        each = np.zeros((len(scene.materials), 2, owner.max() + 2))
        for side in (0, 1):
            np.add.at(each, (material, side, cells[:, side]), area)
        return each

    before = held(
        scene.triangle_material[pieces.source[owned]],
        owner[owned],
        areas(piece_corners(scene, pieces)[owned]),
    )
    after = held(
        scene.triangle_material[mesh.triangle_source], mesh.triangle_cell, areas(corners_of(mesh))
    )
    assert np.allclose(before, after, rtol=0, atol=tolerance.rounding * tolerance.extent)

    # No position is new.
    known = {
        tuple(p)
        for p in np.concatenate([scene.points, piece_corners(scene, pieces).reshape(-1, 3)])
    }
    assert {tuple(p) for p in mesh.vertex} <= known

    # Triangles of one pair of owners are what they were.
    whole = [
        t
        for t, n in enumerate(np.bincount(mesh.triangle_source, minlength=len(scene.triangles)))
        if n == 1 and len(np.unique(owner[pieces.source == t], axis=0)) == 1
    ]
    assert whole
    for t in whole:
        (row,) = np.flatnonzero(mesh.triangle_source == t)
        if np.isin(mesh.vertex[mesh.triangle[row]], scene.corners[t]).all():
            assert np.array_equal(mesh.vertex[mesh.triangle[row]], scene.corners[t])
            assert np.array_equal(mesh.vertex_uv[mesh.triangle[row]], scene.uv[t])


def test_nothing_gapes_that_did_not(given: tuple[Any, ...]) -> None:
    scene, pieces, owner, tolerance = given
    mesh = join_pieces(scene, pieces, with_owner(owner), tolerance)
    assert len(gaping(scene, corners_of(mesh))) == 0
    assert len(gaping(scene, piece_corners(scene, pieces))) > 0, "cutting alone leaves gaps"


def test_a_planted_junction_is_found(quads: Any, room_faces: Any, partition: Any) -> None:
    scene = halls(quads, room_faces, partition)
    corners = scene.corners
    assert len(gaping(scene, corners)) == 0
    a, b, c = corners[0]
    planted = np.concatenate([corners[1:], [[a, (a + b) / 2, c], [(a + b) / 2, b, c]]])
    assert len(gaping(scene, planted)) > 0


def piece_corners(scene: Scene, pieces: Pieces) -> np.ndarray:
    """(M, 3, 3) the corners of pieces."""
    corners = scene.corners[pieces.source]
    corners[pieces.cut] = pieces.corner[..., :3]
    return corners


def all_cut(corner: np.ndarray, source: np.ndarray, leaf: np.ndarray) -> Pieces:
    """Pieces none of which is said to be whole."""
    return Pieces(source, leaf, np.arange(len(source)), corner)


def floor_in_pieces(
    quads: Any, x: tuple[float, ...], z: tuple[float, ...] = (), times: int = 1
) -> tuple[Scene, np.ndarray, np.ndarray]:
    """A floor of 4 m × 1 m, there so many ``times``, cut at ``x`` and ``z``: the scene, (M, 3, 6)
    corners as `Pieces` has them, and (M,) sources."""
    scene = quads([[[0, 0, 0], [0, 0, 1], [4, 0, 1], [4, 0, 0]]] * times)
    if times > 1:
        scene = replace(scene, triangle_object=np.zeros_like(scene.triangle_object))
    corner, source = [], []
    for t, triangle in enumerate(scene.corners):
        system = np.vstack([triangle.T[[0, 2]], np.ones(3)])
        for left, right in pairwise([0, *x, 4]):
            for near, far in pairwise([0, *z, 1]):
                shape = clipped(clipped(triangle, 0, left, right), 2, near, far)
                weight = np.linalg.solve(
                    system, np.vstack([shape.T[[0, 2]], np.ones(len(shape))])
                ).T
                rows = np.hstack([shape, np.where(np.abs(weight) < 1e-12, 0, weight)])
                corner += [rows[[0, k, k + 1]] for k in range(1, len(rows) - 1)]
                source += [t] * (len(rows) - 2)
    return scene, np.array(corner), np.array(source)


def clipped(polygon: np.ndarray, axis: int, low: float, high: float) -> np.ndarray:
    """The part of a convex polygon between two planes across an axis."""
    for sign, bound in ((1, low), (-1, high)):
        kept = []
        for p, q in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            d, e = sign * (p[axis] - bound), sign * (q[axis] - bound)
            if d >= 0:
                kept.append(p)
            if d * e < 0:
                kept.append(p + d / (d - e) * (q - p))
        polygon = np.array(kept).reshape(-1, 3)
    return polygon


def owners(corner: np.ndarray, who: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """(M, 2) the same owner in front and behind, by the x and z of pieces' middles."""
    x, _, z = corner[..., :3].mean(axis=1).T
    return np.repeat(np.asarray(who(x, z), dtype=np.int32)[:, None], 2, axis=1)


def test_a_floor_of_two_cells_is_two_rectangles(quads: Any) -> None:
    scene, corner, source = floor_in_pieces(quads, (1, 2, 3))
    owner = owners(corner, lambda x, z: x > 2)
    mesh = join_pieces(scene, all_cut(corner, source, owner), owner, scene.tolerance)
    assert np.bincount(mesh.triangle_cell[:, 0]).tolist() == [2, 2]
    assert len(mesh.vertex) == 6


def test_a_floor_that_is_there_twice_stays_so(quads: Any) -> None:
    scene, corner, source = floor_in_pieces(quads, (1, 2, 3), times=2)
    owner = owners(corner, lambda x, z: x > 2)
    mesh = join_pieces(scene, all_cut(corner, source, owner), owner, scene.tolerance)
    area = areas(corners_of(mesh))
    assert np.bincount(mesh.triangle_cell[:, 0], area).tolist() == pytest.approx([4, 4])
    assert len(mesh.triangle) < len(corner)


def test_halves_of_another_look_stay_apart(quads: Any) -> None:
    scene, corner, source = floor_in_pieces(quads, (2,))
    owner = owners(corner, lambda x, z: x > 2)
    shifted = scene.uv + np.array([0, 1e-3])[:, None, None]
    for other in (
        {
            "materials": (Material("one"), Material("other")),
            "triangle_material": np.array([0, 1], dtype=np.int32),
        },
        {"two_sided": np.array([True, False])},
        {"uv": shifted},
    ):
        apart = replace(scene, **other)
        mesh = join_pieces(apart, all_cut(corner, source, owner), owner, scene.tolerance)
        # Of each a triangle and a quadrilateral.
        assert np.bincount(mesh.triangle_source).tolist() == [3, 3], other


def test_a_cell_in_the_middle_leaves_a_hole(quads: Any) -> None:
    scene, corner, source = floor_in_pieces(quads, (1, 3), (0.25, 0.5))

    def who(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        inner = (x > 1) & (x < 3) & (z > 0.25) & (z < 0.5)
        return np.where((x > 3) & (z > 0.5), -1, inner)

    owner = owners(corner, who)
    mesh = join_pieces(scene, all_cut(corner, source, owner), owner, scene.tolerance)
    cell, area = mesh.triangle_cell[:, 0], areas(corners_of(mesh))
    assert np.bincount(cell, area).tolist() == pytest.approx([3, 0.5])
    # Six corners around, one of which is a corner of the hole, and three more of that.
    assert np.bincount(cell).tolist() == [8, 2]
    known = {tuple(p) for p in corner[..., :3].reshape(-1, 3)}
    assert {tuple(p) for p in mesh.vertex} <= known


def test_what_cells_own_is_counted(quads: Any) -> None:
    scene, corner, source = floor_in_pieces(quads, (1, 2, 3))
    front = owners(corner, lambda x, z: x > 2)[:, 0]
    # Behind everything but the far quarter is a third cell; the second half is one-sided.
    back = owners(corner, lambda x, z: np.where(x > 3, -1, 2))[:, 1]
    owner = np.stack([front, back], axis=1)
    two_sided = np.array([True, False])
    mesh = join_pieces(
        replace(scene, two_sided=two_sided), all_cut(corner, source, owner), owner, scene.tolerance
    )
    assert (mesh.visible, mesh.owners) == (2, 3 + 2)


def test_a_column_of_narrow_strips_is_not_flattened(quads: Any) -> None:
    """Each strip continues the next within rounding, but the first not the last."""
    angle = np.linspace(0, 0.02, 60)
    x, z = 30 * np.sin(angle), 30 * np.cos(angle)
    strips = [
        [[x[k], 0, z[k]], [x[k + 1], 0, z[k + 1]], [x[k + 1], 1, z[k + 1]], [x[k], 1, z[k]]]
        for k in range(len(angle) - 1)
    ]
    scene = quads(strips)
    tolerance = replace(scene.tolerance, file=1e-5)
    one = np.zeros_like(scene.triangle_object)
    scene = replace(scene, uv=np.zeros_like(scene.uv), triangle_object=one)
    every = np.arange(len(scene.triangles))
    _, corner = np.unique(scene.corners.reshape(-1, 3), axis=0, return_inverse=True)
    numbered = corner.reshape(-1, 3)
    may = np.ones(len(every), dtype=bool)
    assert patches(scene, every, numbered, may, tolerance).tolist() == every.tolist()
    few = patches(scene, every[:4], numbered[:4], may[:4], tolerance)
    assert len(set(few.tolist())) == 1


def test_welded_points_are_near() -> None:
    points = np.array(
        [[0, 0, 0], [1, 0, 0], [1e-9, 0, 0], [1, 1e-7, 0], [-0.0, 0, 0], [2e-9, 0, 0]]
    )
    assert weld(points, 1.5e-9).tolist() == [0, 1, 0, 3, 0, 0], "by way of another"
    assert weld(points, 0.0).tolist() == first_alike(points).tolist() == [0, 1, 2, 3, 0, 5]


@pytest.mark.parametrize("turn", np.linspace(0, 3, 7))
def test_corners_on_straight_edges_are_used(turn: float) -> None:
    """A square with corners along its sides, and a hole that touches one of them."""
    side = [[k / 4, 0] for k in range(4)]
    outer = [[x, y] for x, y in side] + [[1, x] for x, _ in side]
    outer += [[1 - x, 1] for x, _ in side] + [[0, 1 - x] for x, _ in side]
    hole = [[0.25, 0.0], [0.25, 0.5], [0.5, 0.5]]
    rotation = [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    corner = np.array(outer + hole) @ rotation
    start = np.array([0, len(outer), len(outer) + 3])
    triangle, polygon = triangulate_rings(corner, start, np.array([0, 0]))
    assert polygon.tolist() == [0] * (16 + 3 + 2 - 2 - 2)
    area = areas(np.pad(corner[triangle], ((0, 0), (0, 0), (0, 1))))
    assert area.sum() == pytest.approx(1 - 0.0625)
    assert area.min() > 1e-3
    assert len({tuple(p) for p in corner[triangle].reshape(-1, 2)}) == 18


def test_texture_coordinates_stay(given: tuple[Any, ...]) -> None:
    """At random points of the joined pieces, texture coordinates are those of some triangle of the
    model there, of the same material."""
    scene, pieces, owner, tolerance = given
    mesh = join_pieces(scene, pieces, owner, tolerance)
    rng = np.random.default_rng(5)
    some = rng.choice(len(mesh.triangle), 200)
    weight = rng.dirichlet([1, 1, 1], len(some))
    point = np.einsum("nc,ncx->nx", weight, corners_of(mesh)[some])
    shown = np.einsum("nc,ncx->nx", weight, mesh.vertex_uv[mesh.triangle[some]])
    a, b, c = scene.corners.transpose(1, 0, 2)
    sides = np.stack([b - a, c - a], axis=2)
    inverse = np.linalg.pinv(sides)
    for p, uv, source in zip(point, shown, mesh.triangle_source[some], strict=True):
        place = np.einsum("tij,tj->ti", inverse, p - a)
        off = np.linalg.norm(p - a - np.einsum("tij,tj->ti", sides, place), axis=1)
        there = (place.min(axis=1) > -1e-6) & (place.sum(axis=1) < 1 + 1e-6)
        there &= off < 2 * tolerance.file
        there &= scene.triangle_material == scene.triangle_material[source]
        printed = scene.uv[there, 0] + np.einsum(
            "tk,tkj->tj", place[there], scene.uv[there, 1:] - scene.uv[there, :1]
        )
        assert np.abs(printed - uv).max(axis=1).min() < 2e-5
