"""Opens a COLLADA document: its elements by their ids, and its sources of numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.scene.markup import floats, parse_xml
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.placement import rotation, translation

#: Most numbers that a value without named parameters has: red, green, blue and alpha.
_WIDEST = 4


class ColladaDocument:
    """A document and the notes of its ingest.

    Raises ValueError if the file is no COLLADA document, and OSError.
    """

    def __init__(self, path: Path, notes: IngestNotes) -> None:
        self.path, self.notes = path, notes
        self.root = parse_xml(path)
        if self.root.tag != "COLLADA":
            raise ValueError(f"the document is a {self.root.tag}, not a COLLADA")
        self._ids: dict[str, Element] = {}
        for element in self.root.iter():
            if (name := element.get("id")) is not None:
                self._ids.setdefault(name, element)
        self._sources: dict[str, Floats] = {}

    def find(self, name: str, *tags: str) -> Element | None:
        """The element of this id, if it has one of the tags; else None."""
        element = self._ids.get(name)
        return element if element is not None and element.tag in tags else None

    def follow(self, url: str | None, *tags: str) -> Element | None:
        """The element that a URL refers to; None, and a miss, without one."""
        element = self.find((url or "")[1:], *tags)
        if element is None:
            self.notes.miss("PTM-N214", f"{url}: no such {tags[0]} in the file")
        return element

    def values(self, url: str | None) -> Floats:
        """(n, items) the values of a source, those of named parameters only. Raises ValueError."""
        name = (url or "")[1:]
        if name not in self._sources:
            self._sources[name] = self._read_source(name)
        return self._sources[name]

    def _read_source(self, name: str) -> Floats:
        source = self.find(name, "source")
        accessor = None if source is None else source.find("technique_common/accessor")
        if source is None or accessor is None:
            raise ValueError(f"source {name} is missing")
        array = self.find(accessor.get("source", "")[1:], "float_array")
        if array is None:
            raise ValueError(f"source {name} has no numbers")
        stride, offset = int(accessor.get("stride", 1)), int(accessor.get("offset", 0))
        parameters = accessor.findall("param")
        columns = [k for k, item in enumerate(parameters) if item.get("name")]
        columns = columns or list(range(min(stride, _WIDEST)))
        if stride < 1 or offset < 0 or max(columns) >= stride:
            raise ValueError(f"source {name} has a wrong stride")
        numbers = floats(array.text)[offset:]
        count = min(int(accessor.get("count", 0)), len(numbers) // stride)
        if count < 0:
            raise ValueError(f"source {name} has {count} values")
        return numbers[: count * stride].reshape(count, stride)[:, columns]


@dataclass(frozen=True)
class Input:
    """An input of a primitive: its meaning, source, place among the indices of a corner, and the
    number of its set."""

    semantic: str
    source: str
    offset: int
    number: int


def inputs_of(element: Element, document: ColladaDocument) -> list[Input]:
    """The inputs of a primitive; those of its vertices are in the place of VERTEX."""
    result = []
    for item in element.findall("input"):
        offset, source = int(item.get("offset", 0)), item.get("source", "")
        if offset < 0:
            raise ValueError("an input has a negative offset")
        entries = [item]
        if item.get("semantic") == "VERTEX":
            vertices = document.find(source[1:], "vertices")
            entries = [] if vertices is None else vertices.findall("input")
        result += [
            Input(e.get("semantic", ""), e.get("source", ""), offset, int(e.get("set", 0)))
            for e in entries
        ]
    return result


def matrix_of(node: Element) -> Floats:
    """(4, 4) from a node to its parent: the product of its transformations. Raises ValueError."""
    result = np.eye(4)
    with np.errstate(all="ignore"):
        for element in node:
            if element.tag in _TRANSFORMATIONS:
                size, build = _TRANSFORMATIONS[element.tag]
                values = floats(element.text)
                if len(values) != size:
                    raise ValueError(f"{element.tag} of {len(values)} numbers")
                result = result @ build(values)
    return result


def _look_at(values: Floats) -> Floats:
    """(4, 4) of a node at an eye that looks along -Z at an interest: eye, interest, up."""
    eye, interest, up = values.reshape(3, 3)
    z = eye - interest
    x = np.cross(up, z)
    axes = [x, np.cross(z, x), z]
    result = translation(eye)
    result[:3, :3] = np.stack([axis / np.linalg.norm(axis) for axis in axes], axis=1)
    return result


#: The number of values of a transformation, and its matrix.
_TRANSFORMATIONS: dict[str, tuple[int, Callable[[Floats], Floats]]] = {
    "matrix": (16, lambda v: v.reshape(4, 4)),
    "translate": (3, translation),
    "rotate": (4, lambda v: rotation(v[:3], np.radians(v[3]))),
    "scale": (3, lambda v: np.diag([*v, 1.0])),
    "lookat": (9, _look_at),
}
