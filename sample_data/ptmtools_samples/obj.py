"""Wavefront OBJ text."""

from __future__ import annotations

from ptmtools_samples.mesh import Point, Thing, Uv


def number(value: float, digits: int) -> str:
    """Shortest decimal with at most ``digits`` places."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def obj_text(things: list[Thing], head: list[str], library: str) -> str:
    """Returns the objects with shared vertices (0.1 mm) and texture coordinates (1e-5)."""
    points: dict[str, int] = {}
    coordinates: dict[str, int] = {}
    numbers: dict[Point, int] = {}  # most corners repeat, and formatting is slow
    pairs: dict[Uv, int] = {}
    body: list[str] = []
    for thing in things:
        if thing.comment:
            body.append(f"# {thing.comment}")
        body.append(f"o {thing.name}")
        material = ""
        for face in thing.faces:
            if face.material != material:
                material = face.material
                body.append(f"usemtl {material}")
            corners = []
            for p, t in zip(face.points, face.uv, strict=True):
                a, b = numbers.get(p), pairs.get(t)
                if a is None:
                    v = "v " + " ".join(number(c, 4) for c in p)
                    a = numbers[p] = points.setdefault(v, len(points) + 1)
                if b is None:
                    vt = "vt " + " ".join(number(c, 5) for c in t)
                    b = pairs[t] = coordinates.setdefault(vt, len(coordinates) + 1)
                corners.append(f"{a}/{b}")
            body.append("f " + " ".join(corners))
    lines = [*head, f"mtllib {library}", *points, *coordinates, *body]
    return "\n".join(lines) + "\n"
