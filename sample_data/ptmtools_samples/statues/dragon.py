"""A dragon that bites its tail: a scaly tube in a trefoil knot, thick at the head. 1 m wide."""

from __future__ import annotations

import numpy as np

from ptmtools_samples.statues.fields import (
    Noise,
    Points,
    Values,
    blend,
    capsule,
    carve,
    ellipsoid,
    saw,
    sphere,
    step,
    turn,
    union,
)

LOW, HIGH = (-0.56, -0.32, -0.56), (0.56, 0.32, 0.56)
#: Radius of the ring that the knot winds around, and of its windings; metres.
RING, WIND = 0.33, 0.125
#: Numbers of scales along the body and around it, and of spines along its back.
ALONG, AROUND, SPINES = 150, 14, 46


class Dragon:
    def __init__(self, random: np.random.Generator) -> None:
        self.noise = Noise(random)

    def _body(self, p: Points) -> tuple[Values, Values, Values, Values]:
        """Returns the distance to the tube without scales, the position along it (0 head, 1 tail)
        and around it (turns, 0 is the back), and its thickness."""
        x, y, z = p
        out = np.sqrt(x * x + z * z)
        cosine, sine = x / np.maximum(out, 1e-9), z / np.maximum(out, 1e-9)
        half = np.sqrt(np.maximum(1 + cosine, 0) / 2)
        halved = np.sqrt(np.maximum(1 - cosine, 0) / 2) * np.where(sine < 0, -1.0, 1.0)
        # Rotation by three half turns per round aligns both strands.
        c, s = cosine * half - sine * halved, sine * half + cosine * halved
        u, v = out - RING, y
        u, v = c * u + s * v, c * v - s * u
        second = u < 0
        u, v = np.abs(u) - WIND, np.where(second, -v, v)
        along = (turn(cosine, sine) + 0.5 + second) / 2
        thick = 0.03 + 0.052 * (1 - along) * (1 - 0.35 * (1 - along))
        thick = thick - 0.014 * step(-along, -0.06, 0.0) - 0.02 * step(along, 0.9, 1.0)
        away = np.sqrt(u * u + v * v)
        return away - thick, along, turn(u, v), thick

    def __call__(self, p: Points) -> Values:
        body, along, around, thick = self._body(p)
        # Rows of scales, each offset by half a scale from the previous row.
        row = along * ALONG
        number = np.floor(row)
        back = row - number
        shift = 0.5 * (number - 2 * np.floor(number / 2))
        side = saw(around * AROUND + shift)
        belly = step(np.abs(around), 0.36, 0.4)
        rounded = 1 - side * side
        scale = np.maximum(rounded - 1.1 * (1 - back) * (1 - back), 0) * (0.4 + 0.6 * back)
        plate = saw(row * 0.5) * 0.8
        relief = scale * (1 - belly) + plate * belly
        body = body - thick * 0.16 * relief
        spine = thick * 0.75 * saw(along * SPINES) * step(-np.abs(around), -0.035, -0.004)
        body = (body - spine) * 0.75
        whole = blend(body, self._head(p), 0.02)
        return whole + 0.0006 * self.noise(p, 0.012, 2)

    def _head(self, p: Points) -> Values:
        """The head at the start of the tube: x < 0, z = 0, facing −Z."""
        at = np.array([-RING, WIND, 0.0])[:, None]
        # The tube starts above the ring, after three quarters of a turn.
        x, y, z = p - at
        q = np.stack([np.abs(x), y, z])
        skull = ellipsoid(q, (0, 0.015, -0.03), (0.062, 0.05, 0.085))
        snout = capsule(q, (0, 0.01, -0.08), (0, -0.002, -0.17), 0.042, 0.03)
        head = blend(skull, snout, 0.03)
        jaw = capsule(q, (0, -0.035, -0.03), (0, -0.055, -0.155), 0.03, 0.02)
        head = blend(head, jaw, 0.012)
        head = carve(head, capsule(q, (0, -0.032, -0.1), (0, -0.034, -0.21), 0.008, 0.014), 0.006)
        brow = capsule(q, (0.028, 0.05, -0.095), (0.055, 0.052, -0.035), 0.011, 0.014)
        head = blend(head, brow, 0.012)
        socket = sphere(q, (0.052, 0.028, -0.078), 0.016)
        head = union(carve(head, socket, 0.006), sphere(q, (0.046, 0.028, -0.074), 0.0135))
        nostril = sphere(q, (0.017, 0.018, -0.193), 0.008)
        head = carve(blend(head, sphere(q, (0.017, 0.012, -0.183), 0.014), 0.01), nostril, 0.004)
        horn = capsule(q, (0.035, 0.05, -0.01), (0.065, 0.105, 0.06), 0.016, 0.01)
        horn = blend(
            horn, capsule(q, (0.065, 0.105, 0.06), (0.072, 0.125, 0.125), 0.01, 0.003), 0.01
        )
        ridges = 0.0016 * saw((q[1] * 1.2 + q[2]) * 110)
        head = blend(head, horn - ridges, 0.008)
        for k in range(5):
            tooth = (0.028 - 0.002 * k, -0.014, -0.105 - 0.017 * k)
            tip = (tooth[0], -0.042 + 0.002 * k, tooth[2] + 0.003)
            head = union(head, capsule(q, tooth, tip, 0.0065, 0.0015))
        whisker = capsule(q, (0.025, 0.0, -0.175), (0.075, 0.03, -0.215), 0.006, 0.004)
        whisker = blend(
            whisker, capsule(q, (0.075, 0.03, -0.215), (0.11, 0.0, -0.2), 0.004, 0.002), 0.004
        )
        return blend(head, whisker, 0.006)

    def colors(self, p: Points) -> Points:
        """(3, n) red, green and blue, 0 to 1: green with a golden belly, darker in the grooves."""
        body, _, around, thick = self._body(p)
        belly = step(np.abs(around), 0.34, 0.4)
        raised = np.clip(body / thick / 0.16, 0, 1)
        patch = 0.5 + 0.5 * self.noise(p, 0.08, 3)
        green = np.stack([0.1 + 0.25 * patch, 0.34 + 0.2 * patch, 0.16 + 0 * patch])
        gold = np.stack([0.8 + 0 * patch, 0.6 + 0.1 * patch, 0.25 + 0 * patch])
        return (green + belly * (gold - green)) * (0.55 + 0.45 * raised)
