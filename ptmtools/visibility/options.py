"""Options of the visibility stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from ptmtools.options import option, require


@dataclass(frozen=True)
class PvsOptions:
    """Options of `compute_pvs`. Raises InputError PTM-I111 for values out of range."""

    heading: ClassVar[str] = "Visibility"

    method: Literal["full", "fast", "sampled"] = option(
        "full",
        "Method that finds the potentially visible set (PVS) of each cell: full follows every "
        "sequence of portals within the budget; fast tests only the first two portals, which "
        "gives larger sets; sampled shoots random lines and misses visible cells, so it is only "
        "for comparison.",
        name="pvs",
    )
    budget: int = option(
        200_000,
        "Maximum number of operations (tests and clips of portals) in the search from one side of "
        "a portal. Beyond it, undecided cells count as visible: sets become larger, never wrong.",
        name="pvs-budget",
    )
    gain: float = option(
        0.01,
        "With --pvs full, leave the searches out where they could reduce what visitors hold by at "
        "most this share, as random lines show; 0 always searches.",
        name="pvs-gain",
        metavar="SHARE",
    )
    lines: int = option(
        1000, "Number of random lines through each portal, with --pvs sampled.", name="pvs-lines"
    )

    def __post_init__(self) -> None:
        method, lines = self.method, self.lines
        require(
            (
                self.budget >= 0,
                f"budget {self.budget} is out of range",
                "use a budget of at least 0",
            ),
            (
                0 <= self.gain < 1,
                f"--pvs-gain {self.gain:g} is out of range",
                "use a share of at least 0, below 1",
            ),
            (
                method in ("full", "fast", "sampled") and lines >= 1,
                f"visibility cannot be computed by method {method!r} with {lines} lines",
                "choose full, fast or sampled, and at least one line",
            ),
        )
