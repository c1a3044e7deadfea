"""`ach` and its kin, `distance` and `bbox`: clients that know the frustum and no item buffer.

They share out by weights for each texture, the same for all of its levels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.walkthrough.catalogue import Catalogue
from ptmtools.walkthrough.policies.around import NEAREST, every_level, geometry_by_coverage
from ptmtools.walkthrough.policies.engine import EngineClient, Worth

#: (T,) weights of textures, by the shapes in the frustum.
Weights = Callable[[EngineClient, Ints], Floats]


@dataclass(frozen=True)
class Weighted:
    """A policy by weights."""

    weights: Weights

    def __call__(self, client: EngineClient) -> Worth:
        """See `Policy`."""
        shapes = client.world.catalogue.shapes
        there = client.shapes_there()
        ahead = there[client.frustum.meets_boxes(shapes.low[there], shapes.high[there])]
        worth = every_level(client, self.weights(client, ahead))
        return Worth(worth, worth, geometry_by_coverage(client))


def by_distance(client: EngineClient, shapes: Ints) -> Floats:
    """The inverse square of the distance of the nearest shape."""
    stock = client.world.catalogue
    far = client.frustum.distance(stock.shapes.low[shapes], stock.shapes.high[shapes])
    weights = np.zeros(stock.texture_count)
    np.maximum.at(weights, stock.shapes.texture[shapes], 1 / np.maximum(far, NEAREST) ** 2)
    return weights


def by_box(client: EngineClient, shapes: Ints) -> Floats:
    """The shares of the screen that the boxes of the shapes cover, whatever is before them."""
    stock = client.world.catalogue
    covered = client.frustum.covered(stock.shapes.low[shapes], stock.shapes.high[shapes])
    return _summed(stock, shapes, covered)


def by_coverage(client: EngineClient, shapes: Ints) -> Floats:
    """Average coverage of cells in the frustum, made to sum to 1, split equally among their shapes
    in the frustum."""
    return _split(client, shapes, client.coverage())


def by_views(client: EngineClient, shapes: Ints) -> Floats:
    """As `by_coverage`, of the six views by how far they look the same way."""
    row = client.world.catalogue.statistics[client.cell]
    along = client.frustum.direction
    weight = np.maximum([s * along[axis] for axis in range(3) for s in (1, -1)], 0) ** 2
    floor = client.world.catalogue.records[client.cell]["floor"]
    return _split(client, shapes, np.maximum(weight @ np.array(row["views"]), floor))


def by_texture(client: EngineClient, shapes: Ints) -> Floats:
    """As `by_coverage`, split among textures by the shares that the record has of them."""
    stock = client.world.catalogue
    record = stock.records[client.cell]
    known, coverage = client.known(), client.coverage()
    ahead = np.zeros((stock.cell_count, stock.texture_count), dtype=bool)
    ahead[stock.shapes.cell[shapes], stock.shapes.texture[shapes]] = True
    weights = np.zeros(stock.texture_count)
    whole = coverage[ahead[known].any(axis=1)].sum()
    for cell, covers, rows in zip(
        known.tolist(), coverage.tolist(), record["textureShares"], strict=True
    ):
        share = {t: s for t, s in rows if t is not None}
        total = max(sum(s for _, s in rows), 1e-12)
        for t in np.flatnonzero(ahead[cell]).tolist():
            weights[t] += covers * share.get(t, 0.0) / total / max(whole, 1e-12) + 1e-7
    return weights


def _split(client: EngineClient, shapes: Ints, coverage: Floats) -> Floats:
    stock = client.world.catalogue
    of_cell = np.zeros(stock.cell_count)
    of_cell[client.known()] = coverage
    count = np.bincount(stock.shapes.cell[shapes], minlength=stock.cell_count)
    of_cell *= count > 0
    each = of_cell / max(float(of_cell.sum()), 1e-12) / np.maximum(count, 1)
    return _summed(stock, shapes, each[stock.shapes.cell[shapes]])


def _summed(stock: Catalogue, shapes: Ints, of_shape: Floats) -> Floats:
    """(T,) sums over the shapes of each texture."""
    found = np.zeros(stock.texture_count)
    np.add.at(found, stock.shapes.texture[shapes], of_shape)
    return found
