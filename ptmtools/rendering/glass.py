"""Glass in pictures: surfaces without texture that are not opaque, blended as by the web page.

The rays of `ptmtools.rendering.rays` pass through glass. Here they meet it on their way to the
surface behind. Colours blend as they are encoded, the farthest first.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints, normals
from ptmtools.embree import ray_tree
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.records import Sight

#: Most panes along a ray; those behind them are left out.
_MOST = 16


class Glass:
    """The glass of a scene."""

    def __init__(self, surfaces: Surfaces, glow: float = 1.0) -> None:
        """``glow``: share of the colour that does not depend on the angle to the viewer."""
        which = np.flatnonzero(surfaces.glass) if surfaces.opacity is not None else np.zeros(0, int)
        corner = surfaces.corner[which]
        self._color, self._glow = 255 * surfaces.color[which], glow
        self._share = np.zeros(0) if surfaces.opacity is None else surfaces.opacity[which]
        self._one_sided = ~surfaces.two_sided[which]
        self._place, self._normal = corner[:, 0], normals(corner)
        self._all = surfaces.corner[:, 0], normals(surfaces.corner)
        low, high = corner.min(axis=(0, 1), initial=0), corner.max(axis=(0, 1), initial=0)
        self._middle = (low + high) / 2
        #: From the front of a pane to the origin of the ray behind it, metres.
        self._step = 1e-6 * max(1.0, float((high - low).max()))
        self._tree: Any = ray_tree(corner - self._middle) if len(which) else None

    def blend(self, sight: Sight, shown: Floats) -> None:
        """Blends the glass before the surfaces of a sight into (n, 3) colours, 0 to 255."""
        layers = list(self._layers(sight)) if self._tree is not None else []
        for ray, pane in reversed(layers):
            along, normal = sight.ray[ray], self._normal[pane]
            length = np.linalg.norm(along, axis=1) * np.linalg.norm(normal, axis=1)
            facing = np.abs(np.einsum("ij,ij->i", along, normal)) / np.maximum(length, 1e-300)
            light = self._glow + (1 - self._glow) * facing
            share = self._share[pane][:, None]
            shown[ray] = shown[ray] * (1 - share) + self._color[pane] * light[:, None] * share

    def _layers(self, sight: Sight) -> list[tuple[Ints, Ints]]:
        """The first pane of each ray that meets one, the second, and so on: (m,) numbers of rays,
        and (m,) of panes."""
        layers = []
        ray = sight.ray / np.linalg.norm(sight.ray, axis=1, keepdims=True)
        end = np.full(len(ray), np.inf)
        hit = np.flatnonzero(sight.triangle >= 0)
        place, normal = (each[sight.triangle[hit]] for each in self._all)
        end[hit] = _distance(sight.eye, ray[hit], place, normal)
        waiting, gone = np.arange(len(ray)), np.zeros(len(ray))
        last = np.full(len(ray), -1)
        for _ in range(_MOST):
            start = sight.eye - self._middle + ray[waiting] * gone[waiting][:, None]
            rays = start.astype(np.float32), ray[waiting].astype(np.float32)
            pane = self._tree.run(*rays, query="INTERSECT")
            waiting, pane = waiting[pane >= 0], pane[pane >= 0]
            along, normal = ray[waiting], self._normal[pane]
            far = _distance(sight.eye, along, self._place[pane], normal)
            before = far < end[waiting] - self._step
            waiting, pane, far = waiting[before], pane[before], far[before]
            if not len(waiting):
                break
            turn = np.einsum("ij,ij->i", self._normal[pane], ray[waiting])
            # A ray that grazes a pane may meet it again after the step.
            seen = (~self._one_sided[pane] | (turn <= 0)) & (pane != last[waiting])
            last[waiting] = pane
            layers.append((waiting[seen], pane[seen]))
            gone[waiting] = np.maximum(far, gone[waiting]) + self._step
        return layers


def _distance(eye: Floats, along: Floats, place: Floats, normal: Floats) -> Floats:
    """(n,) distances to planes through (n, 3) places along (n, 3) unit rays from a point (3,)."""
    turn = np.einsum("ij,ij->i", along, normal)
    flat = np.where(turn == 0, 1.0, turn)
    far = np.einsum("ij,ij->i", place - eye, normal) / flat
    return np.asarray(np.where(turn == 0, np.inf, far))
