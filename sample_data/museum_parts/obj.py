"""Wavefront OBJ text."""

from __future__ import annotations

from museum_parts.mesh import Thing


def number(value: float, digits: int) -> str:
    """Shortest decimal with at most ``digits`` places."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def obj_text(things: list[Thing], head: list[str], library: str) -> str:
    """The objects with shared vertices (0.1 mm) and texture coordinates (1e-5)."""
    points: dict[str, int] = {}
    coordinates: dict[str, int] = {}
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
                v = "v " + " ".join(number(c, 4) for c in p)
                vt = "vt " + " ".join(number(c, 5) for c in t)
                a = points.setdefault(v, len(points) + 1)
                b = coordinates.setdefault(vt, len(coordinates) + 1)
                corners.append(f"{a}/{b}")
            body.append("f " + " ".join(corners))
    lines = [*head, f"mtllib {library}", *points, *coordinates, *body]
    return "\n".join(lines) + "\n"
