"""Simplified meshes: fewer faces for the same shape, materials and texture.

It knows arrays only. `simplify` takes and gives a `Mesh`; what was tried and measured is said in
`simplification`.
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
