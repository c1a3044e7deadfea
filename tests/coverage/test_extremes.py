"""Tiny, huge, far away, turned, mirrored; just before a wall; a cell of a millimetre; hardly
anything or very much to see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells.model import Cells
from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.backends import BACKENDS
from ptmtools.coverage.backends.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import VIEWS, ItemSurfaces
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.placement import CellVolume
from ptmtools.coverage.sample_points import PointFinder
from ptmtools.coverage.sampling import CLEARANCE, HintSampler
from ptmtools.coverage.solids import SampleObstacles
from ptmtools.coverage.tally import PixelCounter
from ptmtools.scene.model import Material, Scene
from ptmtools.visibility.model import Pvs

SOME = AchOptions(samples=128, face=4)


def all_visible(n):
    return Pvs.from_matrix(np.ones((n, n), dtype=bool))


def assert_near(one, other, tightest=0.4):
    """Within three standard errors of both, which are small enough to tell something."""
    assert np.array_equal(one.start, other.start)
    error = np.hypot(one.error, other.error)
    assert (error < tightest * other.value).all()
    assert (np.abs(one.value - other.value) <= 3 * error).all()
    assert (one.missed <= 1e-3).all()


def turned(scene: Scene, cells: Cells, turn: np.ndarray) -> tuple[Scene, Cells]:
    """The same rooms under an orthogonal (3, 3) matrix. A mirrored face is wound the other way
    round, so that its front stays its front. The walls around all rooms join the BSP tree, since
    the box around a turned building holds more than the building."""
    low, high = cells.root_box
    walls = np.array([[*n, o] for n, o in zip(np.eye(3), -low, strict=True)])
    walls = np.concatenate([walls, [[*-n, o] for n, o in zip(np.eye(3), high, strict=True)]])
    child = np.where(cells.node_child >= 0, cells.node_child + 6, cells.node_child)
    inner = 6 if len(child) else -2
    chain = np.array([[i + 1 if i < 5 else inner, -1] for i in range(6)])
    plane = np.concatenate([walls, cells.node_plane])
    plane[:, :3] = plane[:, :3] @ turn.T
    wound = slice(None, None, -1 if np.linalg.det(turn) < 0 else 1)
    leaf_point = cells.leaf_point @ turn.T
    cut = replace(
        cells,
        node_plane=plane,
        node_child=np.concatenate([chain, child]).astype(np.int32),
        root_box=np.array([leaf_point.min(axis=0), leaf_point.max(axis=0)]),
        leaf_point=leaf_point,
        portal_point=cells.portal_point @ turn.T,
        portal_plane=np.hstack([cells.portal_plane[:, :3] @ turn.T, cells.portal_plane[:, 3:]]),
        vertex=cells.vertex @ turn.T,
        triangle=np.ascontiguousarray(cells.triangle[:, wound]),
    )
    triangles = np.ascontiguousarray(scene.triangles[:, wound])
    return replace(scene.with_points(scene.points @ turn.T), triangles=triangles), cut


def about(axis, degrees: float) -> np.ndarray:
    """Rodrigues' rotation."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = np.radians(degrees)
    return np.eye(3) + np.sin(a) * cross + (1 - np.cos(a)) * cross @ cross


OBLIQUE = about([1, 2, -0.5], 30)


@pytest.mark.parametrize(
    ("factor", "extents"),
    [(1e-9, 0), (1e9, 0), (0.0254, 1e6)],
)
def test_scale_and_place(room_row, elsewhere, backend, factor, extents):
    scene, cells = room_row(3)
    options = replace(SOME, backend=backend)
    offset = factor * extents * 12 * np.array([1.0, -0.7, 0.3])
    there = elsewhere(scene, cells, offset, factor)
    expected = compute_ach(scene, cells, all_visible(3), options)
    actual = compute_ach(*there, all_visible(3), options)
    assert_near(actual, expected)
    # The points are the same but for rounding, so hardly a pixel changes.
    assert np.abs(actual.pixels - expected.pixels).sum() <= 1e-3 * expected.pixels.sum()


def test_turned_obliquely(room_row, backend):
    """The sphere around a point can be turned, so weights by solid angle give the same; plain
    pixels, more of which point at the corners of the six views, need not."""
    scene, cells = room_row(2)
    options = replace(SOME, samples=1024, backend=backend, weighting="solid-angle")
    expected = compute_ach(scene, cells, all_visible(2), options)
    oblique = turned(scene, cells, OBLIQUE)
    assert_near(compute_ach(*oblique, all_visible(2), options), expected, tightest=0.05)
    pixel = replace(options, weighting="pixel")
    straight, turned_over = (
        compute_ach(*rooms, all_visible(2), pixel) for rooms in ((scene, cells), oblique)
    )
    # Turned, the same door is seen by other pixels, all the same it is the same within 10 %.
    assert turned_over.value == pytest.approx(straight.value, rel=0.1)
    assert turned_over.samples.tolist() == [1024, 1024]


@pytest.mark.parametrize(
    ("turn", "weighting"),
    [
        ("quarter", "pixel"),
        ("quarter", "solid-angle"),
        ("mirror x", "pixel"),
        ("mirror x", "solid-angle"),
        ("mirror oblique", "solid-angle"),
    ],
)
def test_quarter_turns_and_mirrors(room_row, backend, weighting, turn):
    """These map the six views onto each other, but for the last, so plain pixels stay."""
    matrix = {
        "quarter": about([0, 1, 0], 90).round(),
        "mirror x": np.diag([-1.0, 1, 1]),
        "mirror oblique": OBLIQUE @ np.diag([1, 1, -1.0]),
    }[turn]
    scene, cells = room_row(3)
    options = replace(SOME, samples=512, backend=backend, weighting=weighting)
    expected = compute_ach(scene, cells, all_visible(3), options)
    actual = compute_ach(*turned(scene, cells, matrix), all_visible(3), options)
    assert_near(actual, expected)


def test_mirrored_views_are_mirrored(room_row):
    """What is at +x comes to -x and so on."""
    scene, cells = room_row(2)
    options = replace(SOME, backend="embree")
    here = compute_ach(scene, cells, all_visible(2), options).views
    there = compute_ach(*turned(scene, cells, np.diag([-1.0, 1, 1])), all_visible(2), options).views
    assert here[1, 0] > 0.2 > here[1, 1] == 0
    assert there[1, [1, 0]] == pytest.approx(here[1, :2], rel=0.1, abs=1e-12)


@pytest.mark.parametrize(("half", "sideways"), [(30, 40.0), (250, 0.0)])
def test_a_picture_a_tenth_of_a_millimetre_off_a_wall_is_seen_from_50_m(
    room_row, furnish, coverage_at, backend, half, sideways, pixel_centres
):
    """In a building 60 or 500 m wide. Counted against the same rays in float64."""
    scene, cells = room_row(2)
    bare = replace(
        cells,
        triangle=cells.triangle[:0],
        triangle_source=cells.triangle_source[:0],
        triangle_cell=cells.triangle_cell[:0],
    )

    def across(x, y, z):
        return [[x, y[0], z[0]], [x, y[0], z[1]], [x, y[1], z[1]], [x, y[1], z[0]]]

    wall, picture = across(0.0, (-half, half), (-half, half)), across(-1e-4, (0.5, 2.5), (-1, 1.5))
    eye = np.array([-50, 1.63, sideways])
    face = 512
    x, y = np.meshgrid(pixel_centres(face), pixel_centres(face))
    right, up, forward = VIEWS[0]
    along = forward + x[..., None] * right + y[..., None] * up
    place = eye + (50 - 1e-4) * along
    expected = np.sum(
        (place[..., 1] > 0.5) & (place[..., 1] < 2.5) & (place[..., 2] > -1) & (place[..., 2] < 1.5)
    )
    assert expected > 100
    for transparent in (False, True):
        room = furnish(scene, bare, [wall], [(0, 0)])
        covered = coverage_at(
            backend, *furnish(*room, [picture], [(1, 1)], transparent), eye, face, near=1.0
        )
        assert abs(int(covered[1]) - expected) <= 2
        nothing_behind = int(covered[0]) + int(covered[1])
        assert covered[2] == 0
        assert nothing_behind > expected


@pytest.mark.parametrize("weighting", ["pixel", "solid-angle"])
def test_a_cell_of_a_millimetre(room_row, backend, weighting, through_doors):
    """The second of three rooms is 1 mm long: half of what is seen from it lies beyond the door
    that the eye stands in, or nothing."""
    scene, cells = room_row(3)

    def squeezed(points):
        x = points[:, 0]
        x = np.where(x < 4.5, x, x - 4 + 1e-3)
        return np.column_stack([x, points[:, 1:]])

    leaf, vertex = squeezed(cells.leaf_point), squeezed(cells.vertex)
    plane = cells.node_plane.copy()
    plane[1, 3] = -4.001
    cells = replace(
        cells,
        node_plane=plane,
        root_box=np.array([[0, 0, -2], [8.001, 4, 2]]),
        leaf_point=leaf,
        portal_point=squeezed(cells.portal_point),
        vertex=vertex,
    )
    scene = scene.with_points(squeezed(scene.points))
    assert np.ptp(cells.leaf_points(1)[:, 0]) == pytest.approx(1e-3)
    options = replace(SOME, samples=2048, backend=backend, weighting=weighting)
    ach = compute_ach(scene, cells, all_visible(3), options)
    assert ach.samples.tolist() == [2048] * 3
    assert ach.missed.max() <= 1e-4
    share = through_doors(1, weighting, length=1e-3)
    assert share == pytest.approx(0.375 / 2, rel=0.01), "the door takes up 6 of 16 m²"
    # Too near to the walls beside the doors are 20 µm of the cell on either side.
    near = 2 * CLEARANCE * scene.tolerance.thin / 1e-3
    assert near == pytest.approx(0.04, rel=0.01)
    share /= 1 - (1 - 0.375) * near
    row = slice(int(ach.start[1]), int(ach.start[2]))
    error = ach.error[row]
    assert (error < 0.003).all()
    assert (np.abs(ach.value[row] - [1 - 2 * share, share, share]) <= 3 * error).all()
    # From the first room, the thin one is its rim, and all behind it is the third.
    whole = through_doors(1, weighting)
    actual = ach.row(0)
    assert abs(actual[1:].sum() - whole) <= 3 * ach.error[0]
    assert actual[1] < 0.01


def test_a_pvs_of_one(room_row, backend):
    """Each cell sees only itself: what else shows is missed, the hint is 1."""
    scene, cells = room_row(2)
    ach = compute_ach(
        scene, cells, Pvs.from_matrix(np.eye(2, dtype=bool)), replace(SOME, backend=backend)
    )
    assert ach.value.tolist() == [1, 1]
    assert ach.error.tolist() == ach.uncertain.tolist() == [0, 0]
    assert (ach.views == 1).all()
    assert (ach.missed > 0.05).all()


@pytest.mark.parametrize("tolerance", [None, 0.05])
def test_one_triangle(room_row, backend, tolerance):
    """A single triangle, all that there is to see, hanging in the second of two rooms."""
    scene, cells = room_row(2)
    points = np.array([[6.0, 1, 0], [6, 3, 0], [6, 2, 1]])
    one = replace(
        scene,
        points=points,
        triangles=np.array([[0, 1, 2]], np.int32),
        uv=np.zeros((1, 3, 2)),
        triangle_object=np.zeros(1, np.int32),
        triangle_material=np.zeros(1, np.int32),
        two_sided=np.ones(1, bool),
    )
    cut = replace(
        cells,
        vertex=points,
        vertex_uv=np.zeros((3, 2)),
        triangle=one.triangles,
        triangle_source=np.zeros(1, np.int32),
        triangle_cell=np.array([[1, 1]], np.int32),
    )
    options = replace(SOME, backend=backend, tolerance=tolerance, face=16)
    ach = compute_ach(one, cut, all_visible(2), options)
    assert ach.value.tolist() == [0, 1, 1, 0]
    assert (ach.pixels[[1, 2]] > 0).all()
    assert np.isnan(ach.error[[0, 3]]).all()
    assert ach.uncertain.tolist() == [0, 0]
    # The triangle has 1 m²: seen from 4 m it takes up about 1/4² of a view's 2².
    assert 1e-3 < ach.pixels[1] / (ach.samples[0] * 6 * 16**2) < 2e-2


def test_a_million_triangles(room_row, through_doors):
    """A rippled sheet in the second room: from the first, all that shows in the door is of it or
    of the room that it is in."""
    scene, cells = room_row(2)
    n = 708
    x, z = np.meshgrid(np.linspace(4.01, 7.99, n), np.linspace(-1.99, 1.99, n), indexing="ij")
    sheet = np.stack([x, 0.5 + 0.2 * np.sin(9 * x) * np.cos(7 * z), z], axis=-1).reshape(-1, 3)
    corner = np.arange(n * n).reshape(n, n) + len(scene.points)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    halves = [np.stack(half, axis=-1).reshape(-1, 3) for half in ((a, b, c), (a, c, d))]
    triangles = np.concatenate([scene.triangles, *halves]).astype(np.int32)
    added = len(triangles) - len(scene.triangles)
    assert added > 999_000
    scene = replace(
        scene,
        points=np.concatenate([scene.points, sheet]),
        triangles=triangles,
        uv=np.zeros((len(triangles), 3, 2)),
        triangle_object=np.zeros(len(triangles), np.int32),
        triangle_material=np.zeros(len(triangles), np.int32),
        two_sided=np.ones(len(triangles), bool),
    )
    cells = replace(
        cells,
        vertex=scene.points,
        vertex_uv=np.zeros((len(scene.points), 2)),
        triangle=triangles,
        triangle_source=np.arange(len(triangles), dtype=np.int32),
        triangle_cell=np.concatenate([cells.triangle_cell, np.ones((added, 2), np.int32)]),
    )
    options = AchOptions(samples=128, face=4, backend="embree")
    ach = compute_ach(scene, cells, all_visible(2), options)
    share = through_doors(1, "pixel")
    assert ach.error[1] < 0.1 * share
    assert abs(ach.row(0)[1] - share) <= 3 * ach.error[1]
    assert ach.missed.tolist() == [0, 0]


def test_five_thousand_cells(room_row, furnish, backend):
    """Pairs of rooms, 20 km of them; each pair by itself is like the only one."""
    pairs, some = 2500, (0, 1, 2499, 2500, 4999)
    scene, cells = room_row(2 * pairs)
    ends = 8.0 * np.arange(1, pairs)
    bricks = [[[x, 0, -1], [x, 3, -1], [x, 3, 1], [x, 0, 1]] for x in ends]
    scene, cells = furnish(scene, cells, bricks, [(int(x) // 4, int(x) // 4 - 1) for x in ends])
    even = 2 * np.arange(pairs)
    row = np.stack([even, even + 1, even + 1, even], axis=1).ravel().astype(np.int32)
    pvs = Pvs(2 * np.arange(2 * pairs + 1), row)
    # The default clearance goes by the extent, and would be 5 cm here.
    options = AchOptions(samples=64, face=8, backend=backend, clearance=1e-3)
    expected = compute_ach(*room_row(2), all_visible(2), options)
    sampler = HintSampler(scene, cells, pvs, options, BACKENDS[backend])
    for cell in some:
        hints = sampler.of_cell(cell)
        # A float32 is 1 mm fine here.
        assert hints.missed <= 2e-3, cell
        assert hints.row.value == pytest.approx(expected.row(cell % 2), abs=2e-3), cell
    sampler.renderer.close()


@pytest.mark.parametrize("by_image", [False, True])
def test_seventy_thousand_cells(
    room_row, furnish, sample_points, backend, drawing, by_image, pixel_centres
):
    """A floor of as many tiles, each a cell of its own: more than 16 bits can tell. What each
    pixel shows is worked out in float64."""
    side = 265
    scene, cells = room_row(1)
    at = np.arange(side) - side / 2
    x, z = (g.ravel() for g in np.meshgrid(at, at, indexing="ij"))
    y = np.zeros(side**2)
    # Wound to face up: a, then along z, then across.
    tiles = np.stack(
        [
            np.stack([x + dx, y, z + dz], axis=-1)
            for dx, dz in ((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0))
        ],
        axis=1,
    )
    bare = replace(
        cells,
        triangle=cells.triangle[:0],
        triangle_source=cells.triangle_source[:0],
        triangle_cell=cells.triangle_cell[:0],
        leaf_cell=np.array([side**2 - 1], np.int32),
    )
    number = np.arange(side**2)
    scene, cells = furnish(scene, bare, tiles.tolist(), np.stack([number, number], axis=1).tolist())
    if by_image:
        painted = (Material("plain"), *(Material(f"m{i}", image=i) for i in range(3)))
        of = scene.triangle_material.copy()
        of[-2 * side**2 :] = 1 + np.repeat(number % 3, 2)
        scene = replace(scene, materials=painted, triangle_material=of)
    surfaces = ItemSurfaces.from_scene(scene, cells)
    assert surfaces.cell_count == side**2 > 2**16
    eye, face = np.array([85.3, 40.7, 55.1]), 128
    v = 3  # the view down
    right, up, forward = VIEWS[v]
    px, py = np.meshgrid(pixel_centres(face), pixel_centres(face))
    place = eye + 40.7 * (forward + px[..., None] * right + py[..., None] * up)
    column = np.floor(place[..., 0] + side / 2).astype(int)
    line = np.floor(place[..., 2] + side / 2).astype(int)
    shown = column * side + line
    expected = np.bincount(shown.ravel(), minlength=side**2)
    assert (np.flatnonzero(expected) > 2**16).any()
    with drawing(backend, surfaces, face) as renderer:
        counter = PixelCounter(renderer, surfaces, cells, face, by_image=by_image)
        owners = counter.owners
        wanted, begin = owners.in_cells(np.arange(side**2, dtype=np.int32))
        seen = counter.count(sample_points(eye), wanted)
    assert len(owners.first) == side**2 + 1
    actual = np.add.reduceat(seen.in_views, begin, axis=1)[v]
    # A pixel whose centre lies on a joint may show either tile.
    assert np.abs(actual - expected).sum() / 2 <= 1e-3 * face**2
    assert actual.sum() == face**2
    assert seen.missed[0] == 0
    if by_image:
        painted = owners.image[wanted] == owners.cell[wanted] % 3
        assert seen.at_points[:, ~painted].sum() == 0


def finder(room_row, points, clearance):
    """Where points are taken in turn from those given, in a room."""
    scene, cells = room_row(1)
    at = PointFinder(
        CellVolume.of_cells(cells)[0], SampleObstacles.from_scene(scene, cells), clearance
    )
    return at, at.usable(np.array(points, dtype=np.float64).reshape(-1, 3))


def test_a_point_on_a_face_an_edge_or_a_corner_is_rejected(room_row):
    on = [[4, 1.7, 0.3], [2, 0, 0], [0, 0, 0.5], [0, 0, -2], [4, 4, 2]]
    clear = [[2, 2, 0], [4 - 1e-3, 1.7, 0.3]]
    _, usable = finder(room_row, on + clear, 1e-4)
    assert usable.tolist() == [False] * 5 + [True] * 2


def test_the_least_bad_point_is_the_one_farthest_from_all_faces(room_row):
    at, usable = finder(room_row, [[4, 1.7, 0.3], [2, 0.3, 0], [0.2, 2, 0], [0, 0, -2]], 1.0)
    assert not usable.any()
    best = at.least_bad()
    assert best.position.tolist() == [[2, 0.3, 0]]
    assert best.near.tolist() == [0.3]
    assert best.shift.tolist() == [[0, 0]]


@pytest.mark.parametrize("order", [1, -1])
def test_the_best_of_all_batches_is_kept(room_row, order):
    at, _ = finder(room_row, [], 1.0)
    for points in ([[2, 0.1, 0], [2, 0.2, 0]], [[2, 0.4, 0], [2, 0.3, 0]])[::order]:
        assert not at.usable(np.array(points)).any()
    assert at.least_bad().near.tolist() == [0.4]


def test_from_on_a_face_itself_the_near_plane_still_has_a_place(room_row):
    at, _ = finder(room_row, [[4, 1.7, 0.3], [2, 0, 0]], 1e-4)
    assert 0 < at.least_bad().near[0] < 1e-4


def test_a_point_on_a_face_sees_the_rest_of_the_room(room_row, backend, coverage_at):
    """Half of everything is the wall it is on, or what is beyond; no pixel is lost or missed."""
    scene, cells = room_row(1)
    face = 32
    covered = coverage_at(backend, scene, cells, [4, 1.7, 0.3], face)
    assert covered[1] == 0
    assert 3 * face**2 <= covered[0] <= 6 * face**2


@pytest.mark.parametrize("tolerance", [None, 0.05])
def test_where_all_is_too_near_the_best_point_serves(room_row, backend, tolerance):
    scene, cells = room_row(1)
    options = replace(SOME, backend=backend, samples=16, clearance=2.5, tolerance=tolerance)
    ach = compute_ach(scene, cells, all_visible(1), options)
    assert ach.samples.tolist() == [1]
    assert ach.rejected[0] > 0
    assert ach.value.tolist() == [1]
    assert ach.pixels[0] == 6 * 4**2
    assert np.isnan(ach.uncertain[0])


@pytest.mark.parametrize("tolerance", [None, 0.05])
@pytest.mark.parametrize("placement", ["sobol", "uniform"])
def test_a_cell_that_no_point_is_located_in_is_given_up(room_row, placement, tolerance):
    """Planes and corners that contradict each other: the tree takes both rooms for the first."""
    scene, cells = room_row(2)
    cells = replace(cells, node_plane=np.array([[1.0, 0, 0, -8.0]]))
    options = replace(SOME, placement=placement, tolerance=tolerance, backend="embree")
    ach = compute_ach(scene, cells, all_visible(2), options)
    assert ach.samples[0] > 0
    assert ach.row(1).sum() == 1
    if placement == "sobol":
        assert ach.samples[1] == 0
        assert ach.row(1).tolist() == [1, 0]


def test_rays_start_at_the_sample_point(room_row, sample_points):
    """At 1e6 extents from the origin too: recentred before anything is rounded to float32."""
    scene, cells = room_row(1)
    far_off = 1e6 * np.array([4.0, -4, 4])
    moved = replace(cells, vertex=cells.vertex + far_off, root_box=cells.root_box + far_off)
    there = ItemSurfaces.from_scene(scene.with_points(scene.points + far_off), moved)
    at = sample_points(np.array([2.1, 1.7, 0.3]) + far_off)
    _, place = EmbreeRenderer(there, 8).trace(at, np.arange(6 * 64))
    away = np.abs(place[0] - far_off - [2, 2, 0]).max(axis=1)
    assert away == pytest.approx(np.full(384, 2.0), abs=1e-6)
