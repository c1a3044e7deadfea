"""How far an object is from a viewpoint, approximately (the paper's III, figure 4).

From the barycentre of the object a segment leads to the viewpoint; the distance is from where it
leaves the object's bounding box to the viewpoint, and 0 for a viewpoint in the box. It is never
less than the distance to the box itself, and never more than that to the barycentre.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats


def distances(eye: Floats, boxes: Floats, barycentres: Floats) -> Floats:
    """(…, m) metres from each viewpoint to each object.

    Parameters
    ----------
    eye: (…, 3) viewpoints.
    boxes: (m, 6) least x, y, z, then greatest x, y, z.
    barycentres: (m, 3), each within its box.
    """
    low, high = boxes[:, :3], boxes[:, 3:]
    way = np.asarray(eye, np.float64)[..., None, :] - barycentres
    # The share of the way at which it passes the last side, along each axis; never where it is
    # parallel to them.
    room = np.where(way > 0, high - barycentres, low - barycentres)
    share = np.divide(room, way, out=np.full(way.shape, np.inf), where=way != 0)
    left = np.clip(share, 0.0, 1.0).min(axis=-1)
    return np.asarray((1.0 - left) * np.linalg.norm(way, axis=-1))
