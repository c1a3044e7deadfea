"""Named objects made of convex polygons with texture coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field

Point = tuple[float, float, float]
Uv = tuple[float, float]


@dataclass(frozen=True)
class Face:
    """A planar convex polygon, counter-clockwise seen from the front; metres."""

    material: str
    points: tuple[Point, ...]
    uv: tuple[Uv, ...]


@dataclass
class Thing:
    """One object of the model."""

    name: str
    faces: list[Face] = field(default_factory=list)
    comment: str = ""


def subtract(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def cross(a: Point, b: Point) -> Point:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def tile_face(material: str, points: tuple[Point, ...], tile: float) -> Face:
    """A face whose image repeats every ``tile`` metres.

    A steep face is mapped upright as seen from its front: u to the viewer's right, v up. A flat
        face has u along x and v along -z. u and v start near 0, which keeps them small.
    """
    normal = cross(subtract(points[1], points[0]), subtract(points[2], points[0]))
    x, y, z = (abs(c) for c in normal)
    if y > max(x, z):
        raw = [(p[0], -p[2]) for p in points]
    elif x > z:
        raw = [(-p[2] if normal[0] > 0 else p[2], p[1]) for p in points]
    else:
        raw = [(p[0] if normal[2] > 0 else -p[0], p[1]) for p in points]
    low_u = min(u for u, _ in raw) // tile
    low_v = min(v for _, v in raw) // tile
    return Face(material, points, tuple((u / tile - low_u, v / tile - low_v) for u, v in raw))


def block(
    material: str, low: Point, high: Point, tile: float, *, without: frozenset[str] = frozenset()
) -> list[Face]:
    """The outward faces of a solid box; ``without`` names sides (+x, -y, …) to omit."""
    (x, y, z), (X, Y, Z) = low, high
    sides: dict[str, tuple[Point, ...]] = {
        "-x": ((x, y, z), (x, y, Z), (x, Y, Z), (x, Y, z)),
        "+x": ((X, y, Z), (X, y, z), (X, Y, z), (X, Y, Z)),
        "-y": ((x, y, z), (X, y, z), (X, y, Z), (x, y, Z)),
        "+y": ((x, Y, Z), (X, Y, Z), (X, Y, z), (x, Y, z)),
        "-z": ((X, y, z), (x, y, z), (x, Y, z), (X, Y, z)),
        "+z": ((x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)),
    }
    return [tile_face(material, p, tile) for side, p in sides.items() if side not in without]
