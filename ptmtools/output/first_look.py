"""First-look bundles: for each cell one file with the coarse levels of all visible textures.

A client that enters a cell without textures makes as many requests as there are textures in view,
each for few bytes. A bundle brings the levels up to a certain size of all of them in one request,
most valuable first, so that any received prefix is well spent. It consists of pieces of `.ptm`
files; those of one texture are a prefix of its file.

The gain of a level is the decrease of its texture's error (`ptmtools.texture.detail`), times the
texture's share of the view. A level alone may gain little, and much with the next one: for each
texture the steps are the corners of the concave hull of its gain over its bytes. Over all textures
the step with the most gain per byte comes next.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.sources import first_bytes

if TYPE_CHECKING:
    from ptmtools.output.content import Content
    from ptmtools.output.model import TextureRecord


class LevelStep(NamedTuple):
    """From one level of a texture to a finer one.

    Attributes
    ----------
    level: the finer one.
    start, end: bytes of the `.ptm`.
    gain: decrease of the error, as in `Detail.differences`.
    """

    level: int
    start: int
    end: int
    gain: float


class BundlePiece(NamedTuple):
    """Bytes of a `.ptm` in a bundle that refine its texture to ``level``."""

    texture: int
    level: int
    start: int
    end: int


class FirstLooks:
    """The bundles of one database, of the textures that were encoded."""

    def __init__(self, content: Content) -> None:
        self._content = content
        side = content.options.first_look
        self._steps = [steps_of(record, side) for record in content.textures]

    def pieces(self, cell: int) -> list[BundlePiece]:
        """The pieces of a cell's bundle, in order."""
        share = self._shares(cell)
        steps = [(texture, step) for texture in share for step in self._steps[texture]]

        def worth(entry: tuple[int, LevelStep]) -> tuple[float, int, int]:
            texture, step = entry
            value = step.gain * share[texture] / (step.end - step.start)
            return -value, texture, step.level

        pieces: list[BundlePiece] = []
        for texture, step in sorted(steps, key=worth):
            start = step.start
            if pieces and pieces[-1].texture == texture:
                start = pieces.pop().start
            pieces.append(BundlePiece(texture, step.level, start, step.end))
        return pieces

    def bundle(self, pieces: Iterable[BundlePiece]) -> bytes:
        """The bytes of a bundle; raises InputError PTM-I120, PTM-I122 if a texture is missing."""
        return b"".join(self._heads[p.texture][p.start : p.end] for p in pieces)

    @cached_property
    def _heads(self) -> list[bytes]:
        """For each texture the prefix of its file that bundles use."""
        heads = []
        for record, steps in zip(self._content.textures, self._steps, strict=True):
            head = b""
            if steps and record.stored:
                head = first_bytes(record.stored, steps[-1].end)
            heads.append(head)
        return heads

    def _shares(self, cell: int) -> dict[int, float]:
        """Texture → its share of the view from a cell, for all visible textures: as measured, else
        by the areas of the surfaces; at least half a pixel's share."""
        content = self._content
        ach, seen = content.ach, content.pvs.row(cell)
        floor = float(ach.floor[cell])
        shares = {
            t: 0.0 for visible in seen.tolist() for t in content.cell_textures[visible].tolist()
        }
        if ach.by_texture:
            rows = ach.entries(cell)
            of_cell = slice(*ach.texture_start[[rows.start, rows.stop]].tolist())
            pairs = zip(
                ach.texture[of_cell].tolist(), ach.texture_value[of_cell].tolist(), strict=True
            )
            for image, value in pairs:
                if image in content.places.of_image:
                    shares[content.places.of_image[image][0]] += value
        else:
            for visible, value in zip(seen.tolist(), ach.row(cell).tolist(), strict=True):
                for texture, part in zip(
                    content.cell_textures[visible].tolist(),
                    self._parts[visible].tolist(),
                    strict=True,
                ):
                    shares[texture] += value * part
        return {texture: max(value, floor) for texture, value in sorted(shares.items())}

    @cached_property
    def _parts(self) -> list[NDArray[np.float64]]:
        """For each cell, aligned with `Content.painted`, the share of its surface area with each
        texture."""
        geometry, parts = self._content.geometry, []
        of_shape, area = self._content.paint, geometry.areas()
        for cell, textures in enumerate(self._content.cell_textures):
            shapes = slice(*geometry.cell_start[cell : cell + 2].tolist())
            whole = float(area[shapes].sum()) or 1.0
            texture_area = [
                float(area[shapes][of_shape[shapes] == texture].sum()) for texture in textures
            ]
            parts.append(np.array(texture_area, np.float64) / whole)
        return parts


def steps_of(record: TextureRecord, side: int) -> list[LevelStep]:
    """The steps of a texture up to its finest level with no side above ``side`` texels, in order
    of decreasing gain per byte; none if the texture was not encoded."""
    if not (record.detail and record.stored):
        return []
    # The mean colour is known before any level, so the first level gains nothing.
    corners = [(-1, 0, 0.0)]
    for n, (level, gain) in enumerate(
        # A lossy source has further levels, which are no part of the `.ptm`.
        zip(record.levels, accumulate(record.detail.differences), strict=False)
    ):
        if max(level.width, level.height) > side:
            break
        corner = (n, level.end, gain)
        while len(corners) > 1 and _slope(*corners[-2:]) <= _slope(corners[-1], corner):
            corners.pop()
        corners.append(corner)
    return list(_level_steps(corners))


def _slope(before: tuple[int, int, float], after: tuple[int, int, float]) -> float:
    """Gain per byte."""
    return (after[2] - before[2]) / (after[1] - before[1])


def _level_steps(corners: list[tuple[int, int, float]]) -> Iterator[LevelStep]:
    for (_, start, before), (level, end, after) in pairwise(corners):
        yield LevelStep(level, start, end, after - before)
