"""The motion of the walker along a way: position and view direction over time.

`Motion` gives the position: the walker takes each leg at one speed, with acceleration at its ends,
stands before pictures, and turns on the spot before going back.

`directions` gives the view: ahead on the way, now and then to a side, and at pictures during stops.
The head follows its target no faster than a neck turns.

`Smoother` turns a way along a grid into a natural one. Every point moves to the middle between two
others of the way, far ones first, repeatedly, as long as the eye stays in the eye region, nothing
comes between neighbours, and the shoulders touch nothing new. A point that cannot move stays, so
the way is walkable at any moment. The ends of legs, and the points where a room is visited in
passing, are fixed.

Tried and rejected: pulling the way tight like a string. It is shorter, and grazes each corner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.model import EyeRegion
from ptmtools_lab.path.ground import BODY, WalkObstacles

#: m/s².
ACCELERATION = 1.5
#: Metres to the point ahead that the walker looks at, and least metres over which the heading is
#: taken.
_AHEAD, _LEAST = 1.2, 0.3
#: Largest turn while walking, radians, and planned speed of turns on the spot, radians a second.
_WALKING, _TURNING = np.radians(45), np.radians(80)


@dataclass(frozen=True)
class Way:
    """Legs of a way, one after the other.

    Attributes
    ----------
    point: (n, 3) metres.
    along: (n,) metres along the way to each point.
    low, high: (l,) metres along the way at the beginning and end of each leg.
    """

    point: Floats
    along: Floats
    low: Floats
    high: Floats

    @staticmethod
    def from_legs(legs: Sequence[Floats]) -> Way:
        """From (n, 3) points of each leg, which begins where the one before ends."""
        point = np.concatenate(legs)
        last = np.cumsum([len(leg) for leg in legs]) - 1
        along = np.cumsum(np.linalg.norm(np.diff(point, axis=0, prepend=point[:1]), axis=1))
        high = along[last]
        return Way(point, along, np.append(0.0, high[:-1]), high)

    def position(self, along: Floats) -> Floats:
        """(n, 3) points at (n,) metres along the way."""
        return np.column_stack([np.interp(along, self.along, axis) for axis in self.point.T])

    def heading(self, along: Floats, leg: Ints) -> Floats:
        """(n, 3) level unit vectors ahead at (n,) metres along the way, in (n,) legs; 0 in legs of
        no length."""
        ahead = np.minimum(along + _AHEAD, self.high[leg])
        behind = np.maximum(np.minimum(along, ahead - _LEAST), self.low[leg])
        towards = self.position(ahead) - self.position(behind)
        towards[:, 1] = 0.0
        length = np.linalg.norm(towards, axis=1, keepdims=True)
        level: Floats = np.divide(towards, length, out=np.zeros_like(towards), where=length > 0)
        return level


@dataclass(frozen=True)
class Motion:
    """A way with times.

    Attributes
    ----------
    way: its (l,) legs.
    begin, arrive, leave: (l,) times of each leg, seconds: its beginning, its end, and the end of
        the stop after it.
    looks: for each leg (k, 3) unit directions of view at its end.
    until: for each leg (k,) end times of these, seconds.
    speed: m/s.
    """

    way: Way
    begin: Floats
    arrive: Floats
    leave: Floats
    looks: Sequence[Floats]
    until: Sequence[Floats]
    speed: float

    @staticmethod
    def from_legs(
        legs: Sequence[Floats], looks: Sequence[Floats], stands: Floats, speed: float
    ) -> Motion:
        """From legs of (n, 3) points, the (k, 3) directions of view ``looks`` at their ends, one
        after the other, and ``stands``, the seconds of each."""
        way = Way.from_legs(legs)
        low, high = way.low, way.high
        number = np.arange(len(legs))
        out, back = way.heading(low, number), way.heading(high, number)
        moves = high > low
        walked = _walking_time(high - low, speed)
        begin, arrive, leave = (np.zeros(len(legs)) for _ in range(3))
        until, clock, stand = [], 0.0, 0
        facing = out[moves][0] if moves.any() else np.array([1.0, 0.0, 0.0])
        if not moves[0] and len(looks[0]):
            facing = looks[0][0]
        for leg in range(len(legs)):
            begin[leg], arrive[leg] = clock, clock + walked[leg]
            clock = arrive[leg]
            facing = back[leg] if moves[leg] else facing
            ends = []
            for look in looks[leg]:
                clock += float(stands[stand]) + _angle(facing, look) / _TURNING
                stand, facing = stand + 1, look
                ends.append(clock)
            until.append(np.array(ends))
            if leg + 1 < len(legs) and moves[leg + 1]:
                clock += max(0.0, _angle(facing, out[leg + 1]) - _WALKING) / _TURNING
            leave[leg] = clock
        return Motion(way, begin, arrive, leave, looks, until, speed)

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.leave[-1])

    def position(self, times: Floats) -> tuple[Floats, Ints]:
        """(n,) metres along the way at (n,) times, seconds, and (n,) the leg."""
        leg = np.maximum(np.searchsorted(self.begin, times, "right") - 1, 0)
        since = np.clip(times, None, self.arrive[leg]) - self.begin[leg]
        length = (self.way.high - self.way.low)[leg]
        return self.way.low[leg] + _walked_length(since, length, self.speed), leg


def _walking_time(length: Floats, speed: float) -> Floats:
    """(n,) seconds for legs of (n,) metres."""
    ramp = speed**2 / ACCELERATION
    whole = length / speed + speed / ACCELERATION
    return np.where(length >= ramp, whole, 2 * np.sqrt(length / ACCELERATION))


def _walked_length(since: Floats, length: Floats, speed: float) -> Floats:
    """(n,) metres walked of (n,) metres after (n,) seconds: slower at both ends."""
    time = _walking_time(length, speed)
    top = np.minimum(speed, np.sqrt(length * ACCELERATION))
    gain = top / ACCELERATION
    first = ACCELERATION * np.minimum(since, gain) ** 2 / 2
    steady = top * np.clip(since - gain, 0.0, np.maximum(time - 2 * gain, 0.0))
    remaining = np.clip(time - since, 0.0, gain)
    last = ACCELERATION * (gain**2 - remaining**2) / 2
    return np.asarray(np.minimum(first + steady + last, length))


def _angle(a: Floats, b: Floats) -> float:
    return float(np.arccos(np.clip(a @ b, -1.0, 1.0)))


#: Radians a second around, and up and down; together less than 110°.
_YAW_RATE, _PITCH_RATE = math.radians(100), math.radians(35)
#: Radians a second squared.
_YAW_GAIN, _PITCH_GAIN = math.radians(400), math.radians(200)
#: Share of the remaining angle by which the head turns per second near its target.
_CLOSING = 4.0
#: Seconds before arrival at which the head turns to the first picture.
_EARLY = 0.6
#: Angle of a glance to a side, radians, its length, and the range of the pause until the next,
#: seconds.
_GLANCE, _GLANCING, _PAUSE = math.radians(25), 1.2, (1.5, 4.5)


def directions(motion: Motion, times: Floats, random: np.random.Generator) -> Floats:
    """(n, 3) unit directions of view at (n,) times, seconds, evenly spaced and close."""
    aim = _aims(motion, times)
    yaw = np.arctan2(aim[:, 2], aim[:, 0]) + _glances(motion, times, random)
    pitch = np.arcsin(np.clip(aim[:, 1], -1.0, 1.0))
    step = float(times[1] - times[0])
    yaw = _follow(yaw, step, _YAW_RATE, _YAW_GAIN)
    pitch = _follow(pitch, step, _PITCH_RATE, _PITCH_GAIN)
    level = np.cos(pitch)
    return np.column_stack([level * np.cos(yaw), np.sin(pitch), level * np.sin(yaw)])


def _aims(motion: Motion, times: Floats) -> Floats:
    """(n, 3) unit vectors to the targets of view, without glances."""
    along, leg = motion.position(times)
    aim = motion.way.heading(along, leg)
    for number, (looks, until) in enumerate(zip(motion.looks, motion.until, strict=True)):
        arrive, leave = motion.arrive[number], motion.leave[number]
        early = max(arrive - _EARLY, motion.begin[number])
        seen = [*np.append(early, until[:-1])] if len(looks) else []
        for look, begin, end in zip(looks, seen, until, strict=True):
            aim[slice(*np.searchsorted(times, [begin, end]))] = look
        if number + 1 < len(motion.looks):
            done = until[-1] if len(looks) else arrive
            onward = motion.way.heading(motion.way.low[number + 1 :][:1], np.array([number + 1]))
            aim[slice(*np.searchsorted(times, [done, leave]))] = onward
    # Without a way or a picture the direction stays as before.
    some = np.flatnonzero(aim.any(axis=1))
    if not len(some):
        return np.tile([1.0, 0.0, 0.0], (len(times), 1))
    return aim[some[np.maximum(np.searchsorted(some, np.arange(len(times)), "right") - 1, 0)]]


def _glances(motion: Motion, times: Floats, random: np.random.Generator) -> Floats:
    """(n,) radians of glances to alternating sides while walking."""
    count = int(times[-1] / (_GLANCING + _PAUSE[0])) + 1
    begin = np.cumsum(random.uniform(*_PAUSE, count) + _GLANCING)
    which = np.searchsorted(begin, times, "right") - 1
    glancing = (which >= 0) & (times - begin[which] < _GLANCING)
    _, leg = motion.position(times)
    glancing &= times < motion.arrive[leg] - _EARLY
    return np.where(glancing, np.where(which % 2 == 0, _GLANCE, -_GLANCE), 0.0)


def _follow(aim: Floats, step: float, rate: float, gain: float) -> Floats:
    """(n,) angles that follow (n,) targets, ``step`` seconds apart, at most at a ``rate`` that
    changes by at most ``gain`` a second, all in radians."""
    result = np.empty(len(aim))
    angle, turning = float(aim[0]), 0.0
    for row, wanted in enumerate(aim.tolist()):
        remaining = math.remainder(wanted - angle, math.tau)
        swift = min(rate, _CLOSING * abs(remaining), math.sqrt(gain * abs(remaining)))
        change = math.copysign(swift, remaining) - turning
        turning += max(-gain * step, min(gain * step, change))
        angle += turning * step
        result[row] = angle
    return result


#: Distances, in points along the way, to the two points between which a point moves.
_REACHES = (4, 2, 4, 2, 3, 1, 2, 1)


class Smoother:
    """Smooths ways of eyes at one height above the floor, metres, with a body of one radius."""

    def __init__(
        self, eyes: EyeRegion, obstacles: WalkObstacles, eye_height: float, radius: float
    ) -> None:
        self._eyes, self._obstacles, self._radius = eyes, obstacles, radius
        self._below = [np.array([0, (1 - height) * eye_height, 0]) for height in BODY]

    def smooth(self, point: Floats, fixed: Bools, leg: Ints) -> Floats:
        """(n, 3) smoothed points. Those of (n,) ``fixed`` stay, and no point depends on others
        beyond the ends of its (n,) ``leg``, ascending."""
        begin, end = np.searchsorted(leg, leg), np.searchsorted(leg, leg, "right") - 1
        row = np.arange(len(point))
        hits, parted = self._body_hits(point), self._gaps(point)
        for reach in _REACHES:
            step = np.minimum(reach, np.minimum(row - begin, end - row))
            target = (point[row - step] + point[row + step]) / 2
            moves = ~fixed & (step > 0)
            while moves.any():
                candidate = np.where(moves[:, None], target, point)
                hit, apart = self._body_hits(candidate), self._gaps(candidate)
                bad = (moves & ~self._eyes.contains(candidate)) | (apart & ~parted)
                bad |= (hit & ~hits).any(axis=1)
                if not bad.any():
                    point, hits, parted = candidate, hit, apart
                    break
                # A point that stays never becomes invalid, so the cause is a near one that moves.
                moves &= np.convolve(bad, np.ones(2 * reach + 1))[reach:-reach] == 0
        return point

    def _gaps(self, point: Floats) -> Bools:
        """(n,) whether an eye cannot go from a point to the next one."""
        following = np.append(point[1:], point[-1:], axis=0)
        outside = ~self._eyes.contains((point + following) / 2)
        return outside | self._obstacles.blocks(point, following)

    def _body_hits(self, point: Floats) -> Bools:
        """(n, 2·heights) contacts of the body at each point: by height from shoulder to shoulder,
        and from the point to the next."""
        ahead = np.diff(point, axis=0, append=point[-1:])
        length = np.hypot(ahead[:, 0], ahead[:, 2])
        side = np.zeros_like(point)
        side[:, 0], side[:, 2] = -ahead[:, 2], ahead[:, 0]
        side *= np.divide(self._radius, length, out=np.zeros(len(point)), where=length > 0)[:, None]
        crossings = []
        for below in self._below:
            crossings.append(self._obstacles.blocks(point - below - side, point - below + side))
            crossings.append(self._obstacles.blocks(point - below, point - below + ahead))
        return np.stack(crossings, axis=1)
