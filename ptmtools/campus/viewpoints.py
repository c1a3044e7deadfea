"""Where a visitor is put who wants to see an object: before it, at the height of eyes.

Candidates stand before the four sides of its box and its four corners, as far away as lets the
whole box into the view, nearer where little is seen from there, and on whatever lies below. Of them
that one is taken from which most of the object is seen, past all others; the widest side where
several are alike.
"""

from __future__ import annotations

import math

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.campus.model import Vector
from ptmtools.campus.occlusion import Surroundings

#: Height of eyes, and how near and how far from a box one stands, metres.
EYE, NEAREST, FARTHEST = 1.6, 3.0, 150.0
#: Half of the angle that the box fits into.
_HALF_VIEW = math.radians(25)
#: Shares of the distance that are tried.
_SHARES = (1.0, 0.5, 0.25)
#: How many points of the object are looked at; gains below this share count as none.
_POINTS, _ALIKE = 64, 0.05
#: Who stands higher than this over an object's lowest point, metres, stands on a roof, which costs
#: such a share of what is seen.
_STEP, _ON_TOP = 3.0, 0.5
#: From so far above an object the ground is looked for, in its own heights.
_ABOVE = 2.0


def viewpoint(around: Surroundings, corner: Floats, box: Floats) -> tuple[Vector, Vector]:
    """Position and unit direction of a visitor who looks at an object.

    Parameters
    ----------
    around: the whole scene.
    corner: (T, 3, 3) faces of the object.
    box: (6,) its bounding box.
    """
    low, high = box[:3], box[3:]
    middle, half = (low + high) / 2, (high - low) / 2
    target = _points_of(corner)
    best: tuple[float, Floats] | None = None
    for share in _SHARES:
        for x, z in ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            eye = _candidate(around, low, high, middle, half, np.array([x, z]), share)
            seen = _seen(around, eye, target)
            # Sides before corners, the widest first.
            width = half[2] if x else half[0]
            seen -= _ON_TOP if eye[1] - EYE > low[1] + _STEP else 0.0
            worth = seen + _ALIKE * (width / max(half[0], half[2], 1e-300) if not x * z else 0.5)
            if best is None or worth > best[0] + _ALIKE:
                best = worth, eye
        if best is not None and best[0] > 2 * _ALIKE:
            break
    assert best is not None
    eye = best[1]
    way = middle - eye
    x, y, z = (way / np.linalg.norm(way)).tolist()
    a, b, c = eye.tolist()
    return (a, b, c), (x, y, z)


def _candidate(
    around: Surroundings,
    low: Floats,
    high: Floats,
    middle: Floats,
    half: Floats,
    way: Floats,
    share: float,
) -> Floats:
    """Where one stands before the side or corner of a box that ``way`` leads to."""
    across = half[0] if way[0] == 0 else half[2] if way[1] == 0 else math.hypot(half[0], half[2])
    far = max(across, half[1]) / math.tan(_HALF_VIEW) * share
    far = min(max(far, NEAREST), FARTHEST)
    ground = way * (half[[0, 2]] + far / np.linalg.norm(way))
    x, z = middle[0] + ground[0], middle[2] + ground[1]
    top = high[1] + _ABOVE * max(2 * half[1], EYE)
    floor = min(low[1], around.ground)
    hit = around.below(np.array([x, top, z]), top - floor)
    return np.array([x, (around.ground if hit is None else hit) + EYE, z])


def _points_of(corner: Floats) -> Floats:
    """(n, 3) points spread over a surface by area, a little inside of its faces."""
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(across, axis=1).cumsum()
    if not area[-1] > 0:
        return np.asarray(corner.mean(axis=1)[:_POINTS])
    place = (np.arange(_POINTS) + 0.5) / _POINTS
    face = np.searchsorted(area, place * area[-1]).clip(0, len(corner) - 1)
    along = np.sqrt((place * 0.7548776662466927 * _POINTS) % 1.0)
    aside = (place * 0.5698402909980532 * _POINTS) % 1.0
    share = np.stack([1 - along, along * (1 - aside), along * aside], axis=1)
    return np.asarray(np.einsum("nk,nkx->nx", share, corner[face]))


def _seen(around: Surroundings, eye: Floats, target: Floats) -> float:
    """The share of points that are seen from an eye."""
    return float(np.mean(around.free(np.broadcast_to(eye, target.shape), target)))
