"""One step of joining as a fragment shader: the reference of what a client does on its GPU (§3.2).

As in the paper, a quad of the size of the result is drawn into a framebuffer; a pattern texture of
2×2 texels, repeated over it R times (Eq. 1), says for each fragment which of the two images it is
from, and all three are looked up at the fragment's own place, nearest texel. Rows and columns
differ in the pattern alone. Integer textures, so that texels come out as they went in; all
coordinates are multiples of powers of two, which single precision holds exactly up to sides of
2^16.

A client keeps the result as the texture of the next step, and shows it meanwhile.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.coverage.backends.opengl import create_context
from ptmtools.neighbours.interlace.model import Axis

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
    """Joins by OpenGL; to be used and closed by the thread that made it."""

    def __init__(self) -> None:
        """Opens a context without a window; raises MissingComponentError PTM-M500 where there is
        no OpenGL 3.3."""
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
        """What `ptmtools.neighbours.interlace.steps.join` makes of two (h, w, c) images of uint8
        or uint16, 1
        to 4 components, whose sides are powers of two up to `most` / 2."""
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
        """Gives the context back."""
        self._context.release()


def _held(components: int) -> int:
    return 4 if components == 3 else components


def _type(texels: Texels) -> str:
    """moderngl's name of the samples."""
    return f"u{texels.dtype.itemsize}"
