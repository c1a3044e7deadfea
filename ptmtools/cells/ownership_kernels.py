"""Compiled descent of whole triangles through a BSP tree (see `ownership`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.compiled import plain_kernel as kernel


@kernel
def sink(
    plane: Floats,
    child: NDArray[np.int32],
    corner: Floats,
    facing: Floats,
    slack: float,
    at: Ints,
    lying: Bools,
) -> None:
    """Lets triangles sink until a plane cuts them.

    Parameters
    ----------
    plane, child: (N, 4), (N, 2), the tree, as `Cells.node_plane` and `Cells.node_child` have it.
    corner, facing: (n, 3, 3) triangles, and (n, 3) the side that each goes to where it lies in a
        plane.
    slack: metres from a plane at which a corner lies in it.
    at: (n,) where each begins, and where it is left: a node that cuts it, or leaf i as -2 - i.
    lying: (n,) set for those that lie in the plane of a node on the way.
    """
    for i in range(len(at)):
        node = at[i]
        while node >= 0:
            a, b, c, d = plane[node, 0], plane[node, 1], plane[node, 2], plane[node, 3]
            ahead = behind = False
            for k in range(3):
                away = corner[i, k, 0] * a + corner[i, k, 1] * b + corner[i, k, 2] * c + d
                ahead |= away > slack
                behind |= away < -slack
            if ahead and behind:
                break
            if not ahead and not behind:
                lying[i] = True
                ahead = facing[i, 0] * a + facing[i, 1] * b + facing[i, 2] * c > 0
            node = child[node, 0 if ahead else 1]
        at[i] = node
