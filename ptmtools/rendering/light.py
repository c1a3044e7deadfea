"""Light of pictures without baked light: what shows, and a distant lamp with ambient light.

The lamp wraps around objects (half Lambert, squared), so relief is visible on all sides of a
statue. It multiplies sRGB values, like the rest of the simulator.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, normals
from ptmtools.output.served import Served

#: Colour of the sky, 0 to 255, as on the web page.
SKY = (0.16 * 255, 0.17 * 255, 0.19 * 255)
#: Least share of their colour that surfaces without texture and light show, and in buildings that
#: have light.
GLOW, LIT_GLOW = 0.25, 0.7
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
    """Returns the database with colours multiplied by the light of the lamp."""
    surfaces = served.surfaces
    color = surfaces.color * lamps(surfaces.corner)[:, None]
    return replace(served, surfaces=replace(surfaces, color=color))


def as_bytes(colors: Floats) -> NDArray[np.uint8]:
    """Rounds colours to 8 bits."""
    return np.rint(np.clip(colors, 0, 255)).astype(np.uint8)
