"""The bytes and errors of previews: python benchmarks/codec/previews.py [IMAGE…]

For each set of images: by size of a level, all images together,

- the bytes of the exact levels up to it, and its root mean square error from the finest level,
- the bytes of a lossy image of it by format and quality, and that image's error;

then the whole ladder of previews that `ptm textures` writes, with other `LADDER`s.

Sets: the images given, or the sample museum's (`make sample`), the shared textures and scenes.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from images import ROOT, image_files, sets

from ptmtools.parallel import map_in_order
from ptmtools.texture import build_pyramid, encode, load_image, previews as settings, read_header
from ptmtools.texture.previews import PreviewOptions, Pyramid

QUALITIES = (
    ("webp", 20), ("webp", 50), ("webp", 75), ("webp", 90),
    ("avif", 50), ("avif", 65), ("jpeg", 75),
)  # fmt: skip
#: Levels that are tabulated, from the finest on.
LEVELS = 5
#: AVIF of more texels is left out: its encoder takes seconds.
LARGEST_AVIF = 1 << 20
LADDERS = (0, 25, 50)

Row = tuple[int, float, int]


def measured(file: Path) -> dict[tuple[int, str], Row]:
    """(levels below the finest, name of the column) → bytes, sum of squares, texels."""
    texels = load_image(file).array()
    if texels.dtype != np.uint8:
        return {}
    ends = [level.end for level in read_header(encode(texels)).levels]
    pyramid = Pyramid(build_pyramid(texels))
    rows: dict[tuple[int, str], Row] = {}
    finest = len(pyramid.levels) - 1
    weight = texels.shape[0] * texels.shape[1]
    for below in range(min(LEVELS, finest + 1)):
        level = finest - below
        rows[below, "exact"] = ends[level], weight * pyramid.squares[level], weight
        for name, quality in QUALITIES:
            size = math.prod(pyramid.levels[level].shape[:2])
            if name == "avif" and size > LARGEST_AVIF:
                continue
            preview, _ = pyramid.preview(level, quality, name)
            column = f"{name} {quality}"
            rows[below, column] = preview.bytes, weight * preview.error**2, weight
    every = dict.fromkeys(range(finest + 1), sys.maxsize)
    for ladder in LADDERS:
        settings.LADDER = ladder
        made = pyramid.ladder(PreviewOptions(), every)
        rows[LEVELS, f"ladder -{ladder}"] = (
            sum(preview.bytes for preview, _ in made),
            0.0,
            len(made),
        )
    rows[LEVELS, "ptm"] = ends[-1], 0.0, 1
    return rows


def table(name: str, files: Iterable[Path]) -> None:
    """Prints the tables of a set."""
    total: dict[tuple[int, str], list[float]] = defaultdict(lambda: [0, 0.0, 0])
    for rows in map_in_order(measured, list(files), 2):
        for key, row in rows.items():
            total[key] = [a + b for a, b in zip(total[key], row, strict=True)]
    columns = ["exact", *(f"{form} {quality}" for form, quality in QUALITIES)]
    print(f"\n{name}: kB, and root mean square error from the finest level\n")
    print("| level |", " | ".join(columns), "|")
    print("|---|" + "---:|" * len(columns))
    for below in range(LEVELS):
        cells = []
        for column in columns:
            length, square, weight = total[below, column]
            known = weight == total[below, "exact"][2] > 0
            cells.append(f"{length / 1000:,.0f}, {math.sqrt(square / weight):.1f}" if known else "")
        print(f"| 1/{2**below} |", " | ".join(cells), "|")
    whole = total[LEVELS, "ptm"][0]
    print("\n| quality of coarser previews | kB | of the .ptm | files |\n|---|---:|---:|---:|")
    for ladder in LADDERS:
        length, _, files_ = total[LEVELS, f"ladder -{ladder}"]
        print(f"| {75 - ladder} | {length / 1000:,.0f} | {length / whole:.1%} | {files_:,.0f} |")


def main() -> None:
    """Prints the tables of all sets."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("images", nargs="*", type=Path)
    given = parser.parse_args().images
    if given:
        table("images", given)
        return
    museum = image_files(ROOT / "build" / "museum" / "textures")
    for name, files in {"museum": museum, **sets()}.items():
        if files:
            table(name, files)


if __name__ == "__main__":
    main()
