"""Shares of textures within the cells: they sum to the hints and go by what is seen."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.item_buffer import ItemSurfaces
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.placement import CellVolume
from ptmtools.coverage.sample_points import PointFinder, PointSequence
from ptmtools.coverage.sampling import CLEARANCE
from ptmtools.coverage.solids import SampleObstacles
from ptmtools.coverage.tally import Owners
from ptmtools.scene.model import Material
from ptmtools.visibility.model import Pvs

BY_TEXTURE = AchOptions(samples=64, face=8, per_texture=True)
FLOOR, CEILING, BACK, FRONT = range(4)


def all_visible(n):
    return Pvs.from_matrix(np.ones((n, n), dtype=bool))


def painted(scene, images):
    """The quadrilaterals of `room_row` with an image each: -1 where ``images`` does not say."""
    count = 1 + max(images.values())
    materials = (Material("plain"), *(Material(f"image {i}", image=i) for i in range(count)))
    material = np.zeros(len(scene.triangles), np.int32)
    for quad, image in images.items():
        material[2 * quad : 2 * quad + 2] = image + 1
    return replace(scene, materials=materials, triangle_material=material)


def of_entry(ach, entry):
    """{image: share} of an entry."""
    part = slice(int(ach.texture_start[entry]), int(ach.texture_start[entry + 1]))
    return dict(zip(ach.texture[part].tolist(), ach.texture_value[part].tolist(), strict=True))


@pytest.mark.parametrize("tolerance", [None, 0.03])
@pytest.mark.parametrize("weighting", ["pixel", "solid-angle"])
def test_textures_sum_to_their_cell(room_row, backend, weighting, tolerance):
    """Three rooms, several images in each, some in more than one."""
    scene, cells = room_row(3)
    images = {i: i % 4 for i in range(len(cells.triangle) // 2) if i % 5}
    scene = painted(scene, images)
    options = replace(BY_TEXTURE, backend=backend, weighting=weighting, tolerance=tolerance)
    ach = compute_ach(scene, cells, all_visible(3), options)
    assert ach.by_texture
    assert ach.texture_start[0] == 0
    assert ach.texture_start[-1] == len(ach.texture) == len(ach.texture_value)
    assert len(ach.texture_start) == len(ach.value) + 1
    assert (ach.texture_value > 0).all()
    several = 0
    for entry, value in enumerate(ach.value):
        actual = of_entry(ach, entry)
        assert list(actual) == sorted(actual)
        assert set(actual) <= {-1, 0, 1, 2, 3}
        assert math.fsum(actual.values()) == pytest.approx(value, abs=1e-15)
        several += len(actual) > 2
    assert several >= 5
    plain = compute_ach(scene, cells, all_visible(3), replace(options, per_texture=False))
    assert not plain.by_texture
    for name in ("value", "pixels", "error", "p95", "seen", "views", "uncertain", "samples"):
        assert np.array_equal(getattr(plain, name), getattr(ach, name), equal_nan=True), name


def test_what_is_seen_twice_as_large_has_twice_the_share(room_row, backend):
    """In a cube each side is a sixth of the view, on average: one with the first image, two with
    the second, three without."""
    scene, cells = room_row(1)
    scene = painted(scene, {FLOOR: 0, BACK: 1, FRONT: 1})
    options = replace(BY_TEXTURE, backend=backend, samples=1024, face=4)
    ach = compute_ach(scene, cells, all_visible(1), options)
    actual = of_entry(ach, 0)
    assert actual[0] == pytest.approx(1 / 6, abs=1e-3)
    assert actual[1] == pytest.approx(2 / 6, abs=2e-3)
    assert actual[-1] == pytest.approx(3 / 6, abs=2e-3)


def test_textures_are_counted_where_they_are_seen(room_row, backend, drawing):
    """Against a count of what each pixel shows, by the triangle's image and the viewer's side."""
    scene, cells = room_row(2)
    images = {i: i % 3 for i in range(len(cells.triangle) // 2) if i % 4}
    scene = painted(scene, images)
    options = replace(BY_TEXTURE, backend=backend)
    ach = compute_ach(scene, cells, all_visible(2), options)
    surfaces = ItemSurfaces.from_scene(scene, cells)
    clearance = CLEARANCE * scene.tolerance.thin
    for cell in range(2):
        finder = PointFinder(
            CellVolume.of_cells(cells)[cell], SampleObstacles.from_scene(scene, cells), clearance
        )
        points = PointSequence(finder, "sobol", 0).take(options.points)
        with drawing(backend, surfaces, options.side) as renderer:
            shows = renderer.show(points)[0]
        counted: dict[tuple[int, int], int] = {}
        for point, seen in zip(points.position, shows, strict=True):
            for t, times in zip(*np.unique(seen, return_counts=True), strict=True):
                a, b, c = cells.vertex[cells.triangle[t]]
                behind = np.dot(np.cross(b - a, c - a), point - a) < 0
                key = int(cells.triangle_cell[t, int(behind)]), images.get(int(t) // 2, -1)
                counted[key] = counted.get(key, 0) + int(times)
        total = sum(counted.values())
        assert total == options.points * 6 * options.side**2
        actual = {}
        for entry, other in enumerate(all_visible(2).row(cell), int(ach.start[cell])):
            actual |= {(int(other), image): v for image, v in of_entry(ach, entry).items()}
        assert actual.keys() == counted.keys()
        for key, share in actual.items():
            assert share == pytest.approx(counted[key] / total, abs=1e-12), key


def test_a_transparent_picture_has_a_share_of_its_own(room_row, furnish, backend):
    """And so has what is behind it."""
    scene, cells = room_row(1)
    scene = painted(scene, {FLOOR: 0, CEILING: 0})
    before = compute_ach(scene, cells, all_visible(1), replace(BY_TEXTURE, backend=backend))
    sheet = [[[0.5, 2, -1.5], [0.5, 2, 1.5], [3.5, 2, 1.5], [3.5, 2, -1.5]]]
    scene, cells = furnish(scene, cells, sheet, [(0, 0)], transparent=True)
    curtain = replace(scene.materials[-1], image=1)
    scene = replace(scene, materials=(*scene.materials[:-1], curtain))
    after = compute_ach(scene, cells, all_visible(1), replace(BY_TEXTURE, backend=backend))
    assert set(of_entry(before, 0)) == {-1, 0}
    actual = of_entry(after, 0)
    assert set(actual) == {-1, 0, 1}
    assert actual[1] > 0.1
    for image in (-1, 0):
        opaque = of_entry(before, 0)[image] * before.pixels[0]
        assert actual[image] * after.pixels[0] == pytest.approx(opaque, rel=0.01)


def test_what_belongs_to_no_cell_keeps_its_image_where_the_cell_has_it(room_row):
    """The floor has no owner; it is located in the room that it is seen in. That has the floor's
    image elsewhere too, or has not."""
    scene, cells = room_row(1)
    owner = cells.triangle_cell.copy()
    owner[2 * FLOOR : 2 * FLOOR + 2] = -1
    unowned = replace(cells, triangle_cell=owner)
    options = replace(BY_TEXTURE, backend="embree", samples=512, face=4)
    shared = painted(scene, {FLOOR: 0, CEILING: 0})
    actual = of_entry(compute_ach(shared, unowned, all_visible(1), options), 0)
    assert actual[0] == pytest.approx(2 / 6, abs=5e-3)
    alone = painted(scene, {FLOOR: 1, CEILING: 0})
    actual = of_entry(compute_ach(alone, unowned, all_visible(1), options), 0)
    assert set(actual) == {-1, 0}
    assert actual[-1] == pytest.approx(5 / 6, abs=5e-3)


def test_owners_of_images(room_row):
    scene, cells = room_row(2)
    scene = painted(scene, {FLOOR: 2, CEILING: 2, 4 + FLOOR: 0})
    owners = Owners.from_surfaces(ItemSurfaces.from_scene(scene, cells), by_image=True)
    assert list(zip(owners.cell.tolist(), owners.image.tolist(), strict=True)) == [
        (0, -1),
        (0, 2),
        (1, -1),
        (1, 0),
    ]
    assert owners.first.tolist() == [0, 2, 4]
    which, begin = owners.in_cells(np.array([1, 0], np.int32))
    assert which.tolist() == [2, 3, 0, 1]
    assert begin.tolist() == [0, 2]
    cell = np.array([0, 0, 0, 1, 1, -1], np.int32)
    image = np.array([2, 0, -1, 0, 2, 0], np.int32)
    assert owners.numbers(cell, image).tolist() == [1, 0, 0, 3, 2, -1]
    plain = Owners.from_surfaces(ItemSurfaces.from_scene(scene, cells), by_image=False)
    assert plain.cell.tolist() == [0, 1]
    assert plain.image.tolist() == [-1, -1]


def test_a_cell_without_surfaces_has_an_owner_all_the_same(room_row):
    """A room between two others that is nothing but air."""
    scene, cells = room_row(3)
    owner = np.where(cells.triangle_cell == 1, -1, cells.triangle_cell).astype(np.int32)
    options = replace(BY_TEXTURE, backend="embree")
    ach = compute_ach(scene, replace(cells, triangle_cell=owner), all_visible(3), options)
    assert (ach.value > 0).all(), "located in the room that they are seen in"
    bare = Owners.from_surfaces(
        ItemSurfaces.from_scene(scene, replace(cells, triangle_cell=owner)), by_image=True
    )
    assert bare.cell.tolist() == [0, 1, 2]
