"""From a mesh to its octree: the normals are those of the source, whatever its size and place."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import areas
from ptmtools.errors import InputError, LimitError
from ptmtools.executor import Executor
from ptmtools.parallel import open_executor
from ptmtools_systems.apo import blocks
from ptmtools_systems.apo.blocks import Surface
from ptmtools_systems.apo.making import ApoTexture, make_apo, weld
from ptmtools_systems.apo.model import ApoOptions
from ptmtools_systems.apo.normals import corner_normals
from ptmtools_systems.apo.octree import fault_of
from ptmtools_systems.apo.sampling import REACH, Source, nearest
from ptmtools_systems.apo.traversal import look_up
from tests.systems.apo.meshes import scene_of, sphere, square

OPTIONS = ApoOptions(faces=500, depth=9, error=0.1)


def made(points: np.ndarray, triangles: np.ndarray, options: ApoOptions = OPTIONS) -> ApoTexture:
    actual = make_apo(scene_of(points, triangles), options, Executor())
    assert fault_of(actual.octree) is None
    return actual


@pytest.fixture(scope="module")
def ball() -> ApoTexture:
    return made(*sphere(5, 0.03))


def angles(texture: ApoTexture, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Degrees between normals and those that the octree has at points of the simplified mesh."""
    q = (points - texture.octree.low) / texture.octree.side
    cosine = np.einsum("ij,ij->i", look_up(texture.octree, q).normals, normals)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def source_normals(points: np.ndarray, triangles: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Those of the nearest point of a star-shaped source, looked for along the way from the
    middle: independent of Embree."""
    import trimesh

    mesh = trimesh.Trimesh(points, triangles, process=False)
    _, _, face = trimesh.proximity.closest_point_naive(mesh, at)
    corner = corner_normals(points, triangles)[face]
    weight = trimesh.triangles.points_to_barycentric(
        mesh.triangles[face], trimesh.proximity.closest_point_naive(mesh, at)[0]
    )
    normal = np.einsum("ij,ijk->ik", weight, corner)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def test_the_normals_are_those_of_the_source() -> None:
    points, triangles = sphere(4, 0.03)
    actual = made(points, triangles, replace(OPTIONS, faces=300, density=60, error=0.03))
    rng = np.random.default_rng(1)
    chosen = rng.integers(0, len(actual.mesh.triangles), 60)
    weight = rng.dirichlet([1, 1, 1], 60)
    at = np.einsum("ij,ijk->ik", weight, actual.mesh.points[actual.mesh.triangles[chosen]])
    own = np.einsum("ij,ijk->ik", weight, actual.mesh.normals[actual.mesh.triangles[chosen]])
    expected = source_normals(points, triangles, at)
    off = angles(actual, at, expected)
    assert off.mean() < 4
    plain = np.degrees(np.arccos(np.clip((own * expected).sum(axis=1), -1, 1)))
    assert off.mean() < plain.mean() / 2  # what the simplified mesh itself would show
    assert actual.missed == 0


def test_a_closer_bound_makes_a_larger_and_better_octree() -> None:
    points, triangles = sphere(5, 0.03)
    sizes = []
    for error in (0.4, 0.2, 0.1):
        actual = made(points, triangles, replace(OPTIONS, error=error))
        sizes.append(len(actual.octree.texels))
    assert sizes == sorted(set(sizes))
    assert sizes[2] > 2 * sizes[0]


def test_a_flat_mesh_is_one_texel() -> None:
    points, triangles = square(30)
    actual = made(points, triangles)
    assert actual.octree.texels.tolist() == [[128, 255, 128, 0]]


def test_depth_and_density_bound_the_octree() -> None:
    points, triangles = sphere(5, 0.05)
    shallow = made(points, triangles, replace(OPTIONS, depth=3))
    assert shallow.octree.levels == 4
    assert made(points, triangles, replace(OPTIONS, depth=1)).octree.levels == 2
    few = made(points, triangles, replace(OPTIONS, error=0, density=1))
    many = made(points, triangles, replace(OPTIONS, error=0, density=4))
    assert 2 < len(many.octree.texels) / len(few.octree.texels) < 6


@pytest.mark.parametrize(
    ("scale", "away"), [(2.0**-20, 0.0), (2.0**20, 0.0), (1.0, 4096.0), (1.0, -65536.0)]
)
def test_size_and_place_change_nothing(scale: float, away: float) -> None:
    points, triangles = sphere(5, 0.03)
    # Rounded, so that moving it is exact.
    points = np.round(points * 2**20) / 2**20
    here = made(points, triangles)
    there = made(points * scale + away, triangles)
    assert np.array_equal(here.octree.texels, there.octree.texels)


def test_the_number_of_workers_changes_nothing(
    ball: ApoTexture, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of(*sphere(5, 0.03))
    with open_executor(2) as executor:
        other = make_apo(scene, OPTIONS, executor)
    assert np.array_equal(ball.octree.texels, other.octree.texels)
    assert np.array_equal(ball.mesh.points, other.mesh.points)
    monkeypatch.setattr(blocks, "MOST", 3000)  # some fifteen blocks instead of one, of small cells
    cut = make_apo(scene, OPTIONS, Executor())
    assert np.array_equal(ball.octree.start, cut.octree.start)
    assert np.abs(ball.octree.texels.astype(int) - cut.octree.texels).max() <= 1


def test_equal_points_are_one() -> None:
    points, triangles = sphere(3, 0.03)
    loose = points[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
    one, other = weld(points, triangles), weld(*loose)
    assert np.array_equal(one[0], other[0])
    assert np.array_equal(one[1], other[1])
    zeros = np.array([[0.0, 0, 0], [-0.0, 0, 0], [1, 0, 0]])
    assert len(weld(zeros, np.array([[0, 1, 2]]))[0]) == 2


def test_colours_of_corners_are_kept() -> None:
    points, triangles = sphere(5)
    red = np.where(points[triangles][:, :, :1] > 0, [255, 0, 0], [0, 0, 255]).astype(np.uint8)
    scene = scene_of(points, triangles, red)
    actual = make_apo(scene, replace(OPTIONS, color=True), Executor())
    assert actual.octree.colors is not None
    q = (np.array([[0.9, 0.1, 0.1], [-0.9, 0.1, -0.1]]) - actual.octree.low) / actual.octree.side
    address = look_up(actual.octree, q).address
    assert actual.octree.colors[address].tolist() == [[255, 0, 0, 255], [0, 0, 255, 255]]
    plain = make_apo(scene, OPTIONS, Executor())
    assert plain.octree.colors is None
    assert len(plain.octree.texels) < len(actual.octree.texels)  # the edge of the colours


def sheet(y: float, up: bool) -> tuple[np.ndarray, np.ndarray]:
    points = np.array([[0, y, 0], [0, y, 1], [1, y, 1], [1, y, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return points, triangles if up else triangles[:, ::-1]


def cast(*sheets: tuple[np.ndarray, np.ndarray]) -> tuple[int, float]:
    """What a point at (0.6, 0.5, 0.3) with a normal upward stands for: of which sheet, how far."""
    points = np.concatenate([points for points, _ in sheets])
    triangles = np.concatenate([4 * k + triangles for k, (_, triangles) in enumerate(sheets)])
    source = Source(
        points.astype(np.float32), triangles.astype(np.int32), np.zeros((0, 3, 3), np.float32)
    )
    hits = nearest(source, np.array([[0.6, 0.5, 0.3]]), np.array([[0.0, 1, 0]]))
    actual = int(hits.triangle[0])
    if actual >= 0:
        at = hits.weight[0] @ points[triangles[actual]]
        np.testing.assert_allclose(at[[0, 2]], [0.6, 0.3], atol=1e-5)
        assert abs(abs(at[1] - 0.5) - hits.distance[0]) < 1e-5
    return (actual // 2 if actual >= 0 else -1), float(hits.distance[0])


def test_a_sample_stands_for_the_nearest_surface_that_faces_its_way() -> None:
    assert cast(sheet(0.52, True), sheet(0.49, True))[0] == 1
    assert cast(sheet(0.51, True), sheet(0.47, True))[0] == 0
    # The other side of something thin is passed through, either way.
    assert cast(sheet(0.51, False), sheet(0.53, True))[0] == 1
    assert cast(sheet(0.49, False), sheet(0.48, True))[0] == 1
    assert cast(sheet(0.51, False), sheet(0.49, False))[0] == -1
    # It lies in the surface itself.
    assert cast(sheet(0.5, True), sheet(0.501, True)) == (0, pytest.approx(0, abs=1e-5))
    # Too far away.
    assert cast(sheet(0.5 + 1.01 * REACH, True))[0] == -1
    assert cast(sheet(0.5 - 0.99 * REACH, True))[0] == 0


@pytest.mark.parametrize("turned", [False, True])
def test_a_face_with_two_sides_counts_once(turned: bool) -> None:
    points, triangles = square(12, 0.05)
    both = [triangles, triangles[:, ::-1]]
    actual = made(points, np.concatenate(both[::-1] if turned else both))
    assert actual.missed == 0
    assert actual.source == len(triangles)
    assert any("count once" in note for note in actual.notes)
    assert (actual.octree.texels[0, 1] > 128) != turned


@pytest.mark.parametrize("thickness", [0.05, 0.02])
def test_either_side_of_a_thin_wall_shows_its_own_normal(thickness: float) -> None:
    top, faces = square(40)
    n = len(top)
    points = np.concatenate([top, top - [0, thickness, 0]])
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    actual = made(
        points @ turn.T,
        np.concatenate([faces, faces[:, ::-1] + n]),
        ApoOptions(faces=10**6, density=8),
    )
    rng = np.random.default_rng(4)
    at = np.stack([rng.random(2000), np.zeros(2000), rng.random(2000)], axis=1) @ turn.T
    up = np.broadcast_to(np.array([0.0, 1, 0]) @ turn.T, at.shape)
    up = up * np.sign(np.linalg.det(turn))
    assert (angles(actual, at, up) > 90).mean() < 0.03


def test_memory_does_not_grow_with_a_far_speck(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "MOST", 5000)
    points, triangles = sphere(5, 0.03)
    far = np.array([[1000.0, 0, 0], [1000, 1, 0], [1000, 0, 1]])
    sizes = []
    divided = blocks.divide_work

    def watched(work: Any) -> Any:
        actual = divided(work)
        for block in actual[1]:
            corner = work.surface.corner[block.triangles]
            sizes.append(len(blocks.spread(corner, work.spacing).triangle))
        return actual

    monkeypatch.setattr(blocks, "divide_work", watched)
    made(
        np.concatenate([points, far]),
        np.concatenate([triangles, [[len(points) + k for k in range(3)]]]),
    )
    assert max(sizes) < 20_000  # of 160,000


def test_needles_have_no_more_samples_than_others() -> None:
    corner = np.array([[[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0]]])
    pieces = Surface(corner, np.zeros((1, 3, 3))).cut_up(0.125)
    assert len(pieces.corner) <= 20
    np.testing.assert_allclose(areas(pieces.corner).sum(), areas(corner).sum())


def test_too_many_texels_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ptmtools_systems.apo.octree.ADDRESS_BITS", 10)
    with pytest.raises(LimitError, match=r"PTM-L400"):
        made(*sphere(5, 0.05))


@pytest.mark.parametrize(
    "wrong",
    [
        {"faces": 0},
        {"error": -0.1},
        {"error": float("nan")},
        {"depth": 0},
        {"depth": 21},
        {"density": 0},
    ],
)
def test_options_out_of_range(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        ApoOptions(**wrong)  # type: ignore[arg-type]


def test_the_warm_up_calls_every_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    from ptmtools import jit
    from ptmtools.pipeline.warm_up import warm_objects

    names: set[str] = set()
    call = jit._Kernel.__call__

    def record(self: Any, *arguments: Any) -> Any:
        names.add(f"{self.__module__}.{self.__name__}")
        return call(self, *arguments)

    monkeypatch.setattr(jit._Kernel, "__call__", record)
    actual = make_apo(scene_of(*sphere(5, 0.03)), OPTIONS, Executor())
    look_up(actual.octree, np.full((1, 3), 0.5))
    needed = set(names)
    names.clear()
    warm_objects()
    assert needed
    assert needed <= names
