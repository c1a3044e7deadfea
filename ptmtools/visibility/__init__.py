"""Cells become potentially visible sets (paper §3).

`compute_pvs` computes them, `check_conservative` tries to catch them missing something.
"""

from ptmtools.visibility.model import Pvs
from ptmtools.visibility.pvs import PvsOptions, compute_pvs
from ptmtools.visibility.segments import MissedPair, SegmentReport, check_conservative

__all__ = [
    "MissedPair",
    "Pvs",
    "PvsOptions",
    "SegmentReport",
    "check_conservative",
    "compute_pvs",
]
