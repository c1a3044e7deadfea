"""Makes a walk through every reachable room of a building.

The walk begins at a viewpoint, as a visitor's does. If eyes may be anywhere and there is no floor,
its places lie in leaves and portals: the ways lead from the middle of each leaf to that of each
portal, as near to the height of eyes as possible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.cells.model import Cells
from ptmtools.errors import InputError
from ptmtools.output.names import HINTS
from ptmtools.output.served import read_index
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.stages import CELLS, SCENE
from ptmtools.scene.model import Scene
from ptmtools.store.layout import SERVED
from ptmtools.walk import DIGITS, Walk
from ptmtools_lab.path.ground import ABOUT, WalkGround, WalkObstacles, over_floors
from ptmtools_lab.path.motion import Motion, Smoother, directions
from ptmtools_lab.path.options import PathOptions
from ptmtools_lab.path.tour import Leg, StopViews, middles_of, tour

Triple = tuple[float, float, float]
#: Cell, position in metres, and unit direction of each viewpoint.
Viewpoints = Sequence[tuple[int, Triple, Triple]]
#: Largest distance of a viewpoint from a place of its cell, metres.
_NEAR = 1.0


def beginning(ground: WalkGround, viewpoints: Viewpoints, seed: int) -> Leg | None:
    """A stand at a viewpoint in its direction: at the first usable one for seed 1, the next for
    seed 2, and so on around; None if there is none."""
    legs = []
    for cell, position, direction in viewpoints:
        away = np.linalg.norm(ground.eye - position, axis=1)
        away[ground.cell != cell] = np.inf
        nearest = int(away.argmin())
        if away[nearest] <= _NEAR:
            legs.append(Leg.at(nearest, direction))
    return legs[(seed - 1) % len(legs)] if legs else None


#: Shares of the way to the height of eyes by which the middle of a leaf or portal is moved.
_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)


def through_portals(cells: Cells, obstacles: WalkObstacles, eye_height: float) -> WalkGround:
    """Places at the eye's height, metres, above the lowest points of leaves, and in portals."""
    leaf = np.array([_in_leaf(cells, i, eye_height) for i in range(cells.leaf_count)])
    portal = np.array([_in_portal(cells, k, leaf) for k in range(cells.portal_count)])
    eye = np.concatenate([leaf.reshape(-1, 3), portal.reshape(-1, 3)])
    number = np.arange(cells.portal_count) + cells.leaf_count
    steps = np.concatenate([np.column_stack([cells.portal_leaf[:, i], number]) for i in (0, 1)])
    steps = steps[~obstacles.blocks(eye[steps[:, 0]], eye[steps[:, 1]])].astype(np.int64)
    cost = np.linalg.norm(eye[steps[:, 0]] - eye[steps[:, 1]], axis=1)
    cell = np.append(cells.leaf_cell, np.full(cells.portal_count, -1)).astype(np.int64)
    return WalkGround.from_steps(eye, cell, np.full(len(eye), ABOUT), steps, cost)


def _in_leaf(cells: Cells, leaf: int, eye_height: float) -> Floats:
    point = cells.leaf_points(leaf)
    middle = point.mean(axis=0)
    rise = np.array([0.0, point[:, 1].min() + eye_height - middle[1], 0.0])
    candidates = middle + np.array(_SHARES)[:, None] * rise
    inside = cells.locate_leaf(candidates) == leaf
    inside[-1] = True
    return np.asarray(candidates[inside.argmax()])


def _in_portal(cells: Cells, portal: int, leaf: Floats) -> Floats:
    """The place in a portal nearest to the height of the places of its two leaves; all points of a
    level portal have the same height."""
    corner = cells.portal(portal)
    middle = corner.mean(axis=0)
    normal = cells.portal_plane[portal, :3]
    rise = leaf[cells.portal_leaf[portal], 1].mean() - middle[1]
    # In the portal's plane, upwards.
    up = np.array([0.0, 1.0, 0.0]) - normal[1] * normal
    side = np.cross(np.roll(corner, -1, axis=0) - corner, normal)
    for share in _SHARES:
        candidate = middle + share * rise * up
        lateral = np.einsum("ij,ij->i", candidate - corner, side)
        if (lateral >= 0).all() or (lateral <= 0).all():
            return np.asarray(candidate)
    return np.asarray(middle)


#: Least steps of the head per second.
_STEPS = 60
#: Range of a stop before a picture, as factors of the average.
_STANDS = (0.7, 1.3)


@dataclass(frozen=True)
class Path:
    """A walk with the rooms that it visits.

    Attributes
    ----------
    walk: the walk.
    rooms: number of cells in which a visitor can stand.
    visited: visited cells among them, ascending.
    unreachable: cells among them without a way at the height of eyes, ascending.
    stops: number of stops before pictures.
    """

    walk: Walk
    rooms: int
    visited: tuple[int, ...]
    unreachable: tuple[int, ...]
    stops: int


def make_path(
    scene: Scene,
    cells: Cells,
    options: PathOptions = PathOptions(),  # noqa: B008 - a frozen value
    viewpoints: Viewpoints = (),
) -> Path:
    """A walk through all rooms of a building, from one of its ``viewpoints``, always to the nearest
    room, with stops before pictures; the same for the same seed.

    Raises InputError: PTM-I111 the height of the eyes is out of range; PTM-I247 the building has no
    walkable place.
    """
    random = np.random.default_rng(options.seed)
    eye_height = options.eye_height(cells.walker)
    obstacles, eyes, standing = WalkObstacles(scene, cells), cells.eyes, cells.standing
    if eyes.everywhere:
        ground = through_portals(cells, obstacles, eye_height)
    else:
        ground = over_floors(cells, obstacles, eye_height)
    ground = ground.main_part(standing)
    middles = middles_of(ground, standing)
    if not middles:
        raise InputError(
            "PTM-I247",
            "there is no way for a walker",
            remedy="build the cells with a smaller --walker, or with --standing anywhere",
        )
    views = StopViews(scene, ground, obstacles, random)
    first = beginning(ground, viewpoints, options.seed)
    if first is None:
        first = Leg.at(int(random.choice([*middles.values()])))
    smoother = Smoother(eyes, obstacles, eye_height, cells.walker.radius)
    legs: list[Floats] = []
    looks: list[Floats] = []
    stands, spent = np.zeros(0), 0.0
    for some in tour(ground, middles, views, first):
        ways, ahead = _smooth_legs(ground.eye, some, smoother), [leg.looks for leg in some]
        stood = options.stop * random.uniform(*_STANDS, sum(map(len, ahead)))
        legs, looks, stands = legs + ways, looks + ahead, np.append(stands, stood)
        # Without turns between rounds.
        took = Motion.from_legs(ways, ahead, stood, options.speed).duration
        spent += took
        # In a single room without pictures the walker stays in place.
        if options.duration is None or spent >= options.duration or not took:
            break
    motion = Motion.from_legs(legs, looks, stands, options.speed)
    duration = motion.duration if options.duration is None else options.duration
    walk = _sample_walk(motion, duration, options, cells, random)
    visited = np.unique(cells.locate(walk.eye))
    visited = visited[visited >= 0]
    return Path(
        walk,
        int(standing.sum()),
        tuple(visited[standing[visited]].tolist()),
        tuple(np.setdiff1d(np.flatnonzero(standing), [*middles]).tolist()),
        int(sum((until <= walk.duration).sum() for until in motion.until)),
    )


def _smooth_legs(eye: Floats, legs: list[Leg], smoother: Smoother) -> list[Floats]:
    """(n, 3) points of each leg."""
    points, fixed = [], []
    for leg in legs:
        # With the middles of steps, for a finer test between two points.
        point = np.repeat(eye[leg.places], 2, axis=0)[:-1]
        point[1::2] = (point[:-1:2] + point[2::2]) / 2
        stays: Bools = np.zeros(len(point), dtype=np.bool_)
        stays[[2 * row for row in leg.passed]] = True
        points.append(point)
        fixed.append(stays)
    count = [len(point) for point in points]
    number = np.repeat(np.arange(len(legs)), count)
    smooth = smoother.smooth(np.concatenate(points), np.concatenate(fixed), number)
    return np.split(smooth, np.cumsum(count)[:-1])


def _sample_walk(
    motion: Motion, duration: float, options: PathOptions, cells: Cells, random: np.random.Generator
) -> Walk:
    """The walk, sampled at the rate of the options."""
    substeps = math.ceil(_STEPS / options.rate)
    last = max(int(duration * options.rate), 1)
    times = np.arange(last * substeps + 1) / (substeps * options.rate)
    direction = directions(motion, times, random)[::substeps]
    along, _ = motion.position(times[::substeps])
    eye = motion.way.position(along)
    # Points between two valid points of the way are nearly always valid; else the nearer one is
    # taken.
    outside = np.flatnonzero(~cells.eyes.contains(eye))
    known = motion.way.along
    after = np.searchsorted(known, along[outside]).clip(1, len(known) - 1)
    nearer = known[after] - along[outside] < along[outside] - known[after - 1]
    eye[outside] = motion.way.point[np.where(nearer, after, after - 1)]
    return Walk(
        times[::substeps].round(DIGITS),
        eye.round(DIGITS) + 0.0,
        direction.round(DIGITS) + 0.0,
        options.field_of_view,
        options.aspect,
    )


def path_through(artifacts: Artifacts, options: PathOptions) -> Path:
    """A walk through the building of a database, from one of its viewpoints if it has any yet.

    Raises what `make_path` and `read_index` do.
    """
    return make_path(artifacts[SCENE], artifacts[CELLS], options, _viewpoints(artifacts))


def _viewpoints(artifacts: Artifacts) -> Viewpoints:
    folder = artifacts.db.path / SERVED
    if not (folder / HINTS).exists():
        return ()
    return [(v["cell"], v["position"], v["direction"]) for v in read_index(folder)["viewpoints"]]
