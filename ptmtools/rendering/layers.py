"""Layers before the surfaces of a view: glass and textures with alpha, as on the web page.

The rays of `ptmtools.rendering.rays` pass through them. Here they meet them on their way to the
surface behind, the nearest first. Where a material has a cutoff, texels of less alpha are not drawn
and all others are opaque; other layers blend as their colours are encoded, the farthest first. A
ray ends at an opaque texel, or where next to nothing is left of it, so that foliage costs little
more than the leaves before. From afar the alpha of a cut-out is its share (docs/formats/hints.md).

Each ray has its own order. The page draws whole batches by the distance of the middles of their
boxes, so it differs where layers of several batches reach around each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, normals
from ptmtools.embree import ray_tree
from ptmtools.output.surfaces import LEAST_ALPHA, Surfaces
from ptmtools.rendering.rays import Fronts
from ptmtools.rendering.records import Sight
from ptmtools.tolerance import GRAZING_COSINE, RAY_STEP_SHARE

#: Most layers that a ray meets, those without effect included; it misses what follows, and shows
#: the surface behind.
MOST = 64
#: Rays that are followed at a time.
_BATCH = 1 << 18
#: A ray of which less is left ends.
_SPENT = 1e-6
#: Least length of a normal, m²: a triangle without area has none.
_FLAT = 1e-300

#: At the pixels of a sight: (m,) alpha of their textures, 0 to 1, and (m,) the level of detail that
#: has it, 0 for the finest of the texture.
Alpha = Callable[[Sight], tuple[Floats, Floats]]
#: Of the pixels of a sight and their (m, 1) shares: (m, 3) colours to be added, 0 to 255, and
#: (m, 1) the shares of what is behind that these replace.
Paint = Callable[[Sight, Floats], tuple[Floats, Floats]]


class Layer(NamedTuple):
    """The surfaces that some rays meet at one place in their order, 12 bytes each: all layers of a
    picture are in memory.

    Attributes
    ----------
    ray: (m,) numbers of the rays. triangle: (m,) that they meet. share: (m,) of its colour.
    """

    ray: NDArray[np.int32]
    triangle: NDArray[np.int32]
    share: Singles


def transparent_of(surfaces: Surfaces) -> Bools:
    """(T,) the surfaces that are layers."""
    return surfaces.glass if surfaces.transparent is None else surfaces.transparent


class Layers:
    """The layers of a scene."""

    def __init__(self, surfaces: Surfaces) -> None:
        self._which = which = np.flatnonzero(transparent_of(surfaces))
        corner = surfaces.corner[which]
        self._surfaces = surfaces
        self._one_sided = ~surfaces.two_sided[which]
        self._place, self._normal = corner[:, 0], normals(corner)
        self._unit = 1 / np.maximum(np.linalg.norm(self._normal, axis=1), _FLAT)
        self._all = surfaces.corner[:, 0], normals(surfaces.corner)
        # Not the middle of the box: one pane far away must not coarsen the coordinates of others.
        self._middle = np.median(corner.reshape(-1, 3), axis=0) if len(which) else np.zeros(3)
        #: (t,) from the plane of each to the origin of a ray behind it, metres: more than the
        #: rounding of its corners in single precision. These reach as far as half a size.
        reach = np.abs(corner - self._middle).max(axis=(1, 2), initial=0.5)
        self._step = 2 * RAY_STEP_SHARE * reach
        self._tree: Any = ray_tree(corner - self._middle) if len(which) else None
        self._fronts = Fronts(surfaces, which, self._middle)

    def split(self, sight: Sight, alpha: Alpha) -> tuple[Sight, list[Layer]]:
        """The sight with opaque texels of layers in place of the surfaces behind them, and the
        layers that blend, the first that each ray meets, the second, and so on."""
        layers: list[Layer] = []
        if self._tree is None:
            return sight, layers
        triangle = sight.triangle.copy()
        for begin in range(0, len(triangle), _BATCH):
            rows = slice(begin, begin + _BATCH)
            part = sight._replace(triangle=triangle[rows], ray=sight.ray[rows])
            part_layers = self._march(part, alpha)
            layers += [layer._replace(ray=layer.ray + np.int32(begin)) for layer in part_layers]
        return sight._replace(triangle=triangle), layers

    def _march(self, sight: Sight, alpha: Alpha) -> list[Layer]:
        """The layers that blend; writes the opaque ones to the triangles of the sight.

        Distances are in lengths of the rays.
        """
        layers: list[Layer] = []
        triangle, ray = sight.triangle, sight.ray
        end = np.full(len(ray), np.inf)
        hit = np.flatnonzero(triangle >= 0)
        place, normal = (vectors[triangle[hit]] for vectors in self._all)
        end[hit] = _distance(sight.eye, ray[hit], place, normal)
        waiting, gone, rest = np.arange(len(ray)), np.zeros(len(ray)), np.ones(len(ray))
        for _ in range(MOST):
            start = sight.eye - self._middle + ray[waiting] * gone[waiting][:, None]
            rays = start.astype(np.float32), ray[waiting].astype(np.float32)
            pane = self._tree.run(*rays, query="INTERSECT")
            waiting, pane = waiting[pane >= 0], pane[pane >= 0]
            along, normal = ray[waiting], self._normal[pane]
            distance = _distance(sight.eye, along, self._place[pane], normal)
            turn = np.einsum("ij,ij->i", along, normal) * self._unit[pane]
            # A ray that grazes a plane needs longer for the same step away from it.
            step = self._step[pane] / np.maximum(np.abs(turn), GRAZING_COSINE)
            before = distance < end[waiting] - step
            waiting, pane, distance = waiting[before], pane[before], distance[before]
            turn, step = turn[before], step[before]
            if not len(waiting):
                break
            met = self._which[pane]
            back = np.flatnonzero(self._one_sided[pane] & (turn > 0))
            met[back] = self._front(
                sight.eye, ray[waiting[back]], distance[back], step[back], met[back]
            )
            gone[waiting] = distance + step
            share = self._shares(sight, waiting, met, alpha)
            opaque, blends = share == 1, (share > 0) & (share < 1)
            triangle[waiting[opaque]] = met[opaque]
            if blends.any():
                layer = waiting[blends].astype(np.int32), met[blends].astype(np.int32)
                layers.append(Layer(*layer, share[blends].astype(np.float32)))
            rest[waiting] *= 1 - share
            waiting = waiting[rest[waiting] >= _SPENT]
        return layers

    def _front(
        self, eye: Floats, along: Floats, distance: Floats, step: Floats, back: Ints
    ) -> Ints:
        """(m,) the triangles in front of the one-sided ones that rays meet from behind, -1 for
        none."""
        # From half a step before, so that it is not the front of the layer before.
        start = eye - self._middle + along * (distance - step / 2)[:, None]
        return self._fronts.first_hit(start, along, step, back)

    def _shares(self, sight: Sight, ray: Ints, met: Ints, alpha: Alpha) -> Floats:
        """(m,) the shares of triangles, 0 for -1, at the rays that meet them."""
        surfaces, share = self._surfaces, np.zeros(len(met))
        drawn = np.flatnonzero(met >= 0)
        triangle = met[drawn]
        share[drawn] = 1.0 if surfaces.opacity is None else surfaces.opacity[triangle]
        textured = drawn[surfaces.texture[triangle] >= 0]
        detail = np.zeros(len(met))
        if len(textured):
            shown = sight._replace(triangle=met[textured], ray=sight.ray[ray[textured]])
            texel, detail[textured] = alpha(shown)
            share[textured] *= texel
        if surfaces.cutoff is not None:
            tested = drawn[surfaces.cutoff[triangle] > 0]
            passes = share[tested] >= surfaces.cutoff[met[tested]]
            share[tested] += (1 - np.minimum(detail[tested], 1)) * (passes - share[tested])
        share[share < LEAST_ALPHA] = 0
        return share


def blend(layers: Sequence[Layer], sight: Sight, paint: Paint, shown: Floats) -> None:
    """Blends the layers before a sight over the (n, 3) colours ``shown`` of its pixels, one at a
    time, the farthest first."""
    for ray, triangle, share in reversed(layers):
        part = sight._replace(triangle=triangle.astype(np.int64), ray=sight.ray[ray])
        color, alpha = paint(part, share[:, None].astype(np.float64))
        shown[ray] = shown[ray] * (1 - alpha) + color


def _distance(eye: Floats, along: Floats, place: Floats, normal: Floats) -> Floats:
    """(n,) distances to planes through (n, 3) places along (n, 3) rays from a point (3,)."""
    turn = np.einsum("ij,ij->i", along, normal)
    flat = np.where(turn == 0, 1.0, turn)
    distance = np.einsum("ij,ij->i", place - eye, normal) / flat
    return np.asarray(np.where(turn == 0, np.inf, distance))
