"""The knobs of the visibility stage."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from ptmtools.errors import InputError


@dataclass(frozen=True)
class PvsOptions:
    """Settings of `compute_pvs`.

    Attributes
    ----------
    method: full: portal flow, exact up to the budget; fast: planes and the separators of the first
        two portals, looser and conservative too; sampled: what random lines show, not conservative,
        to compare with.
    budget: operations (chain tests, clips) that the search from one side of a portal may take
        before what it has not refuted counts as visible; the result is conservative at any value.
    lines: random lines through each portal, where sampled.
    exact: whether what floating point rejects by a hair is decided again in exact arithmetic;
        otherwise lines of sight thinner than a rounding are not seen.
    """

    method: Literal["full", "fast", "sampled"] = field(default="full", metadata={"option": "pvs"})
    budget: int = field(default=200_000, metadata={"option": "pvs-budget"})
    lines: int = field(default=1000, metadata={"option": "pvs-lines"})
    exact: bool = field(default=True, metadata={"option": "pvs-exact"})

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
                f"method {self.method!r} with {self.lines} lines is no way to compute visibility",
                remedy="give full, fast or sampled, and at least one line",
            )
