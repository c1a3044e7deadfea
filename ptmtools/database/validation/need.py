"""How fine textures are needed, as a record says it: whether that can be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

#: How far shares, which are rounded, may sum up above 1.
ROUNDED = 1e-2


def impossible_need(record: Mapping[str, Any], levels: Sequence[int]) -> str:
    """What is wrong with the `need` of a record, "" if nothing is or there is none; ``levels``: how
    many each texture has."""
    rows: Sequence[Sequence[Any]] = record.get("need", ())
    textures = [row[0] for row in rows]
    in_sight = {texture for row in record["textures"] for texture in row}
    if any(one >= other for one, other in pairwise(textures)):
        return "its textures do not ascend"
    for texture, first, *shares in rows:
        if texture not in in_sight:
            return f"texture {texture} is not in sight"
        if first + len(shares) > levels[texture]:
            return f"texture {texture} has only {levels[texture]} levels"
        if any(one < other for one, other in pairwise(shares)):
            return f"the shares of texture {texture} increase"
    if sum(row[2] for row in rows) > 1 + ROUNDED:
        return "the shares of the view sum to more than 1"
    return ""
