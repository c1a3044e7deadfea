"""The light that baked surfaces send to an eye: base colours under lightmaps.

A ray meets a face of the scene, and that has pieces in several cells: the piece that holds the
point, on the side that the ray comes from, knows the texel of its lightmap. Images are small ones,
since all that shows is a reflection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.jit import kernel
from ptmtools.light.cells import CellLight
from ptmtools.light.model import CellSurfaces, coded_light
from ptmtools.light.reflectance import SmallImages
from ptmtools.scene.colors import to_linear
from ptmtools.scene.model import Scene

#: The light of a piece: none, by the lightmap, at the corners.
_UNLIT, _MAPPED, _CORNERS = range(3)


@dataclass(frozen=True)
class BakedSurfaces:
    """The surfaces of all cells.

    Attributes
    ----------
    start, piece: CSR (T + 1,) over the scene's triangles, the pieces of each.
    corner, uv, light: (P, 3, 3) of the pieces, (P, 3, 2) in the lightmaps, from the lower left,
        (P, 3, 3) float32 light of those whose kind is `_CORNERS`.
    kind, side, cell: (P,).
    texels, first, width: (n, 3) codes of all lightmaps; (C,) the first of each cell, and its side.
    white: (C,).
    tint, glow, both: (T, 3) base colours beside images, (T, 3) what faces send by themselves, and
        (T,) whether from both sides.
    image, place: (T,) index of an image, -1 for none; (T, 3, 2) coordinates in it.
    images: of the scene.
    unlit: what a white surface without light sends.
    """

    start: Ints
    piece: Ints
    corner: Singles
    uv: Singles
    light: Singles
    kind: NDArray[np.uint8]
    side: NDArray[np.int8]
    cell: Ints
    texels: NDArray[np.uint8]
    first: Ints
    width: Ints
    white: Floats
    tint: Floats
    glow: Floats
    both: Bools
    image: Ints
    place: Floats
    images: SmallImages
    unlit: float

    @staticmethod
    def of_scene(
        scene: Scene,
        pieces: Sequence[CellSurfaces],
        lights: Sequence[CellLight],
        tint: Floats,
        glow: Floats,
        images: SmallImages,
        unlit: float,
    ) -> BakedSurfaces:
        """``tint``, ``glow``: as the fields; ``images``: of the scene."""
        face = np.concatenate([surfaces.face for surfaces in pieces])
        order = np.argsort(face, kind="stable")
        start = np.searchsorted(face[order], np.arange(len(scene.triangles) + 1))
        white = np.array([light.white for light in lights])
        cell = np.repeat(np.arange(len(pieces)), [len(surfaces.face) for surfaces in pieces])
        glass = np.concatenate([surfaces.glass for surfaces in pieces])
        dense = np.concatenate([surfaces.dense for surfaces in pieces])
        shares = to_linear(np.concatenate([light.vertex for light in lights]) / 255)
        maps = [np.zeros((0, 0, 3)) if k.texels is None else np.rint(k.texels) for k in lights]
        sizes = np.array([len(texels) for texels in maps])
        image = np.array([material.image for material in scene.materials], np.int64)
        return BakedSurfaces(
            start,
            order,
            np.concatenate([surfaces.corner for surfaces in pieces]),
            np.concatenate([light.uv for light in lights]),
            (shares * white[cell][:, None, None]).astype(np.float32),
            np.where(glass, _UNLIT, np.where(dense, _CORNERS, _MAPPED)).astype(np.uint8),
            np.concatenate([surfaces.side for surfaces in pieces]),
            cell,
            np.concatenate([texels.reshape(-1, 3) for texels in maps]).astype(np.uint8),
            _starts(sizes**2),
            sizes,
            white,
            tint,
            glow,
            scene.two_sided,
            image[scene.triangle_material],
            scene.uv,
            images,
            unlit,
        )

    def radiance(self, face: Ints, u: Floats, v: Floats, point: Floats, front: Bools) -> Floats:
        """(n, 3) what (n,) triangles of the scene send from (n, 3) points, with these barycentric
        coordinates, on the (n,) sides that rays come from."""
        piece, share = find_pieces(
            face, point, front, self.start, self.piece, self.corner, self.side
        )
        light = np.full((len(face), 3), self.unlit)
        light[piece < 0] = 0.0
        kind = np.where(piece < 0, _UNLIT, self.kind[piece])
        rows = np.flatnonzero(kind == _CORNERS)
        light[rows] = np.einsum("nk,nkc->nc", share[rows], self.light[piece[rows]])
        rows = np.flatnonzero(kind == _MAPPED)
        light[rows] = self._map_light(piece[rows], share[rows])
        colors = self.tint[face]
        textured = np.flatnonzero(self.image[face] >= 0)
        across, along = u[textured, None], v[textured, None]
        a, b, c = np.moveaxis(self.place[face[textured]], 1, 0)
        colors[textured] *= self.images.texels(
            self.image[face[textured]], a + across * (b - a) + along * (c - a)
        )
        sent = colors * light
        # Lamps with an image show that.
        shows = (self.image[face] < 0) & (front | self.both[face])
        return np.asarray(np.where(shows[:, None], np.maximum(sent, self.glow[face]), sent))

    def _map_light(self, piece: Ints, share: Floats) -> Floats:
        """(n, 3) the light of the nearest texels of lightmaps."""
        cell, at = self.cell[piece], np.einsum("nk,nkx->nx", share, self.uv[piece])
        size = self.width[cell]
        column, row = (
            np.clip((part * size).astype(np.int64), 0, size - 1)
            for part in (at[:, 0], 1 - at[:, 1])
        )
        code = self.texels[self.first[cell] + row * size + column]
        return np.asarray(_SHARES[code] * self.white[cell][:, None])


#: The share of white of each code.
_SHARES = coded_light(np.arange(256, dtype=np.float64), 1.0)


def _starts(count: Ints) -> Ints:
    return np.concatenate([[0], np.cumsum(count)])[:-1].astype(np.int64)


@kernel
def find_pieces(
    face: Ints,
    point: Floats,
    front: Bools,
    start: Ints,
    piece: Ints,
    corner: Singles,
    side: NDArray[np.int8],
) -> tuple[Ints, Floats]:
    """(n,) the piece of each face that holds a point, or is nearest to it, -1 if none of them shows
    the side; (n, 3) the shares of its corners in the point."""
    holder = np.full(len(face), -1)
    share = np.zeros((len(face), 3))
    for n in range(len(face)):
        best = -np.inf
        for entry in range(start[face[n]], start[face[n] + 1]):
            p = piece[entry]
            if (side[p] < 0 and front[n]) or (side[p] > 0 and not front[n]):
                continue
            uu, uw, ww, du, dw = 0.0, 0.0, 0.0, 0.0, 0.0
            for axis in range(3):
                a = float(corner[p, 0, axis])
                s, t, d = corner[p, 1, axis] - a, corner[p, 2, axis] - a, point[n, axis] - a
                uu, uw, ww = uu + s * s, uw + s * t, ww + t * t
                du, dw = du + d * s, dw + d * t
            area = uu * ww - uw * uw
            if area <= 0:
                continue
            second, third = (ww * du - uw * dw) / area, (uu * dw - uw * du) / area
            least = min(second, third, 1 - second - third)
            if least > best:
                best, holder[n] = least, p
                share[n, 1], share[n, 2] = second, third
        total = 0.0
        for k in range(1, 3):
            share[n, k] = min(max(share[n, k], 0.0), 1.0 - total)
            total += share[n, k]
        share[n, 0] = 1.0 - total
    return holder, share
