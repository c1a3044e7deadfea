"""Windows and doors: reveals, frames with glazing bars, panes, sills and surrounds.

An opening fills a hole of its wall completely, so the wall stays closed: the reveal leads from the
edge of the hole to the frame, and the frame encloses the panes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from ptmtools_samples.campus.solids import Wall, box, extrude, zip_strip
from ptmtools_samples.mesh import Face, Point

Hole = tuple[float, float, float, float]  # low u, low v, high u, high v


@dataclass(frozen=True)
class Style:
    """Dimensions and materials of windows; metres.

    ``panes``: columns and rows; a ``transom`` makes the topmost row lower. ``glass``: materials,
    one chosen for each window. ``arched``: a round head within the opening.
    """

    panes: tuple[int, int] = (2, 2)
    frame: str = "paint_white"
    glass: tuple[str, ...] = ("glass_dark", "glass_blinds", "glass_curtains", "glass_sky")
    depth: float = 0.16
    bar: float = 0.06
    transom: bool = False
    arched: bool = False
    trim: str = "stone_trim"
    sill: bool = True
    surround: str = ""  # "", "lintel", "frame", "pediment", "keystone"


def cells(
    wall: Wall,
    material: str | Sequence[str],
    us: Sequence[float],
    vs: Sequence[float],
    holes: Sequence[Hole],
    d: float,
) -> list[Face]:
    """Returns the rectangles of a grid outside the holes, whose edges lie on grid lines.

    ``material`` may be given for each row.
    """
    faces = []
    for j, (v, V) in enumerate(pairwise(vs)):
        name = material if isinstance(material, str) else material[j]
        for u, U in pairwise(us):
            x, y = (u + U) / 2, (v + V) / 2
            if not any(h[0] < x < h[2] and h[1] < y < h[3] for h in holes):
                faces.append(wall.face(name, [(u, v, d), (U, v, d), (U, V, d), (u, V, d)]))
    return faces


def rectangle_sides(us: Sequence[float], vs: Sequence[float], d: float) -> list[list[Point]]:
    """Returns the four sides of a rectangle with its grid points, counter-clockwise from below."""
    (u, *_, U), (v, *_, V) = us, vs
    return [
        [(x, v, d) for x in us],
        [(U, y, d) for y in vs],
        [(x, V, d) for x in reversed(us)],
        [(u, y, d) for y in reversed(vs)],
    ]


def reveal(
    wall: Wall, material: str, front: list[list[Point]], back: list[list[Point]]
) -> list[Face]:
    """Connects an outline to the one behind it, facing into the opening."""
    return [
        wall.face(material, piece)
        for a, b in zip(front, back, strict=True)
        for piece in zip_strip(a, b)
    ]


def grid_lines(low: float, high: float, cuts: Sequence[float]) -> list[float]:
    """Returns the grid lines of a wall between two of them, inclusive."""
    return [c for c in cuts if low - 1e-9 <= c <= high + 1e-9]


def _pane(wall: Wall, material: str, hole: Hole, pane: Hole, d: float) -> Face:
    """One sheet of glass; all sheets of a window show one image."""
    u, v, U, V = pane
    wide, tall = hole[2] - hole[0], hole[3] - hole[1]
    uv = [((a - hole[0]) / wide, (b - hole[1]) / tall) for a, b in ((u, v), (U, v), (U, V), (u, V))]
    return wall.face(material, [(u, v, d), (U, v, d), (U, V, d), (u, V, d)], uv)


def glaze(
    wall: Wall,
    hole: Hole,
    us: Sequence[float],
    vs: Sequence[float],
    style: Style,
    glass: str,
    reveals: str,
) -> list[Face]:
    """A rectangular window in a hole whose edges carry the grid lines ``us`` and ``vs`` of the
    wall."""
    u, v, U, V = hole
    across, up = style.panes
    bar = min(style.bar, (U - u) / (across * 4), (V - v) / (up * 4))
    wide = (U - u - bar * (across + 1)) / across
    columns = [
        x for k in range(across + 1) for x in (u + k * (wide + bar), u + k * (wide + bar) + bar)
    ]
    tall = V - v - bar * (up + 1)
    shares = [1.0] * up
    if style.transom and up > 1:
        shares[-1] = 0.5
    rows = [v, v + bar]
    for share in shares:
        top = rows[-1] + tall * share / sum(shares)
        rows += [top, top + bar]
    columns[-1], rows[-1] = U, V
    panes = [
        (columns[2 * i + 1], rows[2 * j + 1], columns[2 * i + 2], rows[2 * j + 2])
        for i in range(across)
        for j in range(up)
    ]
    d, deep = -style.depth, -style.depth - 0.05
    faces = reveal(wall, reveals, rectangle_sides(us, vs, 0), rectangle_sides(columns, rows, d))
    faces += cells(wall, style.frame, columns, rows, panes, d)
    for pane in panes:
        x, y = (pane[0], pane[2]), (pane[1], pane[3])
        faces += reveal(wall, style.frame, rectangle_sides(x, y, d), rectangle_sides(x, y, deep))
        faces.append(_pane(wall, glass, hole, pane, deep))
    return faces


def _arch(u: float, v: float, U: float, V: float, d: float) -> list[list[Point]]:
    """An outline with a round head in four parts: sill, right, head, left."""
    r = (U - u) / 2
    spring = max(v + 0.2, V - r)
    middle = (u + U) / 2
    n = 10
    curve = [
        (
            middle + r * math.cos(math.pi * k / n),
            spring + (V - spring) * math.sin(math.pi * k / n),
            d,
        )
        for k in range(n + 1)
    ]
    a, b = n // 4, n - n // 4
    return [
        [(u, v, d), (U, v, d)],
        [(U, v, d), *curve[: a + 1]],
        curve[a : b + 1],
        [*curve[b:], (u, v, d)],
    ]


def arch(
    wall: Wall,
    hole: Hole,
    us: Sequence[float],
    vs: Sequence[float],
    style: Style,
    glass: str,
    reveals: str,
) -> list[Face]:
    """A window with a round head; its surround, level with the wall, fills the rest of the hole."""
    u, v, U, V = hole
    m = 0.14
    edge = rectangle_sides(us, vs, 0)
    arch = _arch(u + m, v + m, U - m, V - m, 0)
    deep_arch = _arch(u + m, v + m, U - m, V - m, -style.depth)
    bar = style.bar * 1.3
    frame = _arch(u + m + bar, v + m + bar, U - m - bar, V - m - bar, -style.depth)
    deep = [[(p[0], p[1], -style.depth - 0.06) for p in side] for side in frame]
    faces = [
        wall.face(style.trim, piece)
        for a, b in zip(edge, arch, strict=True)
        for piece in zip_strip(a, b)
    ]
    faces += reveal(wall, reveals, arch, deep_arch)
    faces += reveal(wall, style.frame, deep_arch, frame) + reveal(wall, style.frame, frame, deep)
    outline = [p for side in deep for p in side[:-1]]
    uv = [((p[0] - u) / (U - u), (p[1] - v) / (V - v)) for p in outline]
    faces.append(wall.face(glass, outline, uv))
    # Bars in front of the glass are closed solids.
    middle, back, front = (u + U) / 2, -style.depth - 0.07, -style.depth - 0.02
    half = style.bar / 2
    low, high = v + m + bar / 2, V - m - bar / 2
    faces += box(wall, style.frame, (middle - half, low, back), (middle + half, high, front))
    spring = max(v + 0.2, V - (U - u) / 2)
    for y in (spring, (low + spring) / 2):
        faces += box(
            wall,
            style.frame,
            (u + m + bar / 2, y - half, back),
            (U - m - bar / 2, y + half, front - 0.005),
        )
    return faces


def dressing(wall: Wall, hole: Hole, style: Style, *, sill: bool) -> list[Face]:
    """Sill, lintel or surround of a window: solids in front of the wall."""
    u, v, U, V = hole
    trim, faces = style.trim, []
    if sill and style.sill:
        profile = [(-0.02, v - 0.1), (0.09, v - 0.1), (0.1, v - 0.02), (-0.02, v + 0.025)]
        faces += extrude(wall, profile, u - 0.08, U + 0.08, trim)
    if style.surround == "lintel":
        faces += box(wall, trim, (u - 0.15, V - 0.01, -0.02), (U + 0.15, V + 0.22, 0.04))
    if style.surround in ("frame", "pediment"):
        for x in (u - 0.16, U - 0.01):
            faces += box(wall, trim, (x, v - 0.02, -0.02), (x + 0.17, V, 0.06))
        faces += box(wall, trim, (u - 0.2, V - 0.01, -0.02), (U + 0.2, V + 0.18, 0.08))
    if style.surround == "pediment":
        top = [
            (-0.02, V + 0.3),
            (0.16, V + 0.3),
            (0.2, V + 0.38),
            (0.2, V + 0.42),
            (-0.02, V + 0.5),
        ]
        faces += extrude(wall, top, u - 0.3, U + 0.3, trim)
    if style.surround == "keystone":
        middle = (u + U) / 2
        faces += box(wall, trim, (middle - 0.13, V - 0.2, -0.02), (middle + 0.13, V + 0.2, 0.09))
    return faces


def door(
    wall: Wall,
    hole: Hole,
    us: Sequence[float],
    vs: Sequence[float],
    leaf: str,
    frame: str,
    reveals: str,
) -> list[Face]:
    """Two leaves under a fanlight, deep in the wall."""
    u, v, U, V = hole
    head = min(V - 0.5, v + 2.3)
    bar, d, deep = 0.08, -0.3, -0.36
    middle = (u + U) / 2
    columns = [u, u + bar, middle - bar / 4, middle + bar / 4, U - bar, U]
    rows = [v, v + 0.02, head, head + bar, V - bar, V]
    leaves = [(columns[k], rows[1], columns[k + 1], rows[2]) for k in (1, 3)]
    lights = [(columns[k], rows[3], columns[k + 1], rows[4]) for k in (1, 3)]
    faces = reveal(wall, reveals, rectangle_sides(us, vs, 0), rectangle_sides(columns, rows, d))
    faces += cells(wall, frame, columns, rows, [*leaves, *lights], d)
    for pane in (*leaves, *lights):
        x, y = (pane[0], pane[2]), (pane[1], pane[3])
        faces += reveal(wall, frame, rectangle_sides(x, y, d), rectangle_sides(x, y, deep))
        if pane in leaves:
            faces.append(_pane(wall, leaf, pane, pane, deep))
        else:
            faces.append(_pane(wall, "glass_dark", hole, pane, deep))
    for at in (middle - 0.16, middle + 0.1):  # handles
        faces += box(wall, "metal", (at, v + 0.9, deep - 0.01), (at + 0.06, v + 1.25, deep + 0.08))
    return faces


def plinth_steps(
    wall: Wall, middle: float, width: float, height: float, material: str, out: float = 0.0
) -> list[Face]:
    """Stairs from the ground to a threshold: a landing, then treads of 0.32 m and about 0.16 m."""
    count = max(1, round(height / 0.16))
    profile = [(-0.03, 0.0), (1.3 + out + 0.32 * (count - 1), 0.0)]
    for k in range(count):
        d = 1.3 + out + 0.32 * (count - 1 - k)
        profile += [(d, height * (k + 1) / count), (d - 0.32, height * (k + 1) / count)]
    profile[-1] = (-0.03, height)
    return extrude(wall, profile, middle - width / 2, middle + width / 2, material)
