"""Light of lit pictures, which have no baked light: a distant lamp, and ambient light.

The lamp wraps around objects (half Lambert, squared), so relief is visible on all sides of a
statue. It multiplies sRGB values, like the rest of the simulator.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, normals
from ptmtools.output.served import Served
from ptmtools.rendering.tone import show_vertex_light

#: Share of ambient light, and unit vector towards the lamp.
AMBIENT = 0.3
LAMP = tuple(float(v) for v in np.array([0.5, 0.7, 0.6]) / np.linalg.norm([0.5, 0.7, 0.6]))


def lamps(corner: Floats) -> Floats:
    """(n,) light on triangles (n, 3, 3) with flat shading, `AMBIENT` to 1."""
    return light_on(normals(corner))


def light_on(normal: Floats) -> Floats:
    """(n,) light on normals (n, 3) of any length, `AMBIENT` to 1."""
    length = np.linalg.norm(normal, axis=1)
    along = np.divide(normal @ LAMP, length, out=np.zeros(len(normal)), where=length > 0)
    result: Floats = AMBIENT + (1 - AMBIENT) * ((1 + along) / 2) ** 2
    return result


def with_lamp(served: Served) -> Served:
    """Returns the database with colours multiplied by the light of the lamp, beside that at
    vertices."""
    surfaces = show_vertex_light(served).surfaces
    color = surfaces.color * lamps(surfaces.corner)[:, None]
    return replace(served, surfaces=replace(surfaces, color=color))


def as_bytes(colors: Floats) -> NDArray[np.uint8]:
    """Rounds colours to 8 bits."""
    return np.rint(np.clip(colors, 0, 255)).astype(np.uint8)
