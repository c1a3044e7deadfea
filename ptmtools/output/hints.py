"""The hints: an index, `hints.json`, a record for each cell, and the statistics of the coverage.

The index holds only the data that a client needs before its first step, the record of a cell the
data for that cell and the cells visible from it. The statistics state the accuracy of the coverage
and its variation by point and view. The files are written in the order in which they refer to each
other, the index last.

(Tried for the index: the level sizes and `gpuBytes` of textures beside the ends of their levels,
0.4 kB more than the museum's 2.3 gzipped, although they follow from the rest; the URLs of each cell
instead of templates, 3.6 kB more than willowgarage's 5.5; no boxes, 3.1 less, but then a client
that comes to a place without a viewpoint would have to fetch all records to find its cell.)
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.cells.model import Cells
from ptmtools.output.convexity import leaf_numbers, portal_polygons, slack_of
from ptmtools.output.model import PreviewRecord, TextureRecord, Viewpoint
from ptmtools.output.names import (
    HINTS,
    RECORD_FILES,
    STATISTICS,
    cell_name,
    mesh_path,
    path_of,
)
from ptmtools.output.numbers import coordinates, document_text, significant, whole
from ptmtools.texture.model import gpu_texel_bytes

if TYPE_CHECKING:
    from ptmtools.coverage.required_levels import Need
    from ptmtools.light.model import Light
    from ptmtools.output.content import Content
    from ptmtools.output.mesh_levels import MeshLevels
    from ptmtools.texture.model import Level


FORMAT = "ptmtools hints"
#: Of the index, the records and the statistics.
SCHEMA = 3


def index_text(content: Content) -> str:
    """The contents of `hints.json`.

    Raises DatabaseError: PTM-D601 a number is not finite.
    """
    space, cells = content.scene.space, content.cells
    emitters = content.emitters
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
    if light := content.extras.light:
        head["light"] = light.display(content.options.tone)
    factors = significant(light.exposure.ravel(), NEED_DIGITS) if light else []
    exposures = [factors[k : k + 3] for k in range(0, len(factors), 3)]
    materials = content.scene.materials
    # Images that are normal maps of materials, and nothing else.
    normal_maps = {m.normal.image for m in materials if m.normal} - {m.image for m in materials}
    lists: dict[str, list[Any]] = {
        "viewpoints": [_viewpoint(v) for v in content.viewpoints],
        "textures": [
            _texture(r, content.scene.objects, content.options.fallback)
            | ({"normals": True} if r.image in normal_maps else {})
            | ({"probe": _probe(light, r.probe)} if light and r.probe >= 0 else {})
            for r in content.textures
        ],
        **{r.kind.name: list(r.rows) for r in content.extras.represented if r.kind and r.rows},
        "cells": [
            {"name": cell_name(c), "box": box}
            | ({} if standing else {"standing": False})
            | ({"room": room} if (room := cells.room_name(c)) else {})
            | ({"exposure": exposures[c]} if exposures and exposures[c] != [1, 1, 1] else {})
            for c, (box, standing) in enumerate(
                zip(_boxes(content), cells.standing.tolist(), strict=True)
            )
        ],
    }
    if content.meshes:
        lists["meshes"] = [_mesh(mesh) for mesh in content.meshes]
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


def _texture(record: TextureRecord, objects: Sequence[str], fallback: bool) -> dict[str, Any]:
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
        if any(record.detail.offsets):
            row["offsets"] = list(record.detail.offsets)
    if record.previews:
        row["previews"] = [_preview(preview) for preview in record.previews]
    if record.cell >= 0:
        row["light"] = record.cell
    if record.object >= 0:
        row["relief"] = objects[record.object]
    return row


def _probe(light: Light, cell: int) -> dict[str, Any]:
    white, mean, *places = light.probe[cell].tolist()
    centre, low, high = (coordinates(places[k : k + 3], "probes") for k in (0, 3, 6))
    white, mean = significant(np.array([white, mean]))
    return {"cell": cell, "white": white, "mean": mean, "centre": centre, "low": low, "high": high}


def _preview(record: PreviewRecord) -> Mapping[str, Any]:
    preview = record.preview
    row: dict[str, Any] = {
        "file": quote(record.file),
        "level": preview.level,
        "width": preview.width,
        "height": preview.height,
        "bytes": preview.bytes,
        "difference": whole(preview.difference),
        "error": whole(preview.error),
    }
    return row | ({"exact": True} if preview.exact else {})


def _mesh(levels: MeshLevels) -> Mapping[str, Any]:
    return {
        "cell": levels.cell,
        "box": coordinates(levels.box, "meshes"),
        "errors": significant(np.array(levels.errors), NEED_DIGITS),
        "files": [mesh_path(number) for number in levels.files],
    }


def _boxes(content: Content) -> list[Any]:
    """For each cell the least and the greatest coordinates of its leaves, rounded outwards to
    between a thousandth and a hundredth of the building."""
    cells = content.cells
    low, high = (
        end.reduceat(cells.leaf_point, cells.leaf_point_start[:-1], axis=0)
        for end in (np.minimum, np.maximum)
    )
    box = np.array(
        [[*low[leaves].min(axis=0), *high[leaves].max(axis=0)] for leaves in content.leaves]
    )
    decimals = 2 - math.floor(math.log10(cells.tolerance.extent))
    rounded = np.concatenate(
        [_round_down(box[:, :3], decimals), -_round_down(-box[:, 3:], decimals)], axis=1
    )
    return [[int(v) if v.is_integer() else v for v in row] for row in (rounded + 0.0).tolist()]


def _round_down(values: Floats, decimals: int) -> Floats:
    """To a whole multiple of 10 ** -decimals, not above the value."""
    step = 10.0**-decimals
    lower = np.round(np.floor(values / step) * step, decimals)
    return np.where(lower > values, np.round(lower - step, decimals), lower)


RECORD_FORMAT = "ptmtools cell"
#: Significant digits of the need; sampling leaves two.
NEED_DIGITS = 3
#: The worth of a probe as a share of that of the lightmap of its cell.
_OF_PROBES = 0.2


class RecordWriter:
    """Writes the records of one database."""

    def __init__(self, content: Content) -> None:
        self._content = content
        self._adjacent = content.cells.adjacent()
        self._portals = _portals(content.cells)
        self._leaves = leaf_numbers(content.cells, slack_of(content.cells))

    def record(self, cell: int) -> str:
        """The text of a cell's record. Raises DatabaseError PTM-D601."""
        content = self._content
        visible = content.pvs.row(cell).tolist()
        rows = content.ach.entries(cell)
        head: dict[str, object] = {
            "format": RECORD_FORMAT,
            "schema": SCHEMA,
            "cell": cell,
            "name": cell_name(cell),
            "adjacent": self._adjacent[cell].tolist(),
            "visible": visible,
            "ach": content.shares[cell],
            "floor": significant(content.ach.floor[cell : cell + 1])[0],
            "textures": [content.cell_textures[seen].tolist() for seen in visible],
        }
        if content.ach.by_texture:
            head["textureShares"] = [self._texture_shares(e) for e in range(rows.start, rows.stop)]
        if content.extras.need:
            head["need"] = self._need(content.extras.need, cell)
        leaves = [self._leaf(leaf) for leaf in content.leaves[cell]]
        return document_text(head, {"leaves": leaves, "portals": self._portals[cell]})

    def _leaf(self, leaf: int) -> dict[str, Any]:
        cells = self._content.cells
        faces = cells.face_start[cells.leaf_face_start[leaf] : cells.leaf_face_start[leaf + 1] + 1]
        index = (cells.face_index[faces[0] : faces[-1]] - cells.leaf_point_start[leaf]).tolist()
        loops = [index[a:b] for a, b in pairwise((faces - faces[0]).tolist())]
        return {"points": self._leaves[leaf], "faces": loops}

    def _need(self, need: Need, cell: int) -> list[list[Any]]:
        """For each visible texture its index, the coarsest required level, and shares."""
        content, cells = self._content, self._content.pvs.row(cell).tolist()
        visible = {place for seen in cells for place in content.cell_textures[seen].tolist()}
        images = {image: place for image, (place, _) in content.places.of_image.items()}
        maps = dict(enumerate(place for place, _ in content.places.of_object.values()))
        rows = []
        for measured, places in ((need, images), (content.extras.map_need, maps)):
            if measured is None:
                continue
            for entry in range(*measured.start[cell : cell + 2].tolist()):
                place = places[int(measured.image[entry])]
                shares = measured.share[slice(*measured.share_start[entry : entry + 2].tolist())]
                if place in visible:
                    first = int(measured.first[entry])
                    rows.append([place, first, *significant(shares, NEED_DIGITS)])
        return sorted([*rows, *self._light_need(cell)])

    def _light_need(self, cell: int) -> Iterator[list[Any]]:
        """The need of the lightmaps and probes of visible cells. A texel of one is so large that
        every view requires the finest level."""
        places, ach = self._content.places, self._content.ach
        for of_cells, worth in ((places.of_cell, 1.0), (places.probe, _OF_PROBES)):
            if not of_cells:
                continue
            shares = significant(worth * ach.value[ach.entries(cell)], NEED_DIGITS)
            for seen, share in zip(self._content.pvs.row(cell).tolist(), shares, strict=True):
                if share and seen in of_cells:
                    place, record = of_cells[seen]
                    yield [place, record.level_count - 1, share]

    def _texture_shares(self, entry: int) -> list[list[Any]]:
        """The pairs of a texture, None for untextured surfaces, and its share of an ACH entry."""
        ach, records = self._content.ach, self._content.places.of_image
        of_entry = slice(*ach.texture_start[entry : entry + 2].tolist())
        place = [records[i][0] if i in records else None for i in ach.texture[of_entry].tolist()]
        return [list(p) for p in zip(place, significant(ach.texture_value[of_entry]), strict=True)]


def _portals(cells: Cells) -> list[list[dict[str, Any]]]:
    """For every cell its portals to other cells, each counter-clockwise seen from inside it."""
    rows: list[list[dict[str, Any]]] = [[] for _ in range(cells.cell_count)]
    area = coordinates(cells.portal_area, "portals") if cells.portal_count else []
    ends = cells.portal_cell
    polygons = portal_polygons(
        cells.portal_point, cells.portal_start, cells.portal_plane[:, :3], slack_of(cells)
    )
    for k, polygon in enumerate(polygons):
        behind, ahead = ends[k].tolist()
        if behind == ahead or min(behind, ahead) < 0:
            continue
        for cell, neighbour, loop in ((behind, ahead, polygon[::-1]), (ahead, behind, polygon)):
            row = {"neighbour": neighbour, "area": area[k], "polygon": loop}
            rows[cell].append(row | ({"passage": True} if cells.portal_passage[k] else {}))
    return rows


STATISTICS_FORMAT = "ptmtools statistics"


def statistics_text(content: Content) -> str:
    """The text of `hints/statistics.json`; raises DatabaseError PTM-D601."""
    ach = content.ach
    head: dict[str, object] = {
        "format": STATISTICS_FORMAT,
        "schema": SCHEMA,
        "coverage": {"backend": ach.backend, "renderer": ach.renderer},
    }
    textures = [
        {"sha256": record.sha256}
        | ({"errors": [whole(error) for error in record.errors]} if record.errors else {})
        for record in content.textures
    ]
    cells = [_cell(content, c) for c in range(content.cells.cell_count)]
    return document_text(head, {"textures": textures, "cells": cells})


def _cell(content: Content, cell: int) -> dict[str, Any]:
    ach = content.ach
    rows, this_cell = ach.entries(cell), slice(cell, cell + 1)
    return {
        "samples": int(ach.samples[cell]),
        "rejected": int(ach.rejected[cell]),
        "missed": significant(ach.missed[this_cell])[0],
        "uncertain": significant(ach.uncertain[this_cell])[0],
        "unseenBelow": significant(ach.unseen_below[this_cell])[0],
        "error": significant(ach.error[rows]),
        "p95": significant(ach.p95[rows]),
        "seen": significant(ach.seen[rows]),
        "views": [significant(view) for view in ach.views[rows].T],
    }


def hints_files(content: Content) -> Iterator[tuple[str, str | bytes]]:
    """Path, relative to the served folder, and contents of each file.

    Raises DatabaseError: PTM-D601 a number is not finite; for the index, before the first file.
    """
    return _files(content, index_text(content))


def _files(content: Content, index: str) -> Iterator[tuple[str, str | bytes]]:
    writer, count = RecordWriter(content), content.cells.cell_count
    for cell in range(count):
        content.extras.progress(cell, count, "hints")
        yield path_of(cell, RECORD_FILES), writer.record(cell)
    content.extras.progress(count, count, "hints")
    yield STATISTICS, statistics_text(content)
    yield HINTS, index
