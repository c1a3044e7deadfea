"""Tables along a walk: what each pair of cell and texture covers, and its error at each level.

For every pixel of a frame the texture is sampled as OpenGL would, trilinearly, once with all of its
levels and once for each level as the finest that is there. The difference, root mean square over R,
G and B (0 to 255), is summed up by the pair. A run then only looks up: the error of a frame is the
sum over its pairs, each at the level that the client holds. Nothing that is no texture is wrong
once its cell is there; what is not there is grey.

The level of detail is that of a screen of 1080 lines, whatever the item buffer has: a coarser
buffer samples fewer pixels of the same picture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.progress import Progress, silent
from ptmtools.scene.mapping import gradients
from ptmtools.walkthrough.served import Surfaces
from ptmtools.walkthrough.view.pyramids import Pyramids
from ptmtools.walkthrough.view.rays import Camera, Caster

#: Lines of the screen that pictures are made for.
LINES = 1080
#: Rays that are cast at a time.
_RAYS = 1 << 17


@dataclass(frozen=True)
class Views:
    """What is on the screen, frame by frame; the rows of a frame are its pairs.

    Attributes
    ----------
    start: (F + 1,) where the rows of each frame begin.
    cell, texture: (R,) int32 of each row; the texture is -1 for surfaces without.
    error, square: (R, L + 2) its part of the frame's mean of errors, and of squared errors, with as
        the finest that is there: nothing, the mean colour, level 0, level 1, …
    need: (R, L) the share of the pixels for which a level is wanted, beside the coarser ones; for
        surfaces without texture the first is the share that they cover.
    sight: (R, L) the same in the item buffer that a client draws, with half as many pixels each
        way.
    owner, depth: (V, n) int32, float32 of that item buffer's pixels: the cell that is on the
        screen, -1 for none, and how far away it is along the view, metres.
    """

    start: Ints
    cell: NDArray[np.int32]
    texture: NDArray[np.int32]
    error: Singles
    square: Singles
    need: Singles
    sight: Singles
    owner: NDArray[np.int32]
    depth: Singles

    @property
    def frames(self) -> int:
        """How many there are."""
        return len(self.start) - 1

    def rows(self, frame: int) -> slice:
        """Those of a frame."""
        return slice(int(self.start[frame]), int(self.start[frame + 1]))


def look(
    surfaces: Surfaces,
    pyramids: Pyramids,
    camera: Camera,
    eye: Floats,
    direction: Floats,
    progress: Progress = silent,
    *,
    full: Pyramids | None = None,
) -> Views:
    """The tables of (F, 3) eyes and unit directions of view; errors are against what ``full`` would
    show, which holds the same textures in other quality."""
    from ptmtools.walkthrough.view.kernels import add_frame

    corner = surfaces.corner
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    gradient = gradients(corner, surfaces.uv)
    pairs, pair = np.unique(
        np.stack([surfaces.cell, surfaces.texture], axis=1).reshape(-1, 2),
        axis=0, return_inverse=True,
    )  # fmt: skip
    pair = pair.reshape(-1).astype(np.int64)
    deepest = pyramids.start.shape[1]
    wide = (deepest + 2, deepest + 2, deepest, deepest)
    room = np.zeros((deepest + 7, 3))
    sums = [np.zeros((len(pairs), columns)) for columns in wide]
    parts: list[list[Floats]] = [[] for _ in wide]
    found: list[Ints] = []
    caster = Caster(surfaces)
    pixel = 2 * np.tan(camera.field_of_view / 2) / LINES
    compared = pyramids if full is None else full
    seen = camera.sparse
    shares = np.array([1, 1, 1, max(int(seen.sum()), 1) / len(seen)]) * len(seen)
    owner = np.full((len(eye), int(seen.sum())), -1, np.int32)
    depth = np.full(owner.shape, np.inf, np.float32)
    at_once = max(1, _RAYS // len(seen))
    for begin in range(0, len(eye), at_once):
        progress(begin, len(eye), "looking along the walk")
        batch = slice(begin, begin + at_once)
        rays, axes = camera.rays(direction[batch])
        rays = rays.reshape(len(rays), -1, 3)
        origin = np.repeat(eye[batch], len(seen), axis=0)
        shown = caster.first(origin, rays.reshape(-1, 3)).reshape(len(rays), -1)
        for k in range(len(rays)):
            add_frame(
                shown[k], rays[k], axes[k], eye[begin + k], pixel, corner, normal, gradient,
                surfaces.uv, surfaces.texture, pair, surfaces.color, surfaces.clamped,
                pyramids.texel, pyramids.start, pyramids.size, pyramids.count, pyramids.mean,
                compared.texel, compared.start, compared.size, compared.count, full is None, seen,
                room, *sums,
            )  # fmt: skip
            shows = shown[k, seen]
            hit = np.flatnonzero(shows >= 0)
            shows = shows[hit]
            owner[begin + k, hit] = surfaces.cell[shows]
            offset = corner[shows, 0] - eye[begin + k]
            facing = np.einsum("ij,ij->i", normal[shows], rays[k][seen][hit])
            depth[begin + k, hit] = np.einsum("ij,ij->i", normal[shows], offset) / facing
            there = np.flatnonzero(sums[2][:, 0])
            found.append(there)
            for table, part, share in zip(sums, parts, shares.tolist(), strict=True):
                part.append(table[there] / share)
                table[there] = 0.0
    progress(len(eye), len(eye), "looking along the walk")
    rows = np.concatenate([np.zeros(0, np.int64), *found])
    tables = [
        np.concatenate([np.zeros((0, columns)), *part]).astype(np.float32)
        for columns, part in zip(wide, parts, strict=True)
    ]
    start = np.concatenate([[0], np.cumsum([len(r) for r in found])]).astype(np.int64)
    cell, texture = pairs[rows].T.astype(np.int32)
    error, square, need, sight = tables
    return Views(start, cell, texture, error, square, need, sight, owner, depth)


def limited(views: Views, count: Ints) -> Views:
    """The same views of textures that lack their finest levels; ``count`` (T,) is how many levels
    each has. What they cannot show stays an error."""
    deepest = int(count.max(initial=1))
    # One more, of surfaces without texture, which is the last.
    has = np.arange(deepest) < np.append(count, deepest)[views.texture, None]
    need, sight = (np.where(has, each[:, :deepest], 0) for each in (views.need, views.sight))
    error, square = (
        np.ascontiguousarray(each[:, : deepest + 2]) for each in (views.error, views.square)
    )
    return replace(views, error=error, square=square, need=need, sight=sight)
