"""A hall with pictures in the forms that modelling programs give them, as an OBJ."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

Corner = tuple[float, float, float]
#: Metres: the hall, and a picture.
WIDTH, DEPTH, HEIGHT = 12.0, 8.0, 4.0
ACROSS, UP, LOW = 0.8, 1.2, 1.0


def write_hall(folder: Path) -> Path:
    """The file: four pictures on the wall at z = 0, and a screen with a sign, which is none."""
    lines = ["mtllib hall.mtl"]
    count = 0

    def quad(*corners: Corner, repeat: float = 1.0) -> None:
        nonlocal count
        ends = ((0, 0), (1, 0), (1, 1), (0, 1))
        for corner, (u, v) in zip(corners, ends, strict=True):
            lines.append("v {} {} {}".format(*corner))
            lines.append(f"vt {u * repeat} {v * repeat}")
        lines.append("f " + " ".join(f"{k}/{k}" for k in range(count + 1, count + 5)))
        count += 4

    def box(low: Corner, high: Corner, repeat: float = 1.0, inward: bool = False) -> None:
        (a, b, c), (x, y, z) = low, high
        sides = (
            ((a, b, z), (x, b, z), (x, y, z), (a, y, z)),
            ((x, b, c), (a, b, c), (a, y, c), (x, y, c)),
            ((a, b, c), (a, b, z), (a, y, z), (a, y, c)),
            ((x, b, z), (x, b, c), (x, y, c), (x, y, z)),
            ((a, y, z), (x, y, z), (x, y, c), (a, y, c)),
            ((a, b, c), (x, b, c), (x, b, z), (a, b, z)),
        )
        for side in sides:
            quad(*(side[::-1] if inward else side), repeat=repeat)

    def start(name: str, material: str) -> None:
        lines.extend((f"o {name}", f"usemtl {material}"))

    def canvas(left: float, away: float) -> tuple[Corner, ...]:
        right, top = left + ACROSS, LOW + UP
        return (left, LOW, away), (right, LOW, away), (right, top, away), (left, top, away)

    start("hall", "wall")
    box((0, 0, 0), (WIDTH, HEIGHT, DEPTH), repeat=6, inward=True)
    start("slab", "one")
    box((1, LOW, 0.01), (1 + ACROSS, LOW + UP, 0.06))
    start("turned", "two")
    quad(*canvas(4, 0.03)[::-1])
    start("board", "wall")
    box((6.95, LOW - 0.05, 0.01), (7.05 + ACROSS, LOW + UP + 0.05, 0.03))
    lines.append("usemtl three")
    quad(*canvas(7, 0.04))
    start("wallpaper", "wall")
    quad(*canvas(10, 0.03))
    start("screen", "wall")
    box((1, 0, 7.9), (4, 3, 7.95))
    lines.append("usemtl sign")
    quad((2, 2, 7.89), (1.6, 2, 7.89), (1.6, 2.3, 7.89), (2, 2.3, 7.89))
    materials = []
    for number, name in enumerate(("wall", "one", "two", "three", "sign")):
        Image.new("RGB", (8, 8), (50 * number, 90, 120)).save(folder / f"{name}.png")
        materials += [f"newmtl {name}", f"map_Kd {name}.png"]
    (folder / "hall.mtl").write_text("\n".join(materials) + "\n")
    file = folder / "hall.obj"
    file.write_text("\n".join(lines) + "\n")
    return file
