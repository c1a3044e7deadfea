"""Which triangles may bound a leaf, by the names of their objects and materials."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from ptmtools.arrays import Bools
from ptmtools.cells.options import SubdivideOptions
from ptmtools.scene.model import Scene


def may_occlude(scene: Scene, options: SubdivideOptions) -> Bools:
    """(T,) which triangles are opaque and not called detail by name."""
    detail = named(scene, options.detail) & ~named(scene, options.structural)
    return scene.opaque & ~detail


def named(scene: Scene, patterns: Sequence[str]) -> Bools:
    """(T,) which triangles have an object or a material of such a name."""
    objects = np.array([matches(name, patterns) for name in scene.objects], dtype=bool)
    materials = np.array([matches(m.name, patterns) for m in scene.materials], dtype=bool)
    return np.asarray(objects[scene.triangle_object] | materials[scene.triangle_material])


def matches(name: str, patterns: Sequence[str]) -> bool:
    """Whether one of the patterns, with * and ?, is a name's."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)
