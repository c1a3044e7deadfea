"""Lists of cells and shares, as the cell files and the hints both have them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.validation.findings import Findings


def check_list(
    name: str, own: Any, entries: Sequence[Any], file: str, place: str, found: Findings
) -> None:
    """A list of a cell, of indices or of its files' URLs: ascending, none twice, not the cell
    ``own`` itself. A list of visible cells begins with that."""
    rest = entries
    if name.startswith("visible"):
        if not entries or entries[0] != own:
            found.add("PTM-D690", file, place, f"{name} does not begin with {own}")
            return
        rest = entries[1:]
    if own in rest:
        found.add("PTM-D697", file, place, f"{name} has {own} itself in it")
    elif list(rest) != _ascending(rest):
        found.add("PTM-D697", file, place, f"{name} has an entry twice or out of order")


def _ascending(entries: Sequence[Any]) -> list[Any]:
    ordered = sorted(set(entries))
    if ordered and isinstance(ordered[0], str):
        ordered.sort(key=len)  # "c9999.wrl" comes before "c10000.wrl"
    return ordered


def check_graph(
    adjacent: Mapping[Any, Sequence[Any]],
    visible: Mapping[Any, Sequence[Any]],
    whose: Callable[[Any], tuple[str, str]],
    found: Findings,
) -> None:
    """Both relations are symmetric, and who is adjacent is visible.

    ``whose`` gives file and place of a cell. Entries that are no cells are passed over.
    """
    seen = {cell: frozenset(row) for cell, row in visible.items()}
    for cell, row in adjacent.items():
        if hidden := sorted(set(row) - seen[cell]):
            found.add("PTM-D696", *whose(cell), f"{hidden[0]} is adjacent, but not visible")
    touching = {cell: frozenset(row) for cell, row in adjacent.items()}
    for code, rows, what in (
        ("PTM-D694", touching, "names it as adjacent, and not the other way round"),
        ("PTM-D695", seen, "sees it, and not the other way round"),
    ):
        for cell, others in rows.items():
            for other in sorted(others):
                if other in rows and cell not in rows[other]:
                    found.add(code, *whose(other), f"{cell} {what}")


def check_shares(
    ach: NDArray[np.float64],
    slack: float,
    file: str,
    place: str,
    codes: tuple[str, str],
    found: Findings,
) -> None:
    """Values in [0, 1] that sum to 1."""
    if ((ach < 0) | (ach > 1)).any():
        found.add(codes[0], file, place, "an ach value is outside 0 to 1")
    total = float(ach.sum())
    if not abs(total - 1) <= slack:
        found.add(codes[1], file, place, f"the ach values sum to {total:.9g}")
