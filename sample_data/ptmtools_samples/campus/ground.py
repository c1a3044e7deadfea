"""Streets, pavements, gardens and paths as one open surface, with road markings."""

from __future__ import annotations

from ptmtools_samples.campus.layout import (
    BEYOND,
    CURB_HEIGHT,
    EDGE,
    GARDEN,
    KERB,
    PAVEMENT,
    Plot,
    Street,
)
from ptmtools_samples.campus.materials import MATERIALS
from ptmtools_samples.campus.solids import Flat
from ptmtools_samples.mesh import Face, Point, Thing, tile_face

#: Shares of a plot's frontage: a lane, garden, the path to the door, garden, a margin.
COLUMNS = (0.0, 0.06, 0.42, 0.58, 0.94, 1.0)
#: Materials of front gardens and paths, in turn.
GARDENS = [
    ("cobbles", "cobbles"),
    ("grass", "paving"),
    ("gravel", "paving"),
    ("grass", "gravel"),
    ("paving", "paving"),
    ("grass", "cobbles"),
]
PAINT = 0.015


def has_lane(plot: Plot) -> bool:
    """Whether a lane separates this plot from the previous one."""
    return plot.slot % 3 == 1


def garden(plot: Plot, plots: int) -> tuple[str, str]:
    """Returns the materials of the front garden and of the path; the last third has lawns only."""
    if plot.slot * 3 >= plots:
        return ("grass", "paving")
    return GARDENS[(plot.slot * 2 + (plot.side > 0)) % len(GARDENS)]


def _flat(material: str, corners: list[Flat], y: float) -> Face:
    return tile_face(material, tuple((x, y, z) for x, z in corners), MATERIALS[material].tile)


def _patch(
    street: Street, segment: int, f: tuple[float, float], t: tuple[float, float]
) -> list[Flat]:
    a, b = min(t), max(t)
    return [
        street.mitre_point(segment, f[0], b),
        street.mitre_point(segment, f[1], b),
        street.mitre_point(segment, f[1], a),
        street.mitre_point(segment, f[0], a),
    ]


def _kerb(a: Flat, b: Flat, side: int) -> Face:
    """The face of the kerb from a to b along the street."""
    p, q = (b, a) if side > 0 else (a, b)
    (x, z), (X, Z) = p, q
    long = ((X - x) * (X - x) + (Z - z) * (Z - z)) ** 0.5
    points: tuple[Point, ...] = ((x, 0, z), (X, 0, Z), (X, CURB_HEIGHT, Z), (x, CURB_HEIGHT, z))
    tile = MATERIALS["stone_trim"].tile
    uv = (
        (0.0, 0.0),
        (long / tile, 0.0),
        (long / tile, CURB_HEIGHT / tile),
        (0.0, CURB_HEIGHT / tile),
    )
    return Face("stone_trim", points, uv)


def make_ground(street: Street) -> list[Thing]:
    things: list[Thing] = []
    slots = max(p.slot for p in street.plots) + 1
    built = {(p.segment, p.slot, p.side): p for p in street.plots}
    first = 0
    for segment, share in enumerate(street.shares):
        road = Thing(f"ground_street_{segment + 1}")
        walks = Thing(f"ground_pavement_{segment + 1}")
        things += [road, walks]
        for k in range(share):
            for side in (1, -1):
                number = first + k
                plot = built.get((segment, number, side)) or Plot(-1, segment, number, side, 0, 0)
                cover, path = garden(plot, slots * 2 // 3 if slots > 2 else slots)
                name = "right" if side > 0 else "left"
                lawn = Thing(f"ground_garden_{number + 1:02d}_{name}")
                things.append(lawn)
                for c in range(5):
                    f = ((k + COLUMNS[c]) / share, (k + COLUMNS[c + 1]) / share)
                    lane = c == 0 and has_lane(plot)

                    def strip(a: float, b: float, material: str, y: float = CURB_HEIGHT) -> Face:
                        corners = _patch(street, segment, f, (side * a, side * b))  # noqa: B023
                        return _flat(material, corners, y)

                    road.faces.append(strip(0, KERB, "asphalt", 0))
                    walks.faces.append(strip(KERB, PAVEMENT, "asphalt" if lane else "paving"))
                    ends = [street.mitre_point(segment, x, side * KERB) for x in f]
                    walks.faces.append(_kerb(ends[0], ends[1], side))
                    front = path if c == 2 and plot.number >= 0 else cover
                    lawn.faces.append(strip(PAVEMENT, GARDEN, "asphalt" if lane else front))
                    lawn.faces.append(strip(GARDEN, EDGE, "asphalt" if lane else "grass"))
        first += share
    things.append(_ends(street))
    things.append(_markings(street))
    return things


def _ends(street: Street) -> Thing:
    """The street and its sides beyond the first and the last plot."""
    thing = Thing("ground_beyond")
    last = len(street.headings) - 1
    for segment, near, extension in ((0, 0.0, -BEYOND), (last, 1.0, BEYOND)):
        hx, hz = street.headings[segment]

        def point(t: float, out: float) -> Flat:
            x, z = street.mitre_point(segment, near, t)  # noqa: B023
            return x + hx * out, z + hz * out  # noqa: B023

        for side in (1, -1):
            for a, b, material, y in (
                (0.0, KERB, "asphalt", 0.0),
                (KERB, PAVEMENT, "paving", CURB_HEIGHT),
                (PAVEMENT, EDGE, "grass", CURB_HEIGHT),
            ):
                low, high = sorted((side * a, side * b))
                s, e = sorted((0.0, extension))
                corners = [point(high, s), point(high, e), point(low, e), point(low, s)]
                thing.faces.append(_flat(material, corners, y))
            s, e = sorted((0.0, extension))
            thing.faces.append(_kerb(point(side * KERB, s), point(side * KERB, e), side))
    return thing


def _markings(street: Street) -> Thing:
    """A broken centre line, and a crossing at each bend."""
    thing = Thing("ground_markings")
    for segment in range(len(street.headings)):
        count = int(street.segment_length / 9)
        for k in range(count):
            f = ((k + 0.3) / count, (k + 0.63) / count)
            thing.faces.append(_flat("marking", _patch(street, segment, f, (-0.07, 0.07)), PAINT))
        for k in range(8):
            t = -KERB + 0.7 + k * 1.2
            f = (6 / street.segment_length, 10 / street.segment_length)
            thing.faces.append(_flat("marking", _patch(street, segment, f, (t, t + 0.5)), PAINT))
    return thing
