"""Makes a simplified mesh and the octree of its normals from a model of many triangles.

The steps of paper 2, §3.1: the mesh is scaled into a cube and simplified; the simplified mesh is
sampled, and rays find the source point of each sample; the octree is divided until the normals in a
leaf are similar.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.executor import Executor
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene, Space
from ptmtools.simplification import Mesh, SimplifyOptions, simplify
from ptmtools_systems.apo.blocks import BlockSource, Surface, build
from ptmtools_systems.apo.model import ApoOptions, Octree
from ptmtools_systems.apo.normals import corner_normals
from ptmtools_systems.apo.octree import Bounds, cube_around, octree_of
from ptmtools_systems.apo.sampling import Paint, Source, paint_of, spacing_for

#: Longest edge of a sampled triangle, as a share of the cube: two cells of the blocks, so that a
#: triangle lies in few blocks.
_LONGEST = 0.125
_TWICE = "faces that lie in the same place count once: a place has one normal"


@dataclass(frozen=True)
class Simple:
    """A simplified mesh.

    Attributes
    ----------
    points: (V, 3) float64, in the units of the source. triangles: (T, 3) int32.
    normals: (V, 3) float32 unit normals, smooth everywhere.
    """

    points: Floats
    triangles: NDArray[np.int32]
    normals: Singles


@dataclass(frozen=True)
class ApoTexture:
    """The simplified mesh and octree of `make_apo`.

    Attributes
    ----------
    mesh, octree: see their classes.
    source: number of triangles of the source.
    deviation: estimate by the quadrics of the distance of the simplified mesh from the source, in
        its units.
    missed: share of samples whose rays do not hit the source.
    options: options of `make_apo`.
    space: transformation of the model's coordinates to those of the mesh.
    notes: messages, one line each.
    """

    mesh: Simple
    octree: Octree
    source: int
    deviation: float
    missed: float
    options: ApoOptions
    space: Space
    notes: tuple[str, ...] = ()


def make_apo(
    scene: Scene, options: ApoOptions, executor: Executor, progress: Progress = silent
) -> ApoTexture:
    """The simplified mesh and the octree texture of all triangles of a scene.

    Raises
    ------
    LimitError: PTM-L400 the octree has too many texels.
    MissingComponentError: PTM-M100 ``method`` needs pymeshlab, which cannot be loaded.
    """
    points, triangles = weld(scene.points, scene.triangles)
    triangles, kept = distinct(triangles)
    simplified = simplify(
        Mesh(points, triangles), SimplifyOptions(options.faces, method=options.method), progress
    )
    mesh = smooth(simplified.mesh.points, simplified.mesh.triangles)
    paint = paint_of(scene, kept) if options.color else None
    octree, missed = octree_around(mesh, points, triangles, options, paint, executor, progress)
    return ApoTexture(
        mesh,
        octree,
        len(triangles),
        simplified.error,
        missed,
        options,
        scene.space,
        (*simplified.notes, *([_TWICE] if len(kept) < len(scene.triangles) else [])),
    )


def octree_around(
    mesh: Simple,
    points: Floats,
    triangles: NDArray[np.int32],
    options: ApoOptions,
    paint: Paint | None,
    executor: Executor,
    progress: Progress = silent,
) -> tuple[Octree, float]:
    """The octree of the normals of (T, 3) triangles between distinct (P, 3) points, around their
    simplified ``mesh``; and the share of its samples whose rays do not hit them.

    Raises LimitError PTM-L400: it has too many texels.
    """
    cube = cube_around(np.concatenate([points, mesh.points]))
    source = Source(
        cube.coordinates(points).astype(np.float32),
        triangles,
        corner_normals(points, triangles).astype(np.float32),
        paint,
    )
    corner = cube.coordinates(mesh.points)[mesh.triangles]
    surface = Surface(corner, mesh.normals[mesh.triangles].astype(np.float64)).cut_up(_LONGEST)
    work = BlockSource(
        source,
        surface,
        # Samples closer than half a leaf of the greatest depth add nothing.
        max(
            spacing_for(surface.corner, options.density * len(triangles)),
            0.5 ** (options.depth + 1),
        ),
        Bounds(options.error, options.color_error, options.depth),
    )
    levels, missed = build(work, executor, progress)
    return octree_of(levels, cube), missed


def distinct(triangles: NDArray[np.int32]) -> tuple[NDArray[np.int32], Ints]:
    """Triangles without repeated sets of corners, and their numbers: of a two-sided face one is
    kept, since a place has one normal."""
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    kept = np.sort(first)
    return triangles[kept], kept


def smooth(points: Floats, triangles: NDArray[np.int32]) -> Simple:
    """A mesh with smooth normals, also at creases: diverging rays there would miss a part of the
    source."""
    corner = corner_normals(points, triangles, 180.0)
    normals = np.zeros((len(points), 3), np.float32)
    normals[triangles.ravel()] = corner.reshape(-1, 3)  # equal at all corners of a point
    return Simple(points, triangles, normals)


def weld(points: Floats, triangles: NDArray[np.int32]) -> tuple[Floats, NDArray[np.int32]]:
    """The same triangles over distinct points."""
    rows = np.ascontiguousarray(points + 0.0).view([("", np.float64)] * 3).ravel()
    _, first, number = np.unique(rows, return_index=True, return_inverse=True)
    return points[first], number.reshape(-1)[triangles].astype(np.int32)


def warm_up() -> None:
    """Calls the compiled kernels that making and drawing octree textures need."""
    from pathlib import Path
    from tempfile import TemporaryDirectory

    from ptmtools.pipeline.warm_up import write_building
    from ptmtools.scene import IngestOptions, ingest
    from ptmtools_systems.apo.traversal import look_up

    with TemporaryDirectory() as folder:
        scene = ingest(write_building(Path(folder)), IngestOptions())
        replaced = make_apo(scene, ApoOptions(faces=len(scene.triangles) // 4, depth=3), Executor())
    look_up(replaced.octree, np.full((1, 3), 0.5))
