"""When the walker is where: he walks each leg at one speed, gaining it and losing it at its ends,
stands where there is something to look at, and turns on the spot before he walks back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints

#: m/s².
ACCELERATION = 1.5
#: Metres ahead on the way towards which he looks, and over which the heading is taken at least.
_AHEAD, _LEAST = 1.2, 0.3
#: What he turns by while he walks, and how fast he turns on the spot, as far as time is planned
#: for; radians, and radians a second.
_WALKING, _TURNING = np.radians(45), np.radians(80)


@dataclass(frozen=True)
class Way:
    """Legs of a way, one after the other.

    Attributes
    ----------
    point: (n, 3) metres.
    along: (n,) metres on the way to each point.
    low, high: (l,) where on it each leg begins and ends.
    """

    point: Floats
    along: Floats
    low: Floats
    high: Floats

    @staticmethod
    def of(legs: Sequence[Floats]) -> Way:
        """Of (n, 3) points of each leg, which begins where the last one ended."""
        point = np.concatenate(legs)
        last = np.cumsum([len(leg) for leg in legs]) - 1
        along = np.cumsum(np.linalg.norm(np.diff(point, axis=0, prepend=point[:1]), axis=1))
        high = along[last]
        return Way(point, along, np.append(0.0, high[:-1]), high)

    def position(self, along: Floats) -> Floats:
        """(n, 3) points at (n,) metres on the way."""
        return np.column_stack([np.interp(along, self.along, axis) for axis in self.point.T])

    def heading(self, along: Floats, leg: Ints) -> Floats:
        """(n, 3) level unit vectors towards what is ahead at (n,) metres on the way, in (n,) legs;
        0 in legs of no length."""
        ahead = np.minimum(along + _AHEAD, self.high[leg])
        behind = np.maximum(np.minimum(along, ahead - _LEAST), self.low[leg])
        towards = self.position(ahead) - self.position(behind)
        towards[:, 1] = 0.0
        length = np.linalg.norm(towards, axis=1, keepdims=True)
        level: Floats = np.divide(towards, length, out=np.zeros_like(towards), where=length > 0)
        return level


@dataclass(frozen=True)
class Motion:
    """A way, with times.

    Attributes
    ----------
    way: its (l,) legs.
    begin, arrive, leave: (l,) seconds: when each leg begins, when it ends, and when the stand at
        its end does.
    looks: for each leg (k, 3) unit vectors to look along at its end.
    until: for each leg (k,) seconds until when each of these is looked at.
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
    def of(legs: Sequence[Floats], looks: Sequence[Floats], stands: Floats, speed: float) -> Motion:
        """Of legs, (n, 3) points each, at the ends of which something is looked along ``looks``,
        (k, 3) each, one after the other, for ``stands`` seconds, an element for each look."""
        way = Way.of(legs)
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

    def at(self, times: Floats) -> tuple[Floats, Ints]:
        """(n,) metres on the way at (n,) times, seconds, and (n,) the leg."""
        leg = np.maximum(np.searchsorted(self.begin, times, "right") - 1, 0)
        since = np.clip(times, None, self.arrive[leg]) - self.begin[leg]
        length = (self.way.high - self.way.low)[leg]
        return self.way.low[leg] + _walked(since, length, self.speed), leg


def _walking_time(length: Floats, speed: float) -> Floats:
    """(n,) seconds that legs of (n,) metres take."""
    ramp = speed**2 / ACCELERATION
    whole = length / speed + speed / ACCELERATION
    return np.where(length >= ramp, whole, 2 * np.sqrt(length / ACCELERATION))


def _walked(since: Floats, length: Floats, speed: float) -> Floats:
    """(n,) metres walked of (n,) metres after (n,) seconds: faster at first, slower at last."""
    time = _walking_time(length, speed)
    top = np.minimum(speed, np.sqrt(length * ACCELERATION))
    gain = top / ACCELERATION
    first = ACCELERATION * np.minimum(since, gain) ** 2 / 2
    steady = top * np.clip(since - gain, 0.0, np.maximum(time - 2 * gain, 0.0))
    left = np.clip(time - since, 0.0, gain)
    last = ACCELERATION * (gain**2 - left**2) / 2
    return np.asarray(np.minimum(first + steady + last, length))


def _angle(one: Floats, other: Floats) -> float:
    return float(np.arccos(np.clip(one @ other, -1.0, 1.0)))
