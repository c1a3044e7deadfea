"""The item buffer by rasterisation: OpenGL through EGL, no window, hardware or Mesa.

Six plain draws into one strip of R32UI pixels, each fragment writing its triangle's number, and
one read. Measured and rejected: occlusion queries (slower), layered cube rendering (slower, or
wrong in moderngl), a histogram in a compute shader (bit for bit the same, and needs OpenGL 4.3).

- The eye is subtracted in float64's precision: a position travels as two floats, high and low.
- Depth is linear, w / far. A perspective depth of 24 bits with a small near plane loses pictures
  that hang 1 mm off a wall at 5 to 20 m; linear ones resolve 6e-8 of the farthest depth.
- The projection has no far plane, and its near plane only clips.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import BEFORE, VIEWS, Surfaces
from ptmtools.errors import MissingComponentError

APT = "apt install libegl1 libgl1 libgl1-mesa-dri"
#: Renderers that run on the processor.
SOFTWARE = re.compile(r"llvmpipe|softpipe|swrast|swiftshader|software", re.IGNORECASE)

VERTEX = """
#version 330
in vec3 high;
in vec3 low;
uniform vec3 eye_high;
uniform vec3 eye_low;
uniform mat3 view;  // rows right, up, forward
uniform float near;
out float w;
void main() {
    vec3 p = view * ((high - eye_high) + (low - eye_low));
    w = p.z;
    gl_Position = vec4(p.x, p.y, p.z - 2.0 * near, p.z);
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
        opaque = np.flatnonzero(surfaces.opaque)
        transparent = np.flatnonzero(~surfaces.opaque)
        self._order = np.concatenate([opaque, transparent])
        self._split = len(opaque)
        place = surfaces.place
        self._box = np.stack([place.min(axis=0), place.max(axis=0)]) if len(place) else VIEWS[0, :2]
        self._program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self._vertices: Any = None
        if len(self._order):
            high = place.astype(np.float32)
            low = (place - high).astype(np.float32)
            self._vertices = context.vertex_array(
                self._program,
                [(context.buffer(np.hstack([high, low]).tobytes()), "3f 3f", "high", "low")],
                index_buffer=context.buffer(surfaces.triangle[self._order].tobytes()),
            )
        size = (len(VIEWS) * face, face)
        depth = context.depth_renderbuffer(size)  # 24 bits
        self._background = bytes(4 * size[0] * size[1])
        self._items = [
            context.texture(size, 1, dtype="u4") for _ in range(2 if len(transparent) else 1)
        ]
        self._targets = [context.framebuffer([items], depth) for items in self._items]
        context.enable_only(moderngl.DEPTH_TEST)
        context.depth_func = "<"

    def layers(self, point: NDArray[np.float64], near: float) -> NDArray[np.int64]:
        """See `Renderer.layers`."""
        if self._vertices is None:
            return np.full((1, len(VIEWS) * self._face**2), -1, dtype=np.int64)
        eye = self._surfaces.normalised(point)
        high = eye.astype(np.float32)
        self._program["eye_high"].value = tuple(high.tolist())
        self._program["eye_low"].value = tuple((eye - high).astype(np.float32).tolist())
        # A surface at distance r from the eye has a depth of at least r / √3 wherever it is seen.
        self._program["near"].value = near * self._surfaces.scale / 2
        # Twice the farthest depth: what is farthest still passes the test against 1.
        far = 2 * float(np.abs(self._box - eye).max())
        self._targets[0].clear(depth=1.0)
        found = [self._draw(0, 0, self._split, 1 / far)]
        if len(self._targets) > 1:
            count = len(self._order) - self._split
            found.append(self._draw(1, self._split, count, BEFORE / far))
        return np.append(-1, self._order)[np.stack(found)]

    def traced(self, point: NDArray[np.float64], pixels: NDArray[np.int64]) -> NDArray[np.int64]:
        """See `Renderer.traced`; by Embree, whose trees are built at the first call."""
        if self._rays is None:
            self._rays = EmbreeRenderer(self._surfaces, self._face)
        return self._rays.traced(point, pixels)

    def _draw(self, layer: int, first: int, count: int, depth_scale: float) -> NDArray[np.int64]:
        """One layer of the six views, before the depth that is there: (6 face²,) triangles in the
        order of the upload, from 1; 0 for none."""
        face, target = self._face, self._targets[layer]
        # OpenGL leaves undefined what clearing does to a target of integers.
        self._items[layer].write(self._background)
        self._program["depth_scale"].value = depth_scale
        self._program["base"].value = first + 1
        target.use()
        for i, view in enumerate(VIEWS if count else ()):
            target.viewport = (i * face, 0, face, face)
            self._program["view"].value = tuple(view.T.reshape(-1))
            self._vertices.render(vertices=3 * count, first=3 * first)
        target.viewport = (0, 0, len(VIEWS) * face, face)
        strip = np.frombuffer(target.read(components=1, dtype="u4"), dtype=np.uint32)
        views = strip.reshape(face, len(VIEWS), face).transpose(1, 0, 2)
        return np.asarray(views.reshape(-1), dtype=np.int64)

    def close(self) -> None:
        """Gives the context back."""
        self._context.release()
        self._rays = None


def create_context() -> Any:
    """A moderngl context without a window; raises `MissingComponentError` PTM-M500 where there is
    no OpenGL 3.3."""
    try:
        import moderngl

        settings: dict[str, Any] = {"backend": "egl"}
        return moderngl.create_context(require=330, standalone=True, **settings)
    except Exception as error:  # moderngl raises bare Exception, ctypes OSError
        raise MissingComponentError(
            "PTM-M500",
            f"no OpenGL to draw with ({error})",
            remedy=f"{APT}, or choose the embree backend",
        ) from error


def is_software(renderer: str) -> bool:
    """Whether an OpenGL renderer, by its own name, runs on the processor."""
    return SOFTWARE.search(renderer) is not None
