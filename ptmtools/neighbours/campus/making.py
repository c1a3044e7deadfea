"""The meshes, lightmaps and viewpoint of one object of a campus; a task of an executor.

The finest mesh is the model's own; each coarser one has a share of the faces of the next finer, but
no fewer than a floor, and no error beyond a bound. All are simplified from the model's own, so that
errors do not add up. (Also leaving out plane parts narrower than 1.5 times the error gives the
sample campus 203,405 coarse faces instead of 471,454, but along its walk the picture is off by 3.57
instead of 2.75 with the preset Medium and no lightmaps: bars and sills make a facade.)
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.neighbours.campus.atlas import unwrap
from ptmtools.neighbours.campus.lightmap import bake, vertex_light
from ptmtools.neighbours.campus.lights import Painted, Rays, open_sides
from ptmtools.neighbours.campus.meshes import Corners, mesh_bytes
from ptmtools.neighbours.campus.model import (
    LIGHT_SIZES,
    CampusMaterial,
    CampusObject,
    MeshFile,
    mesh_file,
)
from ptmtools.neighbours.campus.objects import Part
from ptmtools.neighbours.campus.occlusion import Surroundings, normals
from ptmtools.neighbours.campus.options import CampusOptions
from ptmtools.neighbours.campus.second_set import ModelLight
from ptmtools.neighbours.campus.textures import Written, light_files
from ptmtools.neighbours.campus.viewpoints import viewpoint
from ptmtools.scene.colors import encoded, to_linear
from ptmtools.simplification import Mesh, SimplifyOptions, simplify


@dataclass(frozen=True)
class Level:
    """A mesh of an object.

    Attributes
    ----------
    corner: (T, 3, 3) metres.
    material: (T,) indices.
    uv: (T, 3, 2).
    color: (T, 3, 3) uint8 sRGB, or None.
    source: (T,) the face of the finest mesh that each came from.
    error: metres, see `Simplified`.
    """

    corner: Floats
    material: NDArray[np.int32]
    uv: Floats
    color: NDArray[np.uint8] | None
    source: NDArray[np.int32]
    error: float


def level_faces(faces: int, lods: int, ratio: float, least: int) -> list[int]:
    """How many faces each mesh of an object of so many ``faces`` may have, the coarsest first."""
    wanted = [faces * ratio ** (lods - 1 - lod) for lod in range(lods)]
    return [min(faces, max(least, round(some))) for some in wanted]


def levels(mesh: Mesh, lods: int, ratio: float, least: int, error: float) -> list[Level]:
    """The meshes of an object, from the coarsest to the finest; ``error`` is a share of the
    diagonal of its box."""
    bound = error * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    whole = len(mesh.triangles)
    result = []
    for faces in level_faces(whole, lods, ratio, least):
        if faces == whole:
            result.append(_level(mesh, np.arange(whole, dtype=np.int32), 0.0))
            continue
        less = simplify(mesh, SimplifyOptions(faces=faces, error=bound, keep_parts=True))
        result.append(_level(less.mesh, less.source, less.error))
    return result


def _level(mesh: Mesh, source: NDArray[np.int32], error: float) -> Level:
    material, uv = mesh.material, mesh.uv
    assert material is not None
    assert uv is not None
    return Level(mesh.points[mesh.triangles], material, uv, mesh.colors, source, error)


#: A coarse face may lie so many times the error of its mesh, which is a mean, beneath the surface.
_BENEATH = 2.0


@dataclass(frozen=True)
class Work:
    """What all objects have in common.

    Attributes
    ----------
    points, triangles, uv, colors, two_sided: as of the scene.
    material: (T,) indices into `materials`.
    around: what takes light.
    painted: the model's own lightmaps, if those are asked for.
    """

    points: Floats
    triangles: NDArray[np.int32]
    uv: Floats
    colors: NDArray[np.uint8] | None
    two_sided: Bools
    material: NDArray[np.int32]
    materials: tuple[CampusMaterial, ...]
    around: Surroundings
    options: CampusOptions
    painted: ModelLight | None = None


@dataclass(frozen=True)
class ObjectMade:
    """An object's record and its files; `notes` on it; how many texels of its lightmaps are read on
    faces, and how many were computed."""

    record: CampusObject
    meshes: tuple[tuple[str, bytes], ...]
    lightmaps: tuple[Written, ...]
    notes: tuple[str, ...] = ()
    covered: int = 0
    computed: int = 0


def make_object(work: Work, task: tuple[str, Part]) -> ObjectMade:
    """An object by its name in files.

    Raises what `unwrap` raises.
    """
    name, part = task
    options, faces = work.options, part.triangles
    used, index = np.unique(work.triangles[faces], return_inverse=True)
    mesh = Mesh(
        work.points[used],
        index.reshape(-1, 3).astype(np.int32),
        work.material[faces],
        work.uv[faces],
        None if work.colors is None else work.colors[faces],
    )
    lods = levels(mesh, options.lods, options.ratio, options.faces, options.error)
    finest = lods[-1]
    lit, side = options.lightmaps != "none", np.ones(len(faces))
    place, lightmaps, notes = None, [], []
    covered = computed = 0
    if lit:
        atlas = unwrap(mesh.points, mesh.triangles)
        place = atlas.uv
        side = _sides(work, faces, finest)
        look = _look(work, faces, finest, finest, side)
        maps = bake(look, finest.corner, atlas, look.grain)
        source = _light_source(work, faces)
        texels = [(len(m.value), encoded(m.value.astype(np.float64)), source) for m in maps]
        lightmaps = light_files(name, texels, options.quality)
        covered, computed = sum(m.covered for m in maps), sum(m.computed for m in maps)
        if atlas.side != LIGHT_SIZES[0]:
            least = (
                "any lightmap" if atlas.side is None else f"a lightmap of less than {atlas.side}"
            )
            notes.append(
                f"{part.label}: too many charts for {least}; neighbours run into each other"
            )
    files, records = [], []
    for lod, level in enumerate(lods):
        fine = level is finest
        color = None if level.color is None else to_linear(level.color / 255)
        if lit and not fine:
            look = _look(work, faces, finest, level, side)
            held = vertex_light(look, level.corner, normals(level.corner))[..., None]
            color = held * (np.ones(3) if color is None else color)
        corners = Corners(level.corner, level.material, level.uv, place if fine else None, color)
        data, file = mesh_bytes(corners, work.materials), mesh_file(name, lod)
        files.append((file, data))
        record = MeshFile(file, len(level.corner), len(data), zlib.crc32(data), _short(level.error))
        records.append(record)
    box = _box(lods)
    return ObjectMade(
        CampusObject(
            name=name,
            label=part.label,
            parts=part.parts,
            box=tuple(box.tolist()),
            barycentre=_barycentre(finest.corner, box),
            viewpoint=viewpoint(work.around, finest.corner, box),
            materials=tuple(np.unique(work.material[faces]).tolist()),
            lightmap=name if lit else None,
            meshes=tuple(records),
        ),
        tuple(files),
        tuple(lightmaps),
        tuple(notes),
        covered,
        computed,
    )


def _sides(work: Work, faces: Ints, finest: Level) -> Floats:
    """(T,) as of `open_sides`; a painted face has its light on both."""
    if work.painted is not None:
        return np.ones(len(faces))
    return open_sides(work.around, finest.corner, work.two_sided[faces], work.options.reach)


def _look(work: Work, faces: Ints, finest: Level, level: Level, side: Floats) -> Rays | Painted:
    """The light on the faces of a level, of which (T,) of the finest say the sides."""
    if work.painted is not None:
        painted = work.painted
        return Painted(
            finest.corner, painted.uv[faces], painted.image[faces], painted.images, level.source
        )
    return Rays.of(
        work.around,
        level.corner,
        work.options.samples,
        work.options.reach,
        _BENEATH * level.error,
        side[level.source],
    )


def _light_source(work: Work, faces: Ints) -> tuple[int, int]:
    """The size of what the lightmap is made of: the largest image, or rays as many as texels."""
    if work.painted is None:
        return LIGHT_SIZES[-1], LIGHT_SIZES[-1]
    used = {i for i in np.unique(work.painted.image[faces]).tolist() if i >= 0}
    sizes = [work.painted.images[i].texels.shape for i in used] or [(1, 1)]
    height, width = max(sizes, key=max)
    return width, height


def _box(lods: list[Level]) -> Floats:
    """(6,) of the positions of all meshes as their files have them."""
    held = [level.corner.astype(np.float32).reshape(-1, 3) for level in lods]
    low, high = (np.array([f(p, axis=0) for p in held]) for f in (np.min, np.max))
    return np.concatenate([low.min(axis=0), high.max(axis=0)]).astype(np.float64)


def _barycentre(corner: Floats, box: Floats) -> tuple[float, float, float]:
    """The centre of a surface; within its box, whatever rounding did."""
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(across, axis=1)
    weight = area if area.sum() > 0 else np.ones(len(area))
    x, y, z = np.clip(
        np.average(corner.mean(axis=1), axis=0, weights=weight), box[:3], box[3:]
    ).tolist()
    return x, y, z


def _short(error: float) -> float:
    """Six digits: what follows is noise."""
    return float(f"{error:.6g}")
