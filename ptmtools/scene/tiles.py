"""Texture coordinates far from the origin, as projected map coordinates are.

Files have them in single precision, which at 1,024 repetitions still tells apart the texels of an
image of 4,096, and at five million has two steps to a repetition. Where a texture repeats, whole
repetitions more or less show the same.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints

#: Repetitions from the origin up to which coordinates stay as they are.
FAR = 1024.0
#: Beyond it single precision has no fractions.
MOST = 2.0**24


def near_origin(uv: Floats, group: Ints, repeats: Bools) -> Floats:
    """(T, 3, 2) finite coordinates, moved near the origin by whole repetitions.

    Parameters
    ----------
    group: (T,) what is moved as one: faces of one group stay as far from each other as they were.
    repeats: (T, 2) whether the texture repeats along each axis, alike in a group. By an even number
        it may be moved even where every other repetition is mirrored.
    """
    if not (uv.max(initial=0.0) > FAR or uv.min(initial=0.0) < -FAR):
        return uv
    far, uv = (np.abs(uv).max(axis=1) > FAR) & repeats, uv.copy()
    order = np.argsort(group, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        for axis in np.flatnonzero(far[rows].any(axis=0)):
            uv[rows, :, axis] -= 2 * np.floor(np.median(uv[rows, :, axis]) / 2)
    return uv
