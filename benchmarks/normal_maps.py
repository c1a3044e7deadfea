"""Measures what normal maps of materials cost and change: bytes of a site, and pictures.

    python benchmarks/normal_maps.py [MODEL…] [--jobs 2] [--keep DIR]

Each model is built with `--normal-maps none` and with `draw`. *Images* are the bytes of the images
that the model has without and with its maps, *exact* those of the maps' `.ptm`s and *previews*
those of their previews. *Site* is all that a visitor of the whole building downloads, *first room*
what is needed for its first picture, both as of `ptm publish`. *Pixels* is the share of the pixels
of all viewpoints that the maps change, and *by* the mean change of these, 0 to 255. ``--keep``
writes the pictures that change most, without and with the maps, as PNG.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from scenes import SHARED, model_file

from ptmtools.coverage.options import AchOptions
from ptmtools.light.options import LightOptions
from ptmtools.output.served import Served, read_served
from ptmtools.pipeline.build import build_scene
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.scene.options import IngestOptions
from ptmtools.site.content import SiteOptions, site_of
from ptmtools.site.publishing import weight_of
from ptmtools.store.layout import IMAGES
from ptmtools.visibility.options import PvsOptions

#: The model of a gallery with a leather sofa and a floor of boards.
GALLERY = SHARED / "scenes/apartment_gallery/gallery.glb"
#: Pictures.
WIDTH, HEIGHT = 640, 480
NONE, DRAW = "none", "draw"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("models", nargs="*", default=[str(GALLERY)])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path)
    arguments = parser.parse_args()
    print("| model | maps | images, kB | exact, kB | previews, kB | site, kB | with maps ", end="")
    print("| first room, kB | with maps | pixels | by |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for model in arguments.models:
        file = model_file(model)
        print(row(file.parent.name, file, arguments.jobs, arguments.keep), flush=True)


def row(name: str, model: Path, jobs: int, keep: Path | None) -> str:
    """A row of the table."""
    with tempfile.TemporaryDirectory() as folder:
        database = Path(folder) / "db"
        weights, pictures, images = [], [], []
        maps = exact = previews = 0
        for choice in (NONE, DRAW):
            build_scene(
                model,
                database,
                IngestOptions(normal_maps=choice),  # type: ignore[arg-type]
                PvsOptions(method="fast"),
                AchOptions(samples=4, backend="embree"),
                LightOptions("none"),
                workers=jobs,
            )
            served = read_served(database)
            weights.append(weight_of(site_of(database, SiteOptions(pictures=False))))
            pictures.append(drawn(served))
            images.append(sum(f.stat().st_size for f in (database / IMAGES).iterdir()))
            rows = [row for row in served.index["textures"] if row.get("normals")]
            maps, exact = len(rows), sum(row["ends"][-1] for row in rows)
            previews = sum(each["bytes"] for row in rows for each in row.get("previews", ()))
        before, after = pictures
        change = np.abs(after - before).max(axis=-1)
        changed = change > 0
        if keep:
            keep.mkdir(parents=True, exist_ok=True)
            most = int(change.mean(axis=(1, 2)).argmax())
            for choice, each in zip((NONE, DRAW), pictures, strict=True):
                Image.fromarray(each[most].astype(np.uint8)).save(keep / f"{name}-{choice}.png")
    plain, bumpy = weights
    cells = [f"{images[0] / 1000:,.0f} → {images[1] / 1000:,.0f}"]
    cells += [f"{n / 1000:,.1f}" for n in (exact, previews)]
    cells += [f"{plain.whole / 1000:,.1f}", f"{bumpy.whole / plain.whole - 1:+.1%}"]
    cells += [f"{plain.first_room / 1000:,.1f}", f"{bumpy.first_room / plain.first_room - 1:+.1%}"]
    cells += [f"{changed.mean():.1%}", f"{change[changed].mean():.1f}" if changed.any() else "0"]
    return f"| {name} | {maps} | {' | '.join(cells)} |"


def drawn(served: Served) -> np.ndarray:
    """(v, h, w, 3) pictures of all viewpoints."""
    views = range(len(served.index["viewpoints"]))
    options = [ViewOptions(viewpoint=n, width=WIDTH, height=HEIGHT) for n in views]
    return np.array([draw_view(served, each) for each in options], np.int16)


if __name__ == "__main__":
    main()
