"""Pictures of a simplified mesh with its octree texture, as a client shows it by its first levels.

Drawn by OpenGL (`shader`) where there is any, else by rays (`rays`).

Where a picture of a mesh is taken from.

How pictures of octree textures are lit, and what a picture is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.neighbours.apo.model import Octree
from ptmtools.options import option

#: Vertical, degrees.
FIELD_OF_VIEW = 35.0
#: Who looks up or down with less than this of his view level, looks straight up or down: what is
#: level then is rounding.
_STRAIGHT = 2.0**-40


@dataclass(frozen=True)
class View:
    """A pinhole camera with Y up.

    Attributes
    ----------
    eye, target: (3,) where it is, and what is in the middle of the picture.
    width, height: pixels.
    field_of_view: vertical, degrees.
    """

    eye: Floats
    target: Floats
    width: int
    height: int
    field_of_view: float = FIELD_OF_VIEW

    @property
    def axes(self) -> Floats:
        """(3, 3) unit vectors right, up and forward; who looks straight up or down has x to the
        right."""
        ahead = self.target - self.eye
        ahead = ahead / np.linalg.norm(ahead)
        right = np.array([-ahead[2], 0.0, ahead[0]])
        if np.linalg.norm(right) < _STRAIGHT:
            right = np.array([1.0, 0.0, 0.0])
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, ahead), ahead])

    @property
    def half(self) -> tuple[float, float]:
        """Half of the picture's width and height at distance 1."""
        tall = float(np.tan(np.radians(self.field_of_view) / 2))
        return tall * self.width / self.height, tall

    def rays(self, column: Ints, row: Ints) -> Floats:
        """(n, 3) rays, of which the component forward is 1, through middles of pixels; (0, 0) is
        the upper left one."""
        wide, tall = self.half
        right, up, ahead = self.axes
        across = ((column + 0.5) / self.width * 2 - 1)[..., None] * wide
        upward = (1 - (row + 0.5) / self.height * 2)[..., None] * tall
        return np.asarray(ahead + across * right + upward * up)


def view_of(
    points: Floats,
    azimuth: float,
    elevation: float,
    distance: float = 0.0,
    *,
    width: int,
    height: int,
    field_of_view: float = FIELD_OF_VIEW,
) -> View:
    """A view of the middle of (P, 3) points.

    ``azimuth`` 0 looks from +Z, 90 from +X; ``elevation`` 90 from above, degrees. ``distance`` from
    the middle is in diameters (diagonals of the points' box); 0 takes the least that shows all of
    the ball around the box.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    diameter = float(np.linalg.norm(high - low))
    if not diameter > 0:
        raise ValueError("the points are one, of which there is no view")
    turn, rise = np.radians(azimuth), np.radians(elevation)
    from_there = np.array([np.sin(turn) * np.cos(rise), np.sin(rise), np.cos(turn) * np.cos(rise)])
    if distance <= 0:
        angle = np.arctan(np.tan(np.radians(field_of_view) / 2) * min(1.0, width / height))
        distance = float(0.5 / np.sin(angle))
    middle = (low + high) / 2
    return View(middle + distance * diameter * from_there, middle, width, height, field_of_view)


#: Shares of white: everywhere, from the upper left, and from the lower right, which shows relief in
#: the shade.
AMBIENT, KEY, FILL = 0.2, 0.7, 0.2
#: Towards the lights: right, up, and towards the camera.
_KEY, _FILL = (-0.5, 0.65, 0.6), (0.8, -0.3, 0.5)


@dataclass(frozen=True)
class Look:
    """What is shown, and how.

    Attributes
    ----------
    levels: of the octree that are there; 0 shows the mesh's own normals.
    what: "shaded", or "normals" as the octree stores them.
    stone: share of red, green and blue that a surface without colour gives back.
    near: nothing nearer than this share of the farthest is drawn.
    """

    levels: int
    what: str = "shaded"
    stone: tuple[float, float, float] = (0.93, 0.9, 0.85)
    near: float = 2.0**-14

    @property
    def background(self) -> NDArray[np.uint8]:
        """(3,) of pixels that show nothing; no unit normal is stored as black."""
        return np.array([0, 0, 0] if self.what == "normals" else [58, 62, 70], dtype=np.uint8)

    def lights(self, view: View) -> tuple[Floats, Floats]:
        """Unit vectors towards both lights, which go with the camera."""
        axes = view.axes * [[1], [1], [-1]]
        key, fill = (np.array(light) @ axes for light in (_KEY, _FILL))
        return key / np.linalg.norm(key), fill / np.linalg.norm(fill)

    def shown(self, normals: Floats, colors: NDArray[np.uint8] | None, view: View) -> Floats:
        """(n, 3) shares of full light, of unit normals and the (n, 4) colours below them."""
        if self.what == "normals":
            return normals / 2 + 0.5
        key, fill = self.lights(view)
        light = AMBIENT + KEY * np.maximum(normals @ key, 0) + FILL * np.maximum(normals @ fill, 0)
        base = np.array(self.stone) if colors is None else colors[:, :3] / 255
        return np.asarray(np.minimum(base * light[:, None], 1.0))


@dataclass(frozen=True)
class Drawn:
    """A picture, and what its pixels are of.

    Attributes
    ----------
    picture: (h, w, 3) uint8.
    address: (h, w) of the texel; -1 where the mesh's own normal is shown, -2 where nothing is.
    place: (h, w, 3) in the cube; undefined where nothing is.
    stop: (h, w) the depth at which pixels stop; undefined where nothing is.
    """

    picture: NDArray[np.uint8]
    address: Ints
    place: Floats
    stop: Ints

    @property
    def covered(self) -> Bools:
        """(h, w) which pixels show the mesh."""
        return self.address > -2

    @property
    def deepest(self) -> int:
        """The depth beyond which nodes are smaller than the pixels of this view, so that a client
        may stop the transmission (section 4.2); -1 if it shows nothing."""
        return int(self.stop[self.covered].max(initial=-1))


#: Pixels of a side, at most.
WIDEST = 4096


@dataclass(frozen=True)
class RenderOptions:
    """Options of `render`. Raises InputError PTM-I860 for values out of range."""

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
