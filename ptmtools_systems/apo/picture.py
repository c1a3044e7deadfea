"""Renders a simplified mesh with its octree texture, as a client displays it with its first levels.

OpenGL draws (`shader`) where it is available, Embree's rays (`rays`) elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.folder_kinds import FolderPicture
from ptmtools.options import option, require_ranges
from ptmtools.quantities import count
from ptmtools_systems.apo.model import Octree
from ptmtools_systems.apo.view import FIELD_OF_VIEW, Look, OctreePicture, view_of

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
        "Distance from the centre of the mesh, in diameters; 0 selects the smallest distance at "
        "which the whole mesh is visible.",
    )
    field_of_view: float = option(FIELD_OF_VIEW, "Vertical field of view.", metavar="DEGREES")
    width: int = option(1024, "Width of the picture.", metavar="PIXELS")
    height: int = option(1024, "Height of the picture.", metavar="PIXELS")
    what: Literal["shaded", "normals"] = option(
        "shaded", "Draw the mesh lit from the upper left, or its normals as colours."
    )
    backend: Literal["auto", "gl", "embree"] = option(
        "auto",
        "Renderer: gl (OpenGL), embree (rays on the processor), or auto (gl if available, "
        "otherwise embree).",
    )

    def __post_init__(self) -> None:
        ranges = {
            "levels": (0, 64),
            "azimuth": (-360, 360),
            "elevation": (-90, 90),
            "distance": (0, 1e6),
            "field_of_view": (1, 150),
            "width": (1, WIDEST),
            "height": (1, WIDEST),
        }
        require_ranges(self, ranges, "{field} {value:g} is not between {least:g} and {most:g}")


def render(
    octree: Octree,
    points: Floats,
    triangles: NDArray[np.integer],
    options: RenderOptions = RenderOptions(),
    normals: Floats | None = None,
) -> OctreePicture:
    """A picture of the simplified mesh of (P, 3) points and (T, 3) triangles, in its own units;
    ``normals`` (P, 3) are its own (else `corner_normals`), which are displayed without levels.

    Raises InputError PTM-I111 for options out of range, PTM-I247 for a mesh without extent, and
    MissingComponentError PTM-M500 if OpenGL is required and absent.
    """
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
    eye, target = ((place - octree.low) / octree.side for place in (view.eye, view.target))
    view = replace(view, eye=eye, target=target)
    available = octree.levels if options.levels is None else min(options.levels, octree.levels)
    corners = ((points - octree.low) / octree.side)[triangles]
    normal = np.zeros_like(corners)
    if available == 0:
        from ptmtools_systems.apo.normals import corner_normals

        normal = corner_normals(points, triangles) if normals is None else normals[triangles]
    mesh = octree, corners, normal, view, Look(available, options.what)
    if options.backend != "embree":
        from ptmtools_systems.apo import shader

        try:
            return shader.draw(*mesh)
        except MissingComponentError:
            if options.backend == "gl":
                raise
    from ptmtools_systems.apo import rays

    return rays.draw(*mesh)


def draw_folder(folder: Path, options: RenderOptions) -> FolderPicture:
    """A picture of the octree texture in a folder.

    Raises what `read_mesh`, `read_octree` and `render` raise.
    """
    from ptmtools_systems.apo.files import read_mesh, read_octree

    mesh, octree = read_mesh(folder), read_octree(folder)
    frame = render(octree, mesh.points, mesh.triangles, options, mesh.normals.astype(np.float64))
    levels = octree.levels if options.levels is None else min(options.levels, octree.levels)
    document = {"levels": levels, "octree_levels": octree.levels, "renderer": frame.renderer}
    text = f"{levels} of {count(octree.levels, 'level')}, {frame.renderer}"
    return FolderPicture(frame.picture, document, text)
