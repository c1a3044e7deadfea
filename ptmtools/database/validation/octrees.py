"""What octree textures must satisfy beside what `hints.json` says of them (docs/format-apo.md)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ptmtools.database.names import HINTS
from ptmtools.errors import InputError
from ptmtools.findings import Place

if TYPE_CHECKING:
    from ptmtools.database.validation.hints import ReadHints
    from ptmtools.database.validation.served import ServedDatabase

#: More than as many texels as there are addresses take, deflated in any way.
_MOST = 1 << 27


def check_octrees(hints: ReadHints, database: ServedDatabase) -> None:
    """Holds each octree texture against its row: it ends with its last level, each level inflates
    by itself to the texels that it should have, and these are an octree."""
    rows = hints.index.get("octrees", ())
    files = database.resolve_each(HINTS, "octrees", [row["file"] for row in rows])
    for i, (row, file) in enumerate(zip(rows, files, strict=True)):
        if wrong := _contradiction(row):
            database.at(HINTS, f"octrees[{i}]").add("PTM-D860", wrong)
        elif file:
            _check(row, database.head(file, row["ends"][-1] + 1), database.at(file))


def _contradiction(row: Mapping[str, Any]) -> str:
    """What is wrong with a row by itself; empty if nothing is."""
    from ptmtools.apo.model import ADDRESS_BITS

    levels, ends = row["levels"], row["ends"]
    if not len(levels) == len(ends) == len(row["crc32"]):
        return "levels, ends and crc32 are not aligned"
    if min(b - a for a, b in zip([0, *ends], ends, strict=False)) <= 0:
        return "ends are not ascending"
    if sum(levels) > 1 << ADDRESS_BITS or ends[-1] > _MOST:
        return f"has {sum(levels):,} texels in {ends[-1]:,} bytes, more than there can be"
    return ""


def _check(row: Mapping[str, Any], data: bytes, at: Place) -> None:
    from ptmtools.apo.model import Octree
    from ptmtools.apo.reading import Stream, inflated
    from ptmtools.apo.texels import fault_of

    start = np.concatenate([[0], np.cumsum(row["levels"], dtype=np.int64)])
    if len(data) != row["ends"][-1]:
        wrong = "ends before" if len(data) < row["ends"][-1] else "goes on behind"
        at.add("PTM-D861", f"{wrong} the last level")
    try:
        texels = inflated(data, start, Stream(row["file"], row["ends"], row["crc32"]))
    except InputError as fault:
        at.add("PTM-D862", fault.message, fault.place or "")
        return
    octree = Octree(texels, start, np.array(row["cube"]["low"]), row["cube"]["side"])
    if wrong_place := fault_of(octree):
        place, wrong = wrong_place
        at.add("PTM-D863", wrong, place)
