"""Trees, lamps, benches, bollards, hedges, shelters and signs as separate objects."""

from __future__ import annotations

import numpy as np

from ptmtools_samples.campus.ground import garden, has_lane
from ptmtools_samples.campus.layout import (
    CURB_HEIGHT,
    FRONT,
    KERB,
    PAVEMENT,
    Plot,
    PlotFrame,
    Street,
)
from ptmtools_samples.campus.recipes import Recipe
from ptmtools_samples.campus.solids import Wall, box, prism
from ptmtools_samples.mesh import Face, Point, Thing

#: Local frame of boxes: u along the street, d towards it, from the origin of the frame.
LOCAL = Wall((0.0, 0.0), (1.0, 0.0), 1.0)


def tree(kind: str, tall: float, turn: float) -> list[Face]:
    """Two crossed planes with the picture of a tree, and a stem with thickness."""
    half = tall * 0.5
    faces = prism(
        (0, 0),
        [(tall * 0.026, 0), (tall * 0.02, tall * 0.2), (tall * 0.014, tall * 0.4)],
        8,
        "bark",
    )
    c, s = (1 - turn * turn) / (1 + turn * turn), 2 * turn / (1 + turn * turn)
    for x, z in ((c, s), (-s, c)):
        low: list[Point] = [(-x * half, 0, -z * half), (x * half, 0, z * half)]
        high: list[Point] = [(p[0], tall, p[2]) for p in reversed(low)]
        faces.append(Face(kind, (*low, *high), ((0, 0), (1, 0), (1, 1), (0, 1))))
    return faces


def lamp() -> list[Face]:
    """A mast with an arm over the street."""
    mast = [(0.14, 0.0), (0.14, 0.5), (0.07, 0.55), (0.05, 5.6)]
    faces = prism((0, 0), mast, 10, "metal_dark")
    faces += box(LOCAL, "metal_dark", (-0.04, 5.45, -0.02), (0.04, 5.53, 1.3))
    faces += box(LOCAL, "metal", (-0.14, 5.4, 0.9), (0.14, 5.5, 1.6))
    return faces + box(LOCAL, "paint_white", (-0.1, 5.37, 0.95), (0.1, 5.405, 1.55))


def bench() -> list[Face]:
    faces: list[Face] = []
    for x in (-0.8, 0.7):
        faces += box(LOCAL, "metal_dark", (x, 0, -0.2), (x + 0.08, 0.42, 0.22))
        faces += box(LOCAL, "metal_dark", (x, 0.4, -0.26), (x + 0.08, 0.85, -0.18))
    for k in range(4):
        faces += box(
            LOCAL, "bench_wood", (-0.95, 0.41, -0.17 + 0.1 * k), (0.95, 0.45, -0.09 + 0.1 * k)
        )
    for y in (0.55, 0.68, 0.81):
        faces += box(LOCAL, "bench_wood", (-0.95, y, -0.19), (0.95, y + 0.09, -0.15))
    return faces


def bollards(count: int, pitch: float) -> list[Face]:
    faces: list[Face] = []
    for k in range(count):
        levels = [(0.09, 0), (0.09, 0.8), (0.12, 0.82), (0.12, 0.9), (0.04, 0.98)]
        faces += prism((pitch * (k - (count - 1) / 2), 0), levels, 10, "metal_dark")
    return faces


def shelter() -> list[Face]:
    """A bus stop: a roof on posts, panes behind and at the ends, a seat."""
    faces = box(LOCAL, "metal", (-2.2, 2.4, -0.1), (2.2, 2.52, 1.7))
    for x in (-2.1, -0.04, 2.02):
        faces += box(LOCAL, "metal_dark", (x, 0, 0), (x + 0.08, 2.41, 0.08))
    for x, X in ((-1.98, -0.08), (0.08, 1.98)):
        faces += box(LOCAL, "glass_clear", (x, 0.3, 0.03), (X, 2.3, 0.05))
    for x in (-2.07, 2.05):
        faces += box(LOCAL, "glass_clear", (x, 0.3, 0.12), (x + 0.02, 2.3, 1.3))
    return faces + box(LOCAL, "bench_wood", (-1.7, 0.44, 0.15), (1.7, 0.5, 0.6))


def hedge(length: float, tall: float) -> list[Face]:
    return box(LOCAL, "hedge", (-length / 2, 0, -0.4), (length / 2, tall, 0.4))


def sign(number: int) -> list[Face]:
    """A board on two posts; its label is one of forty in a shared picture."""
    faces: list[Face] = []
    for x in (-0.75, 0.67):
        faces += box(LOCAL, "metal", (x, 0, -0.04), (x + 0.08, 2.0, 0.04))
    faces += box(LOCAL, "metal_dark", (-0.95, 1.2, 0.03), (0.95, 2.1, 0.08))
    k = number % 40
    u, v = k % 4 / 4, 1 - (k // 4 + 1) / 10
    board: list[Point] = [
        (-0.9, 1.25, 0.085),
        (0.9, 1.25, 0.085),
        (0.9, 2.05, 0.085),
        (-0.9, 2.05, 0.085),
    ]
    uv = ((u, v), (u + 0.25, v), (u + 0.25, v + 0.1), (u, v + 0.1))
    return [*faces, Face("signs", tuple(board), uv)]


class _Placer:
    """Numbers objects in order of placement, and transforms them to world coordinates."""

    def __init__(self) -> None:
        self.things: list[Thing] = []
        self.counts: dict[str, int] = {}

    def put(self, kind: str, frame: PlotFrame, faces: list[Face], suffix: str = "") -> None:
        self.counts[kind] = self.counts.get(kind, 0) + 1
        name = f"{kind}_{self.counts[kind]:03d}{suffix}"
        self.things.append(Thing(name, frame.place(faces)))


def furnish(
    street: Street,
    recipes: list[Recipe],
    depths: list[float],
    rng: np.random.Generator,
) -> list[Thing]:
    """Returns the furniture of every plot; ``depths`` are those of the buildings."""
    place = _Placer()
    slots = max(p.slot for p in street.plots) + 1
    for plot, recipe, depth in zip(street.plots, recipes, depths, strict=True):
        _garden(place, street, plot, recipe, depth, slots, rng)
    return place.things


def _garden(
    place: _Placer,
    street: Street,
    plot: Plot,
    recipe: Recipe,
    depth: float,
    slots: int,
    rng: np.random.Generator,
) -> None:
    low, high = (f * street.segment_length for f in (plot.low, plot.high))
    pitch, middle = high - low, (low + high) / 2

    def frame(s: float, t: float) -> PlotFrame:
        return street.frame(plot.segment, s, plot.side * t, CURB_HEIGHT, plot.side)

    kind = "tree_slender" if plot.slot % 2 else "tree_broad"
    for share in (0.13, 0.35, 0.65, 0.87):
        if share == 0.13 and has_lane(plot):
            continue
        tall = 6.0 + 2.5 * float(rng.random())
        if garden(plot, slots)[0] != "cobbles":
            place.put(
                "tree",
                frame(low + pitch * share, PAVEMENT + 1.2),
                tree(kind, tall, float(rng.random())),
            )
    for share in (0.2, 0.8):
        tall = 8.0 + 4.0 * float(rng.random())
        t = FRONT + depth + 8 + 6 * float(rng.random())
        place.put(
            "tree", frame(low + pitch * share, t), tree("tree_broad", tall, float(rng.random()))
        )
    lamp_at = 0.24 if plot.side > 0 else 0.74
    place.put("lamp", frame(low + pitch * lamp_at, KERB + 0.5), lamp())
    for share in (0.29, 0.71):
        place.put("bench", frame(low + pitch * share, PAVEMENT + 1.0), bench())
    label = f"_{recipe.name}"
    place.put("sign", frame(middle + 5.2, PAVEMENT + 0.6), sign(plot.number), label)
    if has_lane(plot):
        place.put("bollards", frame(low + pitch * 0.03, PAVEMENT - 0.3), bollards(2, 1.4))
    if garden(plot, slots)[0] == "grass":
        long = pitch * 0.3
        for share in (0.24, 0.76):
            place.put("hedge", frame(low + pitch * share, FRONT - 1.8), hedge(long, 0.9))
    if plot.slot % 4 == 2 and plot.side > 0:
        place.put("shelter", frame(low + pitch * 0.75, PAVEMENT - 1.1), shelter())
