"""Two rooms and a door: a closed model small enough to check by hand."""

from __future__ import annotations

import io
from collections.abc import Iterator

import numpy as np
from PIL import Image

from ptmtools_samples.files import File, Note, constant, ignore
from ptmtools_samples.mesh import Face, Point, Thing, Uv
from ptmtools_samples.obj import obj_text
from ptmtools_samples.options import NoOptions
from ptmtools_samples.shell import rectangles

HEAD = """\
# ptmtools sample: two rooms joined by one door. Metres, Y up; closed; all faces seen from inside.
#
#   0 +-------+-+-------+     Each room is 4 m wide (x), 3 m high (y) and 4 m deep (z).
#     |       | |       |     The wall between them is 0.2 m thick, from x = 4 to x = 4.2.
#     |   A    .    B   |     The door is 1 m wide (z from 1.5 to 2.5) and 2 m high.
#     |       | |       |
#   4 +-------+-+-------+     By hand: volume 48 + 48 + 0.4 = 96.4 m3. Surface of a room
#   z 0       4 4.2    8.2 x  2 (4x4 + 4x3 + 4x3) - 2 = 78 m2, of the doorway 0.2 (1 + 1 + 2 + 2)
#                             = 1.2 m2, together 157.2 m2. Convex cells: A, B and the doorway.
#
# Walls are named after the side that they are on: west is x low, north is z low.
# Texture coordinates: u = metres to the right / 4, v = metres up / 3; floors and ceilings / 1.
"""
MTL = """\
# ptmtools sample: two rooms
newmtl room_a
Kd 1 1 1
map_Kd room_a.png

newmtl room_b
Kd 1 1 1
map_Kd room_b.png

newmtl floor
Kd 1 1 1
map_Kd floor.png

newmtl ceiling
Kd 0.9 0.9 0.85

newmtl doorway
Kd 1 0.8 0.6
map_Kd doorway.png
"""
DOOR = (15, 0, 25, 20)  # decimetres: low z, low y, high z, high y
#: Letters of 5 × 7 dots: pixels of a font may change, and the repository contains the images.
LETTERS = {
    "A": ".###. #...# #...# ##### #...# #...# #...#",
    "B": "####. #...# #...# ####. #...# #...# ####.",
}
Color = tuple[int, int, int]


def _wall(material: str, axis: int, side: int, at: float, low: float, holes: bool) -> list[Face]:
    """A wall 4 m long and 3 m high that faces ``side`` along ``axis``, from ``low`` on the other
    horizontal axis."""
    pieces = rectangles((0, 0, 40, 30), [DOOR] if holes else [])
    rightward = side if axis == 2 else -side
    faces = []
    for a, bottom, b, top in pieces:
        corners = [(a, bottom), (b, bottom), (b, top), (a, top)]
        if rightward < 0:
            corners = [(b, bottom), (a, bottom), (a, top), (b, top)]
        points: list[Point] = []
        uv: list[Uv] = []
        for s, t in corners:
            along = low + s / 10
            points.append((at, t / 10, along) if axis == 0 else (along, t / 10, at))
            uv.append(((s if rightward > 0 else 40 - s) / 40, t / 30))
        faces.append(Face(material, tuple(points), tuple(uv)))
    return faces


def _flat(material: str, y: float, x: float, X: float, z: float, Z: float, up: bool) -> Face:
    points: tuple[Point, ...] = ((x, y, Z), (X, y, Z), (X, y, z), (x, y, z))
    uv: tuple[Uv, ...] = tuple((p[0] - x, 4 - p[2]) for p in points)
    return Face(material, points if up else points[::-1], uv if up else uv[::-1])


def _doorway() -> Thing:
    z, Z, top = DOOR[0] / 10, DOOR[2] / 10, DOOR[3] / 10
    unit: tuple[Uv, ...] = ((0, 0), (0.2, 0), (0.2, 2), (0, 2))
    north: tuple[Point, ...] = ((4, 0, z), (4.2, 0, z), (4.2, top, z), (4, top, z))
    south: tuple[Point, ...] = ((4.2, 0, Z), (4, 0, Z), (4, top, Z), (4.2, top, Z))
    return Thing(
        "doorway",
        [
            _flat("doorway", 0, 4, 4.2, z, Z, True),
            _flat("doorway", top, 4, 4.2, z, Z, False),
            Face("doorway", north, unit),
            Face("doorway", south, unit),
        ],
        "through the wall: floor, lintel, north jamb, south jamb",
    )


def _things() -> list[Thing]:
    things = []
    for name, x in (("a", 0.0), ("b", 4.2)):
        X, material = round(x + 4, 1), f"room_{name}"
        floor, ceiling = (
            _flat("floor", 0, x, X, 0, 4, True),
            _flat("ceiling", 3, x, X, 0, 4, False),
        )
        things += [
            Thing(f"{material}_floor", [floor]),
            Thing(f"{material}_ceiling", [ceiling]),
            Thing(f"{material}_wall_north", _wall(material, 2, 1, 0, x, False)),
            Thing(f"{material}_wall_south", _wall(material, 2, -1, 4, x, False)),
            Thing(
                f"{material}_wall_west",
                _wall(material, 0, 1, x, 0, name == "b"),
                "with the door cut out: left, above, right" if name == "b" else "",
            ),
            Thing(
                f"{material}_wall_east",
                _wall(material, 0, -1, X, 0, name == "a"),
                "with the door cut out: left, above, right" if name == "a" else "",
            ),
        ]
    return [*things, _doorway()]


def _image(color: Color, letter: str) -> bytes:
    """64 × 64 texels: a checkerboard with a letter, which reveals mirroring."""
    i, j = np.indices((64, 64)) // 8
    image = np.asarray(color, dtype=np.int64) + 16 * ((i + j) % 2)[..., None]
    if letter:
        dots = np.array([[dot == "#" for dot in row] for row in LETTERS[letter].split()])
        image[11:53, 17:47][np.kron(dots, np.ones((6, 6), dtype=bool))] = (250, 250, 240)
    out = io.BytesIO()
    Image.fromarray(image.astype(np.uint8)).save(out, "PNG")
    return out.getvalue()


def make_two_rooms(options: NoOptions | None = None, note: Note = ignore) -> Iterator[File]:
    """The files of the two rooms: name and a function that returns the bytes; the OBJ is last."""
    files = {
        "room_a.png": _image((168, 60, 52), "A"),
        "room_b.png": _image((52, 84, 160), "B"),
        "floor.png": _image((150, 120, 84), ""),
        "doorway.png": _image((120, 120, 120), ""),
        "two_rooms.mtl": MTL.encode(),
        "two_rooms.obj": obj_text(_things(), HEAD.splitlines(), "two_rooms.mtl").encode(),
    }
    for name, data in files.items():
        yield name, constant(data)
