"""Draws docs/pictures/apo.jpg: a bust as modelled, simplified, and by levels of its octree.

python benchmarks/apo_picture.py [-o docs/pictures/apo.jpg]
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "sample_data")]

import make_statues  # noqa: E402

from ptmtools.apo.making import make_apo, smooth, welded  # noqa: E402
from ptmtools.apo.model import ApoOptions  # noqa: E402
from ptmtools.apo.picture import RenderOptions, render  # noqa: E402
from ptmtools.executors import open_executor  # noqa: E402
from ptmtools.scene.model import Material, Scene  # noqa: E402
from ptmtools.scene.orientation import tolerance_of  # noqa: E402

TRIANGLES, FACES = 400_000, 2_000
#: Levels that are shown beside the source and the simplified mesh.
LEVELS = (7, 8, 9, None)
#: Of a panel, and of what is drawn, which is made smaller.
WIDE, HIGH, TIMES = 260, 330, 2


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs/pictures/apo.jpg")
    given = parser.parse_args()
    statue = make_statues.make_statue("bust", make_statues.StatueOptions(triangles=TRIANGLES))
    points, triangles = welded(statue.points.astype(np.float64), statue.triangles)
    n = len(triangles)
    none = np.zeros(n, np.int32)
    scene = Scene(
        points,
        triangles,
        np.zeros((n, 3, 2)),
        none,
        none,
        np.ones(n, bool),
        ("bust",),
        (Material("stone"),),
        tolerance_of(points, triangles),
    )
    with open_executor() as executor:
        made = make_apo(scene, ApoOptions(faces=FACES), executor)
    look = RenderOptions(
        azimuth=20, elevation=8, distance=1.75, field_of_view=32,
        width=WIDE * TIMES, height=HIGH * TIMES,
    )  # fmt: skip
    own, source, octree = made.mesh, smooth(points, triangles), made.octree
    plain = replace(look, levels=0)
    panels = [
        (
            f"{n:,} triangles",
            render(octree, points, triangles, plain, source.normals.astype(float)),
        ),
        (
            f"{len(own.triangles):,} triangles",
            render(octree, own.points, own.triangles, plain, own.normals.astype(float)),
        ),
    ]
    for levels in LEVELS:
        name = f"and {levels or octree.levels} levels"
        wanted = replace(look, levels=levels)
        panels.append((name, render(octree, own.points, own.triangles, wanted)))
    sheet = Image.new("RGB", (WIDE * len(panels), HIGH))
    font = ImageFont.load_default(15)
    for k, (name, drawn) in enumerate(panels):
        panel = Image.fromarray(drawn.picture).resize((WIDE, HIGH), Image.Resampling.BOX)
        sheet.paste(panel, (WIDE * k, 0))
        ImageDraw.Draw(sheet).text((WIDE * k + 8, HIGH - 24), name, font=font, fill="white")
    sheet.save(given.output, quality=88)
    print(f"{given.output}: {given.output.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
