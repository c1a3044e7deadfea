"""A hall of statues: one room with pictures on its walls and heavy statues along its axis.

The target scene of octree textures: nearly all bytes are triangles (`statues`), few are images.
Metres, Y up; closed. The same options give the same bytes on every machine (for the same numpy and
Pillow)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from ptmtools_samples.files import HEAD, File, Note, ignore, png
from ptmtools_samples.noise import generator
from ptmtools_samples.obj import obj_text
from ptmtools_samples.options import StatueHallOptions, StatueOptions
from ptmtools_samples.photo_gallery import COLORS, WIDTH_RATIO, Photo, hall, hung, photos
from ptmtools_samples.statues.model import STATUES, make_statue

TITLE = f"# {HEAD} hall of statues"
#: Side of all images, texels.
SIDE = 1024
#: Metres: maximum height and width of a statue, distance between the centres of two, and to the end
#: walls.
STATUE_HEIGHT, STATUE_WIDTH, SPACING, END_SPACING = 2.0, 2.0, 2.6, 3.0
STONE = (0.85, 0.83, 0.78)


def images_of(count: int) -> list[Photo]:
    """Returns ``count`` images of equal size in texels."""
    return [replace(image, side=SIDE) for image in photos(count)]


def statue_rows(options: StatueHallOptions, length: float, first: int) -> list[str]:
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


def make_statue_hall(options: StatueHallOptions, note: Note = ignore) -> Iterator[File]:
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
        f"{TITLE}: {options.statues} statues of {options.triangles:,} triangles, seed "
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
    yield "statue_hall.mtl", lambda: "\n".join([f"{TITLE}: materials\n", *plain, *painted]).encode()
    yield "statue_hall.obj", model
