"""A small statue, made light and thrown away: compiles what octree textures and the simplification
of plain and of painted meshes need.
"""

from __future__ import annotations

import numpy as np

from ptmtools.simplification import Mesh, SimplifyOptions, simplify

#: Fields along each side of the square that is simplified.
_SIDE = 12


def warm_up() -> None:
    """Calls every kernel once."""
    from ptmtools.neighbours.apo.making import make_apo
    from ptmtools.neighbours.apo.model import ApoOptions
    from ptmtools.neighbours.apo.traversal import look_up
    from ptmtools.parallel import Executor
    from ptmtools.scene.model import Material, Scene
    from ptmtools.scene.orientation import tolerance_of

    points, triangles, uv = _waves()
    count = len(triangles)
    none = np.zeros(count, np.int32)
    scene = Scene(
        points,
        triangles,
        uv,
        none,
        none,
        np.ones(count, bool),
        ("waves",),
        (Material("stone"),),
        tolerance_of(points, triangles),
    )
    made = make_apo(scene, ApoOptions(faces=count // 4, depth=3), Executor())
    look_up(made.octree, np.full((1, 3), 0.5))
    simplify(Mesh(points, triangles, none, uv), SimplifyOptions(count // 4))


def _waves() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, triangles and texture coordinates of a square with waves, seen from above."""
    lines = np.arange(_SIDE + 1) / _SIDE
    x, z = np.meshgrid(lines, lines, indexing="ij")
    y = np.sin(9 * x) * np.sin(9 * z) / 9
    a = (np.arange(_SIDE)[:, None] * (_SIDE + 1) + np.arange(_SIDE)).ravel()
    b, c, d = a + 1, a + _SIDE + 2, a + _SIDE + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return points, triangles, points[triangles][:, :, [0, 2]]
