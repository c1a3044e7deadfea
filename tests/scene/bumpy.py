"""Two rooms with relief: normals, heights, and normals of a surface without a texture."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ptmtools.scene.normal_maps import normals_of

TWO_ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"
SIDE = 64
#: What the MTL says of the relief of each material.
STATEMENTS = {
    "room_a": "norm -bm 0.5 waves.png",
    "room_b": "map_Bump -bm 0.5 heights.png",
    "floor": "bump waves.png",
    "ceiling": "norm waves.png",
}


def heights(side: int = SIDE) -> NDArray[np.float64]:
    """(side, side) repeating waves of 2 texels, steeper to the right than upwards."""
    y, x = np.mgrid[:side, :side] * (2 * np.pi / side)
    return np.asarray(2 * (np.sin(4 * x) + 0.5 * np.cos(2 * y + 1)))


def write_bumpy(folder: Path, statements: dict[str, str] | None = None) -> Path:
    """The model with its images in a new folder."""
    model = Path(shutil.copytree(TWO_ROOMS, folder)) / "two_rooms.obj"
    Image.fromarray(normals_of(heights())).save(folder / "waves.png")
    grey = np.rint((heights() + 3) * 255 / 6).astype(np.uint8)
    Image.fromarray(grey).save(folder / "heights.png")
    file = folder / "two_rooms.mtl"
    text = file.read_text()
    for name, statement in (STATEMENTS if statements is None else statements).items():
        text = text.replace(f"newmtl {name}\n", f"newmtl {name}\n{statement}\n")
    file.write_text(text)
    return model
