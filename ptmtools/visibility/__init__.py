"""Cells become potentially visible sets (paper §3).

`compute_pvs` computes them, `check_conservative` tries to catch them missing something.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.visibility.model import Pvs
    from ptmtools.visibility.options import PvsOptions
    from ptmtools.visibility.pvs import compute_pvs
    from ptmtools.visibility.segments import MissedPair, SegmentReport, check_conservative

__all__ = [
    "MissedPair",
    "Pvs",
    "PvsOptions",
    "SegmentReport",
    "check_conservative",
    "compute_pvs",
]

__getattr__ = names(
    __name__,
    {
        "MissedPair": "segments",
        "Pvs": "model",
        "PvsOptions": "options",
        "SegmentReport": "segments",
        "check_conservative": "segments",
        "compute_pvs": "pvs",
    },
)
