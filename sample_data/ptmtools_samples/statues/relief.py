"""A panel with three raised figures in an ornamental border. 1.2 m wide, facing +Z."""

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
    ellipsoid,
    saw,
    sphere,
    step,
    turn,
    union,
    wave,
)

LOW, HIGH = (-0.62, -0.42, -0.05), (0.62, 0.42, 0.14)
#: Half the width and height of the panel within the border; metres.
HALF = (0.5, 0.3)
EGG = 0.05


class ReliefSolid:
    def __init__(self, random: np.random.Generator) -> None:
        self.noise = Noise(random)
        # Position, mirroring, height, and positions of the hands of each figure.
        self._figures = [
            (-0.3, 1.0, 0.97, (0.13, 0.08), (-0.04, -0.02)),
            (0.02, -1.0, 1.0, (0.09, 0.18), (-0.11, -0.06)),
            (0.31, -1.0, 0.94, (0.14, 0.02), (0.07, -0.06)),
        ]
        self._stars = random.random((60, 3))

    def __call__(self, p: Points) -> Values:
        x, y, z = p
        slab = box(p, (0, 0, -0.02), (0.6, 0.4, 0.02), 0.004)
        ground = self._ground(p)
        figures = ground
        for figure in self._figures:
            figures = blend(figures, self._figure(p, *figure), 0.006)
        figures = np.maximum(figures, -0.03 - z)
        marks = 0.0006 * self.noise(p, 0.007, 2) * step(HALF[0] + 0.02 - np.abs(x), 0, 0.01)
        chisel = (
            0.001 * wave((x * 0.8 + y) * 70 + 2 * self.noise(p, 0.06)) * step(-z, -0.012, -0.004)
        )
        return union(blend(slab, figures, 0.004), self._border(p)) + marks - chisel

    def _ground(self, p: Points) -> Values:
        """Hills below, a tree at the left, and a sun with rays."""
        x, y, z = p
        hill = -0.27 + 0.02 * wave(x * 1.7) + 0.008 * self.noise(p, 0.08, 2)
        ground = box(p, (0, -0.33, 0.0), (0.52, 0.02, 0.035), 0.01)
        ground = blend(ground, np.maximum(y - hill, np.abs(z) - 0.022), 0.01)
        ground = np.maximum(ground, np.maximum(np.abs(x) - 0.51, -0.35 - y))
        trunk = capsule(p, (-0.455, -0.28, 0.005), (-0.44, 0.1, 0.005), 0.02, 0.012)
        trunk = trunk - 0.003 * wave(turn(x + 0.45, z) * 7 + y * 6)
        tree = trunk
        for a, b, c in self._stars[:26]:
            leaf = (-0.44 + 0.2 * (a - 0.5), 0.17 + 0.17 * (b - 0.5), 0.006 + 0.012 * c)
            tree = blend(tree, ellipsoid(p, leaf, (0.03, 0.016 + 0.012 * c, 0.014)), 0.002)
        sun_x, sun_y = x - 0.42, y - 0.2
        out = np.sqrt(sun_x * sun_x + sun_y * sun_y)
        rays = 0.045 + 0.028 * saw(turn(sun_x, sun_y) * 16)
        sun = union(
            np.maximum(out - rays, np.abs(z) - 0.008) * 0.7, sphere(p, (0.42, 0.2, -0.012), 0.04)
        )
        return union(ground, tree, sun)

    def _figure(
        self,
        p: Points,
        at: float,
        facing: float,
        high: float,
        first_hand: tuple[float, float],
        second_hand: tuple[float, float],
    ) -> Values:
        """A standing figure in a robe, half sunk into the panel."""
        q = np.stack([(p[0] - at) * facing, (p[1] + 0.29) / high - 0.29, p[2]])
        x, y, _ = q
        head = ellipsoid(q, (0.012, 0.2, 0.034), (0.032, 0.04, 0.032))
        nose = capsule(q, (0.034, 0.205, 0.05), (0.044, 0.193, 0.052), 0.006)
        chin = sphere(q, (0.025, 0.168, 0.044), 0.012)
        head = blend(blend(head, nose, 0.008), chin, 0.014)
        head = carve(head, ellipsoid(q, (0.026, 0.205, 0.066), (0.01, 0.006, 0.008)), 0.004)
        hair = ellipsoid(q, (0.002, 0.21, 0.03), (0.038, 0.04, 0.036))
        hair = hair - 0.0025 * wave(turn(x, y - 0.19) * 26 + 2 * wave(y * 14))
        hair = carve(hair, ellipsoid(q, (0.045, 0.188, 0.045), (0.034, 0.042, 0.06)), 0.008)
        neck = capsule(q, (0.004, 0.17, 0.025), (0, 0.12, 0.022), 0.018)
        torso = ellipsoid(q, (0, 0.06, 0.018), (0.062, 0.085, 0.04))
        hips = ellipsoid(q, (-0.005, -0.05, 0.016), (0.062, 0.08, 0.042))
        robe = capsule(q, (-0.012, -0.06, 0.012), (-0.02, -0.25, 0.01), 0.058, 0.078)
        robe = np.maximum(robe, -0.265 - y)
        knee = capsule(q, (0.022, -0.08, 0.03), (0.045, -0.2, 0.03), 0.03, 0.022)
        dress = blend(blend(torso, hips, 0.04), blend(robe, knee, 0.03), 0.04)
        warp = self.noise(p, 0.06, 2)
        fall = step(-y, -0.09, 0.1)
        folds = wave(x * (26 - 20 * np.maximum(-y, 0)) + 0.8 * warp + 0.3 * facing)
        drape = wave((y + 0.9 * x) * 24 + 0.9 * warp)
        fine = wave(x * 75 + 2.5 * warp + y * 6)
        dress = dress - (0.006 * folds + 0.0016 * fine) * fall - 0.003 * drape * (1 - fall)
        belt = capsule(q, (-0.06, 0.0, 0.045), (0.06, 0.004, 0.045), 0.008)
        dress = blend(dress, np.maximum(belt, np.abs(dress) - 0.007), 0.003)
        figure = blend(blend(dress, neck, 0.012), union(blend(head, neck, 0.012), hair), 0.004)
        for side, (hx, hy) in ((0.052, first_hand), (-0.05, second_hand)):
            elbow = (side + 0.5 * hx, min(0.02, hy - 0.02), 0.045)
            arm = capsule(q, (side, 0.105, 0.028), elbow, 0.023, 0.018)
            fore = capsule(q, elbow, (side + hx, hy, 0.056), 0.017, 0.011)
            palm = ellipsoid(q, (side + 1.1 * hx, hy + 0.005, 0.057), (0.016, 0.013, 0.01))
            arm = blend(blend(arm, fore, 0.012), palm, 0.008)
            figure = blend(figure, arm, 0.008)
        foot = ellipsoid(q, (0.045, -0.272, 0.03), (0.04, 0.014, 0.022))
        return blend(figure, foot, 0.006)

    def _border(self, p: Points) -> Values:
        """Two mouldings with eggs and darts between them."""
        x, y, z = p
        wide, tall = np.abs(x) - HALF[0], np.abs(y) - HALF[1]
        across = np.maximum(wide, tall)  # 0 at the inner edge, 0.1 at the outer
        bed = np.maximum(np.abs(across - 0.05) - 0.045, np.abs(z) - 0.012)
        inner = np.sqrt((across - 0.012) ** 2 + (z - 0.01) ** 2) - 0.012
        outer = np.sqrt((across - 0.088) ** 2 + (z - 0.012) ** 2) - 0.014
        cord = inner - 0.0016 * wave((x - y) * 60 + across * 60)
        along = np.where(wide > tall, y, x)
        cell = along / EGG
        off = (cell - np.floor(cell) - 0.5) * EGG
        q = np.stack([off, across - 0.05, z])
        egg = ellipsoid(q, (0, 0.004, 0.008), (0.0135, 0.02, 0.02))
        shell = ellipsoid(q, (0, 0.002, 0.006), (0.0205, 0.0265, 0.014))
        shell = carve(shell, ellipsoid(q, (0, 0.003, 0.016), (0.0165, 0.0225, 0.02)), 0.002)
        side = np.stack([EGG / 2 - np.abs(off), q[1], z])
        dart = capsule(side, (0, 0.022, 0.01), (0, -0.022, 0.012), 0.0045, 0.002)
        corner = np.stack([np.abs(x) - 0.55, np.abs(y) - 0.35, z])
        around = turn(corner[0], corner[1])
        out = np.sqrt(corner[0] ** 2 + corner[1] ** 2)
        petal = 0.018 + 0.02 * (1 - (2 * saw(around * 8) - 1) ** 2)
        rosette = np.maximum(out - petal, np.abs(z - 0.012) - 0.012 + 0.15 * (0.03 - out)) * 0.6
        rosette = union(rosette, sphere(corner, (0, 0, 0.016), 0.013))
        inside = np.maximum(np.abs(corner[0]), np.abs(corner[1])) - 0.045
        row = np.maximum(union(egg, shell, dart), -inside)
        ends = np.maximum(np.abs(x) - 0.6, np.abs(y) - 0.4)
        return np.asarray(np.maximum(union(bed, cord, outer, row, rosette), ends))

    def colors(self, p: Points) -> Points:
        """(3, n) red, green and blue, 0 to 1: a blue ground, white figures and gilt ornament, like
        glazed clay."""
        spots = 0.04 * self.noise(p, 0.02, 3)
        raised = step(p[2], 0.004, 0.012)
        across = np.maximum(np.abs(p[0]) - HALF[0], np.abs(p[1]) - HALF[1])
        border = step(across, -0.004, 0.004)
        blue, white, gold = ((0.16, 0.28, 0.55), (0.93, 0.91, 0.86), (0.78, 0.6, 0.24))
        ground, figure, gilt = (np.array(c)[:, None] for c in (blue, white, gold))
        color = ground + raised * (figure - ground)
        return np.asarray(np.clip(color + border * (gilt - color) + spots, 0, 1))
