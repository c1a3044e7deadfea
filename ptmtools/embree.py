"""Builds Embree's trees of triangles, for rays.

Embree stores single-precision coordinates, so callers centre and scale large scenes first.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Singles


def ray_tree(points: Floats | Singles, triangles: NDArray[np.int32] | None = None) -> Any:
    """Embree's scene of triangles, in its robust mode, which misses no edge.

    points: (T, 3, 3) corners; with ``triangles`` (T, 3), (V, 3) vertices.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    tree = EmbreeScene(robust=True)
    singles = np.ascontiguousarray(points, dtype=np.float32)
    TriangleMesh(tree, singles, *(() if triangles is None else (triangles,)))
    return tree
