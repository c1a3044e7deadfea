"""Pictures of a simplified mesh with its octree texture, as a client shows it by its first levels.

Drawn by OpenGL (`shader`) where there is any, else by rays (`rays`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.apo.model import Octree
from ptmtools.apo.shading import Drawn, Look
from ptmtools.apo.view import FIELD_OF_VIEW, View, view_of
from ptmtools.arrays import Floats
from ptmtools.errors import InputError, MissingComponentError

#: Pixels of a side, at most.
WIDEST = 4096


@dataclass(frozen=True)
class RenderOptions:
    """
    Attributes
    ----------
    levels: of the octree that are there, from the root on; 0 shows the mesh's own normals.
    azimuth: where the view is taken from, degrees around the Y axis: 0 is +Z, 90 is +X.
    elevation: and degrees above the horizon.
    distance: from the middle of the mesh, in diameters of it; 0 takes the least that shows all.
    field_of_view: vertical, degrees.
    width, height: pixels.
    what: the mesh as lit from the upper left, or the normals as they are stored.
    backend: what draws: gl is OpenGL, embree rays, auto what is there.
    """

    levels: int | None = None
    azimuth: float = 25.0
    elevation: float = 15.0
    distance: float = 0.0
    field_of_view: float = FIELD_OF_VIEW
    width: int = 1024
    height: int = 1024
    what: Literal["shaded", "normals"] = "shaded"
    backend: Literal["auto", "gl", "embree"] = "auto"

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class Rendering:
    """A picture, and what its pixels are of; ``renderer`` is the name of what drew it."""

    drawn: Drawn
    renderer: str

    @property
    def picture(self) -> NDArray[np.uint8]:
        """(h, w, 3)."""
        return self.drawn.picture


def render(
    octree: Octree,
    points: Floats,
    triangles: NDArray[np.integer],
    options: RenderOptions | None = None,
    normals: Floats | None = None,
) -> Rendering:
    """A picture of the simplified mesh of (P, 3) points and (T, 3) triangles, in its own units;
    ``normals`` (P, 3) are its own (else `corner_normals`), which show where no level is there.

    Raises InputError PTM-I860 for options out of range, PTM-I861 for a mesh without extent, and
    MissingComponentError PTM-M500 where OpenGL is asked for and absent.
    """
    options = options or RenderOptions()
    if not len(points) or not np.ptp(points, axis=0).any():
        raise InputError("PTM-I861", "a mesh without extent, of which there is no picture")
    view = view_of(
        points,
        options.azimuth,
        options.elevation,
        options.distance,
        width=options.width,
        height=options.height,
        field_of_view=options.field_of_view,
    )
    return render_view(
        octree, points, triangles, view, options.levels, options.what, options.backend, normals
    )


def render_view(
    octree: Octree,
    points: Floats,
    triangles: NDArray[np.integer],
    view: View,
    levels: int | None = None,
    what: str = "shaded",
    backend: str = "auto",
    normals: Floats | None = None,
) -> Rendering:
    """The same from a given view, in the units of the mesh."""
    there = octree.levels if levels is None else min(levels, octree.levels)
    look = Look(there, what)
    corners = ((points - octree.low) / octree.side)[triangles]
    own = _own(points, triangles, normals) if there == 0 else np.zeros_like(corners)
    inside = View(
        (view.eye - octree.low) / octree.side,
        (view.target - octree.low) / octree.side,
        view.width,
        view.height,
        view.field_of_view,
    )
    if backend != "embree":
        from ptmtools.apo.shader import OctreeShader

        try:
            with OctreeShader(octree) as shader:
                return Rendering(shader.draw(corners, own, inside, look), shader.name)
        except MissingComponentError:
            if backend == "gl":
                raise
    from importlib.metadata import version

    from ptmtools.apo.rays import draw

    name = f"Embree (embreex {version('embreex')})"
    return Rendering(draw(octree, corners, own, inside, look), name)


def _own(points: Floats, triangles: NDArray[np.integer], normals: Floats | None) -> Floats:
    if normals is not None:
        return np.asarray(np.asarray(normals, dtype=np.float64)[triangles])
    from ptmtools.apo.normals import corner_normals

    return corner_normals(points, triangles)


def _check(options: RenderOptions) -> None:
    """Raises InputError PTM-I860 for what is out of range."""
    ranges = {
        "levels": (0, 64, options.levels if options.levels is not None else 1),
        "azimuth": (-360, 360, options.azimuth),
        "elevation": (-90, 90, options.elevation),
        "distance": (0, 1e6, options.distance),
        "field_of_view": (1, 150, options.field_of_view),
        "width": (1, WIDEST, options.width),
        "height": (1, WIDEST, options.height),
    }
    for name, (least, most, value) in ranges.items():
        if not least <= value <= most:
            raise InputError(
                "PTM-I860",
                f"{name.replace('_', ' ')} {value:g} is not between {least:g} and {most:g}",
            )
