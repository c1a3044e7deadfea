"""Where the walker looks: ahead on his way, now and then to a side, and at pictures before which he
stands. The head follows what is looked at as fast as a neck turns, and no faster."""

from __future__ import annotations

import math

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.walkthrough.path.motion import Motion

#: Radians a second around, and up and down; together less than 110°.
_YAW_RATE, _PITCH_RATE = math.radians(100), math.radians(35)
#: Radians a second squared.
_YAW_GAIN, _PITCH_GAIN = math.radians(400), math.radians(200)
#: Near its aim the head turns by this share of what is left in a second.
_CLOSING = 4.0
#: Seconds before arriving that the first picture is turned to.
_EARLY = 0.6
#: A glance is so far to a side, radians, so long, and the next one so much later, seconds.
_GLANCE, _GLANCING, _PAUSE = math.radians(25), 1.2, (1.5, 4.5)


def directions(motion: Motion, times: Floats, random: np.random.Generator) -> Floats:
    """(n, 3) unit vectors in which the walker looks at (n,) times, seconds, evenly spaced and
    close."""
    aim = _aims(motion, times)
    yaw = np.arctan2(aim[:, 2], aim[:, 0]) + _glances(motion, times, random)
    pitch = np.arcsin(np.clip(aim[:, 1], -1.0, 1.0))
    step = float(times[1] - times[0])
    yaw = _followed(yaw, step, _YAW_RATE, _YAW_GAIN)
    pitch = _followed(pitch, step, _PITCH_RATE, _PITCH_GAIN)
    level = np.cos(pitch)
    return np.column_stack([level * np.cos(yaw), np.sin(pitch), level * np.sin(yaw)])


def _aims(motion: Motion, times: Floats) -> Floats:
    """(n, 3) unit vectors to what is looked at, but for glances."""
    along, leg = motion.at(times)
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
    # Where there is no way, and nothing to look at, he goes on looking as before.
    some = np.flatnonzero(aim.any(axis=1))
    if not len(some):
        return np.tile([1.0, 0.0, 0.0], (len(times), 1))
    return aim[some[np.maximum(np.searchsorted(some, np.arange(len(times)), "right") - 1, 0)]]


def _glances(motion: Motion, times: Floats, random: np.random.Generator) -> Floats:
    """(n,) radians to a side, the one and the other in turn, while he walks."""
    count = int(times[-1] / (_GLANCING + _PAUSE[0])) + 1
    begin = np.cumsum(random.uniform(*_PAUSE, count) + _GLANCING)
    which = np.searchsorted(begin, times, "right") - 1
    glancing = (which >= 0) & (times - begin[which] < _GLANCING)
    _, leg = motion.at(times)
    glancing &= times < motion.arrive[leg] - _EARLY
    return np.where(glancing, np.where(which % 2 == 0, _GLANCE, -_GLANCE), 0.0)


def _followed(aim: Floats, step: float, rate: float, gain: float) -> Floats:
    """(n,) angles that follow (n,) others, a ``step`` of seconds apart, at no more than a ``rate``,
    which grows and shrinks by no more than a ``gain`` a second, all in radians."""
    found = np.empty(len(aim))
    angle, turning = float(aim[0]), 0.0
    for row, wanted in enumerate(aim.tolist()):
        left = math.remainder(wanted - angle, math.tau)
        swift = min(rate, _CLOSING * abs(left), math.sqrt(gain * abs(left)))
        change = math.copysign(swift, left) - turning
        turning += max(-gain * step, min(gain * step, change))
        angle += turning * step
        found[row] = angle
    return found
