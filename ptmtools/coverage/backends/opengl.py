"""The item buffer by rasterisation: OpenGL through EGL, no window, hardware or Mesa.

Every fragment writes its triangle's number into R32UI pixels. The views of many sample points lie
side by side in one large target, which is cleared and read once; each is a draw with a viewport of
its own. Depth is linear, w / far; the projection has no far plane, and its near plane only clips.

Measured and rejected: one instanced draw for all points, tiles distinguished in the shader (in a
2 mm cell beside walls of 10 m adding a tile's place to a position costs whole pixels); occlusion
queries (slower), layered cube rendering (slower, or wrong in moderngl), a histogram in a compute
shader (bit for bit the same, and needs OpenGL 4.3).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.coverage.backends.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import BEFORE, VIEWS, ItemSurfaces
from ptmtools.coverage.sample_points import SamplePoints
from ptmtools.errors import MissingComponentError

APT = "apt install libegl1 libgl1 libgl1-mesa-dri"
#: Renderers that run on the processor.
SOFTWARE = re.compile(r"llvmpipe|softpipe|swrast|swiftshader|software", re.IGNORECASE)
#: The widest target, pixels a side, except for larger views. Software needs no large one.
WIDEST = {True: 2048, False: 4096}
#: Rays that look for cells outside the PVS, whose surfaces then have to be drawn too: a side of
#: a view, and points.
PROBE_FACE, PROBE_POINTS = 8, 16
#: Time of Mesa's rasteriser, µs, for each triangle (of the PVS, in those of the six views that
#: it can show in) and each pixel. Fitted, as `embree.RAY_COST`, to `benchmarks/ach.py`; only their
#: proportions matter.
TRIANGLE_COST, PIXEL_COST = 1.0, 0.05
#: Of a graphics card for each sample point, triangle and pixel; fitted to an NVIDIA H200.
CARD_POINT_COST, CARD_TRIANGLE_COST, CARD_PIXEL_COST = 300.0, 0.15, 0.04

VERTEX = """
#version 330
in vec3 high;
in vec3 low;
uniform vec3 point_high;
uniform vec3 point_low;
uniform vec2 shift;
uniform mat3 view;  // rows right, up, forward
uniform float near;
out float w;
void main() {
    vec3 p = view * ((high - point_high) + (low - point_low));
    w = p.z;
    gl_Position = vec4(p.xy - shift * p.z, p.z - 2.0 * near, p.z);
}
"""

FRAGMENT = """
#version 330
in float w;
uniform float depth_scale;
uniform int base;
out uint triangle;
void main() {
    gl_FragDepth = w * depth_scale;
    triangle = uint(gl_PrimitiveID + base);
}
"""


def cost(triangles: float, pixels: int, gpu: int | None) -> float:
    """See `Backend.coster`."""
    context = create_context(gpu)
    software = is_software(context.info["GL_RENDERER"])
    context.release()
    if software:
        return TRIANGLE_COST * triangles + PIXEL_COST * pixels
    return CARD_POINT_COST + CARD_TRIANGLE_COST * triangles + CARD_PIXEL_COST * pixels


class OpenGLRenderer:
    """Draws with OpenGL; to be used and closed by the thread that made it."""

    def __init__(self, surfaces: ItemSurfaces, face: int, gpu: int | None = None) -> None:
        """Uploads ``surfaces`` to a graphics device, for views of ``face`` pixels a side; raises as
        `create_context`."""
        self._context = context = create_context(gpu)
        self.name = str(context.info["GL_RENDERER"])
        self._surfaces = surfaces
        self._face = face
        self._rays: EmbreeRenderer | None = None
        self._probe: EmbreeRenderer | None = None
        corners = surfaces.vertex[surfaces.triangle]
        self._low, self._high = corners.min(axis=1), corners.max(axis=1)
        ends = surfaces.vertex if len(surfaces.vertex) else np.zeros((1, 3))
        self._box = np.stack([ends.min(axis=0), ends.max(axis=0)])
        largest = int(context.info["GL_MAX_TEXTURE_SIZE"])
        widest = max(min(WIDEST[is_software(self.name)], largest), 3 * face)
        self._tiles = widest // face  # along a side of the target
        self.most = self._tiles**2 // len(VIEWS)
        self._program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        vertex = np.hstack(_two_floats(surfaces.vertex))
        self._vertices = context.buffer(vertex.tobytes()) if len(vertex) else None
        size = (self._tiles * face,) * 2
        depth = context.depth_renderbuffer(size)  # 24 bits
        self._layers = 1 if surfaces.opaque.all() else 2
        self._items = [context.texture(size, 1, dtype="u4") for _ in range(self._layers)]
        self._targets = [context.framebuffer([items], depth) for items in self._items]
        context.enable_only(context.DEPTH_TEST)
        context.depth_func = "<"

    def show(self, points: SamplePoints, needed: Bools | None = None) -> NDArray[np.int32]:
        """See `Renderer.show`."""
        shape = (self._layers, len(points), len(VIEWS), self._face**2)
        if self._vertices is None or not len(points):
            return np.full(shape, -1, dtype=np.int32)
        lists = self.lists(points, needed)
        order = np.concatenate([part for view in lists for part in view])
        count = np.array([[len(part) for part in view] for view in lists])
        first = np.cumsum(count).reshape(count.shape) - count
        index = self._context.buffer(self._surfaces.triangle[order].tobytes() or bytes(12))
        content = [(self._vertices, "3f 3f", "high", "low")]
        drawing = self._context.vertex_array(self._program, content, index_buffer=index)
        try:
            drawn = [
                self._draw(drawing, first[:, layer], count[:, layer], layer, points)
                for layer in range(self._layers)
            ]
        finally:
            drawing.release()
            index.release()
        return np.append(-1, order).astype(np.int32)[np.stack(drawn)].reshape(shape)

    def trace(self, points: SamplePoints, pixels: Ints) -> tuple[NDArray[np.int32], Floats]:
        """See `Renderer.trace`; by Embree, whose trees are built at the first call."""
        self._rays = self._rays or EmbreeRenderer(self._surfaces, self._face)
        return self._rays.trace(points, pixels)

    def lists(self, points: SamplePoints, needed: Bools | None = None) -> list[list[Ints]]:
        """For each of the six views the opaque and the transparent triangles to be drawn: those
        that reach into the view's pyramid from somewhere in the box around the points, of the cells
        ``needed`` and of none, and of those outside that a few rays meet, so that nothing shows
        through in their place. (All cells: 1.4 times the processor time in the museum and the
        hospital, 2.1 times in willowgarage, preset ``paper``.)"""
        cell = self._surfaces.cell
        kept = np.arange(len(cell))
        if needed is not None and not needed.all():
            self._probe = self._probe or EmbreeRenderer(self._surfaces, PROBE_FACE)
            met = self._probe.show(points.part(slice(PROBE_POINTS)))
            drawn = np.append(needed, False)
            drawn[cell[np.unique(met[met >= 0])]] = True
            drawn[-1] = False  # the other side of most walls
            kept = np.flatnonzero(drawn[cell].any(axis=1) | (cell < 0).all(axis=1))
        position = self._surfaces.normalise(points.position)
        # Extent of the triangles, seen from the points.
        low = self._low[kept] - position.max(axis=0)
        high = self._high[kept] - position.min(axis=0)
        lists = []
        for right, up, forward in VIEWS:
            _, deepest = _box_range(forward, low, high)
            ahead = deepest > 0
            for axis in (right, up):
                nearest, farthest = _box_range(axis, low, high)
                sideways = np.maximum(np.maximum(nearest, -farthest), 0.0)
                ahead &= sideways <= (1 + 1 / self._face) * deepest
            shown = kept[ahead]
            opaque = self._surfaces.opaque[shown]
            lists.append([shown[opaque], shown[~opaque]])
        return lists

    def _draw(
        self, drawing: Any, first: Ints, count: Ints, layer: int, points: SamplePoints
    ) -> Ints:
        """One layer of all views, each of ``count`` triangles from its ``first`` on, in front of
        the stored depth: (K, 6, face²) triangles in the order of the upload, from 1; 0 for none."""
        target, face, tiles = self._targets[layer], self._face, self._tiles
        rows = -(-len(VIEWS) * len(points) // tiles)
        size = (tiles * face, rows * face)
        if layer == 0:
            target.clear(depth=1.0, viewport=size)
        # OpenGL leaves undefined what clearing does to a target of integers.
        self._items[layer].write(bytes(4 * size[0] * size[1]), viewport=(0, 0, *size))
        target.use()
        for k, uniforms in enumerate(self._uniforms(points, layer)):
            for name, value in uniforms.items():
                self._program[name].value = value
            for v in np.flatnonzero(count).tolist():
                tile = len(VIEWS) * k + v
                target.viewport = (tile % tiles * face, tile // tiles * face, face, face)
                self._program["view"].value = tuple(VIEWS[v].T.reshape(-1).tolist())
                self._program["base"].value = int(first[v]) + 1
                drawing.render(vertices=3 * int(count[v]), first=3 * int(first[v]))
        target.viewport = (0, 0, *size)
        pixels = np.frombuffer(target.read(size, components=1, dtype="u4"), dtype=np.uint32)
        split = pixels.reshape(rows, face, tiles, face)
        images = split.transpose(0, 2, 1, 3).reshape(rows * tiles, face**2)
        return np.asarray(images[: len(VIEWS) * len(points)], dtype=np.int64)

    def _uniforms(self, points: SamplePoints, layer: int) -> Iterator[dict[str, Any]]:
        """The shaders' variables for each sample point."""
        position = self._surfaces.normalise(points.position)
        high, low = _two_floats(position)
        # A surface at distance r from the point has a depth of at least r / √3 wherever it is seen.
        near = points.near * self._surfaces.scale / 2
        # Twice the farthest depth: what is farthest still passes the test against 1.
        depth = 2 * np.abs(self._box[:, None] - position).max(axis=(0, 2))
        for k in range(len(points)):
            yield {
                "point_high": tuple(high[k].tolist()),
                "point_low": tuple(low[k].tolist()),
                "shift": tuple((points.shift[k] / self._face).tolist()),
                "near": float(near[k]),
                "depth_scale": (1.0 if layer == 0 else BEFORE) / float(depth[k]),
            }

    def close(self) -> None:
        """Gives the context back."""
        self._context.release()
        self._rays = self._probe = None


def _two_floats(values: Floats) -> tuple[Singles, Singles]:
    """Values rounded to float32, and the remainders."""
    high = values.astype(np.float32)
    return high, (values - high).astype(np.float32)


def _box_range(axis: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Least and greatest coordinates of (n, 3) boxes along an axis of the coordinates."""
    i = int(np.argmax(np.abs(axis)))
    return (low[:, i], high[:, i]) if axis[i] > 0 else (-high[:, i], -low[:, i])


def create_context(gpu: int | None = None) -> Any:
    """A moderngl context without a window, on the EGL device with number ``gpu``, or the first;
    raises `MissingComponentError` PTM-M500 where there is no OpenGL 3.3."""
    try:
        import moderngl

        settings: dict[str, Any] = {"backend": "egl"}
        if gpu is not None:
            settings["device_index"] = gpu
        return moderngl.create_context(require=330, standalone=True, **settings)
    except Exception as error:  # moderngl raises bare Exception, ctypes OSError
        device = "" if gpu is None else f" on device {gpu}"
        raise MissingComponentError(
            "PTM-M500",
            f"no OpenGL to draw with{device} ({error})",
            remedy=f"{APT}, or choose the embree backend",
        ) from error


def is_software(renderer: str) -> bool:
    """Whether an OpenGL renderer, by its own name, runs on the processor."""
    return SOFTWARE.search(renderer) is not None
