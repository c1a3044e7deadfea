"""One step of joining as a fragment shader (Englert et al., §3.2), for comparison with numpy.

A quad of the size of the result is drawn into a framebuffer. A pattern texture of 2×2 texels,
repeated over it (Eq. 1), selects the image of each fragment; all textures are looked up at the
fragment's own place, nearest texel. Coordinates are multiples of powers of two, which float32 holds
exactly up to sides of 2^16.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.coverage.backends.opengl import create_context
from ptmtools_systems.interlace.model import Axis

Texels = NDArray[Any]

#: Which image a texel comes from, first row first: 0 the one there was, 1 the new file's.
PATTERNS: dict[Axis, tuple[tuple[int, int], tuple[int, int]]] = {
    "columns": ((0, 1), (0, 1)),
    "rows": ((0, 0), (1, 1)),
}

VERTEX = """
#version 330
in vec2 corner;
void main() {
    gl_Position = vec4(corner, 0.0, 1.0);
}
"""

FRAGMENT = """
#version 330
uniform usampler2D before;   // the image that the files so far make
uniform usampler2D next;     // the next file, of the same size
uniform usampler2D pattern;  // 2 x 2 texels, repeated
uniform vec2 size;           // of the result, texels
out uvec4 texel;
void main() {
    vec2 place = gl_FragCoord.xy / size;
    vec2 R = size / 2.0;
    texel = texture(pattern, place * R).r == 0u ? texture(before, place) : texture(next, place);
}
"""


class StepShader:
    """Joins by OpenGL; used and closed by one thread."""

    def __init__(self) -> None:
        """Opens a context without a window; raises MissingComponentError PTM-M500 without OpenGL
        3.3."""
        self._context = context = create_context()
        self.name = str(context.info["GL_RENDERER"])
        #: The longest side that it can join.
        self.most = int(context.info["GL_MAX_TEXTURE_SIZE"])
        self._program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        quad = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]], np.float32)
        self._quad = context.buffer(quad.tobytes())
        self._drawing = context.vertex_array(self._program, [(self._quad, "2f", "corner")])
        for unit, name in enumerate(("before", "next", "pattern")):
            self._program[name].value = unit

    def join(self, first: Texels, second: Texels, axis: Axis) -> Texels:
        """As `ptmtools_systems.interlace.steps.join`, of two (h, w, c) images of uint8 or
        uint16, 1 to 4 components, whose sides are powers of two up to `most` / 2."""
        height, width, components = first.shape
        height, width = (2 * height, width) if axis == "rows" else (height, 2 * width)
        pattern = np.array(PATTERNS[axis], first.dtype)[:, :, None]
        images = [self._texture(texels) for texels in (first, second, pattern)]
        images[2].repeat_x = images[2].repeat_y = True
        # OpenGL need not draw into three components.
        drawn = self._context.texture((width, height), _held(components), dtype=_type(first))
        target = self._context.framebuffer([drawn])
        try:
            for unit, image in enumerate(images):
                image.use(unit)
            self._program["size"].value = (width, height)
            target.use()
            self._drawing.render(self._context.TRIANGLE_STRIP)
            joined = np.frombuffer(drawn.read(), first.dtype)
        finally:
            for thing in (target, drawn, *images):
                thing.release()
        return joined.reshape(height, width, -1)[:, :, :components].copy()

    def _texture(self, texels: Texels) -> Any:
        height, width, components = texels.shape
        padded = np.zeros((height, width, _held(components)), texels.dtype)
        padded[:, :, :components] = texels
        texture = self._context.texture(
            (width, height), padded.shape[2], padded.tobytes(), dtype=_type(texels), alignment=1
        )
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        texture.repeat_x = texture.repeat_y = False
        return texture

    def close(self) -> None:
        """Releases the context."""
        self._context.release()


def _held(components: int) -> int:
    return 4 if components == 3 else components


def _type(texels: Texels) -> str:
    """moderngl's name of the samples."""
    return f"u{texels.dtype.itemsize}"
