"""A walk through every room of a building that can be walked to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.cells.model import Cells
from ptmtools.errors import InputError
from ptmtools.scene.model import Scene
from ptmtools.walkthrough.path.beginning import Viewpoints, beginning
from ptmtools.walkthrough.path.footing import over_floors
from ptmtools.walkthrough.path.gaze import directions
from ptmtools.walkthrough.path.motion import Motion
from ptmtools.walkthrough.path.obstacles import Obstacles
from ptmtools.walkthrough.path.options import PathOptions
from ptmtools.walkthrough.path.portals import through_portals
from ptmtools.walkthrough.path.smoothing import Smoother
from ptmtools.walkthrough.path.tour import Leg, middles_of, tour
from ptmtools.walkthrough.path.views import Views
from ptmtools.walkthrough.walk import DIGITS, Walk

#: The head is moved at least so often, in steps a second.
_STEPS = 60
#: He stands before a picture for so many times the average.
_STANDS = (0.7, 1.3)


@dataclass(frozen=True)
class Path:
    """A walk, and what it visits.

    Attributes
    ----------
    walk: the walk.
    rooms: cells in which one can stand.
    visited: those of them that an eye of the walk is in, ascending.
    unreachable: those of them that no way leads to at the height of eyes, ascending.
    stops: how often he stands and looks.
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
    """A walk through all rooms of a building, from one of its ``viewpoints`` on, nearest next, with
    stops before pictures; the same for the same seed.

    Raises InputError: PTM-I810 eyes cannot be as high as asked for; PTM-I811 nobody can walk there.
    """
    random = np.random.default_rng(options.seed)
    eye_height = options.eye_height(cells.walker)
    obstacles, eyes, standing = Obstacles(scene, cells), cells.eyes, cells.standing
    if eyes.everywhere:
        ground = through_portals(cells, obstacles, eye_height)
    else:
        ground = over_floors(cells, obstacles, eye_height)
    ground = ground.main_part(standing)
    middles = middles_of(ground, standing)
    if not middles:
        raise InputError(
            "PTM-I811",
            "there is no way for a walker",
            remedy="build the cells with a smaller --walker, or with --standing anywhere",
        )
    views = Views(scene, ground, obstacles, random)
    first = beginning(ground, viewpoints, options.seed)
    if first is None:
        first = Leg.at(int(random.choice([*middles.values()])))
    smoother = Smoother(eyes, obstacles, eye_height, cells.walker.radius)
    legs: list[Floats] = []
    looks: list[Floats] = []
    stands, spent = np.zeros(0), 0.0
    for some in tour(ground, middles, views, first):
        ways, ahead = _smoothed(ground.eye, some, smoother), [leg.looks for leg in some]
        stood = options.stop * random.uniform(*_STANDS, sum(map(len, ahead)))
        legs, looks, stands = legs + ways, looks + ahead, np.append(stands, stood)
        took = Motion.of(ways, ahead, stood, options.speed).duration  # but for turns between rounds
        spent += took
        # In a single room without pictures he stands where he is.
        if options.duration is None or spent >= options.duration or not took:
            break
    motion = Motion.of(legs, looks, stands, options.speed)
    duration = motion.duration if options.duration is None else options.duration
    walk = _sampled(motion, duration, options, cells, random)
    visited = np.unique(cells.locate(walk.eye))
    visited = visited[visited >= 0]
    return Path(
        walk,
        int(standing.sum()),
        tuple(visited[standing[visited]].tolist()),
        tuple(np.setdiff1d(np.flatnonzero(standing), [*middles]).tolist()),
        int(sum((until <= walk.duration).sum() for until in motion.until)),
    )


def _smoothed(eye: Floats, legs: list[Leg], smoother: Smoother) -> list[Floats]:
    """(n, 3) points of each leg."""
    points, fixed = [], []
    for leg in legs:
        # With the middles of steps, so that what is between two points is looked at closely.
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


def _sampled(
    motion: Motion, duration: float, options: PathOptions, cells: Cells, random: np.random.Generator
) -> Walk:
    """The walk, at the rate asked for."""
    each = math.ceil(_STEPS / options.rate)
    last = max(int(duration * options.rate), 1)
    times = np.arange(last * each + 1) / (each * options.rate)
    direction = directions(motion, times, random)[::each]
    along, _ = motion.at(times[::each])
    eye = motion.way.position(along)
    # Between two points of the way that eyes can be at, they nearly always can be; else at one.
    outside = np.flatnonzero(~cells.eyes.contains(eye))
    known = motion.way.along
    after = np.searchsorted(known, along[outside]).clip(1, len(known) - 1)
    nearer = known[after] - along[outside] < along[outside] - known[after - 1]
    eye[outside] = motion.way.point[np.where(nearer, after, after - 1)]
    return Walk(
        times[::each].round(DIGITS),
        eye.round(DIGITS) + 0.0,
        direction.round(DIGITS) + 0.0,
        options.field_of_view,
        options.aspect,
    )
