"""What lies around a client, as shares of pixels by texture and level: by distance, by coverage, by
need; and what the geometry of cells is worth.

`ach` and its kin, `distance` and `bbox`: clients that know the frustum and no item buffer.

They share out by weights for each texture, the same for all of its levels.

From how many pixels want a level to what it is worth.

Two measures, by what a client knows of the textures:

* `by_pixels`: every level counts the same (the paper's view of it);
* `by_difference`: a level counts by its difference to the one below. A pixel that wants level n and
  has level k is wrong by about the sum of the differences between them.

(Tried: the root mean square over the texels of a level in place of the mean. At 0.5 Mbit/s with
10 % and 30 % of the texture memory, the error of the picture is 1.90 and 1.67 then, and 1.83 and
1.62 so. What the missing levels make together, so that a coarse one under a missing fine one counts
little: no better.)

`screen` and its kin: what an item buffer of the view shows to be missing.

The item buffer has half as many pixels each way as the one that errors are summed over (80 × 45).
It says which texture each pixel shows and which level it wants, or of which cell it shows the
placeholder; ``age`` is how many frames old it is. What lies around, by distance, coverage or need,
counts a fifth: any weight from a twentieth to one does about as well.

`best`: what the viewer does (docs/formats/client.md).

`Screen`, with what lies around by distance and by need, half and half. Distance is right about what
one may walk up to, need about what one sees from where one can stand, and how fine; together they
take 3 % off either alone at half a megabit a second (benchmarks/RESULTS.md). Without need
in the records, distance alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.lab.catalogue import Catalogue
from ptmtools.lab.policies.engine import NOTHING, EngineClient, Worth

#: What is nearer counts as being as far as this, metres.
NEAREST = 0.5
#: What a cell counts that is out of sight, or is seen from a neighbouring cell only, beside one in
#: view.
BEHIND, BEYOND = 0.2, 0.05


def geometry_by_coverage(client: EngineClient) -> Floats:
    """(C,) the worth of the geometry of cells: what a grey cell is wrong by, and how much of the
    view it covers on average."""
    stock = client.world.catalogue
    known = client.known()
    ahead = client.frustum.meets_boxes(stock.low[known], stock.high[known])
    share = np.zeros(stock.cell_count)
    share[known] = np.where(ahead, 1.0, BEHIND) * client.coverage()
    return NOTHING * np.maximum(share, _beyond(client))


def geometry_by_placeholders(client: EngineClient, age: int) -> Floats:
    """(C,) the same by how much of the item buffer, ``age`` frames old, shows a placeholder of each
    cell; coverage says what is behind."""
    share = np.zeros(client.world.catalogue.cell_count)
    share[client.known()] = BEHIND * client.coverage()
    return NOTHING * (np.maximum(share, _beyond(client)) + client.placeholders(age))


def _beyond(client: EngineClient) -> Floats:
    """(C,) what cells count for the neighbours from which they are seen."""
    stock = client.world.catalogue
    share = np.zeros(stock.cell_count)
    for neighbour in stock.adjacent[client.cell].tolist():
        if client.records.whole[neighbour]:
            cells = stock.visible[neighbour]
            share[cells] = np.maximum(share[cells], BEYOND * stock.coverage[neighbour])
    return share


def by_coverage(client: EngineClient) -> Floats:
    """(T, K) shares by average coverage: that of a cell is split equally among its textures, as the
    record of the cell that the client is in names them."""
    stock = client.world.catalogue
    share = np.zeros(stock.texture_count)
    own = stock.records[client.cell]["textures"]
    for covers, textures in zip(client.coverage().tolist(), own, strict=True):
        share[textures] += covers / max(len(textures), 1)
    return every_level(client, share)


def by_distance(client: EngineClient) -> Floats:
    """(T, K) shares that fall with the square of the distance of the nearest shape; they sum to
    1."""
    stock = client.world.catalogue
    shapes, here = stock.shapes, client.loaded_shapes()
    far = client.frustum.distance(shapes.low[here], shapes.high[here])
    share = np.zeros(stock.texture_count)
    np.maximum.at(share, shapes.texture[here], 1 / np.maximum(far, NEAREST) ** 2)
    return every_level(client, share / max(float(share.sum()), 1e-12))


def by_need(client: EngineClient) -> Floats:
    """(T, K) the shares that the record of the cell has as its need."""
    stock = client.world.catalogue
    result = np.zeros(stock.ends.shape)
    for texture, first, *shares in stock.records[client.cell]["need"]:
        result[texture, 1 : first + 1] = shares[0]
        result[texture, first + 1 : first + 1 + len(shares)] = shares
    return result


def every_level(client: EngineClient, share: Floats) -> Floats:
    """(T, K) the same share (T,) for all levels that there are."""
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
        shapes = client.world.catalogue.shapes
        loaded = client.loaded_shapes()
        ahead = loaded[client.frustum.meets_boxes(shapes.low[loaded], shapes.high[loaded])]
        worth = every_level(client, self.weights(client, ahead))
        return Worth(worth, worth, geometry_by_coverage(client))


def distance_shares(client: EngineClient, shapes: Ints) -> Floats:
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


def coverage_shares(client: EngineClient, shapes: Ints) -> Floats:
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
    result = np.zeros(stock.texture_count)
    np.add.at(result, stock.shapes.texture[shapes], of_shape)
    return result


#: (T, K) shares of pixels that want each column → (T, K) worth.
Weighing = Callable[[Catalogue, Floats], Floats]


def by_pixels(stock: Catalogue, shares: Floats) -> Floats:
    """See the module."""
    return shares


def by_difference(stock: Catalogue, shares: Floats) -> Floats:
    """See the module."""
    return shares * stock.differences


#: What lies around counts so much beside what is on the screen, and of that so much for what is to
#: be in texture memory now.
AROUND, HELD = 0.2, 0.1


@dataclass(frozen=True)
class Screen:
    """A policy.

    Attributes
    ----------
    around: (T, K) shares of what lies around the client, or None.
    share: what lies around counts so much beside what is on the screen.
    weighing: of shares.
    age: of the item buffer, frames.
    """

    around: Callable[[EngineClient], Floats] | None = None
    share: float = AROUND
    weighing: Weighing = by_difference
    age: int = 1

    def __call__(self, client: EngineClient) -> Worth:
        """See `Policy`."""
        stock = client.world.catalogue
        sight = client.sight(self.age)
        if self.around is None:
            worth = self.weighing(stock, sight)
            return Worth(worth, worth, geometry_by_placeholders(client, self.age))
        around = self.around(client)
        return Worth(
            hold=self.weighing(stock, sight + HELD * self.share * around),
            fetch=self.weighing(stock, sight + self.share * around),
            geometry=geometry_by_placeholders(client, self.age),
            ahead=self.weighing(stock, around),
        )


#: Of what lies around beside what is on the screen; anything from a twentieth to a half does.
SHARE = 0.1


def by_both(client: EngineClient) -> Floats:
    """(T, K) shares of what lies around."""
    near = by_distance(client)
    if "need" not in client.world.catalogue.records[client.cell]:
        return near
    return (near + by_need(client)) / 2


BEST = Screen(by_both, SHARE)
