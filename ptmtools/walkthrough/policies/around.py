"""What lies around a client, as shares of pixels by texture and level: by distance, by coverage, by
need; and what the geometry of cells is worth."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.walkthrough.policies.engine import NOTHING, EngineClient

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
    shapes, here = stock.shapes, client.shapes_there()
    far = client.frustum.distance(shapes.low[here], shapes.high[here])
    share = np.zeros(stock.texture_count)
    np.maximum.at(share, shapes.texture[here], 1 / np.maximum(far, NEAREST) ** 2)
    return every_level(client, share / max(float(share.sum()), 1e-12))


def by_need(client: EngineClient) -> Floats:
    """(T, K) the shares that the record of the cell has as its need."""
    stock = client.world.catalogue
    found = np.zeros(stock.ends.shape)
    for texture, first, *shares in stock.records[client.cell]["need"]:
        found[texture, 1 : first + 1] = shares[0]
        found[texture, first + 1 : first + 1 + len(shares)] = shares
    return found


def every_level(client: EngineClient, share: Floats) -> Floats:
    """(T, K) the same share (T,) for all levels that there are."""
    stock = client.world.catalogue
    column = np.arange(stock.ends.shape[1])
    return share[:, None] * ((column > 0) & (column <= stock.levels[:, None]))
