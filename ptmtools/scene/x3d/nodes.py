"""The nodes of VRML97 and X3D, whichever encoding they come from; and the XML encoding of X3D.

The fields of a node have no types, because neither encoding needs them: the reader of a field
states what it expects. DEF and USE make a node appear in several places; it is then one object.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.markup import floats, parse_xml

_QUOTED = re.compile(r'"((?:[^"\\]++|\\.)*+)"', re.DOTALL)
_ESCAPED = re.compile(r"\\(.)", re.DOTALL)
#: The fields of nodes in XML that name none; all others are children, or the geometry of a shape.
_FIELDS = {
    "Appearance": "appearance",
    "Material": "material",
    "TwoSidedMaterial": "material",
    "ImageTexture": "texture",
    "PixelTexture": "texture",
    "MovieTexture": "texture",
    "MultiTexture": "texture",
    "TextureTransform": "textureTransform",
    "Coordinate": "coord",
    "CoordinateDouble": "coord",
    "TextureCoordinate": "texCoord",
    "TextureCoordinateGenerator": "texCoord",
    "MultiTextureCoordinate": "texCoord",
    "Color": "color",
    "ColorRGBA": "color",
    "Normal": "normal",
}


@dataclass(eq=False)
class X3dNode:
    """A node.

    Attributes
    ----------
    type, name: the name is that of DEF, "" without.
    file: that it is in; its URLs are relative to the folder of that.
    fields: a text in XML; else a list of arrays of numbers, texts, truth values and nodes.
    """

    type: str
    name: str
    file: Path
    fields: dict[str, Any] = field(default_factory=dict)

    def numbers(self, name: str, width: int = 1) -> Floats:
        """(n, width) the numbers of a field, (0, width) without it. Raises ValueError."""
        value = self.fields.get(name, [])
        if isinstance(value, str):
            flat = floats(value.replace(",", " "))
        elif all(isinstance(part, np.ndarray) for part in value):
            flat = np.concatenate([np.zeros(0), *value])
        else:
            raise ValueError(f"{self.type}: {name} has other values than numbers")
        return flat[: len(flat) // width * width].reshape(-1, width)

    def vector(self, name: str, default: Sequence[float]) -> Floats:
        """As many numbers as ``default`` has, which it is without the field. Raises ValueError."""
        values = self.numbers(name).ravel()
        if len(values) not in (0, len(default)):
            raise ValueError(f"{self.type}: {name} has {len(values)} numbers")
        return values if len(values) else np.array(default, np.float64)

    def number(self, name: str, default: float) -> float:
        """One number. Raises ValueError."""
        return float(self.vector(name, (default,))[0])

    def integers(self, name: str) -> Ints:
        """The integers of a field. Raises ValueError for other numbers."""
        values = self.numbers(name).ravel()
        if not (np.abs(values) < 2**31).all() or (values != np.floor(values)).any():
            raise ValueError(f"{self.type}: {name} has other numbers than integers")
        return values.astype(np.int64)

    def flag(self, name: str, default: bool) -> bool:
        """A truth value."""
        value = self.fields.get(name)
        if isinstance(value, str):
            return value.strip().lower() == "true"
        return bool(value[0]) if value and isinstance(value[0], bool) else default

    def texts(self, name: str) -> list[str]:
        """The texts of a field."""
        value = self.fields.get(name, [])
        if isinstance(value, str):
            parts = _QUOTED.findall(value)
            return [unescape(part) for part in parts] if parts else [value]
        return [part for part in value if isinstance(part, str)]

    def nodes(self, name: str) -> list[X3dNode]:
        """The nodes of a field."""
        return [part for part in self.fields.get(name, []) if isinstance(part, X3dNode)]

    def node(self, name: str) -> X3dNode | None:
        """The first node of a field; None without."""
        return next(iter(self.nodes(name)), None)


def unescape(text: str) -> str:
    """The content of a quoted text."""
    return _ESCAPED.sub(r"\1", text) if "\\" in text else text


def parse_x3d(file: Path) -> list[X3dNode]:
    """The nodes of an X3D scene in XML. Raises as `parse_xml`, and ValueError without a scene."""
    root = parse_xml(file)
    scene = root if root.tag == "Scene" else root.find("Scene")
    if scene is None:
        raise ValueError("the document has no Scene")
    nodes: dict[int, X3dNode] = {}
    names: dict[str, X3dNode] = {}
    for element in scene.iter():
        fields = {key: text for key, text in element.items() if key not in ("DEF", "USE")}
        node = nodes[id(element)] = X3dNode(element.tag, element.get("DEF", ""), file, fields)
        if node.name:
            names.setdefault(node.name, node)
    for parent in scene.iter():
        owner = nodes[id(parent)]
        for child in parent:
            use = child.get("USE")
            node = nodes[id(child)] if use is None else names.get(use, nodes[id(child)])
            usual = "geometry" if parent.tag == "Shape" else "children"
            name = child.get("containerField") or _FIELDS.get(child.tag, usual)
            if not isinstance(owner.fields.get(name), list):
                owner.fields[name] = []
            owner.fields[name].append(node)
    return nodes[id(scene)].nodes("children")
