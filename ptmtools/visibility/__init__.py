"""Cells become potentially visible sets (paper §3).

`compute_pvs` computes them, `check_conservative` tries to catch them missing something.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.visibility.model import Pvs as Pvs
    from ptmtools.visibility.options import PvsOptions as PvsOptions
    from ptmtools.visibility.pvs import compute_pvs as compute_pvs
    from ptmtools.visibility.segments import (
        MissedPair as MissedPair,
        SegmentReport as SegmentReport,
        check_conservative as check_conservative,
    )

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.visibility.model": "Pvs",
        "ptmtools.visibility.options": "PvsOptions",
        "ptmtools.visibility.pvs": "compute_pvs",
        "ptmtools.visibility.segments": "MissedPair SegmentReport check_conservative",
    },
)
