"""The client's traversal as a fragment shader: normal mapping of the simplified mesh by the octree
texture (Lacoste et al., section 3.2; docs/formats/apo.md).

The array of texels lies row by row in a texture of four unsigned bytes, `WIDTH` wide. The
fragment's place in the cube is interpolated, and its derivatives from pixel to pixel determine the
depth to stop at. A look-up ends in one texel, without filtering. It needs OpenGL 3.3, by hardware
or in software; `rays` does the same without it.
"""

from __future__ import annotations

from types import TracebackType
from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.coverage.backends.opengl import create_context
from ptmtools.neighbours.apo.model import Octree
from ptmtools.neighbours.apo.traversal import NEVER, WIDTH, rows_of
from ptmtools.neighbours.apo.view import AMBIENT, FILL, KEY, Frame, Look, View

#: Least farthest depth, for a view without points.
TINY = 2.0**-100

LOOK_UP = f"""
#version 330
uniform usampler2D octree;
uniform int texels;
uniform int deepest;  // depth of the last level that is there

uvec4 texel(int address) {{
    return texelFetch(octree, ivec2(address % {WIDTH}, address / {WIDTH}), 0);
}}

int ones(uint mask) {{
    mask -= mask >> 1u & 0x55u;
    mask = (mask & 0x33u) + (mask >> 2u & 0x33u);
    return int((mask + (mask >> 4u)) & 0x0fu);
}}

// Address and depth of the texel whose normal is shown at q.
ivec2 look_up(vec3 q, int stop) {{
    q = clamp(q, 0.0, 0.99999994);
    int address = 0;
    int depth = 0;
    uvec4 here = texel(0);
    stop = min(stop, deepest);
    while (here.a != 0u && depth < stop && address + 1 < texels) {{
        q *= 2.0;
        bvec3 half_ = greaterThanEqual(q, vec3(1.0));
        q -= vec3(half_);
        uint bit = 1u << (uint(half_.x) + 2u * uint(half_.y) + 4u * uint(half_.z));
        if ((here.a & bit) == 0u) break;
        uvec4 below = texel(address + 1);
        int first = int(below.r | below.g << 8u | below.b << 16u);
        first += ones(here.a & (bit - 1u)) + ones(below.a & (bit - 1u));
        if (first >= texels) break;
        address = first;
        depth += 1;
        here = texel(address);
    }}
    return ivec2(address, depth);
}}
"""

WHOLE = """
#version 330
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
    gl_Position = vec4(corner, 0.0, 1.0);
}
"""

POINTS = (
    LOOK_UP
    + """
uniform sampler2D places;  // q and where to stop
out ivec2 found;
void main() {
    vec4 place = texelFetch(places, ivec2(gl_FragCoord.xy), 0);
    found = look_up(place.xyz, int(place.w));
}
"""
)

MESH = """
#version 330
in vec3 corner;
in vec3 own;
uniform vec3 eye;
uniform mat3 view;  // rows right, up, forward
uniform vec2 half_;
uniform float near;
out vec3 q;
out vec3 normal;
out float ahead;
void main() {
    vec3 p = view * (corner - eye);
    q = corner;
    normal = own;
    ahead = p.z;
    // Rows from the top, as pictures have them.
    gl_Position = vec4(p.x / half_.x, -p.y / half_.y, p.z - 2.0 * near, p.z);
}
"""

SHADE = (
    LOOK_UP
    + f"""
in vec3 q;
in vec3 normal;
in float ahead;
uniform float far;
uniform usampler2D colors;
uniform bool colored;
uniform bool only_normals;
uniform vec3 key;
uniform vec3 fill;
uniform vec3 stone;
layout(location = 0) out vec4 shown;
layout(location = 1) out vec4 place;
layout(location = 2) out int address;

void main() {{
    vec3 dx = dFdx(q), dy = dFdy(q);
    // The exponent of D² is floor(log2 D²), so half of it, rounded down, is floor(log2 D).
    int square = (floatBitsToInt(min(dot(dx, dx), dot(dy, dy))) >> 23) - 127;
    int stop = -(square >> 1);
    vec3 n = normal;
    vec3 color = stone;
    address = -1;
    if (deepest >= 0) {{
        address = look_up(q, stop).x;
        n = vec3(texel(address).rgb) / 127.5 - 1.0;
        if (colored)
            color = vec3(texelFetch(colors, ivec2(address % {WIDTH}, address / {WIDTH}), 0).rgb)
                / 255.0;
    }}
    n = normalize(n);
    float light = {AMBIENT} + {KEY} * max(dot(n, key), 0.0) + {FILL} * max(dot(n, fill), 0.0);
    shown = vec4(only_normals ? n * 0.5 + 0.5 : min(color * light, 1.0), 1.0);
    place = vec4(q, float(stop));
    gl_FragDepth = ahead / far;
}}
"""
)


class OctreeShader:
    """An octree on a graphics device; used and closed by the thread that made it.

    Raises MissingComponentError PTM-M500 without OpenGL.
    """

    def __init__(self, octree: Octree, gpu: int | None = None) -> None:
        self._context = context = create_context(gpu)
        self.name = str(context.info["GL_RENDERER"])
        self._octree = octree
        self._texture = self._uploaded(octree.texels)
        self._colors = None if octree.colors is None else self._uploaded(octree.colors)

    def _uploaded(self, texels: np.ndarray) -> Any:
        rows = rows_of(texels)
        texture = self._context.texture(rows.shape[1::-1], 4, rows.tobytes(), dtype="u1")
        texture.filter = (self._nearest, self._nearest)
        return texture

    @property
    def _nearest(self) -> int:
        return int(self._context.NEAREST)

    def look_up(
        self, q: Singles, levels: int | None = None, stop: Ints | int | None = None
    ) -> tuple[Ints, Ints]:
        """(n,) addresses and (n,) depths, as `traversal.look_up`; ``q`` is converted to float32."""
        width = min(WIDTH, max(1, len(q)))
        height = max(1, -(-len(q) // width))
        places = np.zeros((height * width, 4), dtype=np.float32)
        places[: len(q), :3] = q
        places[: len(q), 3] = NEVER if stop is None else np.clip(stop, -1, NEVER)
        context = self._context
        program = context.program(vertex_shader=WHOLE, fragment_shader=POINTS)
        texture = context.texture((width, height), 4, places.tobytes(), dtype="f4")
        texture.filter = (self._nearest, self._nearest)
        result = context.texture((width, height), 2, dtype="i4")
        target = context.framebuffer([result])
        drawing = context.vertex_array(program, [])
        try:
            target.use()
            self._bind(program, self._levels(levels))
            texture.use(1)
            program["places"].value = 1
            context.disable(context.DEPTH_TEST)
            drawing.render(context.TRIANGLES, vertices=3)
            data = np.frombuffer(result.read(), dtype=np.int32).reshape(-1, 2)[: len(q)]
        finally:
            for each in (drawing, target, result, texture, program):
                each.release()
        return data[:, 0].astype(np.int64), data[:, 1].astype(np.int64)

    def draw(self, corners: Floats, own: Floats, view: View, look: Look) -> Frame:
        """A picture of (T, 3, 3) corners in the cube with their own normals (T, 3, 3), which are
        displayed without levels. ``view`` is in the cube, too."""
        context, size = self._context, (view.width, view.height)
        program = context.program(vertex_shader=MESH, fragment_shader=SHADE)
        data = np.concatenate([corners, own], axis=2).astype(np.float32)
        buffer = context.buffer(data.tobytes())
        drawing = context.vertex_array(program, [(buffer, "3f 3f", "corner", "own")])
        shown = context.texture(size, 4, dtype="f1")
        place = context.texture(size, 4, dtype="f4")
        address = context.texture(size, 1, np.full(size, -2, np.int32).tobytes(), dtype="i4")
        depth = context.depth_renderbuffer(size)
        target = context.framebuffer([shown, place, address], depth)
        try:
            target.use()
            context.enable_only(context.DEPTH_TEST)
            context.depth_func = "<"
            target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
            address.write(np.full(size, -2, np.int32).tobytes())
            self._bind(program, look.levels)
            if self._colors is not None:
                self._colors.use(1)
            depths: Floats = (corners.reshape(-1, 3) - view.eye) @ view.axes[2]
            far = 2 * float(np.abs(depths).max(initial=TINY))
            key, fill = look.lights(view)
            values = {
                "eye": tuple(view.eye.tolist()),
                "view": tuple(view.axes.T.reshape(-1).tolist()),
                "half_": view.half,
                "near": far * look.near,
                "far": far,
                "colors": 1 if self._colors is not None else 0,
                "colored": self._colors is not None,
                "only_normals": look.what == "normals",
                "key": tuple(key.tolist()),
                "fill": tuple(fill.tolist()),
                "stone": look.stone,
            }
            for name, value in values.items():
                program[name].value = value
            if len(corners):
                drawing.render(context.TRIANGLES, vertices=3 * len(corners))
            shape = (view.height, view.width)
            color = np.frombuffer(shown.read(), dtype=np.uint8).reshape(*shape, 4)
            at = np.frombuffer(address.read(), dtype=np.int32).reshape(shape).astype(np.int64)
            where = np.frombuffer(place.read(), dtype=np.float32).reshape(*shape, 4)
        finally:
            for each in (drawing, buffer, target, depth, address, place, shown, program):
                each.release()
        picture = np.where((at == -2)[..., None], look.background, color[..., :3])
        return Frame(
            picture.astype(np.uint8),
            at,
            where[..., :3].astype(np.float64),
            where[..., 3].astype(np.int64),
        )

    def _levels(self, levels: int | None) -> int:
        available = self._octree.levels if levels is None else min(levels, self._octree.levels)
        if available < 1:
            raise ValueError("the look-up needs at least one level")
        return available

    def _bind(self, program: Any, levels: int) -> None:
        self._texture.use(0)
        program["octree"].value = 0
        program["texels"].value = len(self._octree.texels)
        program["deepest"].value = levels - 1

    def close(self) -> None:
        """Releases the context."""
        self._context.release()

    def __enter__(self) -> OctreeShader:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
