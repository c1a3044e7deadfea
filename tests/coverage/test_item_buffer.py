"""One sample point: what the six views show, against what can be worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings, strategies as st

from ptmtools.coverage.backends.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import VIEWS, ItemSurfaces
from ptmtools.coverage.tally import PixelCounter

FACE = 64


def centres_within(low: Fraction, high: Fraction, face: int) -> int:
    """How many of a row of pixel centres lie strictly between two points of [-1, 1]."""
    at = [Fraction(2 * i + 1, face) - 1 for i in range(face)]
    return sum(low < x < high for x in at)


def rectangle_across(x, y, z):
    """Corners of a rectangle in the plane x, facing -x; y and z are (low, high)."""
    return [[x, y[0], z[0]], [x, y[0], z[1]], [x, y[1], z[1]], [x, y[1], z[0]]]


def picked(cells, which):
    """The pieces ``which`` of a subdivision, in that order."""
    return replace(
        cells,
        triangle=cells.triangle[which],
        triangle_source=cells.triangle_source[which],
        triangle_cell=cells.triangle_cell[which],
    )


def test_views_are_six_different_right_angled_frames():
    for right, up, forward in VIEWS:
        assert np.array_equal(
            np.array([right, up, forward]) @ np.array([right, up, forward]).T, np.eye(3)
        )
    assert len({tuple(v[2]) for v in VIEWS}) == 6


@pytest.mark.parametrize("face", [16, 64, 129])
def test_the_door_covers_its_projected_area(room_row, coverage_at, backend, face):
    """From (1, 1.7, 0.3) the door in the plane x = 4, y in [0, 3], z in [-1, 1] lies wholly in
    the view along +x, three metres ahead; through it nothing shows but room 1."""
    scene, cells = room_row(2)
    eye = [Fraction(1), Fraction(17, 10), Fraction(3, 10)]
    covered = coverage_at(backend, scene, cells, [float(x) for x in eye], face)
    depth = 4 - eye[0]
    low = [(0 - eye[1]) / depth, (-1 - eye[2]) / depth]
    high = [(3 - eye[1]) / depth, (1 - eye[2]) / depth]
    sides = [h - l for l, h in zip(low, high, strict=True)]
    area = sides[0] * sides[1] * Fraction(face, 2) ** 2  # in pixels
    boundary = 2 * (sides[0] + sides[1]) * Fraction(face, 2)
    assert abs(int(covered[1]) - area) <= boundary
    rows, columns = (centres_within(l, h, face) for l, h in zip(low, high, strict=True))
    assert covered.tolist() == [6 * face**2 - rows * columns, rows * columns, 0]


def test_the_partition_counts_for_the_viewers_side(room_row, coverage_at, backend):
    """Its front is room 1, but from room 0 nobody sees its front."""
    scene, cells = room_row(2)
    from_0 = coverage_at(backend, scene, cells, [2, 1.7, 0.3])
    from_1 = coverage_at(backend, scene, cells, [6, 1.7, 0.3])
    assert from_0[0] > from_0[1] > 0
    assert from_1[1] > from_1[0] > 0


@pytest.mark.parametrize("distance", [5.0, 20.0])
@pytest.mark.parametrize("sideways", [0.0, 17.0])
def test_a_picture_1_mm_off_the_wall_wins(
    room_row, furnish, coverage_at, backend, distance, sideways, pixel_centres
):
    """The wall is 60 m long; the picture stands for cell 1. Counted against the same rays in
    float64; seen sideways from 5 m the wall runs past the eye at a grazing angle."""
    scene, cells = room_row(2)
    wall = rectangle_across(0.0, (-30, 30), (-30, 30))
    picture = rectangle_across(-0.001, (0.5, 2.5), (-1.0, 1.5))
    scene, cells = furnish(scene, picked(cells, []), [wall, picture], [(0, 0), (1, 1)])
    eye = np.array([-distance, 1.63, sideways])
    face = 256
    x, y = np.meshgrid(pixel_centres(face), pixel_centres(face))
    expected = 0
    for right, up, forward in VIEWS:
        direction = forward + x[..., None] * right + y[..., None] * up
        with np.errstate(divide="ignore"):
            t = (distance - 0.001) / direction[..., 0]
        height, along = (eye + t[..., None] * direction)[..., 1:].transpose(2, 0, 1)
        inside = (height > 0.5) & (height < 2.5) & (along > -1) & (along < 1.5)
        expected += np.sum(inside & (t > 0))
    covered = coverage_at(backend, scene, cells, eye, face)
    assert expected > 20
    assert abs(int(covered[1]) - expected) <= 2


def test_a_pane_counts_and_so_does_what_is_behind_it(room_row, furnish, coverage_at, backend):
    scene, cells = room_row(2)
    eye = [1, 1.7, 0.3]
    before = coverage_at(backend, scene, cells, eye)
    pane = rectangle_across(4.0, (0, 3), (-1, 1))
    glazed = furnish(scene, cells, [pane], [(0, 1)], transparent=True)
    after = coverage_at(backend, *glazed, eye)
    assert after.tolist() == [before[0] + before[1], before[1], 0]
    bricked = furnish(scene, cells, [pane], [(0, 1)], transparent=False)
    assert coverage_at(backend, *bricked, eye).tolist() == [6 * FACE**2, 0, 0]


def test_of_panes_the_nearest_counts_once_and_never_behind_a_wall(
    room_row, furnish, coverage_at, backend
):
    scene, cells = room_row(2)
    eye = [1, 1.7, 0.3]
    before = coverage_at(backend, scene, cells, eye)
    small = rectangle_across(3.0, (1, 2), (-0.5, 0.5))
    behind = rectangle_across(3.5, (1, 2), (-0.5, 0.5))
    other_room = rectangle_across(4.5, (1, 3), (-1.9, -1.4))  # hidden by the partition
    one = coverage_at(backend, *furnish(scene, cells, [small], [(0, 0)], transparent=True), eye)
    quads = [small, behind, other_room]
    more = furnish(scene, cells, quads, [(0, 0), (0, 0), (1, 1)], transparent=True)
    assert one[0] > before[0]
    assert one[1] == before[1]
    # Seen from here, the farther pane of equal size lies within the nearer one's outline.
    assert coverage_at(backend, *more, eye).tolist() == one.tolist()


def test_a_pane_lying_in_the_wall_counts(room_row, furnish, coverage_at, backend, pixel_centres):
    """Rounding must not decide whether it is before or behind."""
    scene, cells = room_row(1)
    eye = [1.1, 1.7, 0.3]
    poster = rectangle_across(4.0, (0.5, 2), (-1, 1))
    covered = coverage_at(backend, *furnish(scene, cells, [poster], [(0, 0)], True), eye)
    plain = coverage_at(backend, *furnish(scene, cells, [poster], [(0, 0)], False), eye)
    assert plain[0] == 6 * FACE**2
    depth = 4 - 1.1
    at = pixel_centres(FACE)
    rows = np.sum((at > (0.5 - 1.7) / depth) & (at < (2 - 1.7) / depth))
    columns = np.sum((at > (-1 - 0.3) / depth) & (at < (1 - 0.3) / depth))
    assert covered[0] == 6 * FACE**2 + rows * columns


def test_of_coincident_faces_it_does_not_matter_which_wins(room_row, furnish, coverage_at, backend):
    """The partition again, with opposite winding and its sides turned over to match."""
    scene, cells = room_row(2)
    boundary = np.flatnonzero((cells.triangle_cell >= 0).all(axis=1))
    turned = np.concatenate([np.arange(len(cells.triangle)), boundary])
    both_sides = picked(cells, turned)
    both_sides.triangle[len(cells.triangle) :] = both_sides.triangle[len(cells.triangle) :, ::-1]
    both_sides.triangle_cell[len(cells.triangle) :] = both_sides.triangle_cell[
        len(cells.triangle) :, ::-1
    ]
    added = np.arange(len(scene.triangles), len(turned), dtype=np.int32)
    both_sides.triangle_source[len(cells.triangle) :] = added
    twice = replace(
        scene,
        triangles=np.concatenate([scene.triangles, scene.triangles[boundary][:, ::-1]]),
        triangle_material=np.zeros(len(turned), np.int32),
    )
    for eye in ([1, 1.7, 0.3], [6.5, 2.2, -1.1]):
        expected = coverage_at(backend, scene, cells, eye)
        assert coverage_at(backend, twice, both_sides, eye).tolist() == expected.tolist()


def test_the_order_of_the_triangles_does_not_matter(room_row, coverage_at, backend):
    scene, cells = room_row(3)
    eye = [5.3, 1.65, 0.35]
    expected = coverage_at(backend, scene, cells, eye)
    assert (expected[:3] > 0).all()
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(cells.triangle))
        shuffled = picked(cells, order)
        assert coverage_at(backend, scene, shuffled, eye).tolist() == expected.tolist()


def test_background_is_not_counted(room_row, coverage_at, backend):
    """Without its ceiling the room leaves part of the views empty."""
    scene, cells = room_row(1)
    kept = np.flatnonzero(cells.vertex[cells.triangle][:, :, 1].min(axis=1) < 4)
    open_above = picked(cells, kept)
    covered = coverage_at(backend, scene, open_above, [2, 2, 0])
    assert covered.tolist() == [5 * FACE**2, 0]


def test_nothing_to_see(room_row, coverage_at, backend):
    scene, cells = room_row(1)
    bare = replace(picked(cells, []), vertex=np.zeros((0, 3)))
    assert coverage_at(backend, scene, bare, [2, 2, 0]).tolist() == [0, 0]


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (1e6, -1e6, 1e6)])
@pytest.mark.parametrize("power", [-20, 0, 20])
def test_neither_place_nor_unit_matters(
    room_row, furnish, elsewhere, coverage_at, backend, offset, power
):
    scene, cells = room_row(3)
    pane = rectangle_across(3.5, (0.5, 3), (-1, 1))
    scene, cells = furnish(scene, cells, [pane], [(0, 0)], transparent=True)
    eye = np.array([1.1, 1.7, 0.3])
    factor = 2.0**power
    far_off = np.array(offset) * factor
    there = elsewhere(scene, cells, far_off, factor)
    expected = coverage_at(backend, scene, cells, eye)
    actual = coverage_at(backend, *there, eye * factor + far_off, near=1e-3 * factor)
    assert actual.tolist() == expected.tolist()


@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    eye=st.tuples(st.floats(0.2, 11.8), st.floats(0.2, 3.8), st.floats(-1.8, 1.8)),
    face=st.sampled_from([16, 33, 64]),
)
@example(eye=(4.0, 1.0, 0.0), face=33)
def test_backends_agree_anywhere(room_row, coverage_at, gl, eye, face):
    """Rasterised edges are rounded to 1/256 pixel, so an edge along a row of pixel centres may
    move by that row; no more than a few such rows at a time. From the very plane of a partition
    that plane is a row in each of four views, and where rooms meet in it either may win."""
    scene, cells = room_row(3)
    surfaces = ItemSurfaces.from_scene(scene, cells)
    assert surfaces.scale == 2.0**-4
    by_gl = coverage_at("gl", scene, cells, eye, face)
    by_rays = coverage_at("embree", scene, cells, eye, face)
    assert by_gl.sum() == by_rays.sum() == 6 * face**2
    ties = 4 * face if eye[0] in (4, 8) else 0
    assert np.abs(by_gl - by_rays).max() <= 2 * face + ties


class Doubtful:
    """Rays, but with some pixels shown wrongly, as past a rounded edge."""

    name, most = "doubtful", 10

    def __init__(self, rays, wrong, triangle):
        self.rays, self.wrong, self.triangle = rays, wrong, triangle

    def show(self, points, needed=None):
        actual = self.rays.show(points, needed)
        actual.reshape(1, -1)[0, self.wrong] = self.triangle
        return actual

    def trace(self, points, pixels):
        assert set(self.wrong) <= set(pixels)
        return self.rays.trace(points, pixels)

    def close(self):
        self.rays.close()


def test_an_unexpected_cell_is_believed_only_if_a_ray_confirms_it(room_row, sample_points):
    scene, cells = room_row(3)
    surfaces = ItemSurfaces.from_scene(scene, cells)
    rays = EmbreeRenderer(surfaces, FACE)
    eye = sample_points([2.0, 1.7, 0.3])

    def counted(renderer, wanted):
        seen = PixelCounter(renderer, surfaces, cells, FACE).count(eye, np.array(wanted))
        return [*seen.in_views.sum(axis=0).tolist(), int(seen.missed[0])]

    truth = counted(rays, [0, 1, 2])
    assert truth[2] > 0
    in_room_2 = int(np.flatnonzero((cells.triangle_cell == [2, -1]).all(axis=1))[0])
    wrong = Doubtful(rays, [5, 77, 1000], in_room_2)
    fooled = counted(wrong, [0, 1, 2])
    assert fooled[2] == truth[2] + 3
    assert counted(wrong, [0, 1]) == [*truth[:2], truth[2]], "what room 2 really covers is missed"


def test_what_reaches_in_by_less_than_a_tolerance_is_seen_where_it_is(
    room_row, furnish, sample_points
):
    """The end of a wall that belongs to room 2, a tenth of a millimetre deep in room 1: from room
    1, which cannot see room 2, it is part of room 1."""
    scene, cells = room_row(3)
    reach = rectangle_across(8.0 - 1e-5, (0, 3), (1.2, 1.8))
    scene, cells = furnish(scene, cells, [reach], [(2, 2)])
    surfaces = ItemSurfaces.from_scene(scene, cells)
    rays = EmbreeRenderer(surfaces, FACE)
    counter = PixelCounter(rays, surfaces, cells, FACE)
    at = sample_points([6, 1.7, 0.3])
    seen, every = counter.count(at, np.array([0, 1])), counter.count(at, np.arange(3))
    in_room_2 = int(every.at_points[..., 2].sum())
    recovered = int(seen.at_points[..., 1].sum()) - int(every.at_points[..., 1].sum())
    assert recovered > 20
    assert recovered + int(seen.missed[0]) == in_room_2


def test_rays_through_some_pixels_are_the_rays_through_all(
    room_row, furnish, backend, sample_points, drawing
):
    scene, cells = room_row(2)
    pane = rectangle_across(4.0, (0, 3), (-1, 1))
    surfaces = ItemSurfaces.from_scene(*furnish(scene, cells, [pane], [(0, 1)], transparent=True))
    at = sample_points([[1.0, 1.7, 0.3], [2.5, 1.1, -0.3]], shift=(0.3, -0.6))
    whole = EmbreeRenderer(surfaces, FACE).show(at)
    assert whole.shape == (2, 2, 6, FACE**2)
    pixels = np.arange(0, 2 * 6 * FACE**2, 7)
    with drawing(backend, surfaces, FACE) as renderer:
        actual, place = renderer.trace(at, pixels)
        drawn = renderer.show(at)
    assert np.array_equal(actual, whole.reshape(2, -1)[:, pixels])
    hit = actual[0] >= 0
    plane = surfaces.plane[actual[0][hit]]
    off = np.einsum("ij,ij->i", plane[:, :3], surfaces.normalise(place[0][hit])) + plane[:, 3]
    assert np.abs(off).max() < 1e-6
    assert np.mean(drawn != whole) < 1e-3  # triangles that share an edge may share its pixels


def test_many_points_at_once_are_each_alone(room_row, furnish, backend, sample_points, drawing):
    """More than fit into one target or one batch of rays, some in other rooms."""
    scene, cells = room_row(3)
    pane = rectangle_across(4.0, (0, 3), (-1, 1))
    surfaces = ItemSurfaces.from_scene(*furnish(scene, cells, [pane], [(0, 1)], transparent=True))
    points = np.random.default_rng(1).uniform([0.2, 0.2, -1.8], [11.8, 3.8, 1.8], (50, 3))
    face = 16
    with drawing(backend, surfaces, face) as renderer:
        together = renderer.show(sample_points(points, shift=(0.5, 0.25)))
        for k in (0, 17, 49):
            alone = renderer.show(sample_points(points[k], shift=(0.5, 0.25)))
            assert np.array_equal(together[:, k], alone[:, 0])
    assert (together >= 0).any(axis=(1, 2, 3)).all()


def test_culled_surfaces_would_not_show(room_row, sample_points, drawing, gl):
    """Only what the PVS needs is drawn; what stands outside it and shows is drawn nevertheless."""
    scene, cells = room_row(3)
    surfaces = ItemSurfaces.from_scene(scene, cells)
    at = sample_points([[2.0, 1.7, 0.3], [1.0, 1.0, 1.0]])
    with drawing("gl", surfaces, FACE) as renderer:
        every = renderer.show(at)
        assert np.array_equal(renderer.show(at, np.array([True, True, True])), every)
        assert np.array_equal(renderer.show(at, np.array([True, False, False])), every)
        hidden = renderer.lists(at)
    assert sum(len(o) for o, _ in hidden) < 6 * len(surfaces.triangle)


def test_many_small_views_between_two_near_surfaces(room_row, sample_points, drawing, gl):
    """A slab of 12 m by 4 m and 2 mm: corners are far off, what shows is a hair away. OpenGL has to
    see what rays see though hundreds of views lie side by side."""
    scene, cells = room_row(3)
    flat = np.array([1.0, 5e-4, 1.0])
    slab = scene.with_points(scene.points * flat), replace(cells, vertex=cells.vertex * flat)
    surfaces = ItemSurfaces.from_scene(*slab)
    points = np.random.default_rng(3).uniform([0.1, 0.2, -1.9], [11.9, 3.8, 1.9], (60, 3)) * flat
    at = sample_points(points, near=5e-5, shift=(0.2, 0.1))
    face = 8
    with drawing("embree", surfaces, face) as rays, drawing("gl", surfaces, face) as raster:
        assert raster.most >= len(points)
        differ = rays.show(at) != raster.show(at)
    assert differ.mean() < 2e-3
