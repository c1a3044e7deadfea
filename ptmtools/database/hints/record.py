"""The record of a cell: what a client that is in it needs, of the cell and of what it sees."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from ptmtools.cells.model import Cells
from ptmtools.database.hints.index import SCHEMA
from ptmtools.database.hints.numbers import coordinates, document_text, significant
from ptmtools.database.names import cell_name

if TYPE_CHECKING:
    from ptmtools.coverage.need import Need
    from ptmtools.database.content import Content
    from ptmtools.database.hints.first_look import Piece

FORMAT = "ptmtools cell"
#: Significant digits of the need: sampling leaves two.
NEED_DIGITS = 3


class RecordWriter:
    """Writes the records of one database; what they share is prepared once."""

    def __init__(self, content: Content) -> None:
        self._content = content
        self._adjacent = content.cells.adjacent()
        self._portals = _portals(content.cells)

    def record(self, cell: int, first_look: Sequence[Piece] | None) -> str:
        """The text of a cell's record; ``first_look`` is its bundle, None if there are none.

        Raises DatabaseError PTM-D601.
        """
        content = self._content
        seen = content.pvs.row(cell).tolist()
        rows = content.ach.entries(cell)
        head: dict[str, object] = {
            "format": FORMAT,
            "schema": SCHEMA,
            "cell": cell,
            "name": cell_name(cell),
            "adjacent": self._adjacent[cell].tolist(),
            "visible": seen,
            "ach": content.shares[cell],
            "floor": significant(content.ach.floor[cell : cell + 1])[0],
            "textures": [content.painted[other].tolist() for other in seen],
        }
        if content.ach.by_texture:
            head["textureShares"] = [self._texture_shares(e) for e in range(rows.start, rows.stop)]
        if first_look is not None:
            head["firstLook"] = [[piece.texture, piece.level] for piece in first_look]
        if content.need:
            head["need"] = self._need(content.need, cell)
        leaves = [_leaf(content.cells, leaf) for leaf in content.leaves[cell]]
        return document_text(head, {"leaves": leaves, "portals": self._portals[cell]})

    def _need(self, need: Need, cell: int) -> list[list[Any]]:
        """Of each texture in sight its place, the coarsest level wanted, and shares."""
        records, seen = self._content.records, self._content.pvs.row(cell).tolist()
        in_sight = {place for other in seen for place in self._content.painted[other].tolist()}
        rows = []
        for entry in range(*need.start[cell : cell + 2].tolist()):
            place = records[int(need.image[entry])][0]
            shares = need.share[slice(*need.share_start[entry : entry + 2].tolist())]
            if place in in_sight:
                rows.append([place, int(need.first[entry]), *significant(shares, NEED_DIGITS)])
        return sorted(rows)

    def _texture_shares(self, entry: int) -> list[list[Any]]:
        """The pairs of a texture, None for what has none, and its share of an entry of the ACH."""
        ach, records = self._content.ach, self._content.records
        of_entry = slice(*ach.texture_start[entry : entry + 2].tolist())
        place = [records[i][0] if i in records else None for i in ach.texture[of_entry].tolist()]
        return [list(p) for p in zip(place, significant(ach.texture_value[of_entry]), strict=True)]


def _leaf(cells: Cells, leaf: int) -> dict[str, Any]:
    faces = cells.face_start[cells.leaf_face_start[leaf] : cells.leaf_face_start[leaf + 1] + 1]
    index = (cells.face_index[faces[0] : faces[-1]] - cells.leaf_point_start[leaf]).tolist()
    return {
        "points": coordinates(cells.leaf_points(leaf), "leaf points"),
        "faces": [index[a:b] for a, b in pairwise((faces - faces[0]).tolist())],
    }


def _portals(cells: Cells) -> list[list[dict[str, Any]]]:
    """For every cell its portals to other cells, each counter-clockwise seen from inside it."""
    rows: list[list[dict[str, Any]]] = [[] for _ in range(cells.cell_count)]
    area = coordinates(cells.portal_area, "portals") if cells.portal_count else []
    ends = cells.portal_cell
    for k in range(cells.portal_count):
        behind, ahead = ends[k].tolist()
        if behind == ahead or min(behind, ahead) < 0:
            continue
        polygon = coordinates(cells.portal(k), "portals")
        for cell, neighbour, loop in ((behind, ahead, polygon[::-1]), (ahead, behind, polygon)):
            rows[cell].append({"neighbour": neighbour, "area": area[k], "polygon": loop})
    return rows
