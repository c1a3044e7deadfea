"""`hints.json`: cells, visibility, coverage and texture sizes for clients that read no VRML.

docs/hints.md describes it field by field. Numbers are written in full precision; one cell a line,
so that a difference between two databases can be read.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.database.model import EmitOptions, TextureRecord, Viewpoint
from ptmtools.database.names import cell_name, cell_path
from ptmtools.errors import DatabaseError
from ptmtools.scene.model import Space
from ptmtools.visibility.model import Pvs

FORMAT = "ptmtools hints"
SCHEMA = 1
#: Significant digits of statistics.
DIGITS = 5


def hints_text(
    space: Space,
    cells: Cells,
    pvs: Pvs,
    ach: Ach,
    textures: Sequence[TextureRecord],
    images: Sequence[Sequence[int]],
    viewpoints: Sequence[Viewpoint],
    options: EmitOptions,
    *,
    cell_url: Callable[[int], str] = cell_path,
    up: str = "",
) -> str:
    """The contents of `hints.json`; ``images`` are the images that each cell uses. ``cell_url`` and
    ``up``, the way to the served folder, are those of another place than that folder.

    Raises
    ------
    DatabaseError: PTM-D601 a number is not finite.
    """
    place = {record.image: i for i, record in enumerate(textures)}
    adjacent = cells.adjacent()
    portals = _portals(cells)
    head = {
        "format": FORMAT,
        "schema": SCHEMA,
        "origin": list(space.origin),
        "unit": space.metres,
        "up": space.up,
        "closed": cells.closed,
        "avatarSize": list(options.avatar_size),
        "coverage": {"backend": ach.backend, "renderer": ach.renderer},
    }
    rows = [
        {
            "name": cell_name(c),
            "url": cell_url(c),
            "leaves": [_leaf(cells, leaf) for leaf in cells.cell_leaves(c).tolist()],
            "textures": sorted(place[image] for image in images[c]),
            "adjacent": adjacent[c].tolist(),
            "visible": pvs.row(c).tolist(),
            "ach": ach.row(c).tolist(),
            "samples": int(ach.samples[c]),
            "rejected": int(ach.rejected[c]),
            "missed": float(ach.missed[c]),
            "coverage": _coverage(ach, c, place),
            "portals": portals[c],
        }
        for c in range(cells.cell_count)
    ]
    lists: dict[str, Sequence[object]] = {
        "viewpoints": [_viewpoint(v) for v in viewpoints],
        "textures": [_texture(record, options.fallback, up) for record in textures],
        "cells": rows,
    }
    lines = [f" {_json(k)}: {_json(v)}" for k, v in head.items()]
    lines += [f" {_json(k)}: {_rows(v)}" for k, v in lists.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


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
    first = int(cells.leaf_point_start[leaf])
    return {
        "points": cells.leaf_points(leaf).tolist(),
        "faces": [(loop - first).tolist() for loop in cells.leaf_faces(leaf)],
    }


def _coverage(ach: Ach, c: int, place: Mapping[int, int]) -> dict[str, Any]:
    """How far the hints of a cell can be trusted, and how they differ by point, view and texture;
    aligned with its visible cells, with `DIGITS` digits."""
    rows = ach.entries(c)
    told: dict[str, Any] = {
        "error": _short(ach.error[rows]),
        "p95": _short(ach.p95[rows]),
        "seen": _short(ach.seen[rows]),
        "views": [_short(view) for view in ach.views[rows].T],
        "uncertain": _short(ach.uncertain[c : c + 1])[0],
        "unseenBelow": _short(ach.unseen_below[c : c + 1])[0],
        "floor": _short(ach.floor[c : c + 1])[0],
    }
    if ach.by_texture:
        told["textures"] = []
        for entry in range(rows.start, rows.stop):
            of_entry = slice(int(ach.texture_start[entry]), int(ach.texture_start[entry + 1]))
            images, value = ach.texture[of_entry].tolist(), _short(ach.texture_value[of_entry])
            shares = [[place.get(i), share] for i, share in zip(images, value, strict=True)]
            told["textures"].append(shares)
    return told


def _short(values: NDArray[np.float64]) -> list[float | None]:
    """Rounded to `DIGITS` significant digits; None for NaN."""
    return [None if v != v else float(f"{v:.{DIGITS}g}") for v in values.tolist()]


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


def _viewpoint(v: Viewpoint) -> dict[str, Any]:
    return {
        "name": v.name,
        "description": v.description,
        "position": v.position,
        "direction": v.direction,
        "orientation": v.orientation,
        "fieldOfView": v.field_of_view,
        "cell": v.cell,
    }


def _texture(record: TextureRecord, fallback: bool, up: str) -> Mapping[str, Any]:
    png = record.fallback if fallback else None
    return {
        "file": up + quote(record.file),
        "fallback": None if png is None else up + quote(png),
        "width": record.width,
        "height": record.height,
        "components": record.components,
        "sha256": record.sha256,
        "levels": [
            {
                "width": level.width,
                "height": level.height,
                "offset": level.offset,
                "length": level.length,
                "gpuBytes": level.gpu_bytes,
            }
            for level in record.levels
        ],
    }
