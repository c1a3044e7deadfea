"""The index, `hints.json`: what a client needs before the first step, and no more.

Tried: the level sizes and `gpuBytes` of textures beside the ends of their levels, for 0.4 kB more
of the museum's 2.3 gzipped, although they follow from the rest; the URLs of each cell instead of
templates, for 3.6 kB more of willowgarage's 5.5; no boxes, for 3.1 less, but then a client that
comes to a place without a viewpoint would have to fetch all records to find its cell.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.emitters import chosen_emitters
from ptmtools.database.hints.numbers import coordinates, document_text, whole
from ptmtools.database.model import OctreeRecord, TextureRecord, Viewpoint
from ptmtools.database.names import FIRST_LOOK_FILES, RECORD_FILES, STATISTICS, cell_name
from ptmtools.texture.model import gpu_texel_bytes

if TYPE_CHECKING:
    from ptmtools.database.content import Content
    from ptmtools.texture.model import Level

FORMAT = "ptmtools hints"
#: Of the index, the records and the statistics.
SCHEMA = 2


def index_text(content: Content) -> str:
    """The contents of `hints.json`.

    Raises DatabaseError: PTM-D601 a number is not finite.
    """
    space, cells = content.scene.space, content.cells
    emitters = chosen_emitters(content.options.format)
    head: dict[str, Any] = {
        "format": FORMAT,
        "schema": SCHEMA,
        "origin": list(space.origin),
        "unit": space.metres,
        "up": space.up,
        "closed": cells.closed,
        "avatarSize": list(content.options.avatar(cells.walker)),
        "record": RECORD_FILES,
        "geometry": {e.name: e.cell_files for e in emitters if e.cell_files},
        "statistics": STATISTICS,
    }
    if sets := {e.name: e.texture_files for e in emitters if e.texture_files}:
        head["textureSets"] = sets
    if content.options.first_look:
        head["firstLook"] = FIRST_LOOK_FILES
    lists: dict[str, list[Any]] = {
        "viewpoints": [_viewpoint(v) for v in content.viewpoints],
        "textures": [_texture(r, content.options.fallback) for r in content.textures],
        "octrees": [_octree(r) for r in content.octrees],
        "cells": [
            {"name": cell_name(c), "box": box} | ({} if standing else {"standing": False})
            for c, (box, standing) in enumerate(
                zip(_boxes(content), cells.standing.tolist(), strict=True)
            )
        ],
    }
    if not content.octrees:
        del lists["octrees"]
    return document_text(head, lists)


def texel_bytes(level: Level) -> int:
    """Bytes of a texel in texture memory, of the coarsest level."""
    return level.gpu_bytes // (level.width * level.height)


def _viewpoint(viewpoint: Viewpoint) -> dict[str, Any]:
    return {
        "name": viewpoint.name,
        "description": viewpoint.description,
        "position": coordinates(viewpoint.position, "viewpoints"),
        "direction": coordinates(viewpoint.direction, "viewpoints"),
        "fieldOfView": coordinates([viewpoint.field_of_view], "viewpoints")[0],
        "cell": viewpoint.cell,
    }


def _texture(record: TextureRecord, fallback: bool) -> Mapping[str, Any]:
    png = record.fallback if fallback else None
    level = len(record.levels) - 1 if record.fallback_level is None else record.fallback_level
    texel = texel_bytes(record.levels[0]) if record.levels else record.components
    row: dict[str, Any] = {
        "file": quote(record.file),
        "fallback": None if png is None else quote(png),
        "fallbackLevel": None if png is None else level,
        "width": record.width,
        "height": record.height,
        "components": record.components,
        "texelBytes": texel,
        "gpuTexelBytes": gpu_texel_bytes(texel, record.components),
        "ends": [level.end for level in record.levels],
    }
    if record.detail:
        row["differences"] = [whole(value) for value in record.detail.differences]
        row["color"] = list(record.detail.color)
    return row


def _octree(record: OctreeRecord) -> Mapping[str, Any]:
    return {
        "object": record.object,
        "file": quote(record.file),
        "cube": {"low": list(record.low), "side": record.side},
        "levels": list(record.levels),
        "ends": list(record.ends),
        "crc32": list(record.crc32),
    }


def _boxes(content: Content) -> list[Any]:
    """Of each cell the least and the greatest coordinates of its leaves, rounded outwards: to a
    thousandth of the building at least, a hundredth at most."""
    cells = content.cells
    low, high = (
        end.reduceat(cells.leaf_point, cells.leaf_point_start[:-1], axis=0)
        for end in (np.minimum, np.maximum)
    )
    box = np.array([[*low[own].min(axis=0), *high[own].max(axis=0)] for own in content.leaves])
    decimals = 2 - math.floor(math.log10(cells.tolerance.extent))
    rounded = np.concatenate(
        [_rounded_down(box[:, :3], decimals), -_rounded_down(-box[:, 3:], decimals)], axis=1
    )
    return [[int(v) if v.is_integer() else v for v in row] for row in (rounded + 0.0).tolist()]


def _rounded_down(values: NDArray[np.float64], decimals: int) -> NDArray[np.float64]:
    """To a whole multiple of 10 ** -decimals, not above the value."""
    step = 10.0**-decimals
    lower = np.round(np.floor(values / step) * step, decimals)
    return np.where(lower > values, np.round(lower - step, decimals), lower)
