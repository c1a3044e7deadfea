"""The walk of the visitor along the street (format: docs/design/walkthrough.md)."""

from __future__ import annotations

import json
import math

from ptmtools_samples.campus.layout import BEYOND, Street, point_along

SPEED = 11 / 3.6  # m/s: 11 km/h, as in the campus paper, section IV
EYE = 1.6
RATE = 5  # samples per second
#: Length over which a bend is rounded, on either side, m.
ROUNDING = 12.0
FIELD_OF_VIEW, ASPECT = 1.0472, 1.7778


def way_points(street: Street, length: float) -> list[tuple[float, float]]:
    """Returns points (x, z) at `RATE` per second along ``length`` metres of the rounded street."""
    line = street.line()

    def round_corner(s: float) -> tuple[float, float]:
        around = [point_along(line, s + ROUNDING * (k - 8) / 8) for k in range(17)]
        return sum(p[0] for p in around) / 17, sum(p[1] for p in around) / 17

    step = SPEED / RATE
    points = [round_corner(BEYOND)]
    s, pace = BEYOND, 0.05
    count = math.floor(length / step)
    at = points[0]
    gone = 0.0
    while len(points) <= count:
        s += pace
        nearer = round_corner(s)
        moved = math.dist(at, nearer)
        while gone + moved >= step * len(points) and len(points) <= count:
            share = (step * len(points) - gone) / moved
            points.append(
                (at[0] + (nearer[0] - at[0]) * share, at[1] + (nearer[1] - at[1]) * share)
            )
        gone, at = gone + moved, nearer
    return points


def way_text(street: Street, length: float, origin: tuple[float, float]) -> str:
    """Returns the walk with positions relative to ``origin``, the centre of the model's floor."""
    points = way_points(street, length)
    rows = []
    for k, (x, z) in enumerate(points):
        t = k / RATE
        ahead, behind = points[min(k + 10, len(points) - 1)], points[max(k - 2, 0)]
        heading = math.atan2(ahead[1] - behind[1], ahead[0] - behind[0])
        # Look at the houses on either side, slightly upwards.
        turn = 0.32 * math.sin(2 * math.pi * t / 23) * math.sin(2 * math.pi * t / 61)
        up = 0.03 + 0.03 * math.sin(2 * math.pi * t / 31)
        heading += turn
        flat = math.cos(up)
        d = (flat * math.cos(heading), math.sin(up), flat * math.sin(heading))
        row = [t, x - origin[0], EYE, z - origin[1], *d]
        rows.append("[" + ", ".join(json.dumps(round(c, 4) + 0.0) for c in row) + "]")
    head = {"format": "ptmtools walk", "schema": 1, "fieldOfView": FIELD_OF_VIEW, "aspect": ASPECT}
    text = json.dumps(head)[:-1]
    return text + ', "samples": [\n' + ",\n".join(rows) + "\n]}\n"
