"""Draws a view of a served database with the finest levels of its textures.

Embree finds the surface of each ray and the layers before it (`ptmtools.rendering.layers`), and
compiled kernels sample the textures. A lit picture has the lamp of
`ptmtools.rendering.light`, and the relief of octree textures and of the normal maps of objects.
Others have baked light (`ptmtools.rendering.tone`), and shade other surfaces without texture by the
angle to the viewer, like the web page. All have the normal maps of materials.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.options import option, require_ranges
from ptmtools.output.served import Served
from ptmtools.progress import Progress, silent
from ptmtools.rendering.light import as_bytes
from ptmtools.rendering.rays import Caster, RayCamera

#: Maximum side of a picture, pixels.
MAX_SIDE = 4096
#: Default field of view, degrees.
FIELD_OF_VIEW = 60.0
#: Rays per pixel along each axis, and the largest picture, in pixels, that has several; larger
#: pictures have one.
_SAMPLES, _MANY_PIXELS = 2, 1 << 22


@dataclass(frozen=True)
class ViewOptions:
    """Options of `draw_view`. Raises InputError PTM-I111 for values out of range."""

    heading: ClassVar[str] = "View"

    viewpoint: int | None = option(
        None, "Number of the viewpoint in the database; 0, the first, by default."
    )
    eye: tuple[float, ...] | None = option(
        None,
        "Position of the eye, in metres, Y up, and yaw in degrees, counter-clockwise from -Z; "
        "overrides --viewpoint.",
        metavar="X,Y,Z[,YAW]",
        numbers=(3, 4),
    )
    look: tuple[float, float, float] | None = option(
        None, "Point to look at, in metres.", metavar="X,Y,Z"
    )
    field_of_view: float | None = option(
        None,
        "Vertical field of view. Default: the field of view of the viewpoint, or "
        f"{FIELD_OF_VIEW:g}.",
        metavar="DEGREES",
    )
    width: int = option(1280, "Width of the picture.", metavar="PIXELS")
    height: int = option(720, "Height of the picture.", metavar="PIXELS")
    max_side: int = option(
        0, "Maximum width and height of the texture levels; 0 uses the finest.", metavar="TEXELS"
    )
    lit: bool = option(
        False,
        "Light the scene with a lamp, and draw the relief of octree textures and normal maps.",
    )

    def __post_init__(self) -> None:
        ranges = {
            "width": (1, MAX_SIDE),
            "height": (1, MAX_SIDE),
            "max_side": (0, 1 << 16),
            "field_of_view": (1, 170),
        }
        require_ranges(self, ranges, "--{name} {value:g} is not between {least} and {most}")
        if self.eye and self.viewpoint is not None:
            raise _option_error("--viewpoint and --eye exclude each other", "use one of them")
        for name, place in (("eye", self.eye), ("look", self.look)):
            if place and not all(map(math.isfinite, place)):
                raise _option_error(f"--{name} is not finite")
        if self.eye and self.look and len(self.eye) > 3:
            raise _option_error("--look and a yaw of --eye exclude each other", "use one of them")


@dataclass(frozen=True)
class Eye:
    """A viewpoint: position (3,) in metres, unit direction (3,), vertical field of view in
    radians, and the cell of the position, None if the index does not state it."""

    position: Floats
    direction: Floats
    field_of_view: float
    cell: int | None = None


def eye_of(served: Served, options: ViewOptions) -> Eye:
    """Returns the selected viewpoint. Raises InputError PTM-I111 if it does not exist."""
    angle, cell = FIELD_OF_VIEW, None
    if options.eye:
        position = np.array(options.eye[:3], dtype=np.float64)
        yaw = math.radians(options.eye[3] if len(options.eye) > 3 else 0.0)
        direction = np.array([-math.sin(yaw), 0.0, -math.cos(yaw)])
    else:
        rows, number = served.index["viewpoints"], options.viewpoint or 0
        if not 0 <= number < len(rows):
            raise InputError(
                "PTM-I111",
                f"has no viewpoint {number}",
                file=served.folder,
                remedy=f"use 0 to {len(rows) - 1}, or --eye" if rows else "use --eye",
            )
        row = rows[number]
        position = np.array(row["position"], dtype=np.float64)
        direction = np.array(row["direction"], dtype=np.float64)
        angle, cell = _vertical(math.degrees(row["fieldOfView"]), options), row.get("cell")
    if options.look:
        direction = np.array(options.look, dtype=np.float64) - position
    length = float(np.linalg.norm(direction))
    if length == 0:
        raise _option_error("--look is the position of the eye")
    return Eye(position, direction / length, math.radians(options.field_of_view or angle), cell)


def draw_view(
    served: Served, options: ViewOptions, progress: Progress = silent
) -> NDArray[np.uint8]:
    """Draws an sRGB picture (height, width, 3); decodes visible textures only.

    Raises
    ------
    InputError: PTM-I111 the viewpoint does not exist.
    DatabaseError, LimitError: see `read_pyramids` and `read_octrees`.
    """
    from ptmtools.rendering.layers import Layers, blend, transparent_of
    from ptmtools.rendering.light import with_lamp
    from ptmtools.rendering.painting import SurfacePainter
    from ptmtools.rendering.tone import tone_at

    eye = eye_of(served, options)
    if options.lit:
        served = with_lamp(served)
    surfaces = served.surfaces
    samples = _SAMPLES if options.width * options.height <= _MANY_PIXELS else 1
    camera = RayCamera(
        options.width * samples,
        options.height * samples,
        eye.field_of_view,
        options.width / options.height,
        options.height,
    )
    painter = SurfacePainter(
        served,
        tone_at(served, eye.position, eye.cell),
        max_side=options.max_side,
        lit=options.lit,
        progress=progress,
    )
    sight = Caster(surfaces, transparent_of(surfaces)).look(camera, eye.position, eye.direction)
    sight, layers = Layers(surfaces).split(sight, painter.alpha)
    painter.load(sight.triangle, *(layer.triangle for layer in layers))
    shown = painter.colors(sight)
    blend(layers, sight, painter.layer, shown)
    grid = (options.height, samples, options.width, samples, 3)
    return as_bytes(shown.reshape(grid).mean(axis=(1, 3)))


def _vertical(degrees: float, options: ViewOptions) -> float:
    """Vertical field of view, degrees, of a picture whose smaller field of view is ``degrees``."""
    if options.width >= options.height:
        return degrees
    half = math.tan(math.radians(degrees) / 2) * options.height / options.width
    return 2 * math.degrees(math.atan(half))


def _option_error(problem: str, remedy: str | None = None) -> InputError:
    return InputError("PTM-I111", problem, remedy=remedy)
