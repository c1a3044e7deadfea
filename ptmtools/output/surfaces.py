"""The surfaces of a database: the triangles of all cells with what they are drawn with.

Pieces in a boundary between two cells are in both. A pixel belongs to the copy of the cell on the
viewer's side (`sides`). That copy is loaded as soon as the viewer's cell is; the other may be
behind a wall.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, normals
from ptmtools.output.gltf import WRAPS
from ptmtools.output.gltf_reader import ReadGlb, ReadMaterial, ReadPrimitive
from ptmtools.output.locating import SLACK, Locator
from ptmtools.scene.colors import to_srgb

#: Alpha below which the page draws nothing.
LEAST_ALPHA = 0.004


@dataclass(frozen=True)
class MappedRelief:
    """The normal maps of triangles.

    Attributes
    ----------
    number: (n,) int32, the normal map of its object in the hints, -1 without.
    uv: (n, 3, 2) float64 coordinates in it, origin at the upper left; 0 without one.
    frame: (n, 7) float32, see `ptmtools.output.object_maps`; 0 without one.
    """

    number: NDArray[np.int32]
    uv: Floats
    frame: Singles


@dataclass(frozen=True)
class Bumps:
    """The normal maps of materials on triangles.

    Attributes
    ----------
    number: (n,) int32, the normal map in the hints, -1 without.
    uv: (n, 3, 2) float64 coordinates in it, origin at the upper left; 0 without one.
    scale: (n,) factor of x and y of its normals.
    clamped: (n, 2) as in `Surfaces`.
    """

    number: NDArray[np.int32]
    uv: Floats
    scale: Floats
    clamped: Bools


@dataclass(frozen=True)
class Gloss:
    """What triangles reflect.

    Attributes
    ----------
    probe: (n,) int32, the probe in the hints' textures, -1 of those that do not reflect.
    metallic, roughness: (n,) of the material, 0 to 1.
    """

    probe: NDArray[np.int32]
    metallic: Floats
    roughness: Floats


@dataclass(frozen=True)
class Surfaces:
    """All triangles that are drawn, in the order of their cells.

    Attributes
    ----------
    corner: (n, 3, 3) float64 world metres. uv: (n, 3, 2) float64, origin at the upper left.
    cell, shape, texture: (n,) int32; the shape counts over all cells, the texture is -1 without.
    color: (n, 3) factor of the texel, encoded as sRGB, 0 to 1; of corners of several colours
        their mean. vertex_colors: (n, 3, 3) the colours of the corners; None if they have none.
    two_sided, glass: (n,) seen from both sides; without texture and not opaque.
    clamped: (n, 2) whether u and v stop at the edge of the texture instead of repeating it.
    seen: (n, 2) of each the one that is seen in its place from where its normal points to, and from
        behind it, see `sides`.
    represented: member of the extras of nodes → (n,) int32, the row of its object in the list of
        the hints, -1 without (`ptmtools.output.representation`).
    lightmap, spot: (n,) int32, the lightmap in the hints' textures, -1 without; (n, 3, 2) float64
        coordinates in it, origin at the upper left. None if there are no lightmaps.
    white: (n,) the light of which the codes of lightmaps, and of those without one the colours of
        corners, are shares; 0 of what is not lit. None if nothing is.
    relief: the normal maps of objects, if there are any. bumps: those of materials.
    gloss: what reflects, if anything does.
    normals: (n, 3, 3) float32 unit normals of the corners, 0 of flat triangles; None if all are.
    opacity: (n,) of the factor, 0 to 1.
    transparent: (n,) whether it, and the alpha of the texture, count. cutoff: (n,) of those
        whose texels of less alpha are not drawn, and all others opaque; 0 of those that blend.
        These three are None of surfaces that are all opaque.
    """

    corner: Floats
    uv: Floats
    cell: NDArray[np.int32]
    shape: NDArray[np.int32]
    texture: NDArray[np.int32]
    color: Floats
    two_sided: Bools
    glass: Bools
    clamped: Bools
    seen: Ints
    represented: Mapping[str, NDArray[np.int32]] = field(default_factory=dict)
    lightmap: NDArray[np.int32] | None = None
    spot: Floats | None = None
    white: Floats | None = None
    relief: MappedRelief | None = None
    bumps: Bumps | None = None
    gloss: Gloss | None = None
    normals: Singles | None = None
    vertex_colors: Floats | None = None
    opacity: Floats | None = None
    transparent: Bools | None = None
    cutoff: Floats | None = None

    @property
    def light(self) -> Surfaces | None:
        """The same surfaces with their lightmaps as textures; None if there are no lightmaps."""
        if self.lightmap is None or self.spot is None:
            return None
        count = len(self.corner)
        return replace(
            self,
            uv=self.spot,
            texture=self.lightmap,
            color=np.ones((count, 3)),
            clamped=np.ones((count, 2), np.bool_),
        )

    @property
    def bump_surfaces(self) -> Surfaces | None:
        """The same surfaces with the normal maps of their materials as textures; None if there are
        no such maps."""
        bumps = self.bumps
        if bumps is None:
            return None
        white = np.ones((len(self.corner), 3))
        return replace(self, uv=bumps.uv, texture=bumps.number, color=white, clamped=bumps.clamped)

    def boxes(self) -> tuple[Floats, Floats]:
        """(s, 3) corners of the boxes of the shapes, metres; infinite of one without triangles."""
        count = int(self.shape.max(initial=-1)) + 1
        low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
        np.minimum.at(low, self.shape, self.corner.min(axis=1))
        np.maximum.at(high, self.shape, self.corner.max(axis=1))
        return low, high


def sides(corner: Floats, cell: NDArray[np.int32], two_sided: Bools, locator: Locator) -> Ints:
    """(n, 2) the triangle visible in place of each triangle from the side of its normal, and from
    the other side: itself, or its copy in the cell on that side.

    Parameters
    ----------
    corner, cell, two_sided: (n, 3, 3) metres, (n,), (n,) of the triangles.
    locator: of the cells.
    """
    visible = np.repeat(np.arange(len(corner))[:, None], 2, axis=1)
    first, second = _pairs(corner, np.flatnonzero(two_sided))
    apart = cell[first] != cell[second]
    first = np.concatenate([first[apart], np.unique(first[apart])])
    second = np.concatenate([second[apart], np.unique(second[apart])])
    normal = normals(corner[first])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    step = SLACK * np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    for side, away in enumerate((step, -step)):
        point = corner[first].mean(axis=1) + away
        outside = np.empty(len(first))
        for c in np.unique(cell[second]).tolist():
            rows = np.flatnonzero(cell[second] == c)
            outside[rows] = locator.distance_outside(c, point[rows])
        # The copy in the cell that the point is deepest in comes last and wins.
        order = np.lexsort((-outside, first))
        order = order[outside[order] < SLACK / 2]
        visible[first[order], side] = second[order]
    return visible


def _pairs(corner: Floats, among: Ints) -> tuple[Ints, Ints]:
    """All pairs of triangles with the same three corners, each both ways, itself left out."""
    x, y, z = np.moveaxis(corner[among], 2, 0)
    turned = np.take_along_axis(corner[among], np.lexsort((z, y, x))[..., None], axis=1)
    _, group = np.unique(turned.reshape(-1, 9), axis=0, return_inverse=True)
    order = np.argsort(group.reshape(-1), kind="stable")
    group = group.reshape(-1)[order]
    ones, others = [among[:0]], [among[:0]]
    step = 1
    while step < len(group) and (same := group[step:] == group[:-step]).any():
        first, second = among[order[:-step][same]], among[order[step:][same]]
        ones += [first, second]
        others += [second, first]
        step += 1
    return np.concatenate(ones), np.concatenate(others)


def stack_rows(rows: list[NDArray[Any]], width: int) -> Floats:
    """(n, 3, width) rows of several arrays, float64."""
    return np.concatenate([np.zeros((0, 3, width)), *rows])


def surfaces_of(geometry: list[ReadGlb], locator: Locator) -> Surfaces:
    """The triangles of all cells; `locator` has their leaves."""
    shapes = [(glb.cell, p) for glb in geometry for p in glb.primitives]
    count = [len(p.triangle) for _, p in shapes]

    def spread(values: list[Any], kind: type[np.generic], *shape: int) -> NDArray[Any]:
        rows = np.array(values, dtype=kind).reshape(len(shapes), *shape)
        return np.repeat(rows, count, axis=0)

    materials = [p.material for _, p in shapes]
    texture = [
        -1 if p.uv is None or p.material.texture is None else p.material.texture for _, p in shapes
    ]
    lightmap = [-1 if m.light is None else m.light for m in materials]
    spot = stack_rows([corners_of(p.light, p.triangle) for _, p in shapes], 2)
    clamp = WRAPS["clamp"]
    corner = stack_rows([p.point.astype(np.float64)[p.triangle] for _, p in shapes], 3)
    cell = spread([cell for cell, _ in shapes], np.int32)
    two_sided = spread([m.two_sided for m in materials], np.bool_)
    factor = spread([m.factor[:3] for m in materials], np.float64, 3)
    vertex_colors = stack_rows([_colors(p) for _, p in shapes], 3)
    return Surfaces(
        corner=corner,
        uv=stack_rows([corners_of(p.uv, p.triangle) for _, p in shapes], 2),
        cell=cell,
        shape=np.repeat(np.arange(len(shapes), dtype=np.int32), count),
        texture=spread(texture, np.int32),
        color=to_srgb(factor) * vertex_colors.mean(axis=1),
        two_sided=two_sided,
        glass=spread(
            [m.blends and t < 0 for m, t in zip(materials, texture, strict=True)], np.bool_
        ),
        clamped=spread([[w == clamp for w in m.wrap] for m in materials], np.bool_, 2),
        seen=sides(corner, cell, two_sided, locator),
        represented={
            member: spread([p.extras.get(member, -1) for _, p in shapes], np.int32)
            for member in {member for _, p in shapes for member in p.extras}
        },
        lightmap=spread(lightmap, np.int32) if max(lightmap, default=-1) >= 0 else None,
        spot=spot if max(lightmap, default=-1) >= 0 else None,
        white=spread([m.white or 0.0 for m in materials], np.float64)
        if any(m.white for m in materials)
        else None,
        relief=_relief([p for _, p in shapes]),
        bumps=bumps_of([p for _, p in shapes], count),
        gloss=_gloss(materials, count),
        normals=_normals([p for _, p in shapes]),
        vertex_colors=None if all(p.color is None for _, p in shapes) else vertex_colors,
        opacity=spread([m.factor[3] for m in materials], np.float64),
        transparent=spread([m.blends for m in materials], np.bool_),
        cutoff=spread(
            [0 if m.cutoff is None else max(m.cutoff, LEAST_ALPHA) for m in materials], np.float64
        ),
    )


def _gloss(materials: list[ReadMaterial], count: list[int]) -> Gloss | None:
    if all(m.probe is None for m in materials):
        return None
    probe = np.array([-1 if m.probe is None else m.probe for m in materials], np.int32)
    finish = np.array([[m.metallic, m.roughness] for m in materials], np.float64)
    return Gloss(np.repeat(probe, count), *np.repeat(finish, count, axis=0).T)


def _normals(shapes: list[ReadPrimitive]) -> Singles | None:
    if all(p.normals is None for p in shapes):
        return None
    return np.concatenate(
        [
            np.zeros((len(p.triangle), 3, 3), np.float32)
            if p.normals is None
            else p.normals[p.triangle]
            for p in shapes
        ]
    )


def _relief(shapes: list[ReadPrimitive]) -> MappedRelief | None:
    if all(p.frame is None for p in shapes):
        return None
    count = sum(len(p.triangle) for p in shapes)
    number, uv = np.full(count, -1, np.int32), np.zeros((count, 3, 2))
    frame = np.zeros((count, 7), np.float32)
    end = 0
    for p in shapes:
        rows = slice(end, end := end + len(p.triangle))
        if p.frame is not None and p.light is not None:
            number[rows], uv[rows] = p.material.normal or 0, p.light[p.triangle]
            frame[rows] = p.frame[p.triangle[:, 0]]  # the corners have the same
    return MappedRelief(number, uv, frame)


def _colors(primitive: ReadPrimitive) -> Floats:
    """(m, 3, 3) of the corners of triangles, as sRGB encodes them."""
    if primitive.color is None:
        return np.ones((len(primitive.triangle), 3, 3))
    return to_srgb(primitive.color)[primitive.triangle]


def bumps_of(shapes: list[ReadPrimitive], count: list[int]) -> Bumps | None:
    """Those of shapes with ``count`` triangles each, except those that blend, which the page shows
    without; None if there are none."""
    drawn = [p.normal is not None and not _blends(p) for p in shapes]
    if not any(drawn):
        return None
    number = [p.material.normal if has else -1 for p, has in zip(shapes, drawn, strict=True)]
    clamped = [[wrap == WRAPS["clamp"] for wrap in p.material.normal_wrap] for p in shapes]
    return Bumps(
        np.repeat(np.array(number, np.int32), count),
        np.concatenate([corners_of(p.normal, p.triangle) for p in shapes]),
        np.repeat([float(p.material.scale) for p in shapes], count),
        np.repeat(np.array(clamped, np.bool_), count, axis=0),
    )


def _blends(shape: ReadPrimitive) -> bool:
    return shape.material.blends and shape.material.cutoff is None


def corners_of(uv: Singles | None, triangle: Ints) -> Floats:
    """(m, 3, 2) coordinates of the corners of triangles; 0 without."""
    return np.zeros((len(triangle), 3, 2)) if uv is None else uv.astype(np.float64)[triangle]
