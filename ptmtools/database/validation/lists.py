"""Lists of cells and shares, as the cell files and the hints both have them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.findings import Place


def check_list(name: str, own: Any, entries: Sequence[Any], at: Place) -> None:
    """A list of a cell, of indices or of its files' URLs: ascending, none twice, not the cell
    ``own`` itself. A list of visible cells begins with that."""
    rest = entries
    if name.startswith("visible"):
        if not entries or entries[0] != own:
            at.add("PTM-D690", f"{name} does not begin with {own}")
            return
        rest = entries[1:]
    if own in rest:
        at.add("PTM-D697", f"{name} has {own} itself in it")
    elif list(rest) != _ascending(rest):
        at.add("PTM-D697", f"{name} has an entry twice or out of order")


def _ascending(entries: Sequence[Any]) -> list[Any]:
    ordered = sorted(set(entries))
    if ordered and isinstance(ordered[0], str):
        ordered.sort(key=len)  # "c9999.wrl" comes before "c10000.wrl"
    return ordered


def check_graph(
    adjacent: Mapping[Any, Sequence[Any]],
    visible: Mapping[Any, Sequence[Any]],
    at: Callable[[Any], Place],
) -> None:
    """Both relations are symmetric, and who is adjacent is visible.

    ``at`` gives the place of a cell. Entries that are no cells are passed over.
    """
    touching, seen = (
        {cell: frozenset(row) for cell, row in rows.items()} for rows in (adjacent, visible)
    )
    for cell, row in touching.items():
        if hidden := sorted(row - seen[cell]):
            at(cell).add("PTM-D696", f"{hidden[0]} is adjacent, but not visible")
    for code, rows, what in (
        ("PTM-D694", touching, "names it as adjacent, and not the other way round"),
        ("PTM-D695", seen, "sees it, and not the other way round"),
    ):
        for cell, others in rows.items():
            for other in sorted(others):
                if other in rows and cell not in rows[other]:
                    at(other).add(code, f"{cell} {what}")


def check_shares(ach: NDArray[np.float64], slack: float, codes: tuple[str, str], at: Place) -> None:
    """Values in [0, 1] that sum to 1."""
    if ((ach < 0) | (ach > 1)).any():
        at.add(codes[0], "an ach value is outside 0 to 1")
    total = float(ach.sum())
    if not abs(total - 1) <= slack:
        at.add(codes[1], f"the ach values sum to {total:.9g}")
