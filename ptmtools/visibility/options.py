"""The options of the visibility stage."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from ptmtools.errors import InputError


@dataclass(frozen=True)
class PvsOptions:
    """Settings of `compute_pvs`.

    Attributes
    ----------
    method: how the potentially visible set (PVS: the cells that may be visible) of each cell is
        found. full: follow every sequence of portals (openings between cells), within the budget;
        fast: look only at the first two portals, which gives larger sets; sampled: try random
        lines, which misses visible cells and is for comparison only.
    budget: how many operations (tests and clips of portals) the search from one side of a portal
        may take. When they are spent, everything still undecided counts as visible, so a lower
        budget makes sets larger, never wrong.
    lines: random lines through each portal, with --pvs sampled.
    exact: deprecated, does nothing: lines of sight too thin for floating point are always decided
        in higher precision.
    """

    method: Literal["full", "fast", "sampled"] = field(default="full", metadata={"option": "pvs"})
    budget: int = field(default=200_000, metadata={"option": "pvs-budget"})
    lines: int = field(default=1000, metadata={"option": "pvs-lines"})
    exact: bool = field(
        default=True,
        compare=False,
        metadata={
            "option": "pvs-exact",
            "deprecated": "lines of sight too thin for floating point are always decided in higher "
            "precision",
        },
    )

    def __post_init__(self) -> None:
        if self.budget < 0:
            raise InputError(
                "PTM-I402",
                f"budget {self.budget} is out of range",
                remedy="give a budget of at least 0",
            )
        if self.method not in ("full", "fast", "sampled") or self.lines < 1:
            raise InputError(
                "PTM-I402",
                f"visibility cannot be computed by method {self.method!r} with {self.lines} lines",
                remedy="choose full, fast or sampled, and at least one line",
            )
