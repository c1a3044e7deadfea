"""A small building, built once and thrown away: compiles what builds and encoding with default
options need.

It has what decides which loops run: doors in a row, whose edges meet in one line (near ties), a
solid that hangs in a room, and an image large enough for the coder to fit weights.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ptmtools.pipeline.build import build_scene

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
#: Of the image, in texels.
SIDE = 256


def warm_up() -> None:
    """Builds it, one thing after the other."""
    with TemporaryDirectory() as folder:
        build_scene(write_building(Path(folder)), Path(folder, "database"), workers=1)


def write_building(folder: Path) -> Path:
    """An OBJ file of the `PLAN`, Y up, with its material and image in the same folder."""
    texels = np.random.default_rng(1).integers(0, 32, (SIDE, SIDE, 3))
    texels += np.arange(SIDE)[:, None, None] // 2
    Image.fromarray(texels.astype(np.uint8)).save(folder / "wall.png")
    (folder / "building.mtl").write_text("newmtl wall\nmap_Kd wall.png\n")
    lines = ["mtllib building.mtl", "usemtl wall", "vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    for corners in _squares(_solid()):
        lines += [f"v {x} {y} {z}" for x, y, z in corners.tolist()]
        lines.append("f -4/1 -3/2 -2/3 -1/4")
    model = folder / "building.obj"
    model.write_text("\n".join(lines) + "\n")
    return model


def _solid() -> NDArray[np.bool_]:
    """(x, y, z): which cubes of a metre are solid."""
    plan = np.array([list(row) for row in PLAN.split()]).T
    walls, slab = plan == "#", plan != ""
    return np.stack([slab, walls, walls | (plan == "+"), walls, slab], axis=1)


def _squares(solid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(n, 4, 3): what separates solid cubes from others, counter-clockwise as seen from these."""
    squares = []
    for axis in range(3):
        up, u, v = np.roll(np.eye(3, dtype=np.int64), -axis, axis=0)
        for side in (0, 1):
            walls = np.argwhere(~solid & np.roll(solid, 1 - 2 * side, axis))
            square = np.array([0 * u, u, u + v, v])[:: 1 - 2 * side]
            squares.append((walls + side * up)[:, None] + square)
    return np.concatenate(squares)
