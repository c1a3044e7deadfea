"""The upper end of a column: a shaft with sharp-edged flutes, a capital of leaves, and a plate with
moulded sides. 1 m high."""

from __future__ import annotations

import numpy as np

from ptmtools_samples.statues.fields import (
    Noise,
    Points,
    Values,
    blend,
    box,
    capsule,
    carve,
    disc,
    ring,
    saw,
    sphere,
    step,
    union,
    wave,
)

LOW, HIGH = (-0.37, -0.01, -0.37), (0.37, 1.03, 0.37)
#: cos and sin of 7.5°, 22.5° and 37.5°: flutes of an eighth of the shaft.
FLUTES = ((0.9914448614, 0.1305261922), (0.9238795325, 0.3826834324), (0.7933533403, 0.6087614290))


def fold(p: Points) -> Points:
    """Maps points to the sector 0 ≤ z ≤ x, an eighth of the space around the axis."""
    x, y, z = p
    x, z = np.abs(x), np.abs(z)
    return np.stack([np.maximum(x, z), y, np.minimum(x, z)])


class Column:
    def __init__(self, random: np.random.Generator) -> None:
        self.noise = Noise(random)

    def __call__(self, p: Points) -> Values:
        x, y, z = p
        q = fold(p)
        out = np.sqrt(x * x + z * z)
        radius = 0.215 - 0.03 * y
        shaft = np.maximum((out - radius) * 0.99, np.maximum(-y, y - 0.56))
        for c, s in FLUTES:
            away = np.sqrt((q[0] - radius * 1.03 * c) ** 2 + (q[2] - radius * 1.03 * s) ** 2)
            # Flutes have round ends.
            flute = np.maximum(away - 0.125 * radius, np.abs(y - 0.27) - 0.235)
            shaft = np.maximum(shaft, -flute)
        necking = union(
            ring(p, (0, 0.565, 0), 0.196, 0.018),
            disc(p, (0, 0.592, 0), 0.2, 0.008),
            ring(p, (0, 0.016, 0), 0.216, 0.016),
        )
        bell = np.maximum(out - 0.17 - 0.13 * step(y, 0.62, 0.93), np.maximum(0.57 - y, y - 0.92))
        beads = sphere(self._beads(q, p), (0.214, 0.6, 0.0), 0.0125)
        leaves = union(self._leaf(q, 0.0, 0.6, 0.17), self._leaf(q, 1.0, 0.66, 0.2))
        volute = self._volute(q)
        capital = blend(union(blend(bell, leaves, 0.006), volute), necking, 0.004)
        plate = self._plate(p)
        whole = union(shaft, capital, beads, plate)
        chipped = 0.0035 * np.maximum(self.noise(p, 0.07, 2) - 0.3, 0)
        return whole + chipped + 0.0003 * self.noise(p, 0.005)

    def _beads(self, q: Points, p: Points) -> Points:
        """A row of 48 beads, by three further foldings."""
        x, y, z = q
        for c, s in ((0.9238795325, 0.3826834324), (0.9807852804, 0.1950903220)):
            # Mirror points beyond the middle of the sector.
            over = np.maximum(z * c - x * s, 0)
            x, z = x + 2 * over * s, z - 2 * over * c
        return np.stack([x, y, z])

    def _leaf(self, q: Points, diagonal: float, foot: float, high: float) -> Values:
        """Leaves on the axes, or between them, that lean outwards and curl over."""
        x, y, z = q
        if diagonal:
            x, z = (x + z) * 0.7071067812, (x - z) * 0.7071067812
        side = np.abs(z)
        up = np.clip((y - foot) / high, 0, 1.2)
        lean = 0.196 + 0.035 * up + 0.075 * step(up, 0.5, 1.05)
        lobes = 0.8 + 0.2 * saw(up * 4.5 - side * 9)
        wide = 0.062 * (1 - 0.72 * step(up, 0.3, 1.1)) * lobes
        sheet = np.abs(x - lean) - 0.011 - 0.006 * (1 - side / np.maximum(wide, 1e-6))
        veins = 0.004 * wave(side * 38 - up * 2.5) * step(side, 0.003, 0.012)
        blade = np.maximum(
            sheet - veins, np.maximum(side - wide, np.abs(y - foot - high / 2) - high / 2)
        )
        rib = capsule(
            np.stack([x, y, z]), (0.205, foot, 0), (0.24, foot + 0.7 * high, 0), 0.01, 0.006
        )
        curl = capsule(
            np.stack([x, y, side]),
            (0.296, foot + high * 0.96, 0.0),
            (0.29, foot + high * 0.93, 0.022),
            0.019,
            0.012,
        )
        return blend(blend(blade * 0.6, rib, 0.006), curl - 0.002 * wave(side * 90), 0.01)

    def _volute(self, q: Points) -> Values:
        """Spirals under the corners of the plate."""
        x, z = (q[0] + q[2]) * 0.7071067812, (q[0] - q[2]) * 0.7071067812
        u, v = x - 0.315, q[1] - 0.865
        from_eye = np.sqrt(u * u + v * v)
        coil = saw(from_eye * 36 + 0.5 * v / np.maximum(from_eye, 1e-6))
        thick = 0.03 - 0.008 * coil
        return np.asarray(np.maximum(from_eye - 0.055, np.abs(z) - thick) * 0.85)

    def _plate(self, p: Points) -> Values:
        q = fold(p)
        lower = box(p, (0, 0.945, 0), (0.285, 0.022, 0.285), 0.002)
        upper = box(p, (0, 0.99, 0), (0.31, 0.022, 0.31), 0.002)
        hollow = disc(p, (0, 0.967, 0), 2.0, 0.008)
        plate = carve(union(lower, upper), np.maximum(hollow, 0.27 - q[0]), 0.003)
        # Concave sides with a flower in the middle of each.
        swing = np.sqrt((q[0] - 1.27) ** 2 + q[2] * q[2]) - 0.99
        plate = np.maximum(plate, -np.maximum(swing, 0.2 - q[0]))
        flower = sphere(q, (0.275, 0.968, 0), 0.02)
        for high, wide in ((0.026, 0.012), (-0.026, 0.012), (0.0, 0.034)):
            flower = blend(flower, sphere(q, (0.268, 0.968 + high, wide), 0.017), 0.004)
        return union(plate, flower)

    def colors(self, p: Points) -> Points:
        """(3, n) red, green and blue, 0 to 1: layered sandstone, sooty in places sheltered from
        rain."""
        layer = wave(p[1] * 11 + 0.7 * self.noise(p, 0.2, 3))
        grain = self.noise(p, 0.012, 2)
        light = 0.74 + 0.06 * layer + 0.05 * grain
        soot = step(p[1], 0.5, 0.93) * (0.3 + 0.2 * self.noise(p, 0.1, 3))
        light = light * (1 - soot * step(-p[1], -0.935, -0.9))
        return np.stack([light, light * 0.9, light * 0.74])
