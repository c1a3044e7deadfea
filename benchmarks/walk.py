"""Standard walk through a model, and the files that a client fetches along it.

The walk visits the centres of the twelve largest rooms at eye height, always the nearest remaining
one next, through walkable leaves and portals of at least 1 m². It is a curve in space, independent
of the cell size, so that subdivisions are compared on the same walk; the rooms are those of the
subdivision that it is planned on.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells import Cells
from ptmtools.output import TextureRecord
from ptmtools.output.content import Content
from ptmtools.output.vrml import CellWriter
from ptmtools.scene import Scene
from ptmtools.visibility import Pvs

#: Rooms that the walk leads through, and the least portal that it passes (m²).
STOPS, DOOR = 12, 1.0
#: Height of the eyes above the floor, metres.
EYE = 1.6


@dataclass(frozen=True)
class Walk:
    """A walk in space.

    Attributes
    ----------
    corner: (n, 3) its corners, metres. stops: the rooms that it was to lead through, the first
        among them. reached: how many of them it leads through; doors wide enough lead to no others.
    """

    corner: NDArray[np.float64]
    stops: int
    reached: int


@dataclass(frozen=True)
class Way:
    """The leaves that a walk passes, in its order, and how many metres of it lie in each."""

    leaf: NDArray[np.int64]
    metres: NDArray[np.float64]


@dataclass(frozen=True)
class Load:
    """What a walker fetches and holds.

    Attributes
    ----------
    files: cell files fetched, each once. megabytes: their size.
    at_hand: megabytes of cell files in the walker's visible set, on average over the way.
    """

    files: int
    megabytes: float
    at_hand: float


def standard_walk(cells: Cells) -> Walk:
    """The walk that the module describes; ``cells`` are whole rooms."""
    middle = np.array([_eye(cells.leaf_points(i)) for i in range(cells.leaf_count)])
    volume = cells.leaf_volumes() * cells.leaf_standing
    rooms = np.argsort(-cells.cell_volumes(standing=True), kind="stable")[:STOPS]
    stops = {
        int(max(np.flatnonzero(cells.leaf_cell == r), key=lambda leaf: (volume[leaf], -leaf)))
        for r in rooms
    }
    doors: list[list[tuple[int, float]]] = [[] for _ in range(cells.leaf_count)]
    portal: dict[tuple[int, int], tuple[float, int]] = {}
    for k in np.flatnonzero(cells.portal_area >= DOOR).tolist():
        a, b = cells.portal_leaf[k].tolist()
        if not (cells.leaf_standing[a] and cells.leaf_standing[b]):
            continue
        at = _eye(cells.portal(k))
        metres = float(np.linalg.norm(middle[a] - at) + np.linalg.norm(middle[b] - at))
        doors[a].append((b, metres))
        doors[b].append((a, metres))
        for pair in ((a, b), (b, a)):
            portal[pair] = min(portal.get(pair, (np.inf, 0)), (metres, k))
    asked = len(stops)
    here = int(max(stops, key=lambda leaf: volume[leaf]))
    stops.discard(here)
    corners = [middle[here]]
    while stops:
        before, far = _distances(doors, here)
        following = min(stops, key=lambda leaf: (far[leaf], leaf))
        if not np.isfinite(far[following]):
            break
        stops.discard(following)
        leg = [following]
        while leg[-1] != here:
            leg.append(before[leg[-1]])
        for a, b in pairwise(reversed(leg)):
            corners += [_eye(cells.portal(portal[a, b][1])), middle[b]]
        here = following
    return Walk(np.array(corners), asked, asked - len(stops))


def _eye(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The middle of (n, 3) points, no higher than an eye above the lowest."""
    x, y, z = points.mean(axis=0)
    return np.array([x, min(y, points[:, 1].min() + EYE), z])


def _distances(
    doors: list[list[tuple[int, float]]], start: int
) -> tuple[list[int], NDArray[np.float64]]:
    """For every leaf the one before it on the shortest way from ``start``, and the metres."""
    far = np.full(len(doors), np.inf)
    before = [-1] * len(doors)
    far[start] = 0.0
    waiting = [(0.0, start)]
    while waiting:
        metres, leaf = heapq.heappop(waiting)
        for other, step in doors[leaf] if metres == far[leaf] else ():
            if metres + step < far[other]:
                far[other], before[other] = metres + step, leaf
                heapq.heappush(waiting, (metres + step, other))
    return before, far


def passed(cells: Cells, walk: NDArray[np.float64]) -> Way:
    """Where a walk with these (n, 3) corners leads in a subdivision, which need not be its own.

    What lies in no cell, or for less than a hairline in a leaf, is left out. A walk of one point is
    one metre where it stands.
    """
    if len(walk) == 1:
        leaf = cells.locate_leaf(walk)
        leaf = leaf[cells.locate(walk) >= 0]
        return Way(leaf.astype(np.int64), np.ones(len(leaf)))
    least = cells.tolerance.hairline
    actual = [
        (leaf, metres)
        for a, b in pairwise(walk)
        for leaf, metres in _stretches(cells, a, b)
        if metres >= least and cells.leaf_cell[leaf] >= 0
    ]
    return Way(
        np.array([leaf for leaf, _ in actual], dtype=np.int64),
        np.array([metres for _, metres in actual], dtype=np.float64),
    )


def _stretches(
    cells: Cells, a: NDArray[np.float64], b: NDArray[np.float64]
) -> list[tuple[int, float]]:
    """The leaves along a segment, and the metres in each: down the tree, the nearer child first."""
    length = float(np.linalg.norm(b - a))
    waiting: list[tuple[int, float, float]] = []
    actual: list[tuple[int, float]] = []
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = np.sort((cells.root_box - a) / (b - a), axis=0)
    begin, end = max(0.0, float(np.nanmax(sides[0]))), min(1.0, float(np.nanmin(sides[1])))
    if begin < end and cells.leaf_count:
        waiting.append((0 if len(cells.node_plane) else -2, begin, end))
    while waiting:
        node, begin, end = waiting.pop()
        if node < 0:
            if node <= -2:
                actual.append((-2 - node, (end - begin) * length))
            continue
        plane = cells.node_plane[node]
        first, last = (plane[:3] @ (a + t * (b - a)) + plane[3] for t in (begin, end))
        near, far = cells.node_child[node].tolist()
        if first <= 0:
            near, far = far, near
        if (first > 0) == (last > 0):
            waiting.append((near, begin, end))
        else:
            cut = begin + (end - begin) * float(first / (first - last))
            waiting += [(far, cut, end), (near, begin, cut)]
    return actual


class CellText(NamedTuple):
    """A cell's file, and the images that its shapes use."""

    text: str
    images: list[int]


def cell_texts(
    scene: Scene, cells: Cells, pvs: Pvs, hints: Sequence[NDArray[np.float64]]
) -> list[CellText]:
    """The files of all cells; ``hints`` are aligned with the rows of ``pvs``."""
    records = tuple(
        TextureRecord(i, f"textures/{image.name}.ptm", f"{image.name}.png", 1, 1, 3, (), "")
        for i, image in enumerate(scene.images)
    )
    ach: Any = SimpleNamespace(value=np.concatenate(hints))  # all that a cell's file has of it
    content = Content(scene, cells, pvs, ach, records)
    writer = CellWriter(content)
    images = [used.tolist() for used in content.cell_textures]
    return [CellText(writer.cell(c)[0], images[c]) for c in range(cells.cell_count)]


def load(cells: Cells, pvs: Pvs, way: Way, size: NDArray[np.int64]) -> Load:
    """What a walker fetches, who on the way holds what the cell he is in may see; ``size`` is
    (C,) bytes of each cell's file."""
    passes = np.unique(cells.leaf_cell[way.leaf]).tolist()
    met = sorted({int(seen) for cell in passes for seen in pvs.row(cell)})
    return Load(len(met), float(size[met].sum()) / 1e6, at_hand(cells, pvs, way, size) / 1e6)


def at_hand(cells: Cells, pvs: Pvs, way: Way, size: NDArray[np.number]) -> float:
    """The sum of ``size`` (C,) over the walker's visible set, on average over the way."""
    metres = np.bincount(cells.leaf_cell[way.leaf], way.metres, cells.cell_count)
    held = sum(metres[c] * float(size[pvs.row(c)].sum()) for c in np.flatnonzero(metres).tolist())
    return float(held / max(metres.sum(), np.finfo(np.float64).tiny))


def texels_at_hand(scene: Scene, cells: Cells, pvs: Pvs, way: Way, texts: list[CellText]) -> float:
    """Share of the texels in use that the walker's visible set holds, on average over the way."""
    texels = _texels(scene)
    used = np.zeros((len(texts), len(texels)), dtype=bool)
    for c, text in enumerate(texts):
        used[c, text.images] = True
    whole = float(texels[used.any(axis=0)].sum())
    if not whole:
        return 0.0
    metres = np.bincount(cells.leaf_cell[way.leaf], way.metres, cells.cell_count)
    held = sum(
        metres[c] * float(texels[used[pvs.row(c)].any(axis=0)].sum())
        for c in np.flatnonzero(metres).tolist()
    )
    return float(held / max(metres.sum(), np.finfo(np.float64).tiny) / whole)


def _texels(scene: Scene) -> NDArray[np.float64]:
    import io

    from PIL import Image

    actual = []
    for image in scene.images:
        with Image.open(io.BytesIO(image.load())) as opened:
            actual.append(float(opened.width * opened.height))
    return np.array(actual)
