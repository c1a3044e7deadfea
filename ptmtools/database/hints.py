"""`hints.json`: cells, visibility, coverage and texture sizes for clients that read no VRML.

docs/hints.md describes it field by field. Numbers are written in full precision; one cell a line,
so that a difference between two databases can be read. Python's own json writes 21 MB/s: with the
ten numbers of each pair of cells 5 µs a pair, a thousandth of what their coverage took.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.database.model import TextureRecord, Viewpoint
from ptmtools.database.names import cell_name
from ptmtools.errors import DatabaseError

if TYPE_CHECKING:
    from ptmtools.database.content import Content
    from ptmtools.texture.model import Level

FORMAT = "ptmtools hints"
SCHEMA = 1
#: The statistics of the coverage, rounded to so many significant digits.
STATISTICS = ("error", "p95", "seen", "views", "uncertain", "unseen_below", "floor") + (
    "texture_value",
)
DIGITS = 5


def hints_text(content: Content, cell_url: Callable[[int], str], up: str) -> str:
    """The contents of `hints.json`: ``cell_url`` and ``up``, the way to the served folder, as seen
    from where it lies.

    Raises DatabaseError: PTM-D601 a number is not finite.
    """
    space, cells, pvs, ach = content.scene.space, content.cells, content.pvs, content.ach
    place = {image: i for image, (i, _) in content.records.items()}
    adjacent, painted = cells.adjacent(), content.painted
    statistics: Any = {name: _rounded(getattr(ach, name)) for name in STATISTICS}
    rounded = replace(ach, **statistics)
    portals = _portals(cells)
    head = {
        "format": FORMAT,
        "schema": SCHEMA,
        "origin": list(space.origin),
        "unit": space.metres,
        "up": space.up,
        "closed": cells.closed,
        "avatarSize": list(content.options.avatar_size),
        "coverage": {"backend": ach.backend, "renderer": ach.renderer},
    }
    rows = [
        {
            "name": cell_name(c),
            "url": cell_url(c),
            "leaves": [_leaf(cells, leaf) for leaf in content.leaves[c]],
            "textures": painted[c].tolist(),
            "adjacent": adjacent[c].tolist(),
            "visible": pvs.row(c).tolist(),
            "ach": ach.row(c).tolist(),
            "samples": int(ach.samples[c]),
            "rejected": int(ach.rejected[c]),
            "missed": float(ach.missed[c]),
            "coverage": _coverage(rounded, c, place),
            "portals": portals[c],
        }
        for c in range(cells.cell_count)
    ]
    lists: dict[str, Sequence[object]] = {
        "viewpoints": [_viewpoint(v) for v in content.viewpoints],
        "textures": [_texture(r, content.options.fallback, up) for r in content.textures],
        "cells": rows,
    }
    lines = [f" {_json(k)}: {_json(v)}" for k, v in head.items()]
    lines += [f" {_json(k)}: {_rows(v)}" for k, v in lists.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Numbers with `DIGITS` significant digits. (Tried: decimal scaling in NumPy, for 30 lines; of
    willowgarage's 104,000 numbers it rounds in 7 ms, text in 35.)"""
    text = [float(f"{value:.{DIGITS}g}") for value in values.ravel().tolist()]
    return np.array(text, dtype=np.float64).reshape(values.shape)


def _json(value: object) -> str:
    try:
        return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    except ValueError as fault:
        raise DatabaseError(
            "PTM-D601",
            "hints: a number is not finite",
            remedy="check the model for NaN, infinite or huge values",
        ) from fault


def _rows(rows: Sequence[object]) -> str:
    return "[\n  " + ",\n  ".join(_json(r) for r in rows) + "\n ]" if rows else "[]"


def _leaf(cells: Cells, leaf: int) -> dict[str, Any]:
    faces = cells.face_start[cells.leaf_face_start[leaf] : cells.leaf_face_start[leaf + 1] + 1]
    index = (cells.face_index[faces[0] : faces[-1]] - cells.leaf_point_start[leaf]).tolist()
    return {
        "points": cells.leaf_points(leaf).tolist(),
        "faces": [index[a:b] for a, b in pairwise((faces - faces[0]).tolist())],
    }


def _coverage(ach: Ach, c: int, place: Mapping[int, int]) -> dict[str, Any]:
    """How far the hints of a cell can be trusted, and how they differ by point, view and texture;
    aligned with its visible cells; ``ach`` is rounded."""
    rows = ach.entries(c)
    found: dict[str, Any] = {
        "error": _plain(ach.error[rows]),
        "p95": _plain(ach.p95[rows]),
        "seen": _plain(ach.seen[rows]),
        "views": [_plain(view) for view in ach.views[rows].T],
        "uncertain": _plain(ach.uncertain[c : c + 1])[0],
        "unseenBelow": _plain(ach.unseen_below[c : c + 1])[0],
        "floor": _plain(ach.floor[c : c + 1])[0],
    }
    if ach.by_texture:
        found["textures"] = []
        for entry in range(rows.start, rows.stop):
            of_entry = slice(int(ach.texture_start[entry]), int(ach.texture_start[entry + 1]))
            images, value = ach.texture[of_entry].tolist(), _plain(ach.texture_value[of_entry])
            shares = [[place.get(i), share] for i, share in zip(images, value, strict=True)]
            found["textures"].append(shares)
    return found


def _plain(values: NDArray[np.float64]) -> list[float | None]:
    """None for NaN."""
    listed: list[float | None] = values.tolist()
    return [None if v != v else v for v in listed] if np.isnan(values).any() else listed


def _portals(cells: Cells) -> list[list[dict[str, Any]]]:
    """For every cell its portals to other cells, each counter-clockwise seen from inside it."""
    rows: list[list[dict[str, Any]]] = [[] for _ in range(cells.cell_count)]
    for k in range(cells.portal_count):
        behind, ahead = cells.leaf_cell[cells.portal_leaf[k]].tolist()
        if behind == ahead:
            continue
        polygon: NDArray[np.float64] = cells.portal(k)
        area = float(cells.portal_area[k])
        for cell, neighbour, loop in (
            (behind, ahead, polygon[::-1]),
            (ahead, behind, polygon),
        ):
            rows[cell].append({"neighbour": neighbour, "polygon": loop.tolist(), "area": area})
    return rows


def level_row(level: Level) -> dict[str, int]:
    """What the hints say of a level of a texture."""
    return {
        "width": level.width,
        "height": level.height,
        "offset": level.offset,
        "length": level.length,
        "gpuBytes": level.gpu_bytes,
    }


def _viewpoint(viewpoint: Viewpoint) -> dict[str, Any]:
    fields = vars(viewpoint).items()
    return {"fieldOfView" if k == "field_of_view" else k: value for k, value in fields}


def _texture(record: TextureRecord, fallback: bool, up: str) -> Mapping[str, Any]:
    png = record.fallback if fallback else None
    level = len(record.levels) - 1 if record.fallback_level is None else record.fallback_level
    return {
        "file": up + quote(record.file),
        "fallback": None if png is None else up + quote(png),
        "fallbackLevel": None if png is None else level,
        "width": record.width,
        "height": record.height,
        "components": record.components,
        "sha256": record.sha256,
        "levels": [level_row(level) for level in record.levels],
    }
