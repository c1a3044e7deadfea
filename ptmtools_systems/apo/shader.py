"""The client's traversal as a fragment shader: normal mapping of the simplified mesh by the octree
texture (Lacoste et al., section 3.2; docs/formats/apo.md).

The array of texels lies row by row in a texture of four unsigned bytes, `WIDTH` wide. The
fragment's place in the cube is interpolated, and its derivatives from pixel to pixel determine the
depth to stop at. A look-up ends in one texel, without filtering. It needs OpenGL 3.3, by hardware
or in software; `rays` does the same without it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.coverage.backends.opengl import create_context
from ptmtools_systems.apo.model import Octree
from ptmtools_systems.apo.traversal import WIDTH, rows_of
from ptmtools_systems.apo.view import AMBIENT, FILL, KEY, STONE, Look, OctreePicture, OctreeView

#: Least farthest depth, for a view without points; nearest depth, as a share of the farthest.
TINY, NEAR = 2.0**-100, 2.0**-14

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


def draw(
    octree: Octree, corners: Floats, normal: Floats, view: OctreeView, look: Look
) -> OctreePicture:
    """The picture of (T, 3, 3) corners in the cube, with their own normals (T, 3, 3), which are
    displayed without levels. ``view`` is in the cube, too.

    Raises MissingComponentError PTM-M500 without OpenGL.
    """
    context, size, colors = create_context(), (view.width, view.height), octree.colors
    try:
        program = context.program(vertex_shader=MESH, fragment_shader=SHADE)
        data = np.concatenate([corners, normal], axis=2).astype(np.float32)
        buffer = context.buffer(data.tobytes())
        drawing = context.vertex_array(program, [(buffer, "3f 3f", "corner", "own")])
        shown = context.texture(size, 4, dtype="f1")
        place = context.texture(size, 4, dtype="f4")
        address = context.texture(size, 1, dtype="i4")
        target = context.framebuffer([shown, place, address], context.depth_renderbuffer(size))
        target.use()
        context.enable_only(context.DEPTH_TEST)
        context.depth_func = "<"
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        address.write(np.full(size, -2, np.int32).tobytes())
        layers = [octree.texels] if colors is None else [octree.texels, colors]
        textures = [upload_texels(context, texels) for texels in layers]
        for unit, texture in enumerate(textures):
            texture.use(unit)
        depths: Floats = (corners.reshape(-1, 3) - view.eye) @ view.axes[2]
        farthest = 2 * float(np.abs(depths).max(initial=TINY))
        key, fill = look.lights(view)
        values = {
            "octree": 0,
            "texels": len(octree.texels),
            "deepest": look.levels - 1,
            "eye": tuple(view.eye.tolist()),
            "view": tuple(view.axes.T.reshape(-1).tolist()),
            "half_": view.half,
            "near": farthest * NEAR,
            "far": farthest,
            "colors": len(textures) - 1,
            "colored": colors is not None,
            "only_normals": look.what == "normals",
            "key": tuple(key.tolist()),
            "fill": tuple(fill.tolist()),
            "stone": STONE,
        }
        for name, value in values.items():
            program[name].value = value
        if len(corners):
            drawing.render(context.TRIANGLES, vertices=3 * len(corners))
        shape = (view.height, view.width)
        color = np.frombuffer(shown.read(), dtype=np.uint8).reshape(*shape, 4)
        at = np.frombuffer(address.read(), dtype=np.int32).reshape(shape).astype(np.int64)
        where = np.frombuffer(place.read(), dtype=np.float32).reshape(*shape, 4).astype(np.float64)
        picture = np.where((at == -2)[..., None], look.background, color[..., :3]).astype(np.uint8)
        name = str(context.info["GL_RENDERER"])
        return OctreePicture(picture, at, where[..., :3], where[..., 3].astype(np.int64), name)
    finally:
        context.release()


def upload_texels(context: Any, texels: NDArray[np.uint8]) -> Any:
    """The texture of (n, 4) texels, looked up without filtering."""
    rows = rows_of(texels)
    texture = context.texture(rows.shape[1::-1], 4, rows.tobytes(), dtype="u1")
    texture.filter = (context.NEAREST, context.NEAREST)
    return texture
