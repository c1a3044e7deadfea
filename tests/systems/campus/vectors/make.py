"""Writes the frozen campus, once for each schema: a wall with a texture and its alpha, on a plain
floor. What lies here must be readable for ever; nothing is written over it.

    python -m tests.systems.campus.vectors.make tests/systems/campus/vectors/v1
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from ptmtools.scene import IngestOptions
from ptmtools_systems.campus import CampusOptions, make_campus
from tests.systems.campus.models import level, wall, write_obj


def main(folder: str) -> None:
    """Writes a campus to a new folder."""
    with tempfile.TemporaryDirectory() as held:
        model = Path(held)
        y, x = np.mgrid[:64, :64]
        texels = np.stack([4 * x, 4 * y, 0 * x + 90, np.where(x < 32, 255, 0)], axis=2)
        Image.fromarray(texels.astype(np.uint8)).save(model / "fence.png")
        (model / "campus.mtl").write_text(
            "newmtl fence\nKd 1 1 1\nmap_Kd fence.png\nnewmtl floor\nKd 0.2 0.4 0.6\n"
        )
        parts = {"fence": wall((-4, 0), (4, 0), 3, 2), "floor": level((-4, 0), (4, 6), 0)}
        write_obj(model / "campus.obj", [("Garden gate", parts)])
        options = CampusOptions(samples=64, faces=4, quality=50)
        make_campus(model / "campus.obj", folder, options, IngestOptions(unit="m", up="y"))


if __name__ == "__main__":
    main(sys.argv[1])
