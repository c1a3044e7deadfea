"""Generates sample statues: solids with fine relief, as triangle meshes, to try `ptm apo` on.

    python sample_data/make_statues.py -o build/statues
    python sample_data/make_statues.py -o build/statues --triangles 1000000 --only bust --colors

Metres, Y up, facing +Z: a bust, a relief, a dragon and the capital of a column. Each is one closed
surface of triangles of about equal size, 50,000 to 1,000,000 of them. The same seed gives the same
bytes on every machine. Needs numpy, not ptmtools.
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from statue_parts import bust, column, dragon, relief
from statue_parts.files import FORMATS, HEAD
from statue_parts.surface import evaluate, mesh

#: Name: class of the solid, and its bounding box.
STATUES: dict[str, tuple[Any, tuple[float, ...], tuple[float, ...]]] = {
    "bust": (bust.Bust, bust.LOW, bust.HIGH),
    "relief": (relief.Relief, relief.LOW, relief.HIGH),
    "dragon": (dragon.Dragon, dragon.LOW, dragon.HIGH),
    "column": (column.Column, column.LOW, column.HIGH),
}


@dataclass(frozen=True)
class StatueOptions:
    """Options of `make_statue`; the number of triangles is met within some percent."""

    triangles: int = 50_000
    seed: int = 1
    colors: bool = False


@dataclass(frozen=True)
class Statue:
    """(P, 3) points, (T, 3) triangles, counterclockwise from outside, and (P, 3) colours."""

    points: NDArray[np.float32]
    triangles: NDArray[np.int64]
    colors: NDArray[np.uint8] | None


def make_statue(name: str, options: StatueOptions) -> Statue:
    """Generates the statue of a name in `STATUES`."""
    kind, low, high = STATUES[name]
    stream = list(STATUES).index(name)
    solid = kind(np.random.Generator(np.random.PCG64([options.seed, stream])))
    points, triangles = mesh(solid, low, high, options.triangles)
    colors = None
    if options.colors:
        share = np.stack(
            [evaluate(lambda p, k=k: solid.colors(p)[k], points.T) for k in range(3)], 1
        )
        colors = np.rint(255 * np.clip(share, 0, 1)).astype(np.uint8)
    return Statue(points.astype(np.float32), triangles, colors)


def write(path: Path, data: bytes, *, force: bool) -> None:
    """Writes a file atomically; refuses to replace a file of other origin without ``force``."""
    if path.exists() and not force:
        with path.open("rb") as file:
            if HEAD.encode() not in file.read(4096):
                raise FileExistsError(f"{path} is no file of this script; use --force")
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(data)
    os.replace(part, path)


def _between(least: int, most: int) -> Any:
    def number(text: str) -> int:
        value = int(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{value} is not between {least} and {most}")
        return value

    return number


def main(arguments: list[str] | None = None) -> int:
    default = StatueOptions()
    parser = argparse.ArgumentParser(
        description="Make sample statues: closed surfaces with fine relief.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write")
    most = _between(1000, 4_000_000)
    add(
        "--triangles",
        type=most,
        default=default.triangles,
        help="approximate number of triangles per statue",
    )
    add("--only", choices=list(STATUES), action="append", help="generate this statue only")
    add("--format", choices=list(FORMATS), default="ply", help="file format")
    add("--colors", action="store_true", help="include vertex colours")
    add("--seed", type=_between(0, 2**63), default=default.seed, help="seed of the random numbers")
    add("--force", action="store_true", help="replace files of other origin")
    given = parser.parse_args(arguments)
    options = StatueOptions(given.triangles, given.seed, given.colors)
    try:
        for name in given.only or STATUES:
            statue = make_statue(name, options)
            about = f"{name}, {len(statue.triangles)} triangles, seed {options.seed}"
            data = FORMATS[given.format](statue.points, statue.triangles, statue.colors, about)
            path = given.output / f"{name}.{given.format}"
            write(path, data, force=given.force)
            print(f"{path}: {len(statue.triangles):,} triangles, {len(data) / 1e6:.1f} MB")
    except OSError as error:
        parser.exit(1, f"make_statues: {error}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
