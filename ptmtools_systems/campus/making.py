"""The meshes, lightmaps and viewpoint of one object of a campus; a task of an executor.

The finest mesh is the model's own; each coarser one has a share of the faces of the next finer, but
no fewer than a floor, and no error beyond a bound. All are simplified from the model's own, so that
errors do not add up. (Also leaving out plane parts narrower than 1.5 times the error gives the
sample campus 203,405 coarse faces instead of 471,454, but along its walk the picture is off by 3.57
instead of 2.75 with the preset Medium and no lightmaps: bars and sills make a facade.)
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.light.atlas import unwrap
from ptmtools.light.lightmap import vertex_light
from ptmtools.light.looks import PaintedLight
from ptmtools.light.occlusion import Occluders, normals
from ptmtools.scene.colors import encode_srgb, to_linear
from ptmtools.simplification import Mesh, Simplified, SimplifyOptions, simplify
from ptmtools_systems.campus.lightmaps import bake
from ptmtools_systems.campus.meshes import Corners, mesh_bytes
from ptmtools_systems.campus.model import (
    LIGHT_SIZES,
    CampusMaterial,
    CampusObject,
    MeshFile,
    mesh_file,
)
from ptmtools_systems.campus.objects import ObjectPart
from ptmtools_systems.campus.obscurance import RayLight, open_sides
from ptmtools_systems.campus.options import CampusOptions
from ptmtools_systems.campus.second_set import ModelLight
from ptmtools_systems.campus.textures import Written, light_files
from ptmtools_systems.campus.viewpoints import viewpoint


def level_faces(faces: int, lods: int, ratio: float, least: int) -> list[int]:
    """The largest numbers of faces of the meshes of an object of ``faces``, the coarsest first."""
    wanted = [faces * ratio ** (lods - 1 - lod) for lod in range(lods)]
    return [min(faces, max(least, round(some))) for some in wanted]


def levels(mesh: Mesh, lods: int, ratio: float, least: int, error: float) -> list[Simplified]:
    """The meshes of an object, from the coarsest to the finest; ``error`` is a share of the
    diagonal of its box."""
    bound = error * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    whole = len(mesh.triangles)
    return [
        simplify(mesh, SimplifyOptions(faces=faces, error=bound, keep_parts=True))
        if faces < whole
        else Simplified(mesh, np.arange(whole, dtype=np.int32), 0.0)
        for faces in level_faces(whole, lods, ratio, least)
    ]


#: Largest depth of a coarse face beneath the surface, in errors of its mesh, which are means.
_BENEATH = 2.0


@dataclass(frozen=True)
class ObjectSource:
    """Data shared by all objects.

    Attributes
    ----------
    points, triangles, uv, colors, two_sided: as of the scene.
    material: (T,) indices into `materials`.
    around: the occluding surfaces.
    painted: the model's own lightmaps, if the options ask for them.
    """

    points: Floats
    triangles: NDArray[np.int32]
    uv: Floats
    colors: NDArray[np.uint8] | None
    two_sided: Bools
    material: NDArray[np.int32]
    materials: tuple[CampusMaterial, ...]
    around: Occluders
    options: CampusOptions
    painted: ModelLight | None = None


@dataclass(frozen=True)
class ObjectMade:
    """An object's record, files and notes, and the numbers of texels of its lightmaps that are read
    on faces, and computed."""

    record: CampusObject
    meshes: tuple[tuple[str, bytes], ...]
    lightmaps: tuple[Written, ...]
    notes: tuple[str, ...] = ()
    covered: int = 0
    computed: int = 0


def make_object(work: ObjectSource, task: tuple[str, ObjectPart]) -> ObjectMade:
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
    corner = [level.mesh.points[level.mesh.triangles] for level in lods]
    finest = corner[-1]
    light = None
    if options.lightmaps != "none":
        light = _bake_light(work, name, part, mesh, lods[-1])
    files, records = _mesh_files(work, name, faces, lods, light)
    box = _box(corner)
    return ObjectMade(
        CampusObject(
            name=name,
            label=part.label,
            parts=part.parts,
            box=tuple(box.tolist()),
            barycentre=_barycentre(finest, box),
            viewpoint=viewpoint(work.around, finest, box),
            materials=tuple(np.unique(work.material[faces]).tolist()),
            lightmap=name if light else None,
            meshes=tuple(records),
        ),
        tuple(files),
        light.lightmaps if light else (),
        light.notes if light else (),
        light.covered if light else 0,
        light.computed if light else 0,
    )


class _BakedLight(NamedTuple):
    """The light of an object: (T, 3, 2) coordinates in its lightmaps, (T,) lit sides of its faces,
    and the fields of `ObjectMade`."""

    uv: Floats
    side: Floats
    lightmaps: tuple[Written, ...]
    notes: tuple[str, ...]
    covered: int
    computed: int


def _bake_light(
    work: ObjectSource, name: str, part: ObjectPart, mesh: Mesh, level: Simplified
) -> _BakedLight:
    """Bakes the lightmaps of an object; ``level`` is its finest one."""
    faces, finest = part.triangles, level.mesh.points[level.mesh.triangles]
    side = np.ones(len(faces))
    atlas = unwrap(mesh.points, mesh.triangles, LIGHT_SIZES)
    if work.painted is None:  # a painted face has its light on both sides
        side = open_sides(work.around, finest, work.two_sided[faces], work.options.reach)
    look = _look(work, faces, finest, level, side)
    maps = bake(look, finest, atlas, look.grain, LIGHT_SIZES)
    source = _light_source(work, faces)
    texels = [(len(m.value), encode_srgb(m.value.astype(np.float64)), source) for m in maps]
    lightmaps = light_files(name, texels, work.options.quality)
    notes = []
    if atlas.side != LIGHT_SIZES[0]:
        least = "any lightmap" if atlas.side is None else f"a lightmap of less than {atlas.side}"
        notes.append(f"{part.label}: too many charts for {least}; neighbours run into each other")
    covered, computed = sum(m.covered for m in maps), sum(m.computed for m in maps)
    return _BakedLight(atlas.uv, side, tuple(lightmaps), tuple(notes), covered, computed)


def _mesh_files(
    work: ObjectSource,
    name: str,
    faces: Ints,
    lods: Sequence[Simplified],
    light: _BakedLight | None,
) -> tuple[list[tuple[str, bytes]], list[MeshFile]]:
    """The files of the levels, and their records; the finest level has the lightmaps, others have
    light at their vertices."""
    files, records = [], []
    finest = lods[-1].mesh.points[lods[-1].mesh.triangles]
    for lod, level in enumerate(lods):
        points = level.mesh.points[level.mesh.triangles]
        material, uv, colors = level.mesh.material, level.mesh.uv, level.mesh.colors
        assert material is not None
        assert uv is not None
        fine = lod == len(lods) - 1
        color = None if colors is None else to_linear(colors / 255)
        if light and not fine:
            look = _look(work, faces, finest, level, light.side)
            brightness = np.minimum(vertex_light(look, points, normals(points)), 1)
            color = brightness * (np.ones(3) if color is None else color)
        corners = Corners(points, material, uv, light.uv if light and fine else None, color)
        data, file = mesh_bytes(corners, work.materials), mesh_file(name, lod)
        files.append((file, data))
        record = MeshFile(file, len(points), len(data), zlib.crc32(data), _short(level.error))
        records.append(record)
    return files, records


def _look(
    work: ObjectSource, faces: Ints, finest: Floats, level: Simplified, side: Floats
) -> RayLight | PaintedLight:
    """The light on the faces of a level; ``finest``: (T, 3, 3) those of the finest one, ``side``:
    (T,) their lit sides."""
    if (painted := work.painted) is not None:
        image = painted.image[faces]
        return PaintedLight(finest, painted.uv[faces], image, painted.images, level.source)
    return RayLight(
        work.around,
        level.mesh.points[level.mesh.triangles],
        work.options.samples,
        work.options.reach,
        _BENEATH * level.error,
        side[level.source],
    )


def _light_source(work: ObjectSource, faces: Ints) -> tuple[int, int]:
    """The size of the lightmap's source: the largest image, or one ray a texel."""
    if work.painted is None:
        return LIGHT_SIZES[-1], LIGHT_SIZES[-1]
    used = {i for i in np.unique(work.painted.image[faces]).tolist() if i >= 0}
    sizes = [work.painted.images[i].texels.shape for i in used] or [(1, 1)]
    height, width = max(sizes, key=max)
    return width, height


def _box(corners: list[Floats]) -> Floats:
    """(6,) the box around the float32 positions of all meshes."""
    points = np.concatenate([corner.reshape(-1, 3) for corner in corners]).astype(np.float32)
    return np.concatenate([points.min(axis=0), points.max(axis=0)]).astype(np.float64)


def _barycentre(corner: Floats, box: Floats) -> tuple[float, float, float]:
    """The centre of a surface, within its box in spite of rounding."""
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
