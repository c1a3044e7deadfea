"""Materials of the surface styles of an IFC file."""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.scene.ifc.names import name_of
from ptmtools.scene.source import Findings, SourceMaterial

#: Of surfaces without a style.
UNSTYLED = SourceMaterial("default")
_LOST = (
    ("IfcSurfaceTexture", "textures are not carried over"),
    ("IfcIndexedColourMap", "colours of single faces are not carried over"),  # not in IFC2X3
)


def material_of(file: Any, style: Any) -> SourceMaterial:
    """The material of a style as the geometry kernel has it. Styles of one name and look are one:
    programs write the same thousands of times."""
    tint = [style.diffuse.r(), style.diffuse.g(), style.diffuse.b()]
    color = None
    if np.isfinite(tint).all():
        red, green, blue = np.clip(tint, 0, 1).tolist()
        color = red, green, blue
    opacity = 1.0
    if style.has_transparency() and np.isfinite(style.transparency):
        opacity = 1.0 - float(np.clip(style.transparency, 0, 1))
    number = style.instance_id()  # of the style, or of the material that has it
    name = name_of(file.by_id(number)) if number else ""
    return SourceMaterial(name or _shade(color), color, opacity)


def note_lost(file: Any, findings: Findings) -> None:
    """Notes on what surfaces have and is not shown."""
    for name, what in _LOST:
        try:
            count = len(file.by_type(name))
        except RuntimeError:  # no class of this schema
            continue
        if count:
            findings.say("PTM-N245", what, "", count)


def _shade(color: tuple[float, float, float] | None) -> str:
    """The name of a style without one."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in color) if color else UNSTYLED.name
