"""Policies by shares of pixels, and the worth of the geometry of cells.

Shares by texture and level estimate the surroundings of a client, by distance, by coverage and by
need. `Weighted` is for clients that know the frustum and no item buffer (`ach` and its variants,
`distance`, `bbox`): it weights textures, the same for all of their levels.

The worth of a level follows from the pixels that want it and from its difference to the one below:
the error of a pixel that wants level n and has level k is about the sum of the differences between
them.

(Tried: the root mean square over the texels of a level in place of the mean. At 0.5 Mbit/s with 10
% and 30 % of the texture memory, the error of the picture is then 1.90 and 1.67, with the mean 1.83
and 1.62. Also tried: the joint difference of the missing levels, so that a coarse one under a
missing fine one counts little: no better.)

`ScreenPolicy` uses an item buffer of the view (`screen` and its variants). It has half as many
pixels each way as the one that errors are summed over (80 × 45). It gives the texture of each pixel
and the level it wants, or the cell of a placeholder; ``age`` is its age in frames. Surroundings, by
distance, coverage or need, count a fifth: any weight from a twentieth to one does about as well.

`BEST` is the policy of the viewer (docs/formats/client.md): `ScreenPolicy` with surroundings by
distance and by need, half and half. Distance is right about surfaces that one may approach, need
about the resolution of those seen from standing positions; together they take 3 % off either alone
at half a megabit a second (benchmarks/RESULTS.md). Without need in the records it uses distance
alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints, sum_by_group
from ptmtools.site.client import BEHIND, BEYOND, HELD, NEAREST, NOTHING, SURROUNDINGS
from ptmtools_lab.policies.engine import EngineClient, Worth


def geometry_by_coverage(client: EngineClient) -> Floats:
    """(C,) worth of the geometry of cells: the error of a grey cell times its mean share of the
    view."""
    stock = client.world.catalogue
    known = client.visible_set()
    ahead = client.frustum.meets_boxes(stock.low[known], stock.high[known])
    share = np.zeros(stock.cell_count)
    share[known] = np.where(ahead, 1.0, BEHIND) * client.coverage()
    return NOTHING * np.maximum(share, _weights_beyond(client))


def geometry_by_placeholders(client: EngineClient, age: int) -> Floats:
    """(C,) the same by the share of the item buffer, ``age`` frames old, that shows a placeholder
    of each cell; coverage counts hidden cells."""
    share = np.zeros(client.world.catalogue.cell_count)
    share[client.visible_set()] = BEHIND * client.coverage()
    return NOTHING * (np.maximum(share, _weights_beyond(client)) + client.placeholders(age))


def _weights_beyond(client: EngineClient) -> Floats:
    """(C,) weights of cells that are seen from neighbours."""
    stock = client.world.catalogue
    share = np.zeros(stock.cell_count)
    for neighbour in stock.adjacent[client.cell].tolist():
        if client.records.whole[neighbour]:
            cells = stock.visible[neighbour]
            share[cells] = np.maximum(share[cells], BEYOND * stock.coverage[neighbour])
    return share


def by_coverage(client: EngineClient) -> Floats:
    """(T, K) shares by average coverage: that of a cell is divided equally among its textures, as
    listed in the record of the current cell."""
    stock = client.world.catalogue
    share = np.zeros(stock.texture_count)
    rows = stock.records[client.cell]["textures"]
    for covers, textures in zip(client.coverage().tolist(), rows, strict=True):
        share[textures] += covers / max(len(textures), 1)
    return every_level(client, share)


def by_distance(client: EngineClient) -> Floats:
    """(T, K) shares by the inverse square of the distance of the nearest shape; they sum to 1."""
    stock = client.world.catalogue
    shapes, loaded = stock.shapes, client.loaded_shapes()
    distance = client.frustum.distance(shapes.low[loaded], shapes.high[loaded])
    share = np.zeros(stock.texture_count)
    np.maximum.at(share, shapes.texture[loaded], 1 / np.maximum(distance, NEAREST) ** 2)
    return every_level(client, share / max(float(share.sum()), 1e-12))


def by_need(client: EngineClient) -> Floats:
    """(T, K) the need in the record of the cell."""
    stock = client.world.catalogue
    result = np.zeros(stock.ends.shape)
    for texture, first, *shares in stock.records[client.cell]["need"]:
        result[texture, 1 : first + 1] = shares[0]
        result[texture, first + 1 : first + 1 + len(shares)] = shares
    return result


def every_level(client: EngineClient, share: Floats) -> Floats:
    """(T, K) the same share (T,) for all existing levels."""
    stock = client.world.catalogue
    column = np.arange(stock.ends.shape[1])
    return share[:, None] * ((column > 0) & (column <= stock.levels[:, None]))


#: (T,) weights of textures, by the shapes in the frustum.
Weights = Callable[[EngineClient, Ints], Floats]


@dataclass(frozen=True)
class Weighted:
    """A policy by weights."""

    weights: Weights

    def __call__(self, client: EngineClient) -> Worth:
        """See `Policy`."""
        worth = every_level(client, self.weights(client, client.shapes_ahead()))
        return Worth(worth, worth, geometry_by_coverage(client))


def distance_shares(client: EngineClient, shapes: Ints) -> Floats:
    """The inverse square of the distance of the nearest shape."""
    stock = client.world.catalogue
    distance = client.frustum.distance(stock.shapes.low[shapes], stock.shapes.high[shapes])
    weights = np.zeros(stock.texture_count)
    np.maximum.at(weights, stock.shapes.texture[shapes], 1 / np.maximum(distance, NEAREST) ** 2)
    return weights


def by_box(client: EngineClient, shapes: Ints) -> Floats:
    """The shares of the screen that the boxes of the shapes cover, without occlusion."""
    stock = client.world.catalogue
    covered = client.frustum.covered_shares(stock.shapes.low[shapes], stock.shapes.high[shapes])
    return sum_by_group(stock.shapes.texture[shapes], covered, stock.texture_count)


def coverage_shares(client: EngineClient, shapes: Ints) -> Floats:
    """Average coverage of cells in the frustum, scaled to the sum 1 and divided equally among their
    shapes in the frustum."""
    return _split(client, shapes, client.coverage())


def by_views(client: EngineClient, shapes: Ints) -> Floats:
    """As `coverage_shares`, with the six views weighted by their agreement with the direction of
    view."""
    row = client.world.catalogue.statistics[client.cell]
    along = client.frustum.direction
    weight = np.maximum([s * along[axis] for axis in range(3) for s in (1, -1)], 0) ** 2
    floor = client.world.catalogue.records[client.cell]["floor"]
    return _split(client, shapes, np.maximum(weight @ np.array(row["views"]), floor))


def by_texture(client: EngineClient, shapes: Ints) -> Floats:
    """As `coverage_shares`, divided among textures by their shares in the record."""
    stock = client.world.catalogue
    record = stock.records[client.cell]
    known, coverage = client.visible_set(), client.coverage()
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
    of_cell[client.visible_set()] = coverage
    count = np.bincount(stock.shapes.cell[shapes], minlength=stock.cell_count)
    of_cell *= count > 0
    shape_share = of_cell / max(float(of_cell.sum()), 1e-12) / np.maximum(count, 1)
    share = shape_share[stock.shapes.cell[shapes]]
    return sum_by_group(stock.shapes.texture[shapes], share, stock.texture_count)


#: Weight of the surroundings beside the screen in policies other than `BEST`.
AROUND = 0.2


@dataclass(frozen=True)
class ScreenPolicy:
    """A policy by an item buffer.

    Attributes
    ----------
    around: (T, K) shares of the client's surroundings, or None.
    share: weight of the surroundings beside the screen.
    age: age of the item buffer, frames.
    """

    around: Callable[[EngineClient], Floats] | None = None
    share: float = AROUND
    age: int = 1

    def __call__(self, client: EngineClient) -> Worth:
        """See `Policy`."""
        stock, sight = client.world.catalogue, client.sight(self.age)
        if self.around is None:
            worth = stock.by_source(sight) * stock.gains
            return Worth(worth, worth, geometry_by_placeholders(client, self.age), sight=sight)
        around = self.around(client)
        return Worth(
            hold=stock.by_source(sight + HELD * self.share * around) * stock.gains,
            fetch=stock.by_source(sight + self.share * around) * stock.gains,
            geometry=geometry_by_placeholders(client, self.age),
            ahead=stock.by_source(around) * stock.gains,
            sight=sight,
        )


def by_both(client: EngineClient) -> Floats:
    """(T, K) shares of the surroundings by distance and need."""
    near = by_distance(client)
    if "need" not in client.world.catalogue.records[client.cell]:
        return near
    return (near + by_need(client)) / 2


BEST = ScreenPolicy(by_both, SURROUNDINGS)
