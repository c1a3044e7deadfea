"""Clearance from the structure does not depend on the orientation of the model, the division of its
floors, the order of queries, or other objects."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from ptmtools.arrays import Floats
from ptmtools.cells import SubdivideOptions, places
from ptmtools.cells.fabric import Fabric
from ptmtools.cells.floors import Floors
from ptmtools.cells.options import Walker
from ptmtools.cells.places import eye_region, find_places
from ptmtools.cells.structure import Structure
from ptmtools.tolerance import Tolerance
from tests.cells.conftest import box
from tests.conftest import scene_of, subdivided

WALKER = Walker(0.25, 0.5, 1.7)


def turned(faces: Floats, degrees: float) -> Floats:
    """(n, 4, 3) faces turned about the vertical."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return faces @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def furnished(seed: int) -> Floats:
    """(n, 4, 3) faces of a room with boxes and ramps, each turned its own way."""
    rng = np.random.default_rng(seed)
    width, depth = rng.uniform(2, 6, 2)
    faces = [np.array(box((0, 0, 0), (width, 2.8, depth)))]
    for _ in range(rng.integers(2, 9)):
        size = rng.uniform(0.1, 1.5, 3)
        low = np.array([*rng.uniform(0, [width, 2, depth])]) * [1, rng.random() < 0.5, 1]
        solid = np.array(box(tuple(low), tuple(low + size)))
        if rng.random() < 0.3:  # a ramp
            solid[..., 1] += (solid[..., 0] - low[0]) * rng.uniform(0.1, 0.9)
        middle = low + size / 2
        faces.append(turned(solid - middle, rng.uniform(0, 90)) + middle)
    return np.concatenate(faces)


def areas_of(faces: Floats, walker: Walker = WALKER, times: int = 1) -> tuple[float, float]:
    """m² in plan where one can stand, and where eyes can be, each floor by itself."""
    scene = subdivided(scene_of(faces.tolist()), times)
    options = SubdivideOptions(detail_by_shape=False)
    fabric = Fabric.from_scene(scene, options)
    structure = Structure.from_fabric(fabric, scene.tolerance)
    floors = Floors.from_fabric(fabric)
    places = find_places(floors, structure.corners, walker, scene.tolerance)
    eyes = eye_region(places, walker, structure.tolerance)
    return float(shapely.area(places.plan).sum()), float(shapely.area(shapely.union_all(eyes.plan)))


#: Of these GEOS would get some wrong in floating point, if turned.
SEEDS = (4, 107, 184, 193, 266)
#: m²: circles are polygons, whose corners are where they are.
SLACK = 5e-3


@pytest.mark.parametrize("degrees", [12.5, 30.0, 37.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_turning_changes_nothing(seed: int, degrees: float) -> None:
    faces = furnished(seed)
    area, _ = areas_of(faces)
    assert areas_of(turned(faces, degrees))[0] == pytest.approx(area, abs=SLACK)


@pytest.mark.parametrize("radius", [0.25, 1.0])
@pytest.mark.parametrize("seed", [*SEEDS, 127])
def test_floors_that_are_cut_in_two_have_the_same_places(
    seed: int, radius: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    faces, walker = turned(furnished(seed), 37.0), Walker(radius, 0.5, 1.7)
    whole = areas_of(faces, walker)
    monkeypatch.setattr(places, "_CROWD", 3)
    monkeypatch.setattr(places, "CORNERS", 12)
    monkeypatch.setattr(places, "_SHORT", 0.1)
    assert areas_of(faces, walker) == pytest.approx(whole, abs=SLACK)


@pytest.mark.parametrize("times", [1, 3])
@pytest.mark.parametrize("above", [0.45, 1.65])
def test_strips_of_a_ramp_have_the_places_of_the_whole(above: float, times: int) -> None:
    # What is above the next strip may be as high as a body over the slope that goes on beyond.
    def ramp(strips: int) -> Floats:
        x = np.linspace(0, 5, strips + 1)
        y = 0.8 * x + 1e-3 * (np.arange(strips + 1) % 2)
        ends = [np.array([[x, y, 0 * x + z] for z in (-1, 1)]).transpose(2, 0, 1)]
        ends = np.concatenate(ends)
        return np.concatenate([ends[:-1], ends[1:, ::-1]], axis=1)

    beam = [[[2.5, 2 + above + up, z] for up, z in ((0, -1), (0, 1), (0.2, 1), (0.2, -1))]]
    free = 10 - 2 * 0.5
    for strips in (1, 50, 200):
        faces = np.concatenate([ramp(strips), np.array(beam)])
        assert areas_of(faces, times=times)[0] == pytest.approx(free, abs=0.02), strips


def test_walls_are_widened_at_both_ends() -> None:
    # In plan a turned wall is a polygon without width. Of these GEOS would widen one end only.
    floor = np.array([shapely.box(-9, -9, 9, 9)])
    tolerance = Tolerance.for_extent(18.0)
    for seed in (33, 113, 118, 181, 242, 279, 404, 423, 428, 458, 511, 521):
        rng = np.random.default_rng(seed)
        angle, length = rng.uniform(0, 2 * np.pi), rng.uniform(1, 4)
        start, along = rng.uniform(-3, 3, 3), np.array([np.cos(angle), 0, np.sin(angle)])
        corners = start + np.outer([0, length, rng.random() * length], along)
        corners[:, 1] = 0.6, 1.2, 2.5
        level, band = np.zeros((1, 3)), (0.5, 1.7)
        left, _ = places.clear_of(corners[None], floor, level, band, 1.0, tolerance)
        taken = 18**2 - shapely.area(left).sum()
        assert taken == pytest.approx(np.pi + 2 * length, abs=0.1)


@pytest.mark.parametrize("far", [0.0, 500.0, 3000.0])
def test_eyes_are_where_they_are_however_large_the_rest(far: float) -> None:
    # Gravel, each of whose triangles is a floor of its own, in a room; and something else.
    gravel = subdivided(scene_of([[[0, 0, 0], [0, 0, 3], [3, 0, 3], [3, 0, 0]]]), 40).corners
    gravel[..., 1] += 0.004 * np.random.default_rng(1).random(gravel.shape[:2])
    room = np.array(box((0, -0.05, 0), (3, 2.6, 3), "-y +y"))
    other = np.array([[far, 0, far], [far, 0, far + 0.1], [far + 0.1, 0, far]])
    triangles = np.concatenate([gravel, other[None]])[:, [0, 1, 2, 2]]
    place, eyes = areas_of(np.concatenate([room, triangles]))
    assert place == pytest.approx(2.5 * 2.5, abs=0.1)
    assert eyes == pytest.approx(3 * 3, abs=0.35)


def test_slivers_as_wide_as_rounding_have_no_union() -> None:
    shapes = np.array(
        [shapely.box(0, 0, 1e-17, 1), shapely.box(0, 1, 1e-17, 2), shapely.box(0, 0, 1, 1)]
    )
    names, united = places.unite_rows(np.array([7, 7, 9]), shapes, 1e-12)
    assert names.tolist() == [9]
    assert shapely.area(united).tolist() == [1.0]


def test_triangles_whose_shadows_reach_a_floor_are_found() -> None:
    """Against all shadows, one by one; those of neighbours that only come close are discarded."""
    rng = np.random.default_rng(8)
    corners = rng.uniform(-3, 3, (400, 1, 3)) + rng.normal(0, 0.5, (400, 3, 3))
    corners = corners[np.argsort(corners[:, :, 0].min(axis=1))]
    angle = np.linspace(0, 2 * np.pi, 6)[:5] + rng.uniform(0, 1, (40, 1))
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=2) * rng.uniform(0.1, 1, (40, 1, 1))
    plan = shapely.polygons(ring + rng.uniform(-2, 2, (40, 1, 2)))
    slope = rng.uniform(-0.5, 0.5, (40, 3))
    band, reach = (0.2, 1.0), 0.25
    row, near = places._pairs_near(corners, plan, slope, band, reach)
    pairs = set(zip(row.tolist(), near.tolist(), strict=True))
    assert len(pairs) == len(row)
    every, other = np.meshgrid(np.arange(40), np.arange(400), indexing="ij")
    every, other = every.ravel(), other.ravel()
    height = places.heights_above(corners[other], slope[every])
    names, shadow = places.shadows(corners[other][:, :, [0, 2]], height, band, np.arange(16000))
    reached = names[shapely.dwithin(shadow, plan[every[names]], reach)]
    expected = set(zip(every[reached].tolist(), other[reached].tolist(), strict=True))
    assert expected <= pairs
    assert len(expected) <= len(pairs) < 1.2 * len(expected)
