"""First-look bundles: of every texture that a cell sees the coarse levels, in one file a cell.

A client that enters a cell without textures has as many requests to make as there are textures in
view, each for little. A bundle brings the levels up to a certain size of all of them in one, most
valuable first, so that however much of it has come is well spent. It consists of pieces of `.ptm`
files, and those of one texture are a prefix of its file.

What a level brings is how much less its texture is off with it (`ptmtools.texture.detail`), times
its share of the view. A level alone may bring little, and much with the next one: of each texture
those steps are taken whose gain for a byte is the best that is left, the corners of the concave
hull of its gain over its bytes. Of all textures the best step comes next.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import naming
from ptmtools.files import open_regular

if TYPE_CHECKING:
    from ptmtools.output.content import Content
    from ptmtools.output.model import TextureRecord


class Step(NamedTuple):
    """From one level of a texture to a finer one.

    Attributes
    ----------
    level: the one that is then there.
    start, end: bytes of the `.ptm`.
    gain: how much less the texture is off, as `Detail.differences`.
    """

    level: int
    start: int
    end: int
    gain: float


class Piece(NamedTuple):
    """Bytes of a `.ptm` in a bundle, which bring its texture to that level."""

    texture: int
    level: int
    start: int
    end: int


class FirstLooks:
    """The bundles of one database, of the textures whose files are at hand."""

    def __init__(self, content: Content) -> None:
        self._content = content
        side = content.options.first_look
        self._steps = [steps_of(record, side) for record in content.textures]

    def pieces(self, cell: int) -> list[Piece]:
        """What is in the bundle of a cell, in that order."""
        share = self._shares(cell)
        steps = [(texture, step) for texture in share for step in self._steps[texture]]

        def worth(entry: tuple[int, Step]) -> tuple[float, int, int]:
            texture, step = entry
            value = step.gain * share[texture] / (step.end - step.start)
            return -value, texture, step.level

        pieces: list[Piece] = []
        for texture, step in sorted(steps, key=worth):
            start = step.start
            if pieces and pieces[-1].texture == texture:
                start = pieces.pop().start
            pieces.append(Piece(texture, step.level, start, step.end))
        return pieces

    def bundle(self, pieces: Iterable[Piece]) -> bytes:
        """The bytes of a bundle; raises OSError if a texture is not where it was."""
        return b"".join(self._heads[p.texture][p.start : p.end] for p in pieces)

    @cached_property
    def _heads(self) -> list[bytes]:
        """Of each texture the bytes that bundles may have."""
        heads = []
        for record, steps in zip(self._content.textures, self._steps, strict=True):
            head = b""
            if steps and record.stored:
                with naming(record.stored), open_regular(record.stored) as file:
                    head = file.read(steps[-1].end)
            heads.append(head)
        return heads

    def _shares(self, cell: int) -> dict[int, float]:
        """Texture → its share of the view from a cell, of all that can be seen: as it was measured,
        else by the areas of the surfaces. None is below what half a pixel has."""
        content = self._content
        ach, seen = content.ach, content.pvs.row(cell)
        floor = float(ach.floor[cell])
        found = {t: 0.0 for other in seen.tolist() for t in content.painted[other].tolist()}
        if ach.by_texture:
            rows = ach.entries(cell)
            of_cell = slice(*ach.texture_start[[rows.start, rows.stop]].tolist())
            pairs = zip(
                ach.texture[of_cell].tolist(), ach.texture_value[of_cell].tolist(), strict=True
            )
            for image, value in pairs:
                if image in content.records:
                    found[content.records[image][0]] += value
        else:
            for other, value in zip(seen.tolist(), ach.row(cell).tolist(), strict=True):
                for texture, part in zip(
                    content.painted[other].tolist(), self._parts[other].tolist(), strict=True
                ):
                    found[texture] += value * part
        return {texture: max(value, floor) for texture, value in sorted(found.items())}

    @cached_property
    def _parts(self) -> list[NDArray[np.float64]]:
        """Of each cell, aligned with `Content.painted`, the share of its surfaces that has each
        texture."""
        geometry, parts = self._content.geometry, []
        of_shape, area = self._content.paint, geometry.areas()
        for cell, textures in enumerate(self._content.painted):
            own = slice(*geometry.cell_start[cell : cell + 2].tolist())
            whole = float(area[own].sum()) or 1.0
            each = [float(area[own][of_shape[own] == texture].sum()) for texture in textures]
            parts.append(np.array(each, np.float64) / whole)
        return parts


def steps_of(record: TextureRecord, side: int) -> list[Step]:
    """How a texture is refined up to its finest level with no side above ``side``, texels; each
    step brings less for a byte than the one before. None if its file or detail is not at hand."""
    if not (record.detail and record.stored):
        return []
    # The mean colour is there before any level: the first one brings nothing.
    corners = [(-1, 0, 0.0)]
    for n, (level, gain) in enumerate(
        zip(record.levels, accumulate(record.detail.differences), strict=True)
    ):
        if max(level.width, level.height) > side:
            break
        corner = (n, level.end, gain)
        while len(corners) > 1 and _slope(*corners[-2:]) <= _slope(corners[-1], corner):
            corners.pop()
        corners.append(corner)
    return list(_between(corners))


def _slope(one: tuple[int, int, float], other: tuple[int, int, float]) -> float:
    """Gain for a byte."""
    return (other[2] - one[2]) / (other[1] - one[1])


def _between(corners: list[tuple[int, int, float]]) -> Iterator[Step]:
    for (_, start, before), (level, end, after) in pairwise(corners):
        yield Step(level, start, end, after - before)
