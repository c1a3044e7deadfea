"""Worlds made by hand, without files: rooms in a row along x, and somebody who walks through them.

What is on the screen is made up, but by the rules of `WalkViews`: only what reaches into the
frustum, an error that falls with each level, none with the finest that is wanted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.rendering.rays import Frustum, RayCamera
from ptmtools.site.choice import previews_of
from ptmtools.site.client import AVERAGING, LEAST_DIFFERENCE, STILL_SECONDS
from ptmtools_lab.catalogue import Catalogue, Meshes, Shapes, meshes_of
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.tables import WalkViews
from ptmtools_lab.track import Track
from ptmtools_lab.world import Parts, World

#: Metres of a room along x, up and along z.
ROOM = np.array([4.0, 3.0, 4.0])
RATE = 5.0
CAMERA = RayCamera(8, 6, 1.0472, 1.5)
_BOX = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64)
#: The faces of a box whose corners are numbered as in ``_BOX``, outward.
_FACES = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]


@dataclass(frozen=True)
class Texture:
    """Bytes of each level in the file and in texture memory, the coarsest first; memory of more
    levels than the file has, if the finest exist as previews only.

    Attributes
    ----------
    previews: level, bytes and difference of each, by ascending level.
    exact: whether the last preview is the exact form.
    """

    groups: tuple[int, ...]
    memory: tuple[int, ...]
    previews: tuple[tuple[int, int, float], ...] = ()
    exact: bool = False

    @property
    def row(self) -> dict[str, Any]:
        """Its previews in a row of the index."""
        fields = ("level", "bytes", "difference")
        rows: list[Any] = [dict(zip(fields, each, strict=True)) for each in self.previews]
        if self.exact:
            rows[-1]["exact"] = True
        return {"ends": self.groups, "previews": rows}


def leaf(low: Floats, high: Floats) -> dict[str, Any]:
    """A box as a leaf of a record."""
    return {"points": (low + (high - low) * _BOX).tolist(), "faces": _FACES}


def raw(side: int) -> Texture:
    """RGB in groups as §4 writes them, and three bytes a texel in texture memory, as it counts:
    three of four texels, and two bits for the fourth's remainders."""
    levels = [4**k for k in range(side.bit_length())]
    groups = [3, *(9 * n // 4 + -(-3 * n // 16) for n in levels[1:])]
    return Texture(tuple(groups), tuple(3 * n for n in levels))


def catalogue(
    textures: Sequence[Texture],
    shapes: Sequence[tuple[int, int]],
    cells: int = 1,
    *,
    random: np.random.Generator | None = None,
    geometry: int = 4000,
    meshes: Meshes | None = None,
) -> Catalogue:
    """What is served: ``shapes`` are cells and textures, ascending by cell. Without ``random`` each
    shape is the whole of its room, and a cell covers the more the nearer it is."""
    count = np.array([len(t.memory) for t in textures], dtype=np.int64)
    wide = int(count.max(initial=0)) + 1
    ends, memory = (np.zeros((len(textures), wide), np.int64) for _ in range(2))
    differences = np.zeros((len(textures), wide))
    for t, texture in enumerate(textures):
        for table, each in ((ends, texture.groups), (memory, texture.memory)):
            table[t, 1:] = np.cumsum([*each, *[0] * (wide - 1 - len(each))])
        if any(texture.previews for texture in textures):
            differences[t, 1] = LEAST_DIFFERENCE
        each = 8.0 if random is None else random.uniform(1, 20, count[t] - 1)
        differences[t, 2 : count[t] + 1] = each
    cell, texture_of = np.array(shapes, dtype=np.int64).reshape(-1, 2).T
    low = cell[:, None] * [ROOM[0], 0, 0]
    high = low + ROOM
    if random is not None:
        ends_of = np.sort(random.uniform(0, 1, (2, len(shapes), 3)), axis=0)
        low, high = low + ends_of[0] * ROOM, low + ends_of[1] * ROOM
    own = Shapes(cell, texture_of, low, high, np.full((len(cell), 2), np.inf))
    rooms = np.arange(cells)[:, None] * [ROOM[0], 0, 0]
    records = tuple(_record(c, cells, textures, shapes, random) for c in range(cells))
    return Catalogue(
        levels=count,
        stored=np.array([len(t.groups) for t in textures], dtype=np.int64),
        ends=ends,
        memory=memory,
        size=np.repeat(memory[:, :, None], 2, axis=2),
        differences=differences,
        colors=np.full((len(textures), 3), 100.0),
        index_bytes=500,
        statistics_bytes=700,
        record_bytes=np.full(cells, 300),
        geometry_bytes=np.full(cells, geometry),
        low=rooms,
        high=rooms + ROOM,
        records=records,
        statistics=[{"views": np.tile(r["ach"], (6, 1)).tolist()} for r in records],
        shapes=own,
        previews=previews_of([texture.row for texture in textures]),
        meshes=meshes or meshes_of((), ()),
    )


def _record(
    cell: int,
    cells: int,
    textures: Sequence[Texture],
    shapes: Sequence[tuple[int, int]],
    random: np.random.Generator | None,
) -> dict[str, Any]:
    """Sees two rooms each way."""
    others = [c for c in range(cells) if c != cell and abs(c - cell) <= 2]
    visible = [cell, *others]
    weight = np.array([1.0 / (1 + abs(c - cell)) for c in visible])
    if random is not None:
        weight *= random.uniform(0.1, 1, len(visible))
    low = np.array([cell * ROOM[0], 0, 0])
    doors = [c for c in (cell - 1, cell + 1) if 0 <= c < cells]
    rows = [sorted({t for c, t in shapes if c == other and t >= 0}) for other in visible]
    return {
        "visible": visible,
        "ach": (weight / weight.sum()).tolist(),
        "floor": 1e-4,
        "adjacent": doors,
        "leaves": [leaf(low, low + ROOM)],
        "textures": rows,
        "textureShares": [[[None, 1.0], *([t, 1.0] for t in row)] for row in rows],
        "need": [[t, 0, *[0.5 / len(textures)] * len(x.memory)] for t, x in enumerate(textures)],
        "portals": [
            {"neighbour": c, "polygon": _door(low[0] + (ROOM[0] if c > cell else 0))} for c in doors
        ],
    }


def _door(x: float) -> list[list[float]]:
    return [[x, 0, 1.5], [x, 2, 1.5], [x, 2, 2.5], [x, 0, 2.5]]


def world(
    stock: Catalogue,
    eye: Floats,
    direction: Floats,
    random: np.random.Generator | None = None,
) -> World:
    """Who is at (F, 3) eyes and looks along (F, 3) directions. Without ``random``, the screen shows
    all shapes of the room that the eye is in, each as large, and wants all levels."""
    frames = len(eye)
    cell = np.clip(eye[:, 0] // ROOM[0], 0, stock.cell_count - 1).astype(np.int64)
    time = np.arange(frames) / RATE
    return World(
        served=None,  # type: ignore[arg-type] # no client reads files
        pyramids=None,  # type: ignore[arg-type]
        lossy=None,  # type: ignore[arg-type]
        catalogue=stock,
        views=_views(stock, eye, direction, cell, random),
        camera=CAMERA,
        track=Track(
            time=time,
            eye=eye,
            direction=direction,
            cell=cell,
            still=_still(np.hstack([eye, direction])),
            view=np.arange(frames),
            rate=RATE,
        ),
    )


def _still(pose: Floats) -> Bools:
    before = round(STILL_SECONDS * RATE)
    return np.array([f >= before and not np.ptp(pose[f - before : f + 1], axis=0).any()
                     for f in range(len(pose))])  # fmt: skip


def _views(
    stock: Catalogue, eye: Floats, direction: Floats, cell: Ints, random: np.random.Generator | None
) -> WalkViews:
    shapes, deepest, previews = stock.shapes, stock.ends.shape[1] - 1, stock.previews
    states = max(deepest, int((previews.state + previews.column).max(initial=0)))
    wide = (states + 2, states + 2, deepest, deepest)
    start, pairs = [0], []
    tables: list[list[Floats]] = [[] for _ in wide]
    for f in range(len(eye)):
        if random is None:
            met = shapes.cell == cell[f]
        else:
            frustum = Frustum(eye[f], direction[f], CAMERA.field_of_view, CAMERA.aspect)
            met = frustum.meets_boxes(shapes.low, shapes.high)
            met &= np.isin(shapes.cell, stock.visible[cell[f]]) & (random.random(len(met)) < 0.7)
        shown = np.unique(np.stack([shapes.cell[met], shapes.texture[met]], axis=1), axis=0)
        for c, t in shown.tolist():
            pairs.append((c, t))
            share = 1 / len(shown) if random is None else random.uniform(0.1, 1) / len(shown)
            for table, row, columns in zip(
                tables, _row(stock, t, share, random), wide, strict=True
            ):
                table.append(np.pad(row, (0, columns - len(row))))
        start.append(len(pairs))
    rows = [
        np.array(table).reshape(-1, columns).astype(np.float32)
        for table, columns in zip(tables, wide, strict=True)
    ]
    of = np.array(pairs, dtype=np.int32).reshape(-1, 2)
    pixels = (len(eye), int(CAMERA.sparse.sum()))
    owner = np.tile(cell.astype(np.int32)[:, None], pixels[1])
    depth = np.full(pixels, 1.5, np.float32)
    return WalkViews(np.array(start), of[:, 0].copy(), of[:, 1].copy(), *rows, owner, depth)


def _row(
    stock: Catalogue, texture: int, share: float, random: np.random.Generator | None
) -> tuple[Floats, Floats, Floats, Floats]:
    """Error, square, need and sight of a texture (-1 for none) on so large a share of the screen.

    The coarsest level is one texel, and so its mean colour.
    """
    deepest = stock.ends.shape[1] - 1
    wrong, need = np.zeros(deepest + 2), np.zeros(deepest)
    wrong[0] = 64.0
    need[0] = share
    if texture >= 0:
        levels = int(stock.levels[texture])
        wanted = levels if random is None else int(random.integers(1, levels + 1))
        squared = stock.differences[texture, : wanted + 1] ** 2
        # With column k there, all that the columns behind it add is missing.
        wrong[1 : wanted + 2] = np.sqrt(np.append(np.cumsum(squared[:0:-1])[::-1], [0, 0]))[
            : wanted + 1
        ]
        need[:wanted] = share * np.linspace(1, 0.5, wanted)
        wrong = _with_previews(stock, texture, wanted, wrong)
    return wrong * share, wrong**2 * share, need, need.copy()


def _with_previews(stock: Catalogue, texture: int, wanted: int, wrong: Floats) -> Floats:
    """The errors of all states of a texture: those of lossy previews on top of missing levels."""
    previews, states = stock.previews, [*wrong]
    for p in range(previews.first[texture], previews.first[texture + 1]):
        if previews.exact[p]:
            continue
        column = int(previews.column[p])
        assert len(states) >= previews.state[p] + 2
        del states[previews.state[p] + 2 :]
        for k in range(1, column + 1):
            own = previews.difference[p] * AVERAGING ** (column - min(k, wanted))
            states.append(float(np.hypot(wrong[k + 1], own)))
    return np.array(states)


def for_policy(world: World, policy: str) -> World:
    """The same for a policy, in whose form everything is here."""
    return replace(world, form=POLICIES[policy].form)


def standing(stock: Catalogue, seconds: float) -> World:
    """Who stands in the first room."""
    count = round(seconds * RATE) + 1
    return world(stock, *(np.tile(p, (count, 1)) for p in ([1.0, 1.6, 2.0], [1.0, 0.0, 0.0])))


def strolling(stock: Catalogue, seconds: float) -> World:
    """Who walks up and down in the first room, and looks the same way."""
    count = round(seconds * RATE) + 1
    eye = np.tile([1.0, 1.6, 2.0], (count, 1))
    eye[:, 0] += 0.1 * (np.arange(count) % 2)
    return world(stock, eye, np.tile([1.0, 0.0, 0.0], (count, 1)))


SEEDS = st.integers(0, 2**32 - 1)


def any_world(
    seed: int, frames: int = 25, *, previews: bool = False, meshes: bool = False
) -> World:
    """A few rooms and textures, and a walk that turns, stops and comes back."""
    random = np.random.default_rng(seed)
    cells, count = int(random.integers(1, 6)), int(random.integers(1, 7))
    textures = []
    for _ in range(count):
        levels = int(random.integers(1, 7))
        groups = np.maximum(random.integers(3, 12) * 3 ** np.arange(levels), 1)
        memory = random.integers(1, 5) * 4 ** np.arange(levels)
        textures.append(Texture(tuple(groups.tolist()), tuple(memory.tolist())))
        if previews:
            textures[-1] = _any_previews(random, textures[-1])
    shapes = sorted(
        (int(random.integers(cells)), int(random.integers(-1, count)))
        for _ in range(int(random.integers(1, 12)))
    )
    geometry = int(random.integers(1, 9000))
    finer = _any_meshes(random, cells) if meshes else None
    stock = catalogue(textures, shapes, cells, random=random, geometry=geometry, meshes=finer)
    moves = random.random(frames) < 0.7
    step = np.where(moves, random.choice([-1, 1, 1], frames) * random.uniform(0, 1.5, frames), 0)
    x = np.clip(0.5 + np.abs(np.cumsum(step)), 0.1, cells * ROOM[0] - 0.1)
    yaw = np.cumsum(np.where(moves, random.normal(0, 0.5, frames), 0))
    eye = np.stack([x, np.full(frames, 1.6), np.full(frames, 2.0)], axis=1)
    direction = np.stack([np.cos(yaw), np.zeros(frames), np.sin(yaw)], axis=1)
    walked = world(stock, eye, direction, random)
    return replace(walked, opening=_any_opening(random, stock, int(walked.track.cell[0])))


def _any_meshes(random: np.random.Generator, cells: int) -> Meshes:
    """Finer meshes of up to four objects."""
    rows, sizes = [], []
    for _ in range(int(random.integers(1, 5))):
        cell, count = int(random.integers(cells)), int(random.integers(1, 4))
        ends = np.sort(random.uniform(0, 1, (2, 3)), axis=0) * ROOM + [cell * ROOM[0], 0, 0]
        errors = [*np.sort(random.uniform(0, 0.1, count))[::-1].tolist(), 0.0]
        rows.append({"cell": cell, "box": ends.ravel().tolist(), "errors": errors})
        sizes.append(np.sort(random.integers(1, 9000, count)).tolist())
    return meshes_of(rows, sizes)


def _any_opening(random: np.random.Generator, stock: Catalogue, cell: int) -> Parts:
    """An opening of a cell, in half of the worlds."""
    if random.random() < 0.5:
        return ()
    others = [c for c in range(stock.cell_count) if c != cell and random.random() < 0.5]
    parts: list[tuple[str, int, int]] = [("record", cell, int(stock.record_bytes[cell]))]
    parts += [("geometry", c, int(stock.geometry_bytes[c])) for c in (cell, *others)]
    for t in np.flatnonzero(random.random(stock.texture_count) < 0.5).tolist():
        parts.append(("texture", t, int(stock.ends[t, random.integers(1, stock.stored[t] + 1)])))
    for p in np.flatnonzero(random.random(len(stock.previews.bytes)) < 0.5).tolist():
        parts.append(("preview", p, int(stock.previews.bytes[p])))
    return tuple(parts)


def _any_previews(random: np.random.Generator, texture: Texture) -> Texture:
    """The texture with previews of some levels; some have their finest levels as previews only."""
    levels = len(texture.memory)
    chosen = np.flatnonzero(random.random(levels) < 0.6).tolist()
    stored = int(random.integers(1, levels + 1)) if random.random() < 0.5 else levels
    if stored < levels and levels - 1 not in chosen:
        chosen.append(levels - 1)
    size = sum(texture.groups) // 8 * random.random(len(chosen)) + 1
    previews = [
        (level, int(size[n] * 4.0 ** (level - levels)) + 1, float(random.uniform(0, 9)))
        for n, level in enumerate(chosen)
    ]
    exact = bool(chosen) and chosen[-1] == levels - 1 and bool(random.random() < 0.5)
    return Texture(texture.groups[:stored], texture.memory, tuple(previews), exact)
