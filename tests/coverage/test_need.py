"""Required levels of textures, against rays traced one by one, and the hints."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.backends import BACKENDS
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.required_levels import (
    FACE,
    PIXEL,
    Need,
    TextureSize,
    compute_need,
    levels_of_detail,
)
from ptmtools.coverage.sampling import HintSampler
from ptmtools.errors import InputError
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stages import CELLS, PVS, SCENE

TWO_ROOMS = Path(__file__).parents[2] / "sample_data/two_rooms/two_rooms.obj"
POINTS = 16
#: Large and of uneven sides, so that the levels differ.
SIZES = {0: (1024, 512, 10), 1: (300, 300, 9), 2: (64, 64, 3), 3: (4096, 4096, 13)}
SIZES = {image: TextureSize(*size) for image, size in SIZES.items()}
OPTIONS = AchOptions(
    samples=POINTS, face=FACE, backend="embree", weighting="solid-angle", per_texture=True
)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Artifacts:
    db = tmp_path_factory.mktemp("need") / "db"
    build_scene(TWO_ROOMS, db, until=PVS)
    return Artifacts(open_database(db))


@pytest.fixture(scope="module")
def need(rooms: Artifacts) -> Need:
    return compute_need(rooms[SCENE], rooms[CELLS], rooms[PVS], SIZES, POINTS)


def by_level(need: Need, cell: int) -> dict[int, np.ndarray]:
    """Image → share of the view that wants just that level."""
    actual = {}
    for entry in range(*need.start[cell : cell + 2].tolist()):
        share = need.share[slice(*need.share_start[entry : entry + 2].tolist())]
        levels = np.zeros(SIZES[int(need.image[entry])].levels)
        first = int(need.first[entry])
        levels[first : first + len(share)] = share - np.append(share[1:], 0)
        actual[int(need.image[entry])] = levels
    return actual


def met(corners: np.ndarray, eye: np.ndarray, ray: np.ndarray) -> tuple[int, float]:
    """The nearest triangle along a ray, -1 for none, and how far (Möller and Trumbore, 1997)."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(ray, two)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / np.einsum("ij,ij->i", one, p)
        t = eye - corners[:, 0]
        u = np.einsum("ij,ij->i", t, p) * inverse
        q = np.cross(t, one)
        v = q @ ray * inverse
        far = np.einsum("ij,ij->i", two, q) * inverse
        far[~((u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0))] = np.inf
    nearest = int(np.argmin(far))
    return (nearest, far[nearest]) if np.isfinite(far[nearest]) else (-1, 0.0)


def texel_at(corners, uv, size, eye, ray) -> np.ndarray:
    """Where a ray meets the plane of a triangle, in texels."""
    edges = corners[1:] - corners[0]
    normal = np.cross(*edges)
    hit = eye + ray * ((corners[0] - eye) @ normal / (ray @ normal))
    weight, *_ = np.linalg.lstsq(edges.T, hit - corners[0], rcond=None)
    return (uv[0] + weight @ (uv[1:] - uv[0])) * size


def test_rays_followed_one_by_one_want_the_same(rooms: Artifacts, need: Need) -> None:
    """Texels under neighbouring pixels of an upright picture, each by a ray of its own. Few pixels
    lie on an edge, where another triangle may be met."""
    scene, cells, pvs = rooms[SCENE], rooms[CELLS], rooms[PVS]
    assert all(material.image in (-1, *SIZES) for material in scene.materials)
    sampler = HintSampler(scene, cells, pvs, OPTIONS, BACKENDS["embree"])
    points = sampler.points_of(0)
    assert len(points) == POINTS
    origin, along = sampler.renderer._rays(points)
    weight = np.repeat(sampler.weight(points), 6, axis=0).ravel()
    image = np.array([m.image for m in scene.materials])[scene.triangle_material]
    assert scene.opaque.all()
    actual = {i: np.zeros(size.levels) for i, size in SIZES.items()}
    total, chosen = 0, np.random.default_rng(5).permutation(len(origin))[:6000]
    corners = scene.corners
    for pixel in chosen.tolist():
        eye = points.position[pixel // (len(origin) // POINTS)]
        ray = along[pixel].astype(np.float64)
        ray /= np.linalg.norm(ray)
        triangle, _ = met(corners, eye, ray)
        if triangle < 0:
            continue
        total += weight[pixel]
        if image[triangle] < 0:
            continue
        size = SIZES[int(image[triangle])]
        right = np.array([-ray[2], 0, ray[0]]) / math.hypot(ray[0], ray[2])
        span, h = [], PIXEL / 100
        for axis in (right, np.cross(right, ray)):
            ends = [
                texel_at(
                    corners[triangle],
                    scene.uv[triangle],
                    (size.width, size.height),
                    eye,
                    ray + sign * h * axis,
                )
                for sign in (-0.5, 0.5)
            ]
            span.append(np.linalg.norm(ends[1] - ends[0]) * 100)
        detail = max(0, math.floor(math.log2(max(span)))) if max(span) > 0 else 0
        actual[int(image[triangle])][max(size.levels - 1 - detail, 0)] += weight[pixel]
    measured = by_level(need, 0)
    several = 0
    for i, levels in actual.items():
        several += (levels > 0).sum() > 2
        wanted = measured.get(i, np.zeros(len(levels)))
        # 6,000 of 24,576 rays: a standard error of 0.006 at most.
        assert levels / total == pytest.approx(wanted, abs=0.02), i
    assert several >= 2, "the levels do differ"


def test_the_coarsest_is_wanted_wherever_a_texture_shows(rooms: Artifacts, need: Need) -> None:
    ach = compute_ach(rooms[SCENE], rooms[CELLS], rooms[PVS], OPTIONS)
    assert ach.missed.max() == 0
    for cell in range(rooms[CELLS].cell_count):
        of_cell = slice(*ach.texture_start[ach.start[cell : cell + 2]].tolist())
        shares: dict[int, float] = {}
        for image, value in zip(ach.texture[of_cell], ach.texture_value[of_cell], strict=True):
            shares[int(image)] = shares.get(int(image), 0) + float(value)
        shares.pop(-1, None)
        entries = range(*need.start[cell : cell + 2].tolist())
        coarsest = {int(need.image[e]): need.share[need.share_start[e]] for e in entries}
        assert coarsest == pytest.approx(shares, abs=1e-9)
        assert len(shares) > 2


def test_shares_fall_and_are_there(rooms: Artifacts, need: Need) -> None:
    assert len(need.start) == rooms[CELLS].cell_count + 1
    for entry in range(len(need.image)):
        share = need.share[slice(*need.share_start[entry : entry + 2].tolist())]
        assert (np.diff(share) <= 0).all()
        assert share[-1] > 0
        assert need.first[entry] + len(share) <= SIZES[int(need.image[entry])].levels


def test_the_same_again(rooms: Artifacts, need: Need) -> None:
    again = compute_need(rooms[SCENE], rooms[CELLS], rooms[PVS], SIZES, POINTS)
    for name, array in vars(need).items():
        assert np.array_equal(getattr(again, name), array), name


def test_a_coarser_image_wants_coarser_levels_no_less(rooms: Artifacts, need: Need) -> None:
    """Half the texels: the same pixels want what was one level below, or the finest."""
    image = 3
    size = SIZES[image]
    half = {**SIZES, image: TextureSize(size.width // 2, size.height // 2, size.levels - 1)}
    other = compute_need(rooms[SCENE], rooms[CELLS], rooms[PVS], half, POINTS)
    before = by_level(need, 0)[image]
    (entry,) = (e for e in range(other.start[1]) if other.image[e] == image)
    share = other.share[slice(*other.share_start[entry : entry + 2].tolist())]
    after = np.zeros(size.levels - 1)
    first = int(other.first[entry])
    after[first : first + len(share)] = share - np.append(share[1:], 0)
    assert after[:-1] == pytest.approx(before[:-2], abs=1e-9)
    assert after[-1] == pytest.approx(before[-2:].sum(), abs=1e-9)


def test_textures_that_are_not_known_are_left_out(rooms: Artifacts) -> None:
    only = compute_need(rooms[SCENE], rooms[CELLS], rooms[PVS], {1: SIZES[1]}, 4)
    assert set(only.image.tolist()) == {1}
    none = compute_need(rooms[SCENE], rooms[CELLS], rooms[PVS], {}, 4)
    assert len(none.image) == len(none.share) == 0
    with pytest.raises(InputError, match="samples is 0"):
        compute_need(rooms[SCENE], rooms[CELLS], rooms[PVS], SIZES, 0)


@pytest.mark.parametrize("distance", [0.5, 1.0, 40.0])
def test_a_wall_that_is_looked_at_straight_on_and_askew(distance: float) -> None:
    """A metre has 500 texels along x, 100 along y."""
    normal, gradient = np.array([[0.0, 0, 1]]), np.array([[[500.0, 0, 0], [0, 100, 0]]])
    straight = np.array([[0.0, 0, -distance]])
    pixel = 500 * PIXEL * distance
    assert levels_of_detail(straight, normal, gradient) == pytest.approx(math.log2(pixel))
    askew = distance * np.array([[-math.sin(1.2), 0, -math.cos(1.2)]])
    longer = math.log2(pixel / math.cos(1.2))
    assert levels_of_detail(askew, normal, gradient) == pytest.approx(longer)
    above = distance * np.array([[0, math.sin(1.2), -math.cos(1.2)]])
    assert levels_of_detail(above, normal, gradient) == pytest.approx(
        math.log2(max(pixel, 100 * PIXEL * distance / math.cos(1.2)))
    )


def test_straight_down_on_edge_and_at_no_distance() -> None:
    down, floor = np.array([[0.0, -2, 0]]), np.array([[0.0, 1, 0]])
    gradient = np.array([[[10.0, 0, 0], [0, 0, 10]]])
    assert levels_of_detail(down, floor, gradient) == pytest.approx(math.log2(20 * PIXEL))
    assert levels_of_detail(np.array([[1.0, 0, 0]]), floor, gradient) == np.inf
    assert levels_of_detail(np.zeros((1, 3)), floor, gradient) == np.inf
    assert levels_of_detail(down, floor, 0 * gradient) == -np.inf
