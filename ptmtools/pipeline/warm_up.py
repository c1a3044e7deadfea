"""Compiles kernels for ``ptm warm-up``: builds, checks and draws a small building, encodes and
decodes images, and simplifies the building as a statue.

The building has the features that run all kernels: doors in a row, whose edges meet in one line
(near ties), a solid that stands in a room, an image large enough for the coder to fit weights, and
walls that reflect. Its faces are also simplified with their texture coordinates.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from PIL import Image

#: From above, in squares of a metre. # is solid from floor to ceiling, three metres up, + at half
#: height.
PLAN = """
##################
#....#.....#.....#
#.##...........+.#
#.##.#.....#.....#
#....#.....#.....#
##################
"""
#: Side of the image, texels.
TEXELS = 256


def warm_building() -> None:
    """Calls the kernels of builds with default options, of `ptm validate` and of `ptm render`."""
    from ptmtools.output.served import read_served
    from ptmtools.pipeline.build import build_scene
    from ptmtools.pipeline.validation import validate
    from ptmtools.portal_flow.flow_kernels import mark
    from ptmtools.rendering.drawing import ViewOptions, draw_view

    mark(np.zeros(1, np.int64), 0, 1)  # of near ties that let a line pass: few buildings have any
    with TemporaryDirectory() as folder:
        database = Path(folder, "database")
        build_scene(write_building(Path(folder)), database, workers=1)
        validate(database)
        for lit in (False, True):
            draw_view(read_served(database), ViewOptions(width=32, height=18, lit=lit))


def warm_images() -> None:
    """Calls the kernels that encode and decode images of 8 bits, of all profiles."""
    from ptmtools.texture import EncodeOptions, decode, encode

    noise = np.random.default_rng(1).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    repeats = np.tile(noise[:16, :16] // 64 * 64, (8, 8, 1))
    smooth = np.add.outer(np.arange(64), np.arange(64))[..., None].repeat(3, 2).astype(np.uint8)
    for image in (noise, repeats, smooth):
        for profile in ("fast", "small", "paper"):
            decode(encode(image, EncodeOptions(profile=profile)))


def write_building(folder: Path) -> Path:
    """An OBJ file of the `PLAN`, Y up, with its material and image in the same folder."""
    texels = np.random.default_rng(1).integers(0, 32, (TEXELS, TEXELS, 3))
    texels += np.arange(TEXELS)[:, None, None] // 2
    Image.fromarray(texels.astype(np.uint8)).save(folder / "wall.png")
    (folder / "building.mtl").write_text("newmtl wall\nmap_Kd wall.png\nPr 0.3\n")
    plan = np.array([list(row) for row in PLAN.split()]).T
    walls, slab = plan == "#", plan != ""
    solid = np.stack([slab, walls, walls | (plan == "+"), walls, slab], axis=1)
    lines = ["mtllib building.mtl", "usemtl wall", "vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    for corners in _squares(solid):
        lines += [f"v {x} {y} {z}" for x, y, z in corners.tolist()]
        lines.append("f -4/1 -3/2 -2/3 -1/4")
    model = folder / "building.obj"
    model.write_text("\n".join(lines) + "\n")
    return model


def _squares(solid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(n, 4, 3) faces between solid and empty cubes of a metre, given which are solid, (x, y, z);
    counter-clockwise from the empty side."""
    squares = []
    for axis in range(3):
        up, u, v = np.roll(np.eye(3, dtype=np.int64), -axis, axis=0)
        for side in (0, 1):
            walls = np.argwhere(~solid & np.roll(solid, 1 - 2 * side, axis))
            square = np.array([0 * u, u, u + v, v])[:: 1 - 2 * side]
            squares.append((walls + side * up)[:, None] + square)
    return np.concatenate(squares)


def warm_objects() -> None:
    """Calls the kernels of simplification, of plain and painted meshes, and of other
    representations."""
    from ptmtools.output.representation import representations
    from ptmtools.scene import IngestOptions, ingest
    from ptmtools.simplification import Mesh, SimplifyOptions, simplify

    for kind in representations():
        kind.warm_up.load()()
    with TemporaryDirectory() as folder:
        scene = ingest(write_building(Path(folder)), IngestOptions())
    mesh = Mesh(scene.points, scene.triangles, scene.triangle_material, scene.uv)
    simplify(mesh, SimplifyOptions(len(scene.triangles) // 4))
