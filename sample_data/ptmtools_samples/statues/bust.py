"""A bust: head with curls, a cloak over the shoulders, a round foot. 0.7 m high, facing +Z."""

from __future__ import annotations

import numpy as np

from ptmtools_samples.statues.fields import (
    Noise,
    Points,
    Values,
    blend,
    capsule,
    carve,
    disc,
    ellipsoid,
    saw,
    sphere,
    step,
    turn,
    union,
    wave,
)

LOW, HIGH = (-0.27, -0.01, -0.17), (0.27, 0.71, 0.2)


class Bust:
    def __init__(self, random: np.random.Generator) -> None:
        self.noise = Noise(random)
        self._curls = random.random((46, 3))

    def __call__(self, p: Points) -> Values:
        x, y, z = p
        # The face is symmetric except for tool marks and curls.
        half = np.stack([np.abs(x), y, z])
        head = self._head(half)
        hair = self._hair(p)
        body = self._body(p, half)
        neck = capsule(p, (0, 0.36, -0.03), (0, 0.49, -0.012), 0.066, 0.055)
        cords = capsule(half, (0.055, 0.46, 0.0), (0.014, 0.335, 0.062), 0.012)
        neck = blend(neck, cords, 0.03)
        skin = blend(neck, head, 0.025)
        whole = blend(blend(skin, body, 0.02), hair, 0.006)
        foot = union(
            disc(p, (0, 0.02, -0.01), 0.11, 0.02, 0.006),
            blend(
                disc(p, (0, 0.052, -0.01), 0.092, 0.014, 0.012),
                capsule(p, (0, 0.06, -0.01), (0, 0.16, -0.02), 0.055, 0.075),
                0.03,
            ),
        )
        marks = 0.0005 * self.noise(p, 0.006, 2) + 0.0012 * self.noise(p, 0.05)
        return blend(whole, foot, 0.01) + marks

    def _head(self, p: Points) -> Values:
        """The head at points with x ≥ 0; the centre of the eyes is at y = 0.575."""
        skull = ellipsoid(p, (0, 0.585, -0.012), (0.078, 0.1, 0.1))
        jaw = ellipsoid(p, (0, 0.527, 0.022), (0.056, 0.065, 0.062))
        head = blend(skull, jaw, 0.05)
        chin = sphere(p, (0.008, 0.474, 0.066), 0.017)
        head = blend(head, chin, 0.03)
        cheek = ellipsoid(p, (0.043, 0.55, 0.055), (0.024, 0.018, 0.02))
        head = blend(head, cheek, 0.03)
        socket = ellipsoid(p, (0.032, 0.575, 0.091), (0.022, 0.0135, 0.02))
        head = carve(head, socket, 0.014)
        brow = capsule(p, (0.008, 0.594, 0.087), (0.056, 0.599, 0.066), 0.0075, 0.005)
        head = blend(head, brow, 0.016)
        eye = sphere(p, (0.032, 0.574, 0.067), 0.0145)
        lids = ellipsoid(p, (0.032, 0.5745, 0.067), (0.0175, 0.0155, 0.0158))
        slit = ellipsoid(p, (0.032, 0.5735, 0.085), (0.0138, 0.0062, 0.02))
        pupil = sphere(p, (0.031, 0.5745, 0.0835), 0.0038)
        head = blend(head, carve(lids, slit, 0.002), 0.005)
        head = union(head, carve(eye, pupil, 0.001))
        nose = capsule(p, (0, 0.59, 0.084), (0, 0.546, 0.109), 0.0085, 0.0105)
        wing = ellipsoid(p, (0.0115, 0.541, 0.098), (0.0075, 0.0075, 0.0105))
        nose = blend(nose, wing, 0.009)
        nostril = ellipsoid(p, (0.0065, 0.5345, 0.102), (0.0032, 0.004, 0.0055))
        head = carve(blend(head, nose, 0.014), nostril, 0.003)
        mouth = capsule(p, (0, 0.5115, 0.094), (0.024, 0.509, 0.08), 0.0022)
        upper = blend(
            capsule(p, (0.004, 0.5165, 0.0885), (0.022, 0.5105, 0.0785), 0.0062, 0.003),
            sphere(p, (0.003, 0.515, 0.089), 0.005),
            0.005,
        )
        lower = capsule(p, (0, 0.5045, 0.0865), (0.019, 0.507, 0.0775), 0.0072, 0.003)
        groove = capsule(p, (0, 0.521, 0.098), (0, 0.53, 0.1), 0.0028)
        head = blend(blend(head, upper, 0.006), lower, 0.006)
        head = carve(carve(head, mouth, 0.0025), groove, 0.005)
        ear = ellipsoid(p, (0.081, 0.562, -0.008), (0.0085, 0.032, 0.02))
        shell = ellipsoid(p, (0.0895, 0.567, -0.003), (0.0062, 0.02, 0.0115))
        inner = ellipsoid(p, (0.087, 0.561, -0.009), (0.004, 0.013, 0.004))
        ear = union(carve(ear, shell, 0.003), inner)
        return blend(head, ear, 0.008)

    def _hair(self, p: Points) -> Values:
        x, y, z = p
        cap = ellipsoid(p, (0, 0.592, -0.022), (0.088, 0.103, 0.102))
        # Curls neither cover the face nor extend below the hairline.
        face = ellipsoid(p, (0, 0.545, 0.12), (0.074, 0.098, 0.105))
        cap = carve(cap, face, 0.012)
        cap = carve(cap, y - 0.52 - 0.35 * (z + 0.05), 0.015)
        around, warp = turn(z + 0.03, x), self.noise(p, 0.03, 2)
        rise = (y - 0.55) * 9
        lock = wave(9 * around + 0.8 * wave(rise) + 0.5 * warp)
        strand = saw(78 * around + 5 * wave(rise * 0.8) + 4 * lock + 3.5 * warp)
        cap = cap - 0.0042 * lock - 0.0022 * strand
        # Curls along the hairline.
        curls = cap
        for a, b, size in self._curls:
            sweep = 2.1 * (a - 0.5)
            at = (
                0.082 * float(np.clip(sweep * (1.5 - 0.5 * abs(sweep)), -1, 1)),
                0.607 + 0.05 * (1 - abs(sweep) ** 2) + 0.02 * b,
                0.062 - 0.1 * sweep**2 + 0.02 * (0.5 - b),
            )
            radius = 0.011 + 0.006 * size
            away = p - np.array(at)[:, None]
            coil = turn(away[0], away[1]) + (0.5 if size > 0.5 else -0.5) * 260 * np.sqrt(
                away[0] * away[0] + away[1] * away[1]
            )
            ball = ellipsoid(p, at, (radius, radius, radius * 0.85)) - 0.0016 * wave(coil)
            curls = blend(curls, ball, 0.004)
        return curls

    def _body(self, p: Points, half: Points) -> Values:
        x, y, z = p
        chest = ellipsoid(p, (0, 0.25, -0.01), (0.17, 0.13, 0.1))
        shoulder = capsule(half, (0.05, 0.345, -0.03), (0.165, 0.29, -0.03), 0.05, 0.062)
        body = blend(chest, shoulder, 0.06)
        bone = capsule(half, (0.012, 0.338, 0.055), (0.12, 0.348, 0.01), 0.009, 0.007)
        body = blend(body, bone, 0.02)
        cloak = ellipsoid(p, (0.01, 0.235, -0.02), (0.205, 0.15, 0.125))
        cloak = blend(
            cloak, capsule(p, (-0.2, 0.24, -0.03), (-0.1, 0.345, -0.03), 0.052, 0.05), 0.05
        )
        cloak = blend(cloak, capsule(p, (0.2, 0.24, -0.03), (0.1, 0.34, -0.03), 0.05, 0.045), 0.05)
        # The cloak is open over the breast and covers one shoulder.
        opening = ellipsoid(p, (0.035, 0.36, 0.11), (0.095, 0.12, 0.1))
        warp = self.noise(p, 0.09, 2)
        fan = turn(x - 0.16, y - 0.4)
        fold = wave(17 * fan + 0.9 * warp)
        fine = wave(41 * fan + 2 * warp + 12 * z)
        depth = 0.35 + step(-y, -0.34, -0.2)
        cloak = cloak - (0.008 * fold * np.abs(fold) + 0.0022 * fine) * depth
        cloak = carve(cloak, opening, 0.01)
        hem = np.abs(ellipsoid(p, (0.035, 0.36, 0.11), (0.099, 0.124, 0.104))) - 0.004
        cloak = blend(cloak, np.maximum(hem, cloak - 0.005), 0.006)
        clasp = sphere(p, (-0.1, 0.33, 0.052), 0.02)
        clasp = carve(clasp, sphere(p, (-0.104, 0.333, 0.071), 0.008), 0.003)
        body = union(blend(body, cloak, 0.004), clasp)
        # The lower end is a curve.
        return carve(body, y - 0.155 - 1.1 * x * x + 0.25 * np.minimum(z, 0), 0.012)

    def colors(self, p: Points) -> Points:
        """(3, n) red, green and blue, 0 to 1: traces of paint on marble."""
        half = np.stack([np.abs(p[0]), p[1], p[2]])
        vein = np.abs(self.noise(p, 0.14, 4))
        marble = 0.9 - 0.3 * np.maximum(0.08 - vein, 0) / 0.08
        color = np.stack([marble, marble * 0.985, marble * 0.95])
        worn = 0.75 + 0.25 * self.noise(p, 0.03, 3)
        hair = step(self._head(half) - self._hair(p), 0.001, 0.004) * step(p[1], 0.5, 0.52)
        cloth = step(0.42 - p[1], 0.0, 0.02) * step(p[1], 0.17, 0.18)
        neck = capsule(p, (0, 0.3, -0.03), (0, 0.49, -0.012), 0.075)
        breast = ellipsoid(p, (0.035, 0.36, 0.11), (0.095, 0.12, 0.1))
        cloth = cloth * step(np.minimum(neck, breast), 0.0, 0.004)
        for share, paint in ((hair, (0.42, 0.26, 0.13)), (cloth, (0.55, 0.12, 0.14))):
            color = color + share * worn * (np.array(paint)[:, None] - color)
        return color
