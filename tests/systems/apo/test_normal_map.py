"""Normal maps: how near to the source they are, in how many bytes, and what their frames are."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from ptmtools.errors import MissingComponentError
from ptmtools.executor import Executor
from ptmtools.light.atlas import unwrap
from ptmtools.output.object_maps import ObjectMaps, frame_axes
from ptmtools.simplification import Mesh, SimplifyOptions, simplify
from ptmtools.texture import EncodeOptions, encode
from ptmtools_systems.apo.files import encode_stream
from ptmtools_systems.apo.making import Simple, octree_around, smooth
from ptmtools_systems.apo.model import ApoOptions
from ptmtools_systems.apo.normal_map import NormalMap, frames, look_up_normals, normal_map
from ptmtools_systems.apo.normals import corner_normals
from ptmtools_systems.apo.replacing import object_maps
from ptmtools_systems.apo.sampling import Source, interpolate, nearest, spacing_for, spread
from ptmtools_systems.apo.traversal import look_up
from tests.systems.apo.meshes import scene_of, sphere

OPTIONS = ApoOptions(error=0.02, depth=11, density=8.0)


@pytest.fixture(scope="module")
def source() -> tuple[np.ndarray, np.ndarray]:
    """20,480 triangles with finer bumps than 500 can have."""
    return sphere(5, 0.05)


@pytest.fixture(scope="module")
def mesh(source: tuple[np.ndarray, np.ndarray]) -> Simple:
    points, triangles = source
    simple = simplify(Mesh(points, triangles.astype(np.int32)), SimplifyOptions(500)).mesh
    return smooth(simple.points, simple.triangles)


@pytest.fixture(scope="module")
def made(source: tuple[np.ndarray, np.ndarray], mesh: Simple) -> NormalMap:
    points, triangles = source
    return normal_map(mesh, points, triangles.astype(np.int32), OPTIONS)


def test_the_error_is_what_it_is_said_to_be(
    source: tuple[np.ndarray, np.ndarray], mesh: Simple, made: NormalMap
) -> None:
    points, triangles = source
    assert made.error <= OPTIONS.error
    assert made.missed < 0.001
    _, truth, of, weight = compared(points, triangles, mesh)
    uv = np.einsum("nk,nkx->nx", weight, made.uv[of])
    shown = look_up_normals(made.texels, uv, made.frame[of])
    assert rms(shown, truth) == pytest.approx(made.error, rel=0.1)
    # Of its own the mesh is much farther off.
    own = np.einsum("nk,nkx->nx", weight, mesh.normals[mesh.triangles[of]])
    assert rms(own / np.linalg.norm(own, axis=1, keepdims=True), truth) > 3 * made.error


def compared(
    points: np.ndarray, triangles: np.ndarray, mesh: Simple
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points of the mesh, the source's normals there, and triangles and weights of the points."""
    corner = mesh.points[mesh.triangles]
    some = spread(corner, spacing_for(corner, 20_000))
    place, normal = (
        interpolate(corner, some),
        interpolate(mesh.normals[mesh.triangles].astype(float), some),
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    low, side = points.min(axis=0) - 0.01, float(np.ptp(points, axis=0).max()) + 0.02
    whole = Source(
        ((points - low) / side).astype(np.float32),
        triangles.astype(np.int32),
        corner_normals(points, triangles).astype(np.float32),
    )
    hits = nearest(whole, (place - low) / side, normal)
    met = hits.triangle >= 0
    truth = np.einsum("nk,nkx->nx", hits.weight[met], whole.normals[hits.triangle[met]])
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    return place[met], truth, some.triangle[met], some.weight[met]


def rms(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.sqrt(((one - other) ** 2).sum(axis=1).mean()))


def test_it_takes_fewer_bytes_than_an_octree_of_the_same_error(
    source: tuple[np.ndarray, np.ndarray], mesh: Simple, made: NormalMap
) -> None:
    points, triangles = source
    place, truth, _, _ = compared(points, triangles, mesh)
    octree, _ = octree_around(mesh, points, triangles.astype(np.int32), OPTIONS, None, Executor())
    ends = encode_stream(octree.texels, octree)[1]["ends"]
    q = (place - octree.low) / octree.side
    error = [rms(look_up(octree, q, k + 1).normals, truth) for k in range(octree.levels)]
    as_good = next(k for k, e in enumerate(error) if e <= made.error or k == octree.levels - 1)
    size = len(encode(made.texels, EncodeOptions()))
    assert 2 * size < ends[as_good]


def test_a_tighter_error_takes_a_larger_map(
    source: tuple[np.ndarray, np.ndarray], mesh: Simple, made: NormalMap
) -> None:
    points, triangles = source

    def side(**changed: float) -> int:
        options = ApoOptions(**{"error": 0.02, "depth": 11, "density": 8.0, **changed})
        return len(normal_map(mesh, points, triangles.astype(np.int32), options).texels)

    assert side(error=0.3) < len(made.texels) < side(error=0.005)
    assert side(error=0.0, depth=7) == 128
    assert side(error=0.0, density=1.0) == 128  # 20,480 texels are 143²


@pytest.mark.parametrize("mirrored", [False, True])
def test_frames_follow_the_coordinates(mirrored: bool) -> None:
    """Of a square that lies in x and z, seen from above: u grows with x, or against it."""
    points = np.array([[0.0, 0, 0], [2, 0, 0], [2, 0, -1], [0, 0, -1]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    atlas = unwrap(points, triangles, (64,))
    corner = points[triangles]
    place = (corner[..., [0, 2]] * [0.5, -1]).copy()
    if mirrored:
        place[..., 0] = 1 - place[..., 0]
    given = type(atlas)(place, np.zeros(2, np.int64), 64)
    frame = frames(given, corner)
    sign = -1 if mirrored else 1
    assert frame.tolist() == [[0, 1, 0, sign, 0, 0, sign]] * 2
    assert frame_axes(frame)[0].T.tolist() == [[sign, 0, 0], [0, 0, -1], [0, 1, 0]]


def test_without_xatlas(monkeypatch: pytest.MonkeyPatch, mesh: Simple) -> None:
    monkeypatch.setitem(sys.modules, "xatlas", None)
    with pytest.raises(MissingComponentError, match=r"baking normals needs xatlas.*PTM-M100"):
        normal_map(mesh, mesh.points, mesh.triangles, OPTIONS)


def test_arrays(mesh: Simple, made: NormalMap) -> None:
    scene = scene_of(mesh.points, mesh.triangles)
    reliefs = object_maps(scene, np.array([0], np.int32), [made])
    again = ObjectMaps.from_arrays(reliefs.to_arrays())
    assert np.array_equal(again.uv, made.uv)
    assert np.array_equal(again.frame, made.frame)
    assert again.side.tolist() == [len(made.texels)]
    painted = again.scene_with_maps(scene)
    assert [m.image for m in painted.materials] == [-1, 0]
    assert painted.triangle_material.tolist() == [1] * len(mesh.triangles)
    for name, change in (
        ("uv", lambda uv: uv + 1),
        ("uv", lambda uv: uv[1:]),
        ("frame", lambda frame: frame[:, :6]),
        ("side", lambda side: side * 0),
        ("objects", lambda objects: objects - 1),
    ):
        arrays = dict(reliefs.to_arrays())
        with pytest.raises((KeyError, ValueError)):
            ObjectMaps.from_arrays(arrays | {name: change(arrays[name])})
