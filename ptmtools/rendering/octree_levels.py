"""What the levels of octree textures add to a picture."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, areas
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.octrees import Octrees

#: Number of points of each object at which the levels of its octree are compared, and the seed of
#: their places.
_POINTS, _SEED = 4096, 1
#: Brightness of the lit surface in the comparison, 0 to 255.
_BRIGHT = 255 * 0.7


def level_differences(surfaces: Surfaces, octrees: Octrees) -> Floats:
    """(O, L) mean difference of each level to the one before, over the object as displayed, 0 to
    255; 0 for the first level, and after the last."""
    from ptmtools.rendering.relief import DEEP, descend

    steps = np.zeros((octrees.number, int(octrees.levels.max(initial=0))))
    random = np.random.default_rng(_SEED)
    for o in range(octrees.number):
        own = np.flatnonzero(octrees.of == o)
        if not len(own):
            continue
        corner = surfaces.corner[own]
        total = np.cumsum(areas(corner))
        which = np.searchsorted(total, random.uniform(0, total[-1], _POINTS), "right")
        weight = random.dirichlet(np.ones(3), _POINTS)
        place = np.einsum("nk,nkj->nj", weight, corner[np.minimum(which, len(own) - 1)])
        light = np.zeros(DEEP)
        for x, y, z in place.tolist():
            count = descend(octrees, o, x, y, z, DEEP, light)
            steps[o, 1:count] += np.abs(np.diff(light[:count]))
    return _BRIGHT * steps / _POINTS
