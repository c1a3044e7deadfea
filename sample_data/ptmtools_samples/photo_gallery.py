"""A gallery of photographs: one hall whose walls are full of large, distinct images.

The target scene of systems for large image collections: nearly all bytes are images with 1024 to
4096 texels a side (powers of two), in one room that shows most of them at once. The images are
landscapes, portraits and still lifes of the museum, in place of photographs. Metres, Y up; closed.
The same options give the same bytes on every machine (for the same numpy and Pillow)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ptmtools_samples.files import HEAD, File, Note, ignore, png
from ptmtools_samples.mesh import Face, Point, Thing, Uv, tile_face
from ptmtools_samples.noise import generator
from ptmtools_samples.obj import obj_text
from ptmtools_samples.options import PhotoGalleryOptions
from ptmtools_samples.paintings import PAINTINGS, Painting

TITLE = f"# {HEAD} gallery of photographs"
#: Styles closest to photographs.
STYLES = ("landscape", "portrait", "seascape", "still_life", "night")
#: Texels of a side → metres of the longer side on the wall.
METRES = {4096: 3.6, 2048: 2.4, 1024: 1.4}
#: Cycle of texture sides, texels.
SIDES = (4096, 1024, 1024, 2048, 1024, 1024, 2048, 1024, 1024, 2048, 1024, 1024)
#: Metres: gap between images, gap at corners, height of an image's centre, distance from the wall.
GAP, CORNER, CENTRE_HEIGHT, WALL_DISTANCE = 0.6, 0.8, 1.9, 0.02
#: Width of the hall over its length; height, metres.
WIDTH_RATIO, HEIGHT = 0.45, 5.0
COLORS = {"wall": (0.92, 0.91, 0.88), "floor": (0.5, 0.4, 0.3), "ceiling": (0.97, 0.97, 0.96)}


@dataclass(frozen=True)
class Photo:
    """An image: name, texels of a side, width and height on the wall in metres, and painter."""

    name: str
    side: int
    width: float
    height: float
    paint: Painting


def photos(count: int) -> list[Photo]:
    """Returns ``count`` images with the styles in turn."""
    by_name = {name: (paint, aspect) for name, paint, aspect in PAINTINGS}
    actual = []
    for k in range(count):
        paint, aspect = by_name[STYLES[k % len(STYLES)]]
        side = SIDES[k % len(SIDES)]
        longer = METRES[side]
        width, height = (longer, longer / aspect) if aspect > 1 else (longer * aspect, longer)
        actual.append(Photo(f"photo_{k + 1:02d}", side, width, height, paint))
    return actual


def hung(images: list[Photo], least: float = 2.0) -> tuple[float, list[Thing]]:
    """Returns the least length, from ``least`` on, of a hall that holds all images, and the hung
    images."""
    length = least
    while (walls := _fill_hall(images, length)) is None:
        length += 0.5
    return length, walls


def _fill_hall(images: list[Photo], length: float) -> list[Thing] | None:
    """Hangs the images on the walls of a hall of the given length; None if they do not fit."""
    deep = round(length * WIDTH_RATIO, 3)
    waiting, things = list(images), []
    # North, east, south, west: length, and position at s metres from the left end.
    walls: list[tuple[float, Callable[[float], tuple[float, float]]]] = [
        (length, lambda s: (s, WALL_DISTANCE)),
        (deep, lambda s: (length - WALL_DISTANCE, s)),
        (length, lambda s: (length - s, deep - WALL_DISTANCE)),
        (deep, lambda s: (WALL_DISTANCE, deep - s)),
    ]
    for room, place in walls:
        at = CORNER
        while waiting and at + waiting[0].width + CORNER <= room:
            image = waiting.pop(0)
            things.append(_image(image, place(at), place(at + image.width)))
            at += image.width + GAP
    return None if waiting else things


def _image(image: Photo, start: tuple[float, float], end: tuple[float, float]) -> Thing:
    low, high = CENTRE_HEIGHT - image.height / 2, CENTRE_HEIGHT + image.height / 2
    points: tuple[Point, ...] = (
        (start[0], low, start[1]),
        (end[0], low, end[1]),
        (end[0], high, end[1]),
        (start[0], high, start[1]),
    )
    uv: tuple[Uv, ...] = ((0, 0), (1, 0), (1, 1), (0, 1))
    return Thing(image.name, [Face(image.name, points, uv)])


def hall(length: float) -> list[Thing]:
    """Returns the walls, floor and ceiling of a hall, facing inwards."""
    x, z = length, round(length * WIDTH_RATIO, 3)
    ground = ((0.0, 0.0), (x, 0.0), (x, z), (0.0, z))
    flat: list[Point] = [(a, 0.0, b) for a, b in reversed(ground)]
    things = [
        Thing("floor", [tile_face("floor", tuple(flat), 1.0)]),
        Thing("ceiling", [tile_face("ceiling", tuple((a, HEIGHT, b) for a, b in ground), 1.0)]),
    ]
    for k, name in enumerate(("north", "east", "south", "west")):
        (a, b), (c, d) = ground[k], ground[(k + 1) % 4]
        points: tuple[Point, ...] = ((a, 0.0, b), (c, 0.0, d), (c, HEIGHT, d), (a, HEIGHT, b))
        things.append(Thing(f"wall_{name}", [tile_face("wall", points, 1.0)]))
    return things


def make_photo_gallery(options: PhotoGalleryOptions, note: Note = ignore) -> Iterator[File]:
    """Returns the files of the gallery: relative path and a function that returns the bytes; the
    OBJ comes last."""
    count, seed = options.images, options.seed
    images = photos(count)
    length, pictures = hung(images)
    plain = [
        f"newmtl {name}\nKd {' '.join(map(str, color))}\nillum 1\n"
        for name, color in COLORS.items()
    ]
    painted = [
        f"newmtl {i.name}\nKd 1 1 1\nillum 1\nmap_Kd -clamp on textures/{i.name}.png\n"
        for i in images
    ]
    materials = "\n".join([f"{TITLE}: materials\n", *plain, *painted]).encode()
    head = [f"{TITLE}: {count} images, seed {seed}", "# metres, Y up"]
    model = obj_text([*hall(length), *pictures], head, "photo_gallery.mtl").encode()

    def loader(k: int) -> Callable[[], bytes]:
        return lambda: png(images[k].paint(generator(seed, 5, k), images[k].side))

    for k, image in enumerate(images):
        yield f"textures/{image.name}.png", loader(k)
    yield "photo_gallery.mtl", lambda: materials
    yield "photo_gallery.obj", lambda: model
