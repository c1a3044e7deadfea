"""Footprints: rings of (x, z) within a width and a depth behind the front line z = 0."""

from __future__ import annotations

from ptmtools_samples.campus.solids import Ring


def bar(w: float, d: float) -> list[Ring]:
    x = w / 2
    return [[(-x, 0), (x, 0), (x, -d), (-x, -d)]]


def ell(w: float, d: float, wing: float) -> list[Ring]:
    """A front and a wing behind its left end."""
    x = w / 2
    return [[(-x, 0), (x, 0), (x, -wing), (-x + wing, -wing), (-x + wing, -d), (-x, -d)]]


def you(w: float, d: float, wing: float) -> list[Ring]:
    """Two wings towards the front, around an entrance court."""
    x = w / 2
    return [
        [
            (-x, 0),
            (-x + wing, 0),
            (-x + wing, -d + wing),
            (x - wing, -d + wing),
            (x - wing, 0),
            (x, 0),
            (x, -d),
            (-x, -d),
        ]
    ]


def court(w: float, d: float, wing: float) -> list[Ring]:
    x = w / 2
    inner = [(-x + wing, -wing), (-x + wing, -d + wing), (x - wing, -d + wing), (x - wing, -wing)]
    return [bar(w, d)[0], inner]


def risalit(w: float, d: float, middle: float, out: float) -> list[Ring]:
    """A bar with a projecting centre."""
    x, m = w / 2, middle / 2
    front = [(-x, -out), (-m, -out), (-m, 0), (m, 0), (m, -out), (x, -out)]
    return [[*front, (x, -d), (-x, -d)]]


def tee(w: float, d: float, wing: float) -> list[Ring]:
    x, m = w / 2, wing / 2
    return [[(-x, 0), (x, 0), (x, -wing), (m, -wing), (m, -d), (-m, -d), (-m, -wing), (-x, -wing)]]
