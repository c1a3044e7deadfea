"""The client's catalogue as arrays: the content of the index, of records, and of the geometry of
cells.

The client decides which part it may use, by what has arrived.

A texture with resident column k holds levels 0 to k − 1: column 0 is nothing. GPUs have no texels
of three bytes, so RGB counts four; the paper counts three.

A column has several *sources*: the `.ptm`, and previews (`ptmtools.site.choice`). Tables by source
have a row for each texture, which stands for its exact levels, and then one for each preview.

The pictures of the simulator have all objects as modelled: a coarser mesh (`Meshes`) costs a client
bytes here, and no error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.output.model import sizes_of
from ptmtools.output.served import Document, Served
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.rays import Frustum
from ptmtools.scene.colors import gradients
from ptmtools.site.choice import Previews, no_previews, previews_of
from ptmtools.site.client import GROSS, LEAST_DIFFERENCE, NORMALS, SEEN
from ptmtools.texture.model import gpu_texel_bytes
from ptmtools.walk import Browser


@dataclass(frozen=True)
class Meshes:
    """The files of finer meshes, in the order of the index.

    Attributes
    ----------
    mesh, cell: (M,) the object's row in the index, ascending, and its cell.
    bytes: (M,) on the link.
    low, high: (M, 3) corners of the object's box, metres.
    error, coarsest: (M,) metres, of the mesh, and of that in the GLB of the cell.
    """

    mesh: Ints
    cell: Ints
    bytes: Ints
    low: Floats
    high: Floats
    error: Floats
    coarsest: Floats

    @property
    def finest(self) -> Bools:
        """(M,) which files have the object as modelled."""
        last: Bools = np.append(self.mesh[1:] != self.mesh[:-1], len(self.mesh) > 0)
        return last[: len(self.mesh)]

    def gains(self, there: Bools, frustum: Frustum, nearest: float, behind: float) -> Floats:
        """(M,) the share of the view, with the severity of its error, that each file improves
        beside those that are ``there`` (docs/formats/client.md); ``nearest``: the least distance,
        metres; ``behind``: weight of an object out of sight."""
        if not len(self.mesh):
            return np.zeros(0)
        present = np.full(int(self.mesh[-1]) + 1, np.inf)
        present[self.mesh] = self.coarsest
        np.minimum.at(present, self.mesh[there], self.error[there])
        distance = np.maximum(frustum.distance(self.low, self.high), nearest)
        size = np.linalg.norm(self.high - self.low, axis=1) / 2
        ahead = frustum.meets_boxes(self.low, self.high)
        share = np.minimum(1.0, (size / distance) ** 2) * np.where(ahead, 1.0, behind)
        now, then = present[self.mesh] / distance, self.error / distance
        gain = now / (now + GROSS) - then / (then + GROSS)
        gains: Floats = np.where(now > SEEN, share * np.maximum(gain, 0.0), 0.0)
        return gains


def meshes_of(rows: Sequence[Mapping[str, Any]], sizes: Sequence[Sequence[int]]) -> Meshes:
    """The files of an index; ``sizes``: bytes of each on the link."""
    files = [
        (mesh, row["cell"], size, *row["box"], error, row["errors"][0])
        for mesh, (row, file_sizes) in enumerate(zip(rows, sizes, strict=True))
        for size, error in zip(file_sizes, row["errors"][1:], strict=True)
    ]
    table = np.array(files, dtype=np.float64).reshape(-1, 11)
    mesh, cell, size = table[:, :3].astype(np.int64).T
    return Meshes(mesh, cell, size, table[:, 3:6], table[:, 6:9], table[:, 9], table[:, 10])


class Columns(NamedTuple):
    """The columns of textures that can be fetched; columns after the last one of a texture repeat
    it.

    Attributes
    ----------
    levels: (T,) columns of each texture, without the first, which is nothing.
    stored: (T,) those of them that files of ranges hold; finer ones exist as previews only.
    ends: (T, K) bytes of each column and those before it. memory: (T, K) bytes of texture memory.
    size: (T, K, 2) width and height of the finest image that each column shows.
    """

    levels: Ints
    stored: Ints
    ends: Ints
    memory: Ints
    size: Ints


def texel_bytes(texture: Any, *, paper: bool = False) -> int:
    """Bytes per texel of an index entry; with ``paper``, as the paper counts."""
    stored = int(texture["texelBytes"])
    if paper:
        return stored
    return int(texture.get("gpuTexelBytes", gpu_texel_bytes(stored, texture["components"])))


def columns_of(textures: Sequence[Any], *, paper: bool = False) -> Columns:
    """Columns of `.ptm`s and previews for entries of the index: bytes in the `.ptm`, and texture
    memory of all levels of a column."""
    rows = []
    for texture in textures:
        size, ends = np.array(sizes_of(texture)), texture["ends"]
        level_memory = np.cumsum(size.prod(axis=1)) * texel_bytes(texture, paper=paper)
        rows.append(([*ends, *ends[-1:] * (len(size) - len(ends))], level_memory, size))
    stored = np.array([len(texture["ends"]) for texture in textures], dtype=np.int64)
    return align_columns(rows)._replace(stored=stored)


def join_columns(first: Columns, second: Columns) -> Columns:
    """The columns of two lists of textures, one after the other."""
    wide = max(first.ends.shape[1], second.ends.shape[1])

    def both(head: Ints, tail: Ints) -> Ints:
        rest = [(0, 0)] * (head.ndim - 2)
        parts = (np.pad(a, [(0, 0), (0, wide - a.shape[1]), *rest], "edge") for a in (head, tail))
        return np.concatenate(list(parts))

    tables = zip(first[2:], second[2:], strict=True)
    counts = (np.concatenate(pair) for pair in zip(first[:2], second[:2], strict=True))
    return Columns(*counts, *(both(*pair) for pair in tables))


def align_columns(rows: Sequence[tuple[Any, Any, Any]]) -> Columns:
    """Columns of textures with different numbers of them, from each texture's (k,) ``ends`` and
    ``memory`` and (k, 2) ``size``, without the first column."""
    last = np.array([len(row[0]) for row in rows], dtype=np.int64)
    shape = len(rows), int(last.max(initial=0)) + 1
    ends, memory, size = (np.zeros(s, np.int64) for s in (shape, shape, (*shape, 2)))
    for t, row in enumerate(rows):
        n = int(last[t])
        for table, values in zip((ends, memory, size), row, strict=True):
            table[t, 1 : n + 1] = values
            table[t, n + 1 :] = table[t, n]
    return Columns(last, last, ends, memory, size)


@dataclass(frozen=True)
class Shapes:
    """The shapes of all cells.

    Attributes
    ----------
    cell, texture: (n,) int64, ascending by cell; the texture is -1 without.
    low, high: (n, 3) corners of their boxes, metres.
    side: (n, 2) mean width and height of the texture's image on the shape, metres; 0 if the shape
        shows a single point of it.
    """

    cell: Ints
    texture: Ints
    low: Floats
    high: Floats
    side: Floats

    def join(self, more: Shapes) -> Shapes:
        """These shapes and others, by cell."""
        order = np.argsort(np.concatenate([self.cell, more.cell]), kind="stable")
        both: dict[str, Any] = {
            name: np.concatenate([values, vars(more)[name]])[order]
            for name, values in vars(self).items()
        }
        return Shapes(**both)


@dataclass(frozen=True)
class Catalogue:
    """The files that can be fetched, and their properties. K columns: nothing, then the levels, or
    the columns of another form (`ptmtools_lab.forms`).

    Attributes
    ----------
    levels, stored: (T,) columns of each texture, without the first; see `Columns`.
    ends: (T, K) bytes of the file up to each column; of several files, their sum.
    memory: (T, K) bytes of texture memory. size: (T, K, 2) width and height of the finest
        image that a column shows.
    differences: (T, K) mean difference of each column's texels to the column before, 0 to 255, at
        least `LEAST_DIFFERENCE`; 0 after the last column.
    colors: (T, 3) mean colour, 0 to 255.
    index_bytes, statistics_bytes, record_bytes, geometry_bytes: bytes on the link; the latter two
        are (C,).
    low, high: (C, 3) corners of the cells' boxes, metres, as rounded in the index: a client has
        leaves only of cells whose record has arrived.
    records, statistics: of each cell.
    shapes: see `Shapes`.
    previews: see `Previews`. meshes: see `Meshes`.
    normals: the textures that are normal maps of materials.
    """

    levels: Ints
    stored: Ints
    ends: Ints
    memory: Ints
    size: Ints
    differences: Floats
    colors: Floats
    index_bytes: int
    statistics_bytes: int
    record_bytes: Ints
    geometry_bytes: Ints
    low: Floats
    high: Floats
    records: tuple[Document, ...]
    statistics: Sequence[Document]
    shapes: Shapes
    previews: Previews
    meshes: Meshes
    normals: tuple[int, ...] = ()

    @property
    def texture_count(self) -> int:
        """Number of textures."""
        return len(self.levels)

    @property
    def cell_count(self) -> int:
        """Number of cells."""
        return len(self.records)

    @property
    def whole(self) -> int:
        """Bytes of texture memory of all textures with all levels."""
        return int(self.memory[:, -1].sum())

    @cached_property
    def gains(self) -> Floats:
        """(R, K) mean difference that each column of each source removes on pixels that want it, 0
        to 255, less than 0 if its texels are worse than the column before; of normal maps
        `NORMALS` of it."""
        gains = self.previews.gains(self.differences)
        textures = np.concatenate([np.arange(self.texture_count), self.previews.texture])
        gains[np.isin(textures, self.normals)] *= NORMALS
        return gains

    def by_source(self, shares: Floats) -> Floats:
        """(R, K) the (T, K) shares of the textures of all sources."""
        return np.concatenate([shares, shares[self.previews.texture]])

    @cached_property
    def without_previews(self) -> Catalogue:
        """The same catalogue for clients that know no previews."""
        if not len(self.previews.texture):
            return self
        column, last = np.arange(self.ends.shape[1]), self.stored[:, None]
        exists, texture = column <= last, np.arange(self.texture_count)[:, None]
        kept = texture, np.minimum(column, last)
        return replace(
            self,
            levels=self.stored,
            memory=self.memory[kept],
            size=self.size[kept],
            differences=np.where(exists, self.differences, 0.0),
            previews=no_previews(self.texture_count),
        )

    @cached_property
    def first_shape(self) -> Ints:
        """(C + 1,) index of each cell's first shape."""
        return np.searchsorted(self.shapes.cell, np.arange(self.cell_count + 1))

    @cached_property
    def visible(self) -> tuple[Ints, ...]:
        """The cells visible from each cell, itself first."""
        return tuple(np.array(record["visible"], dtype=np.int64) for record in self.records)

    @cached_property
    def coverage(self) -> tuple[Floats, ...]:
        """The average coverage hints of each cell, aligned with `visible`, all above 0."""
        return tuple(
            np.maximum(np.array(record["ach"], dtype=np.float64), record["floor"])
            for record in self.records
        )

    @cached_property
    def adjacent(self) -> tuple[Ints, ...]:
        """The neighbours of each cell through its portals."""
        return tuple(np.array(record["adjacent"], dtype=np.int64) for record in self.records)

    @cached_property
    def in_sight(self) -> tuple[Ints, ...]:
        """The textures of the visible set of each cell, as its record lists them."""
        return tuple(
            np.unique(np.array([t for row in record["textures"] for t in row], dtype=np.int64))
            for record in self.records
        )

    def with_browser_sizes(self, browser: Browser) -> Catalogue:
        """The same catalogue with the record and geometry sizes that a browser recorded."""
        return replace(
            self, record_bytes=browser.record_bytes, geometry_bytes=browser.geometry_bytes
        )

    def in_columns(self, columns: Columns) -> Catalogue:
        """The same textures with other columns, all of the least difference, and no previews."""
        differences = np.where(_existing(columns), LEAST_DIFFERENCE, 0.0)
        previews = no_previews(self.texture_count)
        return replace(self, **columns._asdict(), differences=differences, previews=previews)

    def with_memory(self, memory: Ints) -> Catalogue:
        """The same catalogue with other texture memory (t, k) of the first textures."""
        rows, wide = memory.shape
        table = self.memory.copy()
        table[:rows, :wide] = memory
        table[:rows, wide:] = memory[:, -1:]
        return replace(self, memory=table)

    def extend(self, more: Columns, differences: Floats, shapes: Shapes | None = None) -> Catalogue:
        """The same catalogue with further textures and shapes after its own; ``differences`` (T',
        K')."""
        tables = (getattr(self, name) for name in Columns._fields)
        columns = join_columns(Columns(*tables), more)
        wide = columns.ends.shape[1]
        wider = [
            np.pad(d, ((0, 0), (0, wide - d.shape[1]))) for d in (self.differences, differences)
        ]
        return replace(
            self,
            **columns._asdict(),
            differences=np.concatenate(wider),
            previews=self.previews.pad_to(len(columns.levels)),
            colors=np.concatenate([self.colors, np.zeros((len(more.levels), 3))]),
            shapes=self.shapes if shapes is None else self.shapes.join(shapes),
        )


def catalogue_of(served: Served, differences: Floats, colors: Floats) -> Catalogue:
    """The catalogue of a served folder; ``differences`` (T, L) and ``colors`` (T, 3) are those of
    `Pyramids`, for hints without them."""
    textures = served.index["textures"]
    columns = columns_of(textures)
    differences_: Floats = np.zeros(columns.ends.shape)
    differences_[:, 1:] = differences[:, : differences_.shape[1] - 1]
    if all(len(row.get("differences", ())) == len(sizes_of(row)) for row in textures):
        for into, row in zip(differences_, textures, strict=True):
            into[1 : len(sizes_of(row)) + 1] = row["differences"]
    if textures and all("color" in row for row in textures):
        colors = np.array([row["color"] for row in textures], dtype=np.float64)
    boxes = np.array([cell["box"] for cell in served.index["cells"]], dtype=np.float64)
    low, high = boxes.reshape(-1, 2, 3).transpose(1, 0, 2).copy()
    existing = _existing(columns)
    differences_[existing] = np.maximum(differences_[existing], LEAST_DIFFERENCE)
    for t, row in enumerate(textures):
        if "probe" in row:  # coarser levels are of no use
            differences_[t, : columns.levels[t]] = 0
    return Catalogue(
        **columns._asdict(),
        differences=differences_,
        colors=colors,
        index_bytes=served.index_bytes,
        statistics_bytes=served.statistics_bytes,
        record_bytes=served.record_bytes,
        geometry_bytes=served.geometry_bytes,
        low=low,
        high=high,
        records=served.records,
        statistics=served.statistics["cells"],
        shapes=_shapes(served.surfaces),
        previews=previews_of(textures),
        meshes=meshes_of(served.index.get("meshes", ()), served.mesh_bytes),
        normals=tuple(t for t, row in enumerate(textures) if row.get("normals")),
    )


def _existing(columns: Columns) -> Bools:
    """(T, K) which columns exist, without the first."""
    column = np.arange(columns.ends.shape[1])
    result: Bools = (column > 0) & (column <= columns.levels[:, None])
    return result


def _shapes(surfaces: Surfaces) -> Shapes:
    """The shapes, and once more those with a lightmap, and those with a probe, as if that was their
    texture."""
    shapes, gloss = _textured_shapes(surfaces), surfaces.gloss
    mirrors = replace(surfaces, texture=gloss.probe) if gloss else None
    for maps in (surfaces.light, mirrors):
        if maps is not None:
            mapped = vars(_textured_shapes(maps))
            kept = mapped["texture"] >= 0
            shapes = shapes.join(Shapes(**{name: rows[kept] for name, rows in mapped.items()}))
    return shapes


def _textured_shapes(surfaces: Surfaces) -> Shapes:
    low, high = surfaces.boxes()
    count = len(low)
    cell, texture = (np.zeros(count, np.int64) for _ in range(2))
    cell[surfaces.shape], texture[surfaces.shape] = surfaces.cell, surfaces.texture
    drawn = np.isfinite(low[:, 0])
    area = np.linalg.norm(normals(surfaces.corner), axis=1)
    slope = np.linalg.norm(gradients(surfaces.corner, surfaces.uv), axis=2)
    often = np.stack([np.bincount(surfaces.shape, area * s, count) for s in slope.T], axis=1)
    whole = np.bincount(surfaces.shape, area, count)[:, None]
    side = np.divide(whole, often, out=np.zeros((count, 2)), where=often > 0)
    return Shapes(cell[drawn], texture[drawn], low[drawn], high[drawn], side[drawn])
