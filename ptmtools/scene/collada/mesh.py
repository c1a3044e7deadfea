"""Cuts the primitives of a COLLADA mesh into triangles."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.collada.document import ColladaDocument, Input, inputs_of
from ptmtools.scene.colors import color_bytes
from ptmtools.scene.markup import integers
from ptmtools.scene.polygon import cut, fan_of, keyhole, strip_of

_SURFACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
_OTHERS = ("lines", "linestrips")
_COORDINATES = ("TEXCOORD", "UV")


@dataclass(frozen=True)
class Part:
    """A primitive, cut into triangles.

    Attributes
    ----------
    symbol: of its material.
    points: (P, 3), all used.
    triangles: (T, 3) into `points`.
    index: (T, 3, n) the indices of the corners, by the offsets of the inputs.
    inputs: those of texture coordinates, in the order of their sets, and of colours.
    """

    symbol: str
    points: Floats
    triangles: Ints
    index: Ints
    inputs: list[Input]

    def coordinates(self, number: int | None, document: ColladaDocument) -> Floats | None:
        """(T, 3, 2) texture coordinates of a set, or else of the first; None without any."""
        entries = [item for item in self.inputs if item.semantic in _COORDINATES]
        if not entries:
            return None
        entry = next((item for item in entries if item.number == number), entries[0])
        return self._values(entry, document, 2)

    def colors(self, document: ColladaDocument) -> NDArray[np.uint8] | None:
        """(T, 3, 3) colours; None without any."""
        entry = next((item for item in self.inputs if item.semantic == "COLOR"), None)
        return None if entry is None else color_bytes(self._values(entry, document, 3))

    def _values(self, entry: Input, document: ColladaDocument, width: int) -> Floats:
        values, index = document.values(entry.source), self.index[..., entry.offset]
        if values.shape[1] < width:
            raise ValueError(f"source {entry.source} has values of {values.shape[1]} numbers")
        return values[_check(index, len(values))][..., :width]


def read_mesh(geometry: Element, document: ColladaDocument) -> list[Part]:
    """The surfaces of a geometry. Raises ValueError if it is damaged."""
    place = geometry.get("id", "geometry")
    mesh = geometry.find("mesh")
    if mesh is None:
        document.notes.note("PTM-N215", "geometries other than meshes: not drawn", place)
        return []
    parts = []
    for element in mesh:
        if element.tag in _OTHERS:
            document.notes.note("PTM-N215", f"{element.tag}: not drawn")
        elif element.tag in _SURFACES:
            part = _read_part(element, document, place)
            parts += [part] if len(part.triangles) else []
    return parts


def _check(index: Ints, count: int) -> Ints:
    """The same indices. Raises ValueError if one is not below ``count``."""
    if index.size and not 0 <= index.min() <= index.max() < count:
        raise ValueError("an index exceeds its source")
    return index


def _read_part(element: Element, document: ColladaDocument, place: str) -> Part:
    inputs = inputs_of(element, document)
    position = next((item for item in inputs if item.semantic == "POSITION"), None)
    if position is None:
        raise ValueError(f"{place} has no positions")
    values = document.values(position.source)[:, :3]
    if values.shape[1] < 3:
        raise ValueError(f"{place} has positions of {values.shape[1]} numbers")
    stride = 1 + max(int(item.get("offset", 0)) for item in element.findall("input"))

    def rows(item: Element) -> Ints:
        numbers = integers(item.text)
        if len(numbers) % stride:
            raise ValueError(f"{place}: {len(numbers)} indices for {stride} inputs")
        _check(numbers[position.offset :: stride], len(values))
        return numbers.reshape(-1, stride)

    index, size = [np.zeros((0, stride), np.int64)], [np.zeros(1, np.int64)]
    for item in element:
        if item.tag == "ph":
            loops = [rows(loop) for loop in item if loop.tag in ("p", "h")]
            path, omitted = keyhole([values[loop[:, position.offset]] for loop in loops])
            if omitted:
                document.notes.note("PTM-N211", "holes of too many corners closed", place, omitted)
            corners = np.concatenate(loops)[path] if loops else index[0]
        elif item.tag == "p":
            corners = rows(item)
        else:
            continue
        counts = np.array([len(corners)])
        if element.tag == "polylist":
            counts = integers(element.findtext("vcount"))
        elif element.tag != "polygons":
            if element.tag != "triangles":
                faces = strip_of if element.tag == "tristrips" else fan_of
                corners = corners[faces(len(corners)).ravel()]
            counts = np.full(len(corners) // 3, 3)
        if (counts < 0).any() or counts.sum() != len(corners):
            raise ValueError(f"{place}: polygons of other numbers of corners")
        index.append(corners)
        size.append(counts)
    corner = np.concatenate(index)
    vertex = corner[:, position.offset]
    result = cut(values[vertex], np.cumsum(np.concatenate(size)), document.notes, place)
    used, triangles = np.unique(vertex[result.corner], return_inverse=True)
    others = [item for item in inputs if item.semantic in (*_COORDINATES, "COLOR")]
    return Part(
        element.get("material", ""),
        values[used],
        triangles.reshape(-1, 3),
        corner[result.corner],
        sorted(others, key=lambda item: item.number),
    )
