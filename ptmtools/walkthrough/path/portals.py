"""Places in leaves and portals, where eyes may be anywhere and there is no floor to go by: from the
middle of each leaf to that of each portal, as near to the height of eyes as they go."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.cells.model import Cells
from ptmtools.walkthrough.path.footing import ABOUT
from ptmtools.walkthrough.path.ground import Ground
from ptmtools.walkthrough.path.obstacles import Obstacles

#: The middle of a leaf or portal is moved by such shares of the way to the height of eyes.
_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)


def through_portals(cells: Cells, obstacles: Obstacles, eye_height: float) -> Ground:
    """Places an eye's height, metres, above the lowest points of leaves, and in portals."""
    leaf = np.array([_in_leaf(cells, i, eye_height) for i in range(cells.leaf_count)])
    portal = np.array([_in_portal(cells, k, leaf) for k in range(cells.portal_count)])
    eye = np.concatenate([leaf.reshape(-1, 3), portal.reshape(-1, 3)])
    number = np.arange(cells.portal_count) + cells.leaf_count
    steps = np.concatenate([np.column_stack([cells.portal_leaf[:, i], number]) for i in (0, 1)])
    steps = steps[~obstacles.crossed(eye[steps[:, 0]], eye[steps[:, 1]])].astype(np.int64)
    cost = np.linalg.norm(eye[steps[:, 0]] - eye[steps[:, 1]], axis=1)
    cell = np.append(cells.leaf_cell, np.full(cells.portal_count, -1)).astype(np.int64)
    return Ground.of(eye, cell, np.full(len(eye), ABOUT), steps, cost)


def _in_leaf(cells: Cells, leaf: int, eye_height: float) -> Floats:
    point = cells.leaf_points(leaf)
    middle = point.mean(axis=0)
    rise = np.array([0.0, point[:, 1].min() + eye_height - middle[1], 0.0])
    tried = middle + np.array(_SHARES)[:, None] * rise
    inside = cells.locate_leaf(tried) == leaf
    inside[-1] = True
    return np.asarray(tried[inside.argmax()])


def _in_portal(cells: Cells, portal: int, leaf: Floats) -> Floats:
    """As near to the height of its two leaves' places as a portal goes; one that is level has all
    of its points at one height."""
    corner = cells.portal(portal)
    middle = corner.mean(axis=0)
    normal = cells.portal_plane[portal, :3]
    rise = leaf[cells.portal_leaf[portal], 1].mean() - middle[1]
    # In the portal's plane, upwards.
    up = np.array([0.0, 1.0, 0.0]) - normal[1] * normal
    side = np.cross(np.roll(corner, -1, axis=0) - corner, normal)
    for share in _SHARES:
        tried = middle + share * rise * up
        beside = np.einsum("ij,ij->i", tried - corner, side)
        if (beside >= 0).all() or (beside <= 0).all():
            return np.asarray(tried)
    return np.asarray(middle)
