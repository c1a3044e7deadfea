"""Simplified meshes: fewer faces for the same shape, materials and texture.

It knows arrays only. `simplify` takes and gives a `Mesh`; what was tried and measured is said in
`simplification`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.simplification.model import (
        Mesh as Mesh,
        Simplified as Simplified,
        SimplifyOptions as SimplifyOptions,
    )
    from ptmtools.simplification.simplification import simplify as simplify

__getattr__ = names(__name__)
