"""How textures and colours lie on triangles.

Tried: inverting the Gram matrix of two edges. It squares what is lost to rounding on slivers, of
which one model of furniture had gradients that were off by 2e-9, and gives the same levels.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats


def gradients(corners: Floats, uv: Floats) -> Floats:
    """(T, k, 3) how the texture coordinates u and v, or other values of corners, change along the
    plane of each triangle, per metre; 0 for triangles without area.

    Parameters
    ----------
    corners: (T, 3, 3) metres. uv: (T, 3, k).
    """
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    square = np.maximum((normal**2).sum(axis=1), np.finfo(np.float64).tiny)[:, None]
    along_b, along_c = np.cross(ac, normal) / square, np.cross(normal, ab) / square
    b, c = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return np.asarray(b[:, :, None] * along_b[:, None] + c[:, :, None] * along_c[:, None])
