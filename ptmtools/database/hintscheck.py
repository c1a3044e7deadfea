"""What `hints.json` must satisfy by itself, and beside the cell files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.cellcheck import ReadCell, check_shares
from ptmtools.database.findings import Findings
from ptmtools.database.hints import FORMAT, SCHEMA

#: How far sums of statistics, which are rounded, may be off.
ROUNDED = 1e-3
#: How far the ach values in full precision may sum up beside 1.
ACH_SLACK = 1e-9
#: Missed mass above this is worth a warning.
MISSED = 1e-4

_NUMBER = (int, float)
_LARGEST = float(np.finfo(np.float64).max)
#: Field → type, of the document and of the rows of its lists.
_HEAD: dict[str, Any] = {
    "origin": list,
    "unit": _NUMBER,
    "up": str,
    "closed": bool,
    "avatarSize": list,
    "coverage": dict,
    "viewpoints": list,
    "textures": list,
    "cells": list,
}
_VIEWPOINT: dict[str, Any] = {
    "name": str,
    "description": str,
    "position": list,
    "direction": list,
    "orientation": list,
    "fieldOfView": _NUMBER,
    "cell": int,
}
_TEXTURE: dict[str, Any] = {
    "file": str,
    "fallback": (str, type(None)),
    "width": int,
    "height": int,
    "components": int,
    "sha256": str,
    "levels": list,
}
_LEVEL: dict[str, Any] = dict.fromkeys(("width", "height", "offset", "length", "gpuBytes"), int)
_CELL: dict[str, Any] = {
    "name": str,
    "url": str,
    "leaves": list,
    "textures": list,
    "adjacent": list,
    "visible": list,
    "ach": list,
    "samples": int,
    "rejected": int,
    "missed": _NUMBER,
    "coverage": dict,
    "portals": list,
}
_MAYBE = (*_NUMBER, type(None))
_COVERAGE: dict[str, Any] = {
    "error": list,
    "p95": list,
    "seen": list,
    "views": list,
    "uncertain": _MAYBE,
    "unseenBelow": _NUMBER,
    "floor": _NUMBER,
}
_LEAF: dict[str, Any] = {"points": list, "faces": list}
_PORTAL: dict[str, Any] = {"neighbour": int, "polygon": list, "area": _NUMBER}


@dataclass(frozen=True)
class ReadHints:
    """The parts of `hints.json` that other files are compared with, as JSON has them."""

    viewpoints: list[dict[str, Any]]
    textures: list[dict[str, Any]]
    cells: list[dict[str, Any]]


class _DamageError(Exception):
    """What is wrong with the document."""


def read_hints(data: bytes, file: str, found: Findings) -> ReadHints | None:
    """The hints, or None (told as PTM-D700) if they are not what docs/hints.md says."""
    try:
        document = json.loads(data.decode("utf-8"), parse_constant=_no_constant)
        return _read(document)
    except UnicodeDecodeError as fault:
        found.add("PTM-D700", file, f"byte {fault.start}", "not UTF-8")
    except (_DamageError, ValueError, RecursionError) as fault:
        found.add("PTM-D700", file, "", str(fault))
    return None


def check_hints(hints: ReadHints, file: str, found: Findings) -> None:
    """Checks all that needs no other file."""
    for i, cell in enumerate(hints.cells):
        place = f"cell {i}"
        ach = np.array(cell["ach"], dtype=np.float64)
        check_shares(ach, ACH_SLACK, file, place, ("PTM-D702", "PTM-D702"), found)
        if len(ach) != len(cell["visible"]):
            found.add("PTM-D702", file, place, f"{len(ach)} ach values for {len(cell['visible'])}")
        if cell["missed"] > MISSED:
            share = f"{cell['missed']:.3g} of the pixels"
            found.add("PTM-D703", file, place, f"{share} fell on cells outside the PVS")
        if wrong := _misfit(cell["coverage"], ach, len(hints.textures)):
            found.add("PTM-D707", file, place, wrong)
        to = [portal["neighbour"] for portal in cell["portals"]]
        if sorted(set(to)) != sorted(cell["adjacent"]):
            found.add("PTM-D705", file, place, "the portals lead to other cells than the adjacent")
        for neighbour in sorted(set(to)):
            back = [p["neighbour"] for p in hints.cells[neighbour]["portals"]].count(i)
            if back != to.count(neighbour):
                found.add("PTM-D705", file, place, f"cell {neighbour} has {back} portals back")


def check_against_cells(
    hints: ReadHints,
    cells: Mapping[str, ReadCell],
    textures: Mapping[str, Sequence[str]],
    file: str,
    found: Findings,
) -> None:
    """Compares with the cell files; ``cells`` and their ``textures`` by file in cells/."""
    known = [row["url"].rpartition("/")[2] for row in hints.cells]
    for name in sorted(set(cells) - set(known)):
        found.add("PTM-D701", file, "", f"{name} is missing")
    for i, (name, row) in enumerate(zip(known, hints.cells, strict=True)):
        cell = cells.get(name)
        if cell is None:
            continue
        same: dict[str, bool] = {
            "name": row["name"] == cell.name,
            "adjacent": tuple(known[c] for c in row["adjacent"]) == cell.adjacent,
            "visible": tuple(known[c] for c in row["visible"]) == cell.visible,
            "ach": _equal_single(row["ach"], cell.ach),
            "leaves": _same_box(row["leaves"], cell.hull) and _same_leaves(row["leaves"], cell),
            "textures": sorted(hints.textures[t]["file"] for t in row["textures"])
            == sorted(textures[name]),
        }
        for field in (f for f, equal in same.items() if not equal):
            found.add("PTM-D701", file, f"cell {i}", f"{field} differs from {name}")


def _misfit(coverage: Mapping[str, Any], ach: NDArray[np.float64], known: int) -> str:
    """What is wrong with the statistics of a row of (n,) shares, in a document of ``known``
    textures; empty if nothing is."""
    views = coverage["views"]
    columns = {name: coverage[name] for name in ("error", "p95", "seen")}
    if len(views) != 6:
        return "views are not six"
    columns |= {f"views[{i}]": view for i, view in enumerate(views)}
    for name, values in columns.items():
        if not isinstance(values, list) or len(values) != len(ach):
            return f"{name} is not aligned with ach"
        missing = name != "error" and None in values
        if missing or not all(v is None or (type(v) in _NUMBER and 0 <= v <= 1) for v in values):
            return f"{name} is outside 0 to 1"
    if any(abs(sum(view) - 1) > ROUNDED for view in views):
        return "the shares of a view do not sum to 1"
    # But for a cell that sees nothing, which has 1 for itself.
    if any(seen == 0 < share < 1 for seen, share in zip(coverage["seen"], ach, strict=True)):
        return "what is seen from nowhere has a share"
    return _misfit_textures(coverage["textures"], ach, known) if "textures" in coverage else ""


def _misfit_textures(rows: Any, ach: NDArray[np.float64], known: int) -> str:
    """What is wrong with the shares of textures, of which the document has ``known``."""
    if not isinstance(rows, list) or len(rows) != len(ach):
        return "textures is not aligned with ach"
    for row, share in zip(rows, ach, strict=True):
        if not isinstance(row, list) or not all(_is_share(entry, known) for entry in row):
            return "textures has other entries than pairs of a texture and a share from 0 to 1"
        if abs(sum(part for _, part in row) - share) > ROUNDED:
            return "the shares of textures do not sum to those of their cells"
    return ""


def _is_share(entry: Any, known: int) -> bool:
    """Whether it is ``[texture, share]``, the texture null or one of ``known``."""
    if not isinstance(entry, list) or len(entry) != 2:
        return False
    texture, share = entry
    listed = texture is None or (type(texture) is int and 0 <= texture < known)
    return listed and type(share) in _NUMBER and 0 <= share <= 1


def _no_constant(name: str) -> float:
    raise _DamageError(f"the number {name} is not finite")


def _read(document: Any) -> ReadHints:
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise _DamageError(f"no {FORMAT}")
    if document.get("schema") != SCHEMA:
        raise _DamageError(f"schema {document.get('schema')!r}, known is {SCHEMA}")
    _typed(document, _HEAD, "the document")
    for name in ("viewpoints", "textures", "cells"):
        rows = {"viewpoints": _VIEWPOINT, "textures": _TEXTURE, "cells": _CELL}[name]
        for i, row in enumerate(document[name]):
            _typed(row, rows, f"{name}[{i}]")
    cells, textures = document["cells"], document["textures"]
    for i, texture in enumerate(textures):
        for level in texture["levels"]:
            _typed(level, _LEVEL, f"textures[{i}].levels")
    for i, view in enumerate(document["viewpoints"]):
        _indices([view["cell"]], len(cells), f"viewpoints[{i}].cell")
    for i, cell in enumerate(cells):
        _indices(cell["adjacent"], len(cells), f"cells[{i}].adjacent")
        _indices(cell["visible"], len(cells), f"cells[{i}].visible")
        _indices(cell["textures"], len(textures), f"cells[{i}].textures")
        _numbers([cell["ach"]], None, f"cells[{i}].ach")
        _typed(cell["coverage"], _COVERAGE, f"cells[{i}].coverage")
        for leaf in cell["leaves"]:
            _typed(leaf, _LEAF, f"cells[{i}].leaves")
            _numbers(leaf["points"], 3, f"cells[{i}].leaves.points")
            for loop in leaf["faces"]:
                _indices(loop, len(leaf["points"]), f"cells[{i}].leaves.faces")
        for portal in cell["portals"]:
            _typed(portal, _PORTAL, f"cells[{i}].portals")
            _indices([portal["neighbour"]], len(cells), f"cells[{i}].portals.neighbour")
            _numbers(portal["polygon"], 3, f"cells[{i}].portals.polygon")
            if len(portal["polygon"]) < 3:
                raise _DamageError(f"cells[{i}].portals: a polygon of fewer than 3 points")
    return ReadHints(document["viewpoints"], textures, cells)


def _typed(row: Any, fields: Mapping[str, Any], place: str) -> None:
    if not isinstance(row, dict):
        raise _DamageError(f"{place} is no object")
    for name, kind in fields.items():
        value = row.get(name)
        truth = isinstance(value, bool) and kind is not bool
        if name not in row or not isinstance(value, kind) or truth:
            raise _DamageError(f"{place}: {name} is missing or of another type")


def _indices(values: Any, count: int, place: str) -> None:
    if not isinstance(values, list) or not all(type(v) is int and 0 <= v < count for v in values):
        raise _DamageError(f"{place}: an index is out of range")


def _numbers(rows: Any, width: int | None, place: str) -> None:
    for row in rows:
        whole = isinstance(row, list) and (width is None or len(row) == width)
        if not whole or not all(type(v) in _NUMBER and abs(v) <= _LARGEST for v in row):
            raise _DamageError(f"{place}: not numbers")


def _equal_single(full: Sequence[Any], written: Any) -> bool:
    return np.array_equal(np.array(full, np.float32), np.asarray(written).astype(np.float32))


def _same_box(leaves: Sequence[Mapping[str, Any]], hull: Any) -> bool:
    points = np.array([p for leaf in leaves for p in leaf["points"]], np.float64).reshape(-1, 3)
    if len(points) == 0 or len(hull) == 0:
        return False
    single, other = points.astype(np.float32), np.asarray(hull).astype(np.float32)
    return bool(
        (single.min(axis=0) == other.min(axis=0)).all()
        and (single.max(axis=0) == other.max(axis=0)).all()
    )


def _same_leaves(leaves: Sequence[Mapping[str, Any]], cell: ReadCell) -> bool:
    if len(leaves) != max(len(cell.leaves), 1):
        return False
    pairs = zip(leaves, cell.leaves, strict=False)
    return all(_equal_single(leaf["points"], points) for leaf, points in pairs)
