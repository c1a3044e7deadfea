"""The look-up of the fragment shader at given points, for comparison with numpy."""

from __future__ import annotations

import numpy as np

from ptmtools.coverage.backends.opengl import create_context
from ptmtools_systems.apo.model import Octree
from ptmtools_systems.apo.shader import LOOK_UP, upload_texels
from ptmtools_systems.apo.traversal import NEVER, WIDTH

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
out ivec2 end;
void main() {
    vec4 place = texelFetch(places, ivec2(gl_FragCoord.xy), 0);
    end = look_up(place.xyz, int(place.w));
}
"""
)


def look_up_by_shader(
    octree: Octree, q: np.ndarray, levels: int | None = None, stop: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) addresses and (n,) depths, as `traversal.look_up`, of (n, 3) float32 points."""
    width = min(WIDTH, max(1, len(q)))
    height = max(1, -(-len(q) // width))
    places = np.zeros((height * width, 4), dtype=np.float32)
    places[: len(q), :3] = q
    places[: len(q), 3] = NEVER if stop is None else np.clip(stop, -1, NEVER)
    context = create_context()
    try:
        program = context.program(vertex_shader=WHOLE, fragment_shader=POINTS)
        texture = context.texture((width, height), 4, places.tobytes(), dtype="f4")
        texture.filter = (context.NEAREST, context.NEAREST)
        result = context.texture((width, height), 2, dtype="i4")
        context.framebuffer([result]).use()
        upload_texels(context, octree.texels).use(0)
        texture.use(1)
        program["octree"].value, program["places"].value = 0, 1
        program["texels"].value = len(octree.texels)
        program["deepest"].value = min(levels or octree.levels, octree.levels) - 1
        context.disable(context.DEPTH_TEST)
        context.vertex_array(program, []).render(context.TRIANGLES, vertices=3)
        data = np.frombuffer(result.read(), dtype=np.int32).reshape(-1, 2)[: len(q)]
    finally:
        context.release()
    return data[:, 0].astype(np.int64), data[:, 1].astype(np.int64)
