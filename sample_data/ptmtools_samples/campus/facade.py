"""Walls of a building: a grid of bays and storeys, with holes and their fillings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ptmtools_samples.campus.openings import (
    Hole,
    Style,
    arch,
    cells,
    door,
    dressing,
    glaze,
    grid_lines,
)
from ptmtools_samples.campus.solids import Flat, Ring, Wall, box, walls_of, zip_strip
from ptmtools_samples.mesh import Face, Point


@dataclass(frozen=True)
class FacadeLook:
    """Materials and dimensions of the facades of a building; metres.

    ``ground`` covers the ground floor up to the first string course. ``ratio``: width of a window
    over that of its bay; ``sill`` and ``head``: heights above the floor of the storey.
    ``ground_style``: style of the ground-floor windows.
    """

    wall: str
    ground: str
    style: Style
    ground_style: Style
    plinth: float = 0.48
    storeys: int = 3
    height: float = 3.4
    ground_height: float = 3.8
    bay: float = 3.0
    ratio: float = 0.45
    sill: float = 0.9
    head: float = 2.6
    band: float = 0.7  # height of wall above the topmost storey
    door: str = "door_oak"
    reveals: str = "stone_trim"
    balconies: bool = False

    @property
    def floors(self) -> list[float]:
        """Heights of the floors."""
        first = self.plinth + self.ground_height
        return [self.plinth, *(first + self.height * k for k in range(self.storeys - 1))]

    @property
    def top(self) -> float:
        return self.plinth + self.ground_height + self.height * (self.storeys - 1) + self.band

    def rows(self) -> list[tuple[float, float]]:
        """Bottom and top of the windows of each storey."""
        extra = self.ground_height - self.height
        return [
            (f + self.sill, f + self.head + (extra if k == 0 else 0))
            for k, f in enumerate(self.floors)
        ]


def columns(wall: Wall, look: FacadeLook) -> list[tuple[float, float]]:
    """Returns the openings of the bays from left to right; none on walls shorter than a bay."""
    count = int((wall.length - 0.9) / look.bay)
    if count < 1:
        return []
    pitch = (wall.length - 0.9) / count
    wide = min(pitch * look.ratio, pitch - 0.12)
    middles = [0.45 + pitch * (k + 0.5) for k in range(count)]
    return [(m - wide / 2, m + wide / 2) for m in middles]


#: Content of a bay, by wall, storey, bay and number of bays: "window", "door", "blank", "balcony".
Choice = Callable[[int, int, int, int], str]


@dataclass(frozen=True)
class Bay:
    """A built opening, for attachments before it."""

    wall: Wall
    storey: int
    hole: Hole
    kind: str


def facades(
    rings: list[Ring],
    look: FacadeLook,
    choose: Choice,
    tops: dict[int, list[Flat]],
    rng: np.random.Generator,
) -> tuple[list[Face], list[Bay]]:
    """Returns the closed walls from the ground to ``look.top``, and the openings.

    ``choose(wall, storey, bay, bays)`` selects the content of a bay; ``tops`` gives by wall an
    outline (u, v) of an upper edge that is not level.
    """
    rows = look.rows()
    cuts = sorted({look.plinth, *(v for row in rows for v in row)})
    course = look.plinth + look.ground_height
    cuts = sorted({*cuts, course}) if look.ground != look.wall else cuts
    if look.balconies:
        cuts = sorted({*cuts, *(f + 0.05 for f in look.floors[1:])})
    materials = [look.ground if v < course - 1e-6 else look.wall for v in cuts[:-1]]
    faces: list[Face] = []
    bays: list[Bay] = []
    number = -1
    for ring in rings:
        for wall in walls_of(ring):
            number += 1
            spans = columns(wall, look)
            us = sorted({0.0, wall.length, *(u for span in spans for u in span)})
            actual = []
            for i, (u, U) in enumerate(spans):
                for k, (v, V) in enumerate(rows):
                    kind = choose(number, k, i, len(spans))
                    if kind == "door":
                        v = look.plinth
                    elif kind == "balcony":
                        v = look.floors[k] + (0.05 if k else 0)
                    if kind != "blank":
                        actual.append(Bay(wall, k, (u, v, U, V), kind))
            faces += cells(wall, materials, us, cuts, [b.hole for b in actual], 0)
            low: list[Point] = [(u, cuts[0], 0) for u in us]
            high: list[Point] = [(u, cuts[-1], 0) for u in us]
            floor: list[Point] = [(0, 0, 0), (wall.length, 0, 0)]
            level = [(0.0, look.top), (wall.length, look.top)]
            edge: list[Point] = [(u, v, 0) for u, v in tops.get(number, level)]
            faces += [wall.face(look.ground, p) for p in zip_strip(floor, low)]
            faces += [wall.face(look.wall, p) for p in zip_strip(high, edge)]
            for bay in actual:
                faces += _fill(bay, us, cuts, look, rng)
            bays += actual
    return faces, bays


def _fill(
    bay: Bay, us: list[float], cuts: list[float], look: FacadeLook, rng: np.random.Generator
) -> list[Face]:
    wall, hole = bay.wall, bay.hole
    a, b = grid_lines(hole[0], hole[2], us), grid_lines(hole[1], hole[3], cuts)
    style = look.style if bay.storey else look.ground_style
    glass = style.glass[int(rng.integers(len(style.glass)))]
    if bay.kind == "door":
        return door(wall, hole, a, b, look.door, style.frame, look.reveals)
    if bay.kind == "balcony":
        style = replace(style, panes=(2, 1), arched=False)
    build = arch if style.arched else glaze
    faces = build(wall, hole, a, b, style, glass, look.reveals)
    return faces + dressing(wall, hole, style, sill=bay.kind == "window")


def balcony(bay: Bay, material: str, railing: str) -> list[Face]:
    """A slab before a French window, with posts and a rail, or a sheet of glass."""
    u, v, U, _ = bay.hole
    u, U, v = u - 0.35, U + 0.35, v - 0.03
    out = 1.25
    faces = box(bay.wall, material, (u, v - 0.18, -0.02), (U, v, out))
    top = v + 1.05
    if railing == "glass_clear":
        for low, high in (
            ((u + 0.02, v + 0.06, out - 0.05), (U - 0.02, top, out - 0.03)),
            ((u + 0.02, v + 0.06, 0.03), (u + 0.04, top, out - 0.06)),
            ((U - 0.04, v + 0.06, 0.03), (U - 0.02, top, out - 0.06)),
        ):
            faces += box(bay.wall, railing, low, high)
        return faces + box(
            bay.wall, "metal", (u, top + 0.005, out - 0.07), (U, top + 0.045, out - 0.01)
        )
    count = max(3, int((U - u) / 0.17))
    for k in range(count + 1):
        x = u + 0.01 + (U - u - 0.05) * k / count
        faces += box(
            bay.wall, railing, (x, v - 0.01, out - 0.05), (x + 0.025, top + 0.01, out - 0.025)
        )
    for k in range(8):
        d = 0.05 + (out - 0.15) * k / 8
        for x in (u + 0.01, U - 0.035):
            faces += box(bay.wall, railing, (x, v - 0.01, d), (x + 0.025, top + 0.01, d + 0.025))
    for low, high in (
        ((u, top, out - 0.06), (U, top + 0.04, out - 0.01)),
        ((u, top, -0.02), (u + 0.045, top + 0.04, out - 0.06)),
        ((U - 0.045, top, -0.02), (U, top + 0.04, out - 0.06)),
    ):
        faces += box(bay.wall, railing, low, high)
    return faces


def louvres(bay: Bay, material: str) -> list[Face]:
    """Slanted blades before a window, between two posts."""
    u, v, U, V = bay.hole
    faces = []
    for x in (u - 0.06, U + 0.02):
        faces += box(bay.wall, material, (x, v - 0.05, 0.1), (x + 0.04, V + 0.05, 0.3))
        faces += box(bay.wall, material, (x, V - 0.2, -0.02), (x + 0.04, V - 0.15, 0.12))
    count = max(2, int((V - v) / 0.3))
    for k in range(count):
        y = v + (V - v) * (k + 0.5) / count
        faces += box(bay.wall, material, (u - 0.03, y - 0.015, 0.13), (U + 0.03, y + 0.015, 0.27))
    return faces


def pilasters(walls: list[Wall], look: FacadeLook, material: str, top: float) -> list[Face]:
    """Adds pilasters with base and capital between the bays."""
    faces = []
    for wall in walls:
        spans = columns(wall, look)
        if len(spans) < 2:
            continue
        pitch = spans[1][0] - spans[0][0]
        half = min(0.28, (pitch - (spans[0][1] - spans[0][0])) / 2 - 0.22)
        if half < 0.1:
            continue
        for k in range(len(spans) + 1):
            u = 0.45 + pitch * k
            low = look.plinth
            faces += box(wall, material, (u - half, low + 0.3, -0.02), (u + half, top - 0.3, 0.1))
            faces += box(
                wall,
                material,
                (u - half - 0.06, low - 0.02, -0.02),
                (u + half + 0.06, low + 0.31, 0.16),
            )
            faces += box(
                wall, material, (u - half - 0.06, top - 0.31, -0.02), (u + half + 0.06, top, 0.16)
            )
    return faces
