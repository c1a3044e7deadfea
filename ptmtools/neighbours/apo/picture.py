"""Renders a simplified mesh with its octree texture, as a client displays it with its first levels.

OpenGL draws (`shader`) where it is available, Embree's rays (`rays`) elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.neighbours.apo.model import Octree
from ptmtools.neighbours.apo.view import FIELD_OF_VIEW, Frame, Look, View, view_of
from ptmtools.options import option

#: Most pixels of a side.
WIDEST = 4096


@dataclass(frozen=True)
class RenderOptions:
    """Options of `render`. Raises InputError PTM-I111 for values out of range."""

    heading: ClassVar[str] = "Picture of an octree texture"

    levels: int | None = option(
        None, "Levels of the octree to draw, from the root on; 0 draws the normals of the mesh."
    )
    azimuth: float = option(
        25.0,
        "Direction of the view around the Y axis: 0 is from +Z, 90 from +X.",
        metavar="DEGREES",
    )
    elevation: float = option(15.0, "Direction of the view above the horizon.", metavar="DEGREES")
    distance: float = option(
        0.0,
        "Distance from the centre of the mesh, in diameters; 0 for the smallest that shows all of "
        "it.",
    )
    field_of_view: float = option(FIELD_OF_VIEW, "Vertical field of view.", metavar="DEGREES")
    width: int = option(1024, "Width of the picture.", metavar="PIXELS")
    height: int = option(1024, "Height of the picture.", metavar="PIXELS")
    what: Literal["shaded", "normals"] = option(
        "shaded", "Draw the mesh lit from the upper left, or its normals as colours."
    )
    backend: Literal["auto", "gl", "embree"] = option(
        "auto", "Renderer: OpenGL, rays on the processor, or whichever can run here."
    )

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class Rendering:
    """A picture with data of its pixels; ``renderer`` is the name of the renderer."""

    drawn: Frame
    renderer: str

    @property
    def picture(self) -> NDArray[np.uint8]:
        """(h, w, 3) pixels."""
        return self.drawn.picture


def render(
    octree: Octree,
    points: Floats,
    triangles: NDArray[np.integer],
    options: RenderOptions | None = None,
    normals: Floats | None = None,
) -> Rendering:
    """A picture of the simplified mesh of (P, 3) points and (T, 3) triangles, in its own units;
    ``normals`` (P, 3) are its own (else `corner_normals`), which are displayed without levels.

    Raises InputError PTM-I111 for options out of range, PTM-I247 for a mesh without extent, and
    MissingComponentError PTM-M500 if OpenGL is required and absent.
    """
    options = options or RenderOptions()
    if not len(points) or not np.ptp(points, axis=0).any():
        raise InputError("PTM-I247", "a mesh without extent, of which there is no picture")
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
    """As `render`, from a given view, in the units of the mesh."""
    available = octree.levels if levels is None else min(levels, octree.levels)
    look = Look(available, what)
    corners = ((points - octree.low) / octree.side)[triangles]
    own = _own(points, triangles, normals) if available == 0 else np.zeros_like(corners)
    inside = View(
        (view.eye - octree.low) / octree.side,
        (view.target - octree.low) / octree.side,
        view.width,
        view.height,
        view.field_of_view,
    )
    if backend != "embree":
        from ptmtools.neighbours.apo.shader import OctreeShader

        try:
            with OctreeShader(octree) as shader:
                return Rendering(shader.draw(corners, own, inside, look), shader.name)
        except MissingComponentError:
            if backend == "gl":
                raise
    from importlib.metadata import version

    from ptmtools.neighbours.apo.rays import draw

    name = f"Embree (embreex {version('embreex')})"
    return Rendering(draw(octree, corners, own, inside, look), name)


def _own(points: Floats, triangles: NDArray[np.integer], normals: Floats | None) -> Floats:
    if normals is not None:
        return np.asarray(np.asarray(normals, dtype=np.float64)[triangles])
    from ptmtools.neighbours.apo.normals import corner_normals

    return corner_normals(points, triangles)


def _check(options: RenderOptions) -> None:
    """Raises InputError PTM-I111 for values out of range."""
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
                "PTM-I111",
                f"{name.replace('_', ' ')} {value:g} is not between {least:g} and {most:g}",
            )
