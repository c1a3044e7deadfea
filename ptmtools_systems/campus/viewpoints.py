"""The viewpoint of an object: on the ground, at the height of eyes.

Candidates stand around its box, as far away as lets the whole box into the view, nearer and
farther. Those count that stand under the open sky: the highest surface there is the lowest one,
within a step. The one that sees most of the object is taken, or the first of several alike, before
the widest side. An object that is visible from none of them, because it stands in a building, is
seen from beside it, on whatever floor there is.
"""

from __future__ import annotations

import math

import numpy as np

from ptmtools.arrays import Floats, areas
from ptmtools.light.occlusion import Occluders, points_on, spread_over
from ptmtools_systems.campus.model import Vector

#: Height of eyes, and least and greatest distance from a box, metres.
EYE, NEAREST, FARTHEST = 1.6, 3.0, 150.0
#: Half of the angle of view that the box fits into, radians.
_HALF_VIEW = math.radians(25)
#: Candidates: shares of the distance, and number of directions around the box.
_SHARES, _WAYS = (1.0, 0.7, 0.5, 0.25, 1.5), 24
#: Number of points of the object that are tested; smaller gains than this share count as none.
_POINTS, _ALIKE = 64, 0.05
#: Places no higher than this above the lowest surface, metres, are on the ground.
STEP = 0.6


def viewpoint(around: Occluders, corner: Floats, box: Floats) -> tuple[Vector, Vector]:
    """Position and unit direction of a view of an object.

    Parameters
    ----------
    around: the whole scene.
    corner: (T, 3, 3) faces of the object.
    box: (6,) its bounding box.
    """
    low, high = box[:3], box[3:]
    middle = (low + high) / 2
    target = _points_of(corner)
    place = _candidates(low, high)
    top, ground = _heights(around, place)
    outside = np.column_stack([place[:, 0], top + EYE, place[:, 1]])
    seen = np.where(top <= ground + STEP, _visible_share(around, outside, target), 0.0)
    eyes = outside
    if not seen.max() > _ALIKE:
        # On a floor, beside the foot of the object first.
        head = np.column_stack([place[:, 0], np.full(len(place), low[1] + EYE), place[:, 1]])
        floor = around.upright(head, EYE + STEP, -1.0)
        floor = np.where(floor > head[:, 1] - EYE - STEP, floor, low[1])
        within = np.column_stack([place[:, 0], floor + EYE, place[:, 1]])
        eyes = np.concatenate([outside, within])
        seen = np.concatenate([seen, _visible_share(around, within, target)])
        if not seen.any():
            # Hidden: anywhere on the ground.
            seen = np.concatenate([(top <= ground + STEP) * 1.0, np.zeros(len(within))])
    eye = eyes[int(np.flatnonzero(seen > seen.max() - _ALIKE)[0])]
    way = middle - eye
    x, y, z = (way / np.linalg.norm(way)).tolist()
    a, b, c = eye.tolist()
    return (a, b, c), (x, y, z)


def _candidates(low: Floats, high: Floats) -> Floats:
    """(n, 2) x and z around a box, first at the distance that shows all of it, before the middle of
    its widest side."""
    half, middle = (high - low)[[0, 2]] / 2, (low + high)[[0, 2]] / 2
    turn = 2 * math.pi * np.arange(_WAYS) / _WAYS
    # Alternately to both sides of the first one.
    turn = turn[np.argsort(np.minimum(np.arange(_WAYS), _WAYS - np.arange(_WAYS)), kind="stable")]
    way = np.stack([np.sin(turn), np.cos(turn)], axis=1)
    if half[1] > half[0]:
        way = way[:, ::-1]
    # The distance to the edge of the box, and half of its apparent width.
    with np.errstate(divide="ignore"):
        edge = (half / np.abs(way)).min(axis=1)
    across = np.abs(way[:, ::-1]) @ half
    distance = np.maximum(across, (high[1] - low[1]) / 2) / math.tan(_HALF_VIEW)
    away = np.clip(np.outer(_SHARES, distance), NEAREST, FARTHEST)
    return np.asarray((middle + (edge + away)[..., None] * way).reshape(-1, 2))


def _heights(around: Occluders, place: Floats) -> tuple[Floats, Floats]:
    """(n,) heights of the highest and of the lowest surface at (n, 2) places; the ground of the
    scene where there is none."""
    least, highest = around.points[:, 1].min(), around.points[:, 1].max()
    height = highest - least + EYE
    at = np.column_stack([place[:, 0], np.full(len(place), highest + EYE), place[:, 1]])
    top = around.upright(at, 2 * height, -1.0)
    under = at.copy()
    under[:, 1] = least - EYE
    return top, around.upright(under, 2 * height, 1.0)


def _points_of(corner: Floats) -> Floats:
    """(n, 3) points spread over a surface by area."""
    area = areas(corner)
    if not area.sum() > 0:
        return np.asarray(corner.mean(axis=1)[:_POINTS])
    face = spread_over(area, np.zeros(len(area), np.int64), np.zeros(1, np.int64), _POINTS)[0]
    return points_on(corner[face], np.arange(1, _POINTS + 1))


def _visible_share(around: Occluders, eyes: Floats, target: Floats) -> Floats:
    """(n,) the share of points that is visible from each of (n, 3) eyes."""
    origin, end = np.repeat(eyes, len(target), axis=0), np.tile(target, (len(eyes), 1))
    return np.asarray(around.free(origin, end).reshape(len(eyes), -1).mean(axis=1))
