"""The light of a coarse mesh, in the colours of its vertices.

A lightmap belongs to one mesh: on another one its charts would tear. So only the finest mesh of an
object has it, and the others, which are seen from afar and loaded first, carry their light with
them: at each vertex the value with which linear interpolation over the faces is nearest to the
light at many points of them, in the least squares (Kavan, Bargteil and Sloan 2011). A value taken
at the vertex itself would often lie in a corner, and blacken all of its faces. (Not done: an atlas
for each mesh, which is three more files for an object of which a few hundred faces are seen.)
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.campus.lights import Look
from ptmtools.campus.occlusion import hemisphere, turns
from ptmtools.campus.surface import areas
from ptmtools.tolerance import TIE_SHARE

#: Points of a face at which its light is computed.
POINTS = 8
#: Corners in one place share a light where their faces turn by no more than this (a dot product).
SMOOTH = 0.8
#: How much a vertex wants the mean of its own points, beside what fits them best.
_STEADY = 0.01
_ROUNDS = 24


def vertex_light(look: Look, corner: Floats, normal: Floats) -> Floats:
    """(T, 3) light from 0 to 1 at the corners of (T, 3, 3) faces, as ``look`` says it is on them;
    (T, 3) normals say where surfaces turn."""
    count = len(corner)
    share = _inside()
    point = np.einsum("pk,tkx->tpx", share, corner).reshape(-1, 3)
    face = np.repeat(np.arange(count), POINTS)
    seen = look(face, point, turns(len(point))).reshape(count, POINTS)
    vertex = _shared(corner, normal)
    fitted = _fitted(vertex, share, seen, areas(corner))
    return np.clip(fitted[vertex], 0.0, 1.0)


def _inside() -> Floats:
    """(POINTS, 3) barycentric coordinates spread over a triangle."""
    flat = hemisphere(POINTS).astype(np.float64)
    along = np.sqrt((np.arange(POINTS) + 0.5) / POINTS)
    across = np.arctan2(flat[:, 1], flat[:, 0]) / (2 * np.pi) % 1.0
    return np.stack([1 - along, along * (1 - across), along * across], axis=1)


def _shared(corner: Floats, normal: Floats) -> Ints:
    """(T, 3) a number for each corner; those in one place on faces that hardly turn share it."""
    place = np.unique(corner.reshape(-1, 3), axis=0, return_inverse=True)[1].ravel()
    facing = np.repeat(normal, 3, axis=0)
    order = np.argsort(place, kind="stable")
    number = np.empty(len(place), np.int64)
    given = 0
    for these in np.split(order, np.flatnonzero(np.diff(place[order])) + 1):
        first: list[tuple[Floats, int]] = []
        for one in these.tolist():
            known = next((n for way, n in first if way @ facing[one] >= SMOOTH), -1)
            if known < 0:
                known, given = given, given + 1
                first.append((facing[one], known))
            number[one] = known
    return number.reshape(-1, 3)


def _fitted(vertex: Ints, share: Floats, seen: Singles, area: Floats) -> Floats:
    """(V,) values at vertices whose interpolation is nearest to the light ``seen`` at the points of
    each face, by conjugate gradients on the normal equations."""
    count, weight = (
        int(vertex.max()) + 1,
        np.maximum(area, max(area.max() * TIE_SHARE, np.finfo(float).tiny)),
    )
    within = share.T @ share / POINTS

    def gathered(at_corners: Floats) -> Floats:
        return np.asarray(np.bincount(vertex.ravel(), at_corners.ravel(), count), np.float64)

    mass = gathered(np.repeat(weight, 3).reshape(-1, 3) / 3)
    mean = gathered(np.outer(weight * seen.mean(axis=1), np.full(3, 1 / 3))) / mass

    def times(value: Floats) -> Floats:
        return gathered(weight[:, None] * (value[vertex] @ within)) + _STEADY * mass * value

    target = gathered(weight[:, None] * (seen @ share) / POINTS) + _STEADY * mass * mean
    value = mean.copy()
    rest = target - times(value)
    way = rest / mass
    size = float(rest @ way)
    for _ in range(_ROUNDS):
        if size <= 0:
            break
        moved = times(way)
        step = size / float(way @ moved)
        value += step * way
        rest -= step * moved
        ahead = rest / mass
        size, before = float(rest @ ahead), size
        way = ahead + size / before * way
    return value
