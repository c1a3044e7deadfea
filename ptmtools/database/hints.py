"""`hints.json`: cells, visibility, coverage and texture sizes for clients that read no VRML.

docs/hints.md describes it field by field. Numbers are written in full precision; one cell a line,
so that a difference between two databases can be read.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
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


def hints_text(
    space: Space,
    cells: Cells,
    pvs: Pvs,
    ach: Ach,
    textures: Sequence[TextureRecord],
    images: Sequence[Sequence[int]],
    viewpoints: Sequence[Viewpoint],
    options: EmitOptions,
) -> str:
    """The contents of `hints.json`; ``images`` are the images that each cell uses.

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
            "url": cell_path(c),
            "leaves": [_leaf(cells, leaf) for leaf in cells.cell_leaves(c).tolist()],
            "textures": sorted(place[image] for image in images[c]),
            "adjacent": adjacent[c].tolist(),
            "visible": pvs.row(c).tolist(),
            "ach": ach.row(c).tolist(),
            "samples": int(ach.samples[c]),
            "rejected": int(ach.rejected[c]),
            "missed": float(ach.missed[c]),
            "portals": portals[c],
        }
        for c in range(cells.cell_count)
    ]
    lists: dict[str, Sequence[object]] = {
        "viewpoints": [_viewpoint(v) for v in viewpoints],
        "textures": [_texture(record, options.fallback) for record in textures],
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


def _texture(record: TextureRecord, fallback: bool) -> Mapping[str, Any]:
    png = record.fallback if fallback else None
    return {
        "file": quote(record.file),
        "fallback": None if png is None else quote(png),
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
