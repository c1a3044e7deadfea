"""The item buffer by rasterisation: OpenGL through EGL, no window, hardware or Mesa.

Every fragment writes its triangle's number into R32UI pixels. The views of many sample points lie
side by side in one large target, which is cleared and read once; each is a draw with a viewport of
its own. Measured and rejected: one instanced draw for all points, tiles told apart in the shader
(in a 2 mm cell beside walls of 10 m adding a tile's place to a position costs whole pixels);
occlusion queries (slower), layered cube rendering (slower, or wrong in moderngl), a histogram in a
compute shader (bit for bit the same, and needs OpenGL 4.3).

- The eye is subtracted in float64's precision: positions and eyes travel as two floats each.
- Depth is linear, w / far. A perspective depth of 24 bits with a small near plane loses pictures
  that hang 1 mm off a wall at 5 to 20 m; linear ones resolve 6e-8 of the farthest depth.
- The projection has no far plane, and its near plane only clips.
- Only what can show is drawn (`_Culling`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.eyes import Eyes
from ptmtools.coverage.item_buffer import BEFORE, VIEWS, Surfaces
from ptmtools.errors import MissingComponentError

APT = "apt install libegl1 libgl1 libgl1-mesa-dri"
#: Renderers that run on the processor.
SOFTWARE = re.compile(r"llvmpipe|softpipe|swrast|swiftshader|software", re.IGNORECASE)
#: The widest target, pixels a side, but for larger views. Software needs no large one.
WIDEST = {True: 2048, False: 4096}
#: Rays that look for cells outside the PVS, whose surfaces then have to be drawn too: a side of
#: a view, and points.
PROBE_FACE, PROBE_POINTS = 8, 16

VERTEX = """
#version 330
in vec3 high;
in vec3 low;
uniform vec3 eye_high;
uniform vec3 eye_low;
uniform vec2 shift;
uniform mat3 view;  // rows right, up, forward
uniform float near;
out float w;
void main() {
    vec3 p = view * ((high - eye_high) + (low - eye_low));
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


class OpenGLRenderer:
    """Draws with OpenGL; to be used and closed by the thread that made it."""

    backend = "gl"

    def __init__(self, context: Any, surfaces: Surfaces, face: int) -> None:
        """Uploads ``surfaces`` to a moderngl context, for views of ``face`` pixels a side. The
        context then belongs to the renderer."""
        import moderngl

        self.name = str(context.info["GL_RENDERER"])
        self._context = context
        self._surfaces = surfaces
        self._face = face
        self._rays: EmbreeRenderer | None = None
        self._probe: EmbreeRenderer | None = None
        self._culling = _Culling(surfaces)
        most = int(context.info["GL_MAX_TEXTURE_SIZE"])
        widest = max(min(WIDEST[is_software(self.name)], most), 3 * face)
        self._tiles = widest // face  # along a side of the target
        self._side = self._tiles * face
        self.most = self._tiles**2 // len(VIEWS)
        place = surfaces.place
        self._box = np.stack([place.min(axis=0), place.max(axis=0)]) if len(place) else VIEWS[0, :2]
        self._program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        high = place.astype(np.float32)
        low = (place - high).astype(np.float32)
        self._vertices = context.buffer(np.hstack([high, low]).tobytes()) if len(place) else None
        size = (self._side, self._side)
        depth = context.depth_renderbuffer(size)  # 24 bits
        self._layers = 1 if surfaces.opaque.all() else 2
        self._items = [context.texture(size, 1, dtype="u4") for _ in range(self._layers)]
        self._targets = [context.framebuffer([items], depth) for items in self._items]
        context.enable_only(moderngl.DEPTH_TEST)
        context.depth_func = "<"

    def show(self, eyes: Eyes, needed: NDArray[np.bool_] | None = None) -> NDArray[np.int32]:
        """See `Renderer.show`."""
        shape = (self._layers, len(eyes), len(VIEWS), self._face**2)
        if self._vertices is None or not len(eyes):
            return np.full(shape, -1, dtype=np.int32)
        place = self._surfaces.normalised(eyes.point)
        lists = self._culling.lists(place, self._face, self._drawn(eyes, needed))
        order = np.concatenate([part for view in lists for part in view])
        index = self._context.buffer(self._surfaces.triangle[order].tobytes() or bytes(12))
        content = [(self._vertices, "3f 3f", "high", "low")]
        drawing = self._context.vertex_array(self._program, content, index_buffer=index)
        try:
            drawn = [self._draw(drawing, lists, layer, eyes) for layer in range(self._layers)]
        finally:
            drawing.release()
            index.release()
        return np.append(-1, order).astype(np.int32)[np.stack(drawn)].reshape(shape)

    def trace(
        self, eyes: Eyes, pixels: NDArray[np.int64]
    ) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """See `Renderer.trace`; by Embree, whose trees are built at the first call."""
        if self._rays is None:
            self._rays = EmbreeRenderer(self._surfaces, self._face)
        return self._rays.trace(eyes, pixels)

    def _drawn(self, eyes: Eyes, needed: NDArray[np.bool_] | None) -> NDArray[np.bool_] | None:
        """The cells whose surfaces are to be drawn: those ``needed``, and those outside that a few
        rays meet, so that nothing shows through where they stand. None for all."""
        if needed is None or needed.all():
            return None
        if self._probe is None:
            self._probe = EmbreeRenderer(self._surfaces, PROBE_FACE)
        met = self._probe.show(eyes.part(slice(PROBE_POINTS)))
        cells = self._surfaces.cell[np.unique(met[met >= 0])]
        drawn = needed.copy()
        drawn[cells[cells >= 0]] = True
        return drawn

    def _draw(
        self, drawing: Any, lists: list[list[NDArray[np.int64]]], layer: int, eyes: Eyes
    ) -> NDArray[np.int64]:
        """One layer of all views, before the depth that is there: (K, 6, face²) triangles in the
        order of the upload, from 1; 0 for none."""
        target, face, tiles = self._targets[layer], self._face, self._tiles
        rows = -(-len(VIEWS) * len(eyes) // tiles)
        size = (self._side, rows * face)
        if layer == 0:
            target.clear(depth=1.0, viewport=size)
        # OpenGL leaves undefined what clearing does to a target of integers.
        self._items[layer].write(bytes(4 * size[0] * size[1]), viewport=(0, 0, *size))
        target.use()
        parts = self._parts(lists, layer)
        for k, told in enumerate(self._told(eyes, layer)):
            for name, value in told.items():
                self._program[name].value = value
            for direction, (view, first, count) in enumerate(parts):
                if count:
                    tile = len(VIEWS) * k + direction
                    target.viewport = (tile % tiles * face, tile // tiles * face, face, face)
                    self._program["view"].value = view
                    self._program["base"].value = first + 1
                    drawing.render(vertices=3 * count, first=3 * first)
        target.viewport = (0, 0, *size)
        found = np.frombuffer(target.read(size, components=1, dtype="u4"), dtype=np.uint32)
        split = found.reshape(rows, face, tiles, face)
        each = split.transpose(0, 2, 1, 3).reshape(rows * tiles, face**2)
        return np.asarray(each[: len(VIEWS) * len(eyes)], dtype=np.int64)

    @staticmethod
    def _parts(
        lists: list[list[NDArray[np.int64]]], layer: int
    ) -> list[tuple[tuple[float, ...], int, int]]:
        """For each view its axes, and the first and the number of its triangles of a layer."""
        found, first = [], 0
        for view, parts in zip(VIEWS, lists, strict=True):
            before = first + sum(map(len, parts[:layer]))
            found.append((tuple(view.T.reshape(-1).tolist()), before, len(parts[layer])))
            first += sum(map(len, parts))
        return found

    def _told(self, eyes: Eyes, layer: int) -> Iterator[dict[str, Any]]:
        """What the shaders are told of each sample point."""
        place = self._surfaces.normalised(eyes.point)
        high = place.astype(np.float32)
        low = (place - high).astype(np.float32)
        # A surface at distance r from the eye has a depth of at least r / √3 wherever it is seen.
        near = eyes.near * self._surfaces.scale / 2
        # Twice the farthest depth: what is farthest still passes the test against 1.
        far = 2 * np.abs(self._box[:, None] - place).max(axis=(0, 2))
        for k in range(len(eyes)):
            yield {
                "eye_high": tuple(high[k].tolist()),
                "eye_low": tuple(low[k].tolist()),
                "shift": tuple((eyes.shift[k] / self._face).tolist()),
                "near": float(near[k]),
                "depth_scale": (1.0 if layer == 0 else BEFORE) / float(far[k]),
            }

    def close(self) -> None:
        """Gives the context back."""
        self._context.release()
        self._rays = self._probe = None


class _Culling:
    """Which surfaces can show in a view from somewhere in a box: those of the cells that are to be
    drawn, or of none, that reach into the view's pyramid."""

    def __init__(self, surfaces: Surfaces) -> None:
        self._surfaces = surfaces
        corners = surfaces.place[surfaces.triangle]
        self._low, self._high = corners.min(axis=1), corners.max(axis=1)

    def lists(
        self, place: NDArray[np.float64], face: int, drawn: NDArray[np.bool_] | None
    ) -> list[list[NDArray[np.int64]]]:
        """For each of the six views the opaque and the transparent triangles to be drawn, seen from
        the (K, 3) points; ``drawn`` (C,) are the cells, None for all."""
        cell = self._surfaces.cell
        if drawn is None:
            kept = np.arange(len(cell))
        else:
            wanted = np.append(drawn, False)[cell].any(axis=1) | (cell < 0).all(axis=1)
            kept = np.flatnonzero(wanted)
        # Where the surface is, seen from the points.
        low = self._low[kept] - place.max(axis=0)
        high = self._high[kept] - place.min(axis=0)
        lists = []
        for right, up, forward in VIEWS:
            _, deepest = _along(forward, low, high)
            ahead = deepest > 0
            for axis in (right, up):
                least, most = _along(axis, low, high)
                aside = np.maximum(np.maximum(least, -most), 0.0)
                ahead &= aside <= (1 + 1 / face) * deepest
            shown = kept[ahead]
            opaque = self._surfaces.opaque[shown]
            lists.append([shown[opaque], shown[~opaque]])
        return lists


def _along(
    axis: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
