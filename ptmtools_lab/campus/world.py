"""Data shared by the runs of a walk through a campus, with tables of the error of the picture.

In each frame rays are cast at the meshes of the full picture, at all finest and at all coarsest
meshes of the campus. A pixel belongs to the object whose finest mesh it shows, or, if it shows
none, whose coarsest. Its error (root mean square over R, G and B, 0 to 255) is summed up by object
and texture, for finest and for coarsest meshes, with nothing loaded (grey) and with the texture in
each size. A run only looks up errors: by the mesh that shows an object, and by the resident size of
each texture.

This is an approximation at silhouettes: a pixel of an object shows what the meshes of that kind
show when *all* objects are shown by that kind. Where a coarse mesh leaves open what the fine one
covers, the pixel shows the coarse mesh of the object behind, even if that object is shown by its
fine one. Where the coarse mesh covers more, the pixel belongs to the object behind and follows the
kind of that. A ray that hits nothing is black, as in pictures of other clients.

Where only the full picture, or only the meshes, show something, the meshes differ from the full
picture: that part of the error is in every run (`CampusTables.least`).
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.errors import InputError
from ptmtools.jit import plain_kernel
from ptmtools.output.served import Served
from ptmtools.output.surfaces import Surfaces
from ptmtools.progress import Progress, silent
from ptmtools.rendering.kernels import GREY, blend, texel_under
from ptmtools.rendering.pyramids import full_colors, read_pyramids
from ptmtools.rendering.rays import Caster, Frustum, RayCamera
from ptmtools.rendering.records import Pyramids, Sight, Triangles, triangles_of
from ptmtools.rendering.tone import show_vertex_light
from ptmtools.walk import Walk
from ptmtools_lab.campus.stock import Stock, read_stock, read_surfaces, read_textures
from ptmtools_lab.rows import distance
from ptmtools_lab.track import RATE, frame_times
from ptmtools_lab.world import PIXELS
from ptmtools_systems.campus.model import SIZES

#: Columns of a table: grey, and each size of a texture.
COLUMNS = 4


class Sizes(NamedTuple):
    """Textures in each size."""

    small: Pyramids
    middle: Pyramids
    large: Pyramids


@plain_kernel
def color_of(
    sight: Sight, i: int, triangles: Triangles, textures: Pyramids, color: Floats, work: Floats
) -> None:
    """Writes the colour of a pixel to ``color`` (3,), 0 to 255; black if the pixel shows nothing.

    ``work`` (4, 3) is scratch memory.
    """
    f = sight.triangle[i]
    if f < 0:
        color[:] = 0.0
        return
    t = triangles.texture[f]
    if t < 0:
        color[:] = 255.0
    else:
        u, v, detail = texel_under(sight, i, triangles, textures, t, work[:3])
        blend(textures, t, detail, u, v, triangles.clamped[f], color, work[3])
    for k in range(3):
        color[k] *= triangles.color[f, k]


@plain_kernel
def add_shown(
    owner: Ints,
    sight: Sight,
    triangles: Triangles,
    sizes: Sizes,
    exact: Floats,
    place: Ints,
    sums: Floats,
    work: Floats,
) -> None:
    """Adds the errors of the pixels of a frame as one kind of mesh shows them.

    Parameters
    ----------
    owner: (n,) object of each pixel, -1 for none.
    exact: (n, 3) colours of the full picture.
    place: (m, T + 1) row of an object and a texture; the last is without texture.
    sums: (rows, `COLUMNS`) of root mean squares over R, G and B.
    work: (5, 3) scratch memory.
    """
    shown = work[4]
    for i in range(len(owner)):
        o = owner[i]
        if o < 0:
            continue
        f = sight.triangle[i]
        t = triangles.texture[f] if f >= 0 else -1
        row = place[o, t]
        shown[:] = GREY
        sums[row, 0] += np.sqrt(distance(shown, exact[i]))
        color_of(sight, i, triangles, sizes.small, shown, work[:4])
        sums[row, 1] += np.sqrt(distance(shown, exact[i]))
        if t >= 0:
            color_of(sight, i, triangles, sizes.middle, shown, work[:4])
        sums[row, 2] += np.sqrt(distance(shown, exact[i]))
        if t >= 0:
            color_of(sight, i, triangles, sizes.large, shown, work[:4])
        sums[row, 3] += np.sqrt(distance(shown, exact[i]))


#: Display state of an object.
NOTHING, COARSE, FINE = range(3)


@dataclass(frozen=True)
class CampusTables:
    """Errors of the frames; the rows of a frame are ``start[f]`` to ``start[f + 1]``.

    Attributes
    ----------
    start: (F + 1,).
    object, texture: (R,) int32; the texture is -1 for surfaces without.
    kind: (R,) int8, `COARSE` or `FINE`.
    error: (R, 4) part of the frame's mean error: with nothing loaded, and with the texture in each
        size.
    least: (F,) part of the error that belongs to no object.
    """

    start: Ints
    object: NDArray[np.int32]
    texture: NDArray[np.int32]
    kind: NDArray[np.int8]
    error: Singles
    least: Floats

    def wrong(self, frame: int, mesh: Ints, column: Ints) -> float:
        """e of a frame, for the display state of each object (m,) and the column of each texture
        (T,): 0 is nothing, then the sizes."""
        rows = slice(int(self.start[frame]), int(self.start[frame + 1]))
        number, texture = self.object[rows], self.texture[rows]
        shown = mesh[number]
        # An object without a mesh is grey; the rows of its finest mesh stand for it.
        used = self.kind[rows] == np.where(shown == NOTHING, FINE, shown)
        loaded = np.append(column, self.error.shape[1] - 1)[texture]
        loaded = np.where(shown == NOTHING, 0, loaded)
        part = np.take_along_axis(self.error[rows], loaded[:, None], axis=1)[:, 0]
        return float(part[used].sum(dtype=np.float64) + self.least[frame])


@dataclass(frozen=True)
class FullPicture:
    """The reference picture: surfaces with textures."""

    surfaces: Surfaces
    textures: Pyramids


def look(
    full: FullPicture,
    finest: Surfaces,
    coarsest: Surfaces,
    sizes: tuple[Pyramids, Pyramids, Pyramids],
    camera: RayCamera,
    eye: Floats,
    direction: Floats,
    progress: Progress = silent,
) -> CampusTables:
    """The tables of (F, 3) eyes and directions; ``cell`` of the surfaces is the object."""

    objects = int(max(finest.cell.max(initial=-1), coarsest.cell.max(initial=-1))) + 1
    wide = len(sizes[0].levels) + 1
    place = np.arange(objects * wide).reshape(objects, wide)
    kinds = tuple((kind, Caster(s), triangles_of(s))
                  for kind, s in ((COARSE, coarsest), (FINE, finest)))  # fmt: skip
    one_picture = full.surfaces is finest
    caster, triangles = kinds[1][1:] if one_picture else (None, triangles_of(full.surfaces))
    caster = caster or Caster(full.surfaces)
    pixels = camera.width * camera.height
    work = np.zeros((5, 3))
    sums = np.zeros((objects * wide, COLUMNS))
    start, rows, errors = [0], [np.zeros((0, 3), np.int64)], [np.zeros((0, COLUMNS), np.float32)]
    least = np.zeros(len(eye))
    for f in range(len(eye)):
        progress(f, len(eye), "looking along the walk")
        coarse, fine = (surfaces.look(camera, eye[f], direction[f]) for _, surfaces, _ in kinds)
        sight = fine if one_picture else caster.look(camera, eye[f], direction[f])
        exact = full_colors(sight, triangles, full.textures)
        owner = _owners((fine.triangle, finest), (coarse.triangle, coarsest))
        for (kind, _, drawn), seen in zip(kinds, (coarse, fine), strict=True):
            add_shown(owner, seen, drawn, Sizes(*sizes), exact, place, sums, work)
            nonzero = np.flatnonzero(sums.any(axis=1))
            number, texture = np.divmod(nonzero, wide)
            texture[texture == wide - 1] = -1
            rows.append(np.stack([number, texture, np.full(len(nonzero), kind)], axis=1))
            errors.append((sums[nonzero] / pixels).astype(np.float32))
            sums[nonzero] = 0.0
        start.append(start[-1] + len(rows[-1]) + len(rows[-2]))
        unowned = exact[owner < 0]
        least[f] = np.sqrt((unowned**2).mean(axis=1)).sum() / pixels
    progress(len(eye), len(eye), "looking along the walk")
    number, texture, kind = np.concatenate(rows).T
    return CampusTables(
        np.array(start), number.astype(np.int32), texture.astype(np.int32), kind.astype(np.int8),
        np.concatenate(errors), least,
    )  # fmt: skip


def _owners(*seen: tuple[Ints, Surfaces]) -> Ints:
    """(n,) the object of the first mesh that shows something."""
    result = np.full(len(seen[0][0]), -1, np.int64)
    for triangle, surfaces in seen:
        open_ = (result < 0) & (triangle >= 0)
        result[open_] = surfaces.cell[triangle[open_]]
    return result


@dataclass(frozen=True)
class CampusWorld:
    """A walk through a campus.

    Attributes
    ----------
    stock: the files of the campus.
    tables: errors, or None if not requested. view: (F,) table of each frame, -1 for none.
    time: (F,) s. eye: (F, 3) metres. seen: (F, m) whether the box of each object is in view.
    rate: frames a second.
    """

    stock: Stock
    tables: CampusTables | None
    view: Ints
    time: Floats
    eye: Floats
    seen: Bools
    rate: float

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.time)

    @property
    def lacking(self) -> float:
        """Mean e that the meshes never show, over the frames with tables; 0 without any."""
        some = self.view[self.view >= 0]
        return 0.0 if self.tables is None else float(self.tables.least[some].mean())

    def standing(self, seconds: float) -> CampusWorld:
        """A visitor who stays at the first frame for this time."""
        count = int(np.ceil(seconds * self.rate)) + 1
        first = np.zeros(count, np.int64)
        time = np.arange(count) / self.rate
        return replace(
            self, view=self.view[first], time=time, eye=self.eye[first], seen=self.seen[first]
        )


@dataclass(frozen=True)
class CampusFrames:
    """The frames of a walk through a campus, and its objects.

    Attributes
    ----------
    rate: frames a second. pixels: of the pictures, across and down.
    every: tabulate the errors of each frame whose number it divides, which takes most of the time;
        0: of none.
    only: names of the objects to keep, with * and ?.
    """

    rate: float = RATE
    pixels: tuple[int, int] = PIXELS
    every: int = 1
    only: str = "*"


def prepare_campus(
    folder: str | os.PathLike[str],
    walk: Walk,
    served: Served | None = None,
    pyramids: Pyramids | None = None,
    *,
    frames: CampusFrames = CampusFrames(),
    progress: Progress = silent,
) -> CampusWorld:
    """The world of a walk through a campus.

    Parameters
    ----------
    served: a database of the same model, whose full picture is the reference. If None, the
        reference is the campus with all finest meshes and largest textures: the loss by compression
        and smaller images is then not an error.
    pyramids: its textures, if they have been read already.

    Raises
    ------
    InputError: PTM-I701 the walk was recorded in a browser; PTM-I122, I821 the campus is
        incomplete or damaged, or has no such object.
    LimitError: PTM-L400 the walk is too long; PTM-L204 the index is.
    DatabaseError, LimitError: those of `read_pyramids`.
    """
    time = frame_times(walk, frames.rate)
    if walk.browser:
        raise InputError(
            "PTM-I701",
            "a walk that was recorded in a browser is of its client, not of one of a campus",
            remedy="use a walk of `ptm path`",
        )
    folder = Path(folder)
    stock = read_stock(folder, frames.only)
    eye, direction = walk.at(time)
    view, tables = np.full(len(time), -1, np.int64), None
    if frames.every:
        pose = np.concatenate([eye, direction], axis=1)[:: frames.every]
        seen, inverse = np.unique(pose, axis=0, return_inverse=True)
        view[:: frames.every] = inverse.reshape(-1)
        finest, coarsest = (read_surfaces(folder, stock, level) for level in (-1, 0))
        small, middle, large = (read_textures(folder, stock, size) for size in SIZES)
        full = FullPicture(finest, large)
        if served is not None:
            textures = read_pyramids(served, progress) if pyramids is None else pyramids
            full = FullPicture(show_vertex_light(served).surfaces, textures)
        camera = RayCamera(*frames.pixels, walk.field_of_view, walk.aspect)
        sizes = small, middle, large
        tables = look(full, finest, coarsest, sizes, camera, seen[:, :3], seen[:, 3:], progress)
    low, high = stock.boxes[:, :3], stock.boxes[:, 3:]
    seen_at = [
        Frustum(at, ahead, walk.field_of_view, walk.aspect).meets_boxes(low, high)
        for at, ahead in zip(eye, direction, strict=True)
    ]
    return CampusWorld(stock, tables, view, time, eye, np.array(seen_at), frames.rate)
