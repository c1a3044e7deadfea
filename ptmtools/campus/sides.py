"""Which side of a face with two sides counts: that on which viewers can be.

Outside of a building its walls see the sky, or what sees it; within a closed one nothing does,
however large it is and however narrow the court before it. So walks by random rays begin on both
sides, turned back by what they meet, and that side counts from which more of them come to the sky;
where as many do from either, as of a fence, or as good as none, as within, the lighter one. Faces
of one plane that share an edge are decided together, by points spread over all of them. Where the
two sides are close, more points are asked.

(Tried: the lighter side of each face by itself, by 16 rays from its middle. Rays that end on
something far away count nearly as if they escaped, so a hall of 20 m is lighter within than a court
of 3 m, and a face whose middle lies behind a drainpipe has the other side than the wall around it.)
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.campus.atlas import components
from ptmtools.campus.occlusion import Surroundings, escaping, light, normals, turns
from ptmtools.campus.surface import areas, points_on, spread_over
from ptmtools.tolerance import PARALLEL_COSINE

#: Points of a plane from which walks begin on either side, first, and where that leaves it open;
#: walks of each, and how often one is turned back: from the underside of a sill to the ground, to a
#: wall, to the sky.
_POINTS, _MORE, _WALKS, _BOUNCES = 8, 32, 16, 3
#: Two sides differ where their counts of rays do by so many standard deviations.
_SURE = 3.0
#: At so many faces that share an edge planes are followed through it.
_AT_AN_EDGE = 4


def open_sides(around: Surroundings, corner: Floats, both: Bools, reach: float) -> Floats:
    """(T,) -1 for faces of which the back counts, and 1 for all others.

    ``corner`` is (T, 3, 3); ``both``, (T,), says which have two sides; ``reach`` is as in
    `CampusOptions`.
    """
    normal = normals(corner)
    area = areas(corner)
    wanted = both & (area > 0)
    if not wanted.any():
        return np.ones(len(corner))
    plane = planes(corner, normal, wanted)
    # As seen from the first face of its plane.
    sign = np.where(np.einsum("tx,tx->t", normal, normal[plane]) < 0, -1.0, 1.0)
    front, back = np.zeros(len(corner)), np.zeros(len(corner))

    def look(chosen: Ints, points: int, *, sky: bool) -> None:
        """Set `front` and `back` of planes, by the numbers of their first faces."""
        face = spread_over(area, np.where(wanted, plane, -1), chosen, points).ravel()
        point, turn = (
            points_on(corner[face], np.tile(np.arange(points), len(chosen))),
            turns(len(face)),
        )
        for found, side in ((front, 1.0), (back, -1.0)):
            way = side * sign[face, None] * normal[face]
            rays = around, point, way, turn, _WALKS
            seen = escaping(*rays, _BOUNCES) if sky else light(*rays, reach)
            found[chosen] = seen.reshape(len(chosen), points).sum(axis=1)

    chosen = np.unique(plane[wanted])
    for points, sky in ((_POINTS, True), (_MORE, True), (_MORE, False)):
        look(chosen, points, sky=sky)
        close = np.abs(front - back) <= _SURE * np.sqrt(front + back)
        chosen = chosen[close[chosen]]
    return np.where(wanted, np.where((back > front)[plane], -sign, sign), 1.0)


def planes(corner: Floats, normal: Floats, of: Bools) -> Ints:
    """(T,) for each of (T, 3, 3) faces the first of those that lie in its plane and are connected
    with it by edges; only those ``of`` which it is asked are connected."""
    count = len(corner)
    vertex = np.unique(corner.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
    edge = np.sort(np.stack([vertex, np.roll(vertex, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    order = np.lexsort((edge[:, 1], edge[:, 0]))
    edge, face = edge[order], order // 3
    pairs = [np.zeros((0, 2), np.int64)]
    for step in range(1, _AT_AN_EDGE):
        one, other = face[:-step], face[step:]
        alike = (edge[:-step] == edge[step:]).all(axis=1) & of[one] & of[other]
        alike &= np.abs(np.einsum("nx,nx->n", normal[one], normal[other])) >= PARALLEL_COSINE
        pairs.append(np.stack([one[alike], other[alike]], axis=1))
    joined = np.concatenate(pairs)
    return components(joined[:, [0, 1, 1]], count).astype(np.int64)
