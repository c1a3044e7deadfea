"""Reads appearances of VRML97 and X3D.

VRML97 says that the colours of a texture replace the diffuse colour; the browsers of today
multiply both, and so is a diffuse colour read that a file states. A texture without a Material is
unlit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.scene.colors import to_linear
from ptmtools.scene.mtl import roughness_of
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import DARK, FileRange, SourceMaterial, SourceTexture, SourceWrap
from ptmtools.scene.x3d.nodes import X3dNode

#: Defaults of Material, and the exponent of the highlight of the largest shininess.
_DIFFUSE, _SHININESS, _SHARPEST = (0.8, 0.8, 0.8), 0.2, 128.0
_BLACK, _WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


class AppearanceReader:
    """Reads each appearance once for each kind of shape."""

    def __init__(self, notes: IngestNotes) -> None:
        self._notes = notes
        self._uses: dict[tuple[int, bool, bool], tuple[int, Floats]] = {}
        self._materials: list[SourceMaterial] = []

    @property
    def materials(self) -> tuple[SourceMaterial, ...]:
        return tuple(self._materials)

    def read(self, node: X3dNode | None, *, solid: bool, colored: bool) -> tuple[int, Floats]:
        """The number of the material of a shape, and the (2, 3) matrix of its coordinates; whether
        the shape is ``solid`` and its corners have colours. Raises ValueError."""
        key = id(node), solid, colored
        if key not in self._uses:
            use = X3dNode("Appearance", "", self._notes.model) if node is None else node
            self._materials.append(self._read(use, solid, colored))
            self._uses[key] = len(self._materials) - 1, _transform(use.node("textureTransform"))
        return self._uses[key]

    def _read(self, node: X3dNode, solid: bool, colored: bool) -> SourceMaterial:
        material, place = node.node("material"), node.file.name
        texture = self._texture(node.node("texture"), place)
        fields: dict[str, Any] = {"unlit": material is None and texture is not None}
        color: tuple[float, ...] | None = _WHITE if colored else None
        name = node.name
        if material is not None:
            name = name or material.name
            diffuse = np.clip(material.vector("diffuseColor", _DIFFUSE), 0, 1).tolist()
            glow = np.clip(material.vector("emissiveColor", _BLACK), 0, 1)
            specular = float(material.vector("specularColor", _BLACK).max())
            exponent = _SHARPEST * material.number("shininess", _SHININESS)
            opacity = 1 - min(max(material.number("transparency", 0.0), 0.0), 1.0)
            fields |= {
                "glow": tuple(to_linear(glow).tolist()),
                "roughness": roughness_of(specular, exponent),
                "opacity": opacity,
                "see_through": opacity < 1,
            }
            if texture is not None:
                color = tuple(diffuse) if "diffuseColor" in material.fields else color
            elif not colored:
                dark = max(diffuse) <= DARK < max(glow)
                color = tuple(glow.tolist() if dark else diffuse)
                fields["unlit"] = dark
        if not name and texture is not None:
            name = texture.label
        elif not name and color is not None:
            name = "#" + "".join(f"{round(255 * part):02x}" for part in color)
        return SourceMaterial(
            name=name or "default",
            color=None if color is None else (color[0], color[1], color[2]),
            two_sided=not solid,
            texture=texture,
            **fields,
        )

    def _texture(self, node: X3dNode | None, place: str) -> SourceTexture | None:
        """The image of a texture; None without one, and a miss if it is missing."""
        if node is not None and node.type == "MultiTexture":
            self._notes.note("PTM-N215", "MultiTexture: its first texture alone is drawn", place)
            node = node.node("texture")
        if node is None:
            return None
        if node.type != "ImageTexture":
            self._notes.note("PTM-N215", f"{node.type}: not drawn", place)
            return None
        urls = [url for url in node.texts("url") if url.strip()]
        if not urls:
            return None
        what = f"ImageTexture {urls[0]}"
        file = self._notes.locate_first(urls, what, place, node.file.parent)
        if file is None:
            return None
        wraps: list[SourceWrap] = ["repeat", "repeat"]
        for k, axis in enumerate("ST"):
            if not node.flag(f"repeat{axis}", True):
                wraps[k] = "clamp"
        return SourceTexture(FileRange(file), file.name, what, place, wraps[0], wraps[1])


def _transform(node: X3dNode | None) -> Floats:
    """(2, 3) of TextureTransform: translation, then rotation and scale about the centre."""
    if node is None or node.type != "TextureTransform":
        return np.eye(2, 3)
    centre = node.vector("center", (0.0, 0.0))
    angle = node.number("rotation", 0.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    linear = np.diag(node.vector("scale", (1.0, 1.0))) @ turn
    offset = linear @ (node.vector("translation", (0.0, 0.0)) + centre) - centre
    return np.column_stack([linear, offset])
