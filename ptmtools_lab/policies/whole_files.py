"""Clients that request files as a whole, and documents and geometry as soon as they know of them.

`lru` fetches the textures of visible shapes as a whole, in the order of their first sight, and
removes the least recently seen. It is what files and a cache achieve, without any hint but the
visible sets.

`whole` requests the same, of the visible set of the cell alone, and holds a texture whole or not at
all: what a program without levels of detail draws. The last look decides which are the least
recently seen ones. The page with this policy also uploads what does not fit, in each picture again
(`web/page/gl/whole-memory.js`), to show what that costs. Here it has its mean colour.

`gpuii` fetches interlaced images as Englert et al. do ("Efficient Image Distribution on the Web",
2014, §3.3). The next file is the most important one, by four criteria:

1. Its image is visible: the box of a shape with it intersects the frustum. Occlusion is ignored,
   and nothing else is prefetched.
2. It needs another step: the texels of the image so far are wider or higher than pixels on a shape
   with it, at the distance of the nearest point of that shape's box.
3. It is near: rings around the camera, the nearest first.
4. Within a ring the lowest step first, "to get a consistent look".

Files arrive as a whole, as many at a time as HTTP/1.1 has connections, in a browser one of an
image, and requests are not cancelled. Where no image needs another step, nothing is requested.

Our reading: the width of a ring (`RING`); of equal files the nearest image comes first. Texture
memory, which the paper has only as "one step less", is filled with steps in the same order, and a
step that does not fit is not loaded either; the rest of the memory holds other loaded steps, the
last seen first.
"""

from __future__ import annotations

from abc import ABC

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.rendering.rays import NEAR
from ptmtools.site.client import CONNECTIONS, RING
from ptmtools_lab.client import Client, FileKind
from ptmtools_lab.network import FluidLink
from ptmtools_lab.world import World


class WholeFileClient(Client, ABC):
    """A client that requests whole files, after all earlier requests."""

    def __init__(self, world: World, link: FluidLink, budget: int) -> None:
        super().__init__(world, link, budget)
        #: The frame in which each texture was seen last, -1 for none.
        self._seen = np.full(world.catalogue.texture_count, -1, np.int64)

    def documents(self) -> bool:
        """Requests the index, then the record of the cell and the geometry of its visible set;
        returns whether the index has arrived."""
        self.request(FileKind.INDEX, 0)
        if not self.index:
            return False
        self.request(FileKind.RECORD, int(self.world.track.cell[self.frame]))
        if self.cell >= 0:
            for cell in self.world.catalogue.visible[self.cell].tolist():
                self.request(FileKind.GEOMETRY, cell)
            for mesh in self.finest_meshes(self.world.catalogue.visible[self.cell]):
                self.request(FileKind.MESH, mesh)
        return True

    def request(self, kind: FileKind, number: int) -> None:
        """Requests a file unless it was requested."""
        self.whole(kind, number, -self.link.requests)

    def keep(self, order: Ints, remaining: int) -> None:
        """Adds the finest levels that fit into ``remaining`` bytes, of the textures in this order,
        up to the first that was never seen."""
        memory, have = self.world.catalogue.memory, self.have
        for t in order.tolist():
            if self._seen[t] < 0:
                break
            resident = int(memory[t, self.column[t]])
            fits = int((memory[t, : have[t] + 1] <= resident + remaining).sum()) - 1
            self.column[t] = max(fits, int(self.column[t]))
            remaining -= int(memory[t, self.column[t]]) - resident


class LruClient(WholeFileClient):
    """The client `lru` of the module."""

    def __init__(self, world: World, link: FluidLink, budget: int) -> None:
        super().__init__(world, link, budget)
        self._queue: list[int] = []

    def look(self, frame: int) -> None:
        """See `Client.look`."""
        self.frame = frame
        met = self.world.catalogue.shapes.texture[self.shapes_ahead()]
        for t in dict.fromkeys(met.tolist()):
            if self._seen[t] < 0:
                self._queue.append(t)
            self._seen[t] = frame
        super().look(frame)

    def settle(self) -> None:
        """See `Client.settle`: the finest level that fits, the last seen first."""
        self.column[:] = 0
        self.keep(np.argsort(-self._seen, kind="stable"), self.budget)

    def fetch(self) -> None:
        """See `Client.fetch`: one after the other, whole."""
        if not self.documents():
            return
        while self._queue and len(self.waiting) < CONNECTIONS:
            self.request(FileKind.TEXTURE, self._queue.pop(0))


class WholeClient(WholeFileClient):
    """The client `whole` of the module."""

    def __init__(self, world: World, link: FluidLink, budget: int) -> None:
        super().__init__(world, link, budget)
        stock = world.catalogue
        self._size = stock.memory[np.arange(stock.texture_count), stock.stored]
        #: Textures by their first sight; and those in memory, the least recently seen first.
        self._order: dict[int, None] = {}
        self._held: dict[int, None] = {}

    def settle(self) -> None:
        """See `Client.settle`: textures that are here are used in the order of their shapes."""
        stock = self.world.catalogue
        met, visible = self.shapes_ahead(), stock.visible[self.cell] if self.cell >= 0 else ()
        met = met[np.isin(stock.shapes.cell[met], visible)]
        seen = dict.fromkeys(stock.shapes.texture[met].tolist())
        self._order |= seen
        whole = self.have >= stock.stored
        for t in seen:
            if whole[t] and self._size[t] <= self.budget:
                self._held.pop(t, None)
                self._shrink(self.budget - int(self._size[t]))
                self._held[t] = None
        self.column[:] = 0
        resident = [*self._held]
        self.column[resident] = stock.stored[resident]

    def fetch(self) -> None:
        """See `Client.fetch`: one after the other, whole."""
        if not self.documents():
            return
        for t in self._order:
            if len(self.waiting) >= CONNECTIONS:
                break
            self.request(FileKind.TEXTURE, t)

    def finest_meshes(self, cells: Ints) -> list[int]:
        """See `Client.finest_meshes`: after the geometry of their cells."""
        return super().finest_meshes(cells[self.geometry.whole[cells]])

    def _shrink(self, budget: int) -> None:
        """The least recently seen textures leave until the others fit."""
        used = int(self._size[[*self._held]].sum())
        while used > budget:
            t = next(iter(self._held))
            del self._held[t]
            used -= int(self._size[t])


class GpuiiClient(WholeFileClient):
    """The client `gpuii` of the module; ``ring`` is the width of a ring, metres.

    Attributes
    ----------
    distance: (T,) metres to the nearest shape with each texture in the frustum, infinite without
        one. wanted: (T,) columns that the screen needs.
    """

    def __init__(self, world: World, link: FluidLink, budget: int, ring: float = RING) -> None:
        super().__init__(world, link, budget)
        count = world.catalogue.texture_count
        self._ring = ring
        self.distance: Floats = np.full(count, np.inf)
        self.wanted: Ints = np.zeros(count, np.int64)
        #: Texture and column of each visible and needed step, the most important first.
        self._steps: list[tuple[int, int]] = []
        self._target: Ints = np.zeros(count, np.int64)

    def look(self, frame: int) -> None:
        """See `Client.look`."""
        self.frame = frame
        self._see()
        self._steps = self._order_steps()
        self._target = self._fill(self.wanted)[0]
        super().look(frame)

    def settle(self) -> None:
        """See `Client.settle`."""
        self.column, remaining = self._fill(np.minimum(self.wanted, self.have))
        self.keep(np.lexsort((self.distance, -self._seen)), remaining)

    def fetch(self) -> None:
        """See `Client.fetch`."""
        if not self.documents():
            return
        stock, asked = self.world.catalogue, self.textures.asked
        for t, step in self._steps:
            if len(self.waiting) >= CONNECTIONS:
                break
            end = int(stock.ends[t, step])
            busy = self.world.one_range and asked[t] > self.textures.loaded[t]
            if step <= self._target[t] and asked[t] < end and not busy:
                self.ask(FileKind.TEXTURE, t, end, -self.link.requests)

    def _see(self) -> None:
        """Updates the visible textures, their distances, and the columns that the screen needs."""
        stock, shapes = self.world.catalogue, self.world.catalogue.shapes
        frustum, met = self.world.frustum(self.frame), self.shapes_ahead()
        texture = shapes.texture[met]
        distance = np.maximum(frustum.distance(shapes.low[met], shapes.high[met]), NEAR)
        self.distance = np.full(stock.texture_count, np.inf)
        np.minimum.at(self.distance, texture, distance)
        pixels = np.zeros((stock.texture_count, 2))
        pixel = distance[:, None] * self.world.camera.pixel
        np.maximum.at(pixels, texture, shapes.side[met] / pixel)
        coarse = (stock.size[:, 1:] < pixels[:, None]).any(axis=2).sum(axis=1)
        visible = np.isfinite(self.distance)
        self.wanted = np.where(visible, np.minimum(coarse + 1, stock.levels), 0)
        self._seen[visible] = self.frame

    def _order_steps(self) -> list[tuple[int, int]]:
        texture = np.repeat(np.arange(len(self.wanted)), self.wanted)
        first = np.cumsum(self.wanted) - self.wanted
        step = np.arange(len(texture)) - first[texture] + 1
        distance = self.distance[texture]
        order = np.lexsort((texture, distance, step, distance // self._ring))
        return list(zip(texture[order].tolist(), step[order].tolist(), strict=True))

    def _fill(self, limit: Ints) -> tuple[Ints, int]:
        """(T,) columns that fit, at most ``limit``, by the order of steps; and the bytes left."""
        memory = self.world.catalogue.memory
        column, remaining = np.zeros_like(limit), self.budget
        for t, step in self._steps:
            more = int(memory[t, step] - memory[t, step - 1])
            if step <= limit[t] and column[t] == step - 1 and more <= remaining:
                column[t] = step
                remaining -= more
        return column, remaining
