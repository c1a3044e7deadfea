"""The codes of all findings of a validation, and checks that cell files and hints share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import TOO_LARGE, Place, Severity

#: Code → (severity, meaning). docs/formats/codes.md repeats this table.
CODES: dict[str, tuple[Severity, str]] = {
    "PTM-D650": (
        "error",
        "the manifest is missing or damaged, or records options that a stage cannot have",
    ),
    "PTM-D651": ("error", "a file of the database is missing or cannot be read"),
    "PTM-D652": ("error", "the hash of a file differs from the manifest: the file was changed"),
    "PTM-D653": ("warning", "a file in a folder of ptmtools that no stage wrote"),
    "PTM-D655": ("warning", "the database is not finished: the stage `emit` has not run"),
    "PTM-D656": (
        "error",
        "a stage is out of date: its inputs have changed since, or another release ran it",
    ),
    "PTM-D657": ("error", "a link that leads out, a linked folder, a pipe or a device is served"),
    "PTM-D661": ("error", "a VRML file is not in the emission pattern: its text, nodes or numbers"),
    "PTM-D671": ("error", "a URL is malformed, leads out of the served folder or names no file"),
    "PTM-D675": ("warning", "names of served files differ only in case"),
    "PTM-D676": ("error", "a .gz copy is damaged, or differs from the file without .gz"),
    "PTM-D677": ("warning", "a texture or an octree texture that no other file names or uses"),
    "PTM-D683": ("error", "a hull or a leaf is not convex and closed, or lies out of place"),
    "PTM-D690": ("error", "a list of cells is out of order, or contradicts that of another cell"),
    "PTM-D692": ("error", "ach values are outside 0 to 1, do not sum to 1, or are not aligned"),
    "PTM-D699": (
        "error",
        "the manifest, the root file, the cells, the GLBs and the records contradict each other",
    ),
    "PTM-D700": ("error", "the hints do not match their schemas, or contradict each other"),
    "PTM-D703": (
        "warning",
        "pixels fell on cells outside the potentially visible set (PVS): missed mass",
    ),
    "PTM-D704": (
        "error",
        "hints.json and a texture, an octree texture or a first-look bundle disagree",
    ),
    "PTM-D708": ("warning", "a texture is listed in hints.json that no cell uses"),
    "PTM-D710": ("error", "a texture file is damaged, or its fallback or interlaced image differs"),
    "PTM-D713": TOO_LARGE,
    "PTM-D720": ("error", "the arrays of a stage cannot be read, or do not fit other stages"),
    "PTM-D731": ("error", "a GLB is damaged, or not in the emission pattern"),
}

#: Codes of changed files: a build detects these by itself.
SEEN_BY_BUILD = frozenset(f"PTM-D{n}" for n in (651, 652, 655, 656))
#: Codes that no build can repair: foreign files, the memory limit, and properties of the model.
NOT_BUILT = frozenset(f"PTM-D{n}" for n in (653, 657, 675, 703, 708, 713))


def check_list(name: str, own: Any, entries: Sequence[Any], at: Place) -> None:
    """Checks a cell's list of indices or URLs: ascending, no entry twice, without the cell ``own``
    itself. A list of visible cells begins with ``own``."""
    rest = entries
    if name.startswith("visible"):
        if not entries or entries[0] != own:
            at.add("PTM-D690", f"{name} does not begin with {own}")
            return
        rest = entries[1:]
    if own in rest:
        at.add("PTM-D690", f"{name} contains {own} itself")
    elif list(rest) != _ascending(rest):
        at.add("PTM-D690", f"{name} has an entry twice or out of order")


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
    """Checks that both relations are symmetric and adjacent cells visible. ``at`` gives the place
    of a cell; entries that are not cells are ignored."""
    adjacent_of, visible_of = (
        {cell: frozenset(row) for cell, row in rows.items()} for rows in (adjacent, visible)
    )
    for cell, row in adjacent_of.items():
        if hidden := sorted(row - visible_of[cell]):
            at(cell).add("PTM-D690", f"{hidden[0]} is adjacent, but not visible")
    for rows, relation in (
        (adjacent_of, "is adjacent to it, but not the reverse"),
        (visible_of, "sees it, but not the reverse"),
    ):
        for cell, others in rows.items():
            for other in sorted(others):
                if other in rows and cell not in rows[other]:
                    at(other).add("PTM-D690", f"{cell} {relation}")


def check_shares(ach: NDArray[np.float64], slack: float, at: Place) -> None:
    """Checks that values are in [0, 1] and sum to 1 within ``slack``."""
    if ((ach < 0) | (ach > 1)).any():
        at.add("PTM-D692", "an ach value is outside 0 to 1")
    total = float(ach.sum())
    if not abs(total - 1) <= slack:
        at.add("PTM-D692", f"the ach values sum to {total:.9g}")
