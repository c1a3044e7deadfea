"""Writes a small building that makes a build with default options call every kernel.

It contains the cases that decide which loops run: doors in a row, whose edges meet in one line
(near ties), a solid that hangs in a room, and an image large enough for the coder to fit weights.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

#: The plan in squares of a metre: # is solid from floor to ceiling at 3 m, + at half height only.
PLAN = """
##################
#....#.....#.....#
#.##...........+.#
#.##.#.....#.....#
#....#.....#.....#
##################
"""
#: Side of the image, in texels.
SIDE = 256


def write_building(folder: Path) -> Path:
    """Writes an OBJ file of the `PLAN`, Y up, its material and its image; returns the OBJ file."""
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
    """(x, y, z) whether the cube of a metre is solid."""
    plan = np.array([list(row) for row in PLAN.split()]).T
    walls, slab = plan == "#", plan != ""
    return np.stack([slab, walls, walls | (plan == "+"), walls, slab], axis=1)


def _squares(solid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(n, 4, 3) squares between solid and empty cubes, counter-clockwise as seen from the empty."""
    squares = []
    for axis in range(3):
        up, u, v = np.roll(np.eye(3, dtype=np.int64), -axis, axis=0)
        for side in (0, 1):
            walls = np.argwhere(~solid & np.roll(solid, 1 - 2 * side, axis))
            square = np.array([0 * u, u, u + v, v])[:: 1 - 2 * side]
            squares.append((walls + side * up)[:, None] + square)
    return np.concatenate(squares)
