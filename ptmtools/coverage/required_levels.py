"""Required levels of textures: the share of a cell's views by level of detail, and the levels that
no eye resolves.

From sample points of the cell, as those of the coverage hints, rays are cast over the whole sphere,
weighted by solid angle. Where one meets a textured surface, OpenGL's isotropic level of detail is
log2 ρ, with ρ the larger of the lengths, in texels, that a pixel's width and height span in the
texture; the pixel is that in the middle of an upright picture, so directions are alike. Of the two
levels that are then blended, the finer one is *wanted*. (Tried: the band of ±30° that a level view
of 60° shows, instead of the sphere. It leaves out the floor at one's feet, which wants the finest
level.)

Levels that no eye resolves are never drawn from (``docs/design/codec.md``, "Leaving levels out").
Graphics cards draw from the levels ⌊λ⌋ and ⌊λ⌋ + 1, counted from the finest, 0, with
λ = log2(Pmax / N), where Pmax and Pmin are the lengths of a pixel's footprint on the surface, in
texels, the larger and the smaller one, and N the least of ⌈Pmax / Pmin⌉ and 16
(EXT_texture_filter_anisotropic; 1 where the filter is isotropic). So Pmax / N is at least Pmin / 2
and at least Pmax / 16, and from below:

- at a distance r from the eye, φ off the middle of the picture, a pixel covers r·p·cos²φ or more of
  a surface in any direction, where p is a pixel's size at distance 1; φ is largest in a corner;
- r is at least the distance from a piece of the surface to the eyes that may see it: the
  eye region (`ptmtools.cells.model`) of the cells that see its owner, by boxes;
- a metre on the surface is at least σ2 texels and, in one direction, σ1, the singular values of the
  texels' gradient; Pmax is at least σ1 / √2 times the metres that a pixel covers.

(Tried: the pixel in the middle of the picture, and λ = log2(Pmin). The corners of a picture have
smaller pixels, and eyes that were drawn at random in a room needed levels that were trimmed.)
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, cross, normals, ranges
from ptmtools.cells.model import Cells
from ptmtools.coverage.backends import BACKENDS
from ptmtools.coverage.item_buffer import VIEWS, ItemSurfaces
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.sample_points import SamplePoints
from ptmtools.coverage.sampling import HintSampler
from ptmtools.progress import Progress, silent
from ptmtools.scene.colors import gradients
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

#: Side of a sample point's six views, rays.
FACE = 16
#: Width of a pixel a metre away: 1080 of them over 60°.
PIXEL = 2 * math.tan(math.radians(30)) / 1080
_UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class TextureSize:
    """Size of the finest level stored, texels, and the number of levels."""

    width: int
    height: int
    levels: int


@dataclass(frozen=True)
class Need:
    """
    Attributes
    ----------
    start: (C + 1,) int64, CSR: the entries of each cell, one for every image that its rays met.
    image: (n,) int32 image of the scene, ascending within a cell.
    first: (n,) int32 the coarsest level that any ray wants.
    share_start, share: (n + 1,) int64, CSR, and (m,) float64: the share of the view that wants
        level ``first`` or a finer one, level ``first`` + 1 or a finer one, … until it is 0.
    """

    start: Ints
    image: NDArray[np.int32]
    first: NDArray[np.int32]
    share_start: Ints
    share: Floats


def compute_need(
    scene: Scene,
    cells: Cells,
    pvs: Pvs,
    sizes: Mapping[int, TextureSize],
    points: int,
    progress: Progress = silent,
) -> Need:
    """The need of all cells, from ``points`` sample points each; ``sizes`` of the images that have
    a texture. Equal input gives equal results.

    Raises InputError PTM-I111 for an invalid number of points.
    """
    options = AchOptions(
        samples=points, face=FACE, backend="embree", weighting="solid-angle", placement="sobol"
    )
    sampler = HintSampler(scene, cells, pvs, options, BACKENDS["embree"])
    try:
        wanting = _Wanting(scene, cells, sizes, sampler)
        shares = []
        for cell in range(cells.cell_count):
            progress(cell, cells.cell_count, "need")
            shares.append(wanting.shares(sampler.points_of(cell)))
        progress(cells.cell_count, cells.cell_count, "need")
    finally:
        sampler.renderer.close()
    return _gather(shares)


class _Wanting:
    """Computes the levels that the pixels at any sample points want."""

    def __init__(
        self, scene: Scene, cells: Cells, sizes: Mapping[int, TextureSize], sampler: HintSampler
    ) -> None:
        self._renderer = sampler.renderer
        self._surfaces = surfaces = ItemSurfaces.from_scene(scene, cells)
        self._weight = sampler.weight
        images = max(sizes, default=-1) + 1
        size = np.zeros((images + 1, 2))
        #: The finest level of each image; -1 without a texture, as the image -1, which comes last.
        self._finest = np.full(images + 1, -1, dtype=np.int64)
        for image, image_size in sizes.items():
            size[image], self._finest[image] = (
                (image_size.width, image_size.height),
                image_size.levels - 1,
            )
        self._image = np.where(surfaces.image < images, surfaces.image, -1)
        source = cells.triangle_source
        self._gradient = gradients(scene.corners, scene.uv)[source] * size[self._image][..., None]

    def shares(self, points: SamplePoints) -> Floats:
        """(I, L) share of the view from the points that wants each level of each image."""
        wanted = np.zeros((len(self._finest) - 1, max(int(self._finest.max()), 0) + 1))
        total, batch = 0.0, self._renderer.most
        for first in range(0, len(points), batch):
            part = points.part(slice(first, first + batch))
            rays = len(part) * len(VIEWS) * FACE**2
            weight = np.repeat(self._weight(part), len(VIEWS), axis=0).ravel().astype(np.float64)
            eye = np.repeat(part.position, rays // len(part), axis=0)
            for shows, hits in zip(*self._renderer.trace(part, np.arange(rays)), strict=True):
                total += float(weight[shows >= 0].sum())
                met = np.flatnonzero((shows >= 0) & (self._finest[self._image[shows]] >= 0))
                which = shows[met]
                image = self._image[which]
                finest = self._finest[image]
                normal = self._surfaces.plane[which, :3]
                detail = levels_of_detail(hits[met] - eye[met], normal, self._gradient[which])
                level = finest - np.clip(np.floor(detail), 0, finest).astype(np.int64)
                key = image * wanted.shape[1] + level
                wanted += np.bincount(key, weight[met], wanted.size).reshape(wanted.shape)
        return wanted / total if total else wanted


def levels_of_detail(ray: Floats, normal: Floats, gradient: Floats) -> Floats:
    """(n,) log2 ρ, see above, of pixels that look along the (n, 3) rays, from the eye to the
    surface in metres; (n, 3) unit normals; (n, 2, 3) texels for a metre along the surface."""
    distance = np.linalg.norm(ray, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = ray / distance
        right = np.cross(along, _UP)
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        right = np.where(np.isfinite(right), right, [1.0, 0.0, 0.0])  # straight up or down
        facing = np.einsum("ij,ij->i", along, normal)[:, None]
        spans = []
        for axis in (right, np.cross(right, along)):
            lean = np.einsum("ij,ij->i", axis, normal)[:, None] / facing
            step = PIXEL * distance * (axis - along * lean)
            spans.append(np.linalg.norm(np.einsum("ijk,ik->ij", gradient, step), axis=1))
        detail = np.log2(np.maximum(*spans))
    # Edge on, or where the eye touches the surface, none of it is seen: the coarsest suffices.
    return np.asarray(np.where(np.isnan(detail), np.inf, detail))


def _gather(parts: list[Floats]) -> Need:
    """For each cell, the (I, L) shares that want exactly that level."""
    counts, images, firsts, lengths, shares = [0], [], [], [0], [np.zeros(0)]
    for wanted in parts:
        finer = np.cumsum(wanted[:, ::-1], axis=1)[:, ::-1]
        met = np.flatnonzero(wanted.any(axis=1))
        for image in met.tolist():
            levels = np.flatnonzero(wanted[image])
            shares.append(finer[image, levels[0] : levels[-1] + 1])
            images.append(image)
            firsts.append(int(levels[0]))
            lengths.append(len(shares[-1]))
        counts.append(len(met))
    return Need(
        start=np.cumsum(counts),
        image=np.array(images, dtype=np.int32),
        first=np.array(firsts, dtype=np.int32),
        share_start=np.cumsum(lengths),
        share=np.concatenate(shares),
    )


#: Largest ratio of a screen's width to its height.
ASPECT = 16 / 9
#: Samples along a footprint that is longer than wide, at most.
ANISOTROPY = 16
#: More levels than any image has.
ALL = 64
#: Pieces compared with boxes at a time.
_AT_ONCE = 1 << 16


@dataclass(frozen=True)
class VisitorScreen:
    """The screen of a visitor.

    Attributes
    ----------
    height: pixels.
    field_of_view: from top to bottom, degrees.
    distance: from the eye to the nearest surface, metres, at least.
    """

    height: int
    field_of_view: float
    distance: float

    @property
    def pixel(self) -> float:
        """Lower bound of the size of a pixel at a distance of 1, anywhere in the picture."""
        half = np.tan(np.radians(self.field_of_view) / 2)
        corner = 1 + half**2 * (1 + ASPECT**2)  # 1 / cos²φ
        return float(2 * half / self.height / corner)


def unresolved_levels(
    scene: Scene, cells: Cells, pvs: Pvs, sizes: Sequence[tuple[int, int]], screen: VisitorScreen
) -> Ints:
    """(I,) the number of finest levels of each image that no eye resolves; `ALL` if no eye sees it.
    Normal maps keep their levels.

    Parameters
    ----------
    sizes: (width, height) of each of the scene's images, texels.
    """
    image = np.array([m.image for m in scene.materials], dtype=np.int64)
    piece, owner = cells.emitted(scene.two_sided)
    shown = image[scene.triangle_material[cells.triangle_source[piece]]]
    painted = shown >= 0
    piece, owner, shown = piece[painted], owner[painted], shown[painted]
    texels = _texels(scene, np.array(sizes, dtype=np.float64).reshape(-1, 2))
    distance = np.maximum(_distances(cells, pvs, piece, owner), screen.distance)
    footprint = screen.pixel * distance * texels[cells.triangle_source[piece]]
    least = np.full(len(sizes), np.inf)
    np.minimum.at(least, shown, footprint)
    least[[m.normal.image for m in scene.materials if m.normal]] = 1.0
    # The exponent of a number from 1 up is its logarithm rounded down, plus 1.
    levels = np.frexp(np.where(np.isfinite(least), least, 0.0))[1].astype(np.int64) - 1
    return np.where(np.isfinite(least), np.clip(levels, 0, ALL), ALL)


def _texels(scene: Scene, sizes: Floats) -> Floats:
    """(T,) texels for a metre of each triangle, in any direction; 0 where the texture is stretched
    without limit, inf where the triangle is degenerate."""
    image = np.array([m.image for m in scene.materials], dtype=np.int64)[scene.triangle_material]
    size = np.ones((len(image), 2))
    size[image >= 0] = sizes[image[image >= 0]]
    gradient = gradients(scene.corners, scene.uv) * size[..., None]
    # Sum and root of the product of the squares of the singular values.
    total = (gradient**2).sum(axis=(1, 2))
    product = np.linalg.norm(cross(gradient[:, 0], gradient[:, 1]), axis=1)
    longest = np.sqrt((total + np.sqrt(np.maximum(total**2 - 4 * product**2, 0.0))) / 2)
    shortest = np.divide(product, longest, out=np.zeros_like(longest), where=longest > 0)
    counted = np.maximum(shortest / 2, longest / (ANISOTROPY * np.sqrt(2)))
    flat = ~normals(scene.corners).any(axis=1)
    return np.asarray(np.where(flat, np.inf, counted))


def _distances(cells: Cells, pvs: Pvs, piece: Ints, owner: NDArray[np.int32]) -> Floats:
    """(n,) lower bounds of the distance, metres, from pieces to the nearest eye that may see them;
    inf without such an eye. ``owner`` (n,) ascends."""
    corners = cells.vertex[cells.triangle[piece]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    bottom, top, start = _eye_boxes(cells)
    everyone = np.arange(cells.cell_count, dtype=np.int32)
    nearest = np.full(len(piece), np.inf)
    first = np.searchsorted(owner, np.arange(cells.cell_count + 1))
    for cell in np.unique(owner).tolist():
        viewers = pvs.row(cell) if pvs.conservative else everyone
        box = ranges(start[viewers], start[viewers + 1] - start[viewers])
        step = max(1, _AT_ONCE // max(len(box), 1))
        for begin in range(first[cell], first[cell + 1], step):
            some = slice(begin, min(begin + step, first[cell + 1]))
            gap = np.maximum(bottom[box] - high[some, None], low[some, None] - top[box])
            square = (np.maximum(gap, 0.0) ** 2).sum(axis=2)
            nearest[some] = square.min(axis=1, initial=np.inf)
    return np.asarray(np.sqrt(nearest))


def _eye_boxes(cells: Cells) -> tuple[Floats, Floats, Ints]:
    """(b, 3) and (b, 3) corners of boxes that hold all places where eyes can be, and (C + 1,) CSR
    of those in each cell."""
    eyes, leaf = cells.eyes, np.flatnonzero(cells.leaf_standing & (cells.leaf_cell >= 0))
    leaf = leaf[np.argsort(cells.leaf_cell[leaf], kind="stable")]
    boxes = np.empty((2, len(leaf), 3))
    for i, points in enumerate(map(cells.leaf_points, leaf.tolist())):
        boxes[:, i] = eyes.clip(points.min(axis=0), points.max(axis=0))
    start = np.searchsorted(cells.leaf_cell[leaf], np.arange(cells.cell_count + 1))
    return boxes[0], boxes[1], start
