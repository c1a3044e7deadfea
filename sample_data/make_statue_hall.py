"""Generates a hall of statues: one room with pictures on its walls and heavy statues along its
axis.

    python sample_data/make_statue_hall.py -o build/statue_hall
    python sample_data/make_statue_hall.py -o build/statue_hall --statues 12 --triangles 200000

The target scene of octree textures: nearly all bytes are triangles (`make_statues.py`), few are
images. Metres, Y up; closed. The same options give the same bytes on every machine (for the same
numpy and Pillow)."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from make_photo_gallery import COLORS, WIDTH_RATIO, Photo, hall, hung, photos
from make_statues import STATUES, StatueOptions, make_statue
from ptmtools_samples.files import File, png, write
from ptmtools_samples.museum import generator
from ptmtools_samples.obj import obj_text

from ptmtools.errors import PtmError

HEAD = "# ptmtools sample hall of statues"
#: Side of all images, texels.
SIDE = 1024
#: Metres: maximum height and width of a statue, distance between the centres of two, and to the end
#: walls.
STATUE_HEIGHT, STATUE_WIDTH, SPACING, END_SPACING = 2.0, 2.0, 2.6, 3.0
STONE = (0.85, 0.83, 0.78)


@dataclass(frozen=True)
class HallOptions:
    """Options of `make_hall`; ``triangles`` per statue, met within some percent."""

    statues: int = 6
    triangles: int = 100_000
    images: int = 8
    seed: int = 1


def images_of(count: int) -> list[Photo]:
    """Returns ``count`` images of equal size in texels."""
    return [replace(image, side=SIDE) for image in photos(count)]


def statue_rows(options: HallOptions, length: float, first: int) -> list[str]:
    """Returns the OBJ statements of the statues; ``first`` is the number of preceding points."""
    rows = []
    gap = (length - 2 * END_SPACING) / max(options.statues - 1, 1)
    for k in range(options.statues):
        name = list(STATUES)[k % len(STATUES)]
        made = make_statue(name, StatueOptions(options.triangles, options.seed + k // len(STATUES)))
        low, high = made.points.min(axis=0), made.points.max(axis=0)
        foot = (low + high) / 2 * [1, 0, 1] + low * [0, 1, 0]
        at = [
            END_SPACING + k * gap if options.statues > 1 else length / 2,
            0.0,
            length * WIDTH_RATIO / 2,
        ]
        wide, tall, deep = (high - low).tolist()
        points = (made.points - foot) * min(
            STATUE_HEIGHT / tall, STATUE_WIDTH / max(wide, deep)
        ) + at
        rows += [f"o statue_{k + 1:02d}_{name}", "usemtl stone"]
        rows += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
        rows += [f"f {a} {b} {c}" for a, b, c in (made.triangles + first + 1).tolist()]
        first += len(points)
    return rows


def make_hall(options: HallOptions) -> Iterator[File]:
    """Returns the files of the hall: relative path and a function that returns the bytes; the OBJ
    comes last."""
    images = images_of(options.images)
    length, pictures = hung(images, 2 * END_SPACING + (options.statues - 1) * SPACING)
    plain = [
        f"newmtl {name}\nKd {' '.join(map(str, color))}\nillum 1\n"
        for name, color in {**COLORS, "stone": STONE}.items()
    ]
    painted = [
        f"newmtl {i.name}\nKd 1 1 1\nillum 1\nmap_Kd -clamp on textures/{i.name}.png\n"
        for i in images
    ]
    head = [
        f"{HEAD}: {options.statues} statues of {options.triangles:,} triangles, seed "
        f"{options.seed}",
        "# metres, Y up",
    ]

    def loader(k: int) -> Callable[[], bytes]:
        return lambda: png(images[k].paint(generator(options.seed, 6, k), images[k].side))

    def model() -> bytes:
        room = obj_text([*hall(length), *pictures], head, "statue_hall.mtl")
        first = sum(line.startswith("v ") for line in room.splitlines())
        return "\n".join([room.rstrip(), *statue_rows(options, length, first), ""]).encode()

    for k, image in enumerate(images):
        yield f"textures/{image.name}.png", loader(k)
    yield "statue_hall.mtl", lambda: "\n".join([f"{HEAD}: materials\n", *plain, *painted]).encode()
    yield "statue_hall.obj", model


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description="Make a hall of statues: OBJ, MTL and PNG files.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write")
    add("--statues", type=int, default=HallOptions.statues, help="number of statues, 1 to 100")
    add("--triangles", type=int, default=HallOptions.triangles, help="triangles per statue")
    add(
        "--images",
        type=int,
        default=HallOptions.images,
        help="number of images on the walls, 1 to 100",
    )
    add("--seed", type=int, default=HallOptions.seed, help="seed of the random numbers")
    add("--force", action="store_true", help="write into a folder that holds other files")
    given = parser.parse_args(arguments)
    if not (1 <= given.statues <= 100 and 1 <= given.images <= 100 and given.seed >= 0):
        parser.error("--statues and --images are 1 to 100, --seed 0 or more")
    options = HallOptions(given.statues, given.triangles, given.images, given.seed)
    try:
        write(given.output, list(make_hall(options)), force=given.force)
    except PtmError as error:
        parser.exit(1, f"make_statue_hall: {error}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
