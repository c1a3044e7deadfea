"""Simplifies meshes to fewer faces and preserves shape, materials and texture.

The package depends on arrays only: `simplify` takes a `Mesh` and returns a `Simplified`. Sources
and rejected variants: `simplification.simplification`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.simplification.model import (
        Mesh as Mesh,
        Simplified as Simplified,
        SimplifyOptions as SimplifyOptions,
    )
    from ptmtools.simplification.simplification import simplify as simplify

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.simplification.model": "Mesh Simplified SimplifyOptions",
        "ptmtools.simplification.simplification": "simplify",
    },
)
