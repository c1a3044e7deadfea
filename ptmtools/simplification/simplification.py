"""Simplifies a surface by edge collapses, in ascending order of their error.

After Garland & Heckbert, "Surface simplification using quadric error metrics", 1997, with the
attributes of Hoppe, "New quadric metric for simplifying meshes with appearance attributes", 1999.

Tried (`benchmarks/simplification.py`; other simplifiers: docs/design/simplification.md):

- A stronger pull to the middle of an edge (`collapse_kernels.PULL`): a thousand times leaves 1.13
  times the mean distance (100,000 faces); none leaves flat parts without a best place.
- Refusing thin faces outright: on flat walls collapses that cost nothing were refused, and dear
  ones made instead. Now a thin face is refused where its normal turns, and only at first.
- Penalties in place of a line's freedom (seams as steep quadrics, as for borders in 1997): texture
  coordinates are then no longer exact.

pymeshlab, the tool of the paper on octree textures, serves for comparison and on request. It is
GPL-3 and needs libGL: it is imported in one function, and only here. It knows plain meshes only,
and neither a face's source nor an error: the source goes through it as a quality of faces, which
collapses keep.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.lazy import pymeshlab_absence
from ptmtools.progress import Progress, silent
from ptmtools.simplification.collapse_kernels import collapse_edges, fill
from ptmtools.simplification.legality_kernels import CAREFUL, CARELESS
from ptmtools.simplification.model import Mesh, Simplified, SimplifyOptions, too_many
from ptmtools.simplification.quadrics import attributes, vertex_quadrics, wedge_quadrics
from ptmtools.simplification.state_kernels import (
    CLOSE,
    DROP,
    ENTRIES,
    FACES,
    KEEP,
    MADE,
    MOST_AT_EDGE,
    TOPOLOGY,
    Heap,
    State,
    link_corners,
)
from ptmtools.simplification.surface import Surface, check, edges_of, surface_of
from ptmtools.simplification.topology import HELD, PER_HANDLE, filled, parts_of, topology


def by_meshlab(mesh: Mesh, surface: Surface, faces: int) -> Simplified:
    """A plain mesh with about so many faces; its error is not known (NaN).

    Raises InputError PTM-I111 for a mesh with materials, texture coordinates or colours, and
    MissingComponentError PTM-M100 where pymeshlab cannot be used.
    """
    if not mesh.is_plain:
        raise InputError(
            "PTM-I111",
            "pymeshlab simplifies meshes without materials, textures and colours only",
            remedy="choose the method quadric",
        )
    if fault := pymeshlab_absence():
        raise MissingComponentError(
            "PTM-M100",
            f"pymeshlab cannot be used ({fault})",
            remedy="pip install pymeshlab; apt install libopengl0 libgl1; or choose the method "
            "quadric",
        )
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    numbers = np.arange(len(surface.triangle), dtype=np.float64)
    meshes.add_mesh(pymeshlab.Mesh(surface.point, surface.triangle, f_scalar_array=numbers))
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=faces)
    reduced = meshes.current_mesh()
    source = surface.source[np.rint(reduced.face_scalar_array()).astype(np.int64)]
    points = np.asarray(reduced.vertex_matrix(), np.float64) * surface.scale + surface.centre
    triangles = np.ascontiguousarray(reduced.face_matrix(), dtype=np.int32)
    return Simplified(
        Mesh(points, triangles), source, float("nan"), too_many(len(triangles), faces)
    )


#: Progress is told after so many parts of the work.
PARTS = 50

DEFAULTS = SimplifyOptions()


def simplify(
    mesh: Mesh, options: SimplifyOptions = DEFAULTS, progress: Progress = silent
) -> Simplified:
    """A mesh with at most ``options.faces`` faces, where seams and borders allow it.

    A mesh that has no more is returned as it is. Raises ValueError for arrays that do not fit each
    other, and for numbers that are not finite; for the method ``meshlab`` what `by_meshlab` raises.
    """
    check(mesh)
    count = len(mesh.triangles)
    if count <= options.faces:
        return Simplified(mesh, np.arange(count, dtype=np.int32), 0.0)
    surface = surface_of(mesh)
    if options.method == "meshlab":
        return by_meshlab(mesh, surface, options.faces)
    mended = None if options.keep_parts else filled(mesh, surface, options.faces)
    if mended is None:
        return _simplified(mesh, surface, options, progress)
    simplified = _simplified(mended.mesh, surface_of(mended.mesh), options, progress)
    note = f"{mended.holes:,} small holes are filled: they would hold many of the faces"
    source = mended.like[simplified.source].astype(np.int32)
    return replace(simplified, source=source, notes=(note, *simplified.notes))


def _simplified(
    mesh: Mesh, surface: Surface, options: SimplifyOptions, progress: Progress
) -> Simplified:
    counts = topology(surface)
    state = _state(mesh, surface)
    bound = options.error / surface.scale
    state.worst[1] = bound * bound
    held = PER_HANDLE * counts.handles if options.keep_parts else counts.held
    if held > HELD * options.faces:
        state.number[TOPOLOGY] = CLOSE if options.keep_parts else DROP
    _collapse(state, options.faces, progress)
    result = _result(mesh, surface, state, options)
    if state.number[TOPOLOGY] == KEEP:
        return result
    # That of which no face stands for any is gone.
    part = np.empty(len(mesh.triangles), np.int64)
    part[surface.source] = parts_of(
        edges_of(surface.triangle, len(surface.point)), len(surface.source)
    )
    left = len(np.unique(part[result.source]))
    if left == counts.parts:
        return result
    gone = f"{counts.parts - left:,} of {counts.parts:,} parts are gone"
    return replace(result, notes=(f"{gone}: they would hold many of the faces", *result.notes))


def _state(mesh: Mesh, surface: Surface) -> State:
    attribute = attributes(mesh, surface)
    vertices, corners = len(surface.point), surface.triangle.size
    head, tail = np.full(vertices, -1, np.int32), np.full(vertices, -1, np.int32)
    beyond = np.empty(corners, np.int32)
    link_corners(surface.triangle, head, tail, beyond)
    return State(
        point=surface.point,
        triangle=surface.triangle,
        kept=surface.kept,
        wedge=surface.wedge,
        freedom=surface.freedom,
        quadric=vertex_quadrics(surface),
        texture=wedge_quadrics(mesh, surface, attribute),
        attribute=attribute,
        head=head,
        tail=tail,
        beyond=beyond,
        version=np.zeros(vertices, np.int32),
        mark=np.zeros(vertices, np.int64),
        moved=np.zeros(vertices, bool),
        number=np.array([len(surface.triangle), 0, 0, 0, 0, 0]),
        place=np.empty(3),
        shared=np.empty((MOST_AT_EDGE, 6), np.int32),
        shown=np.empty(2),
        limits=np.array(CAREFUL),
        worst=np.zeros(3),
    )


def _collapse(state: State, faces: int, progress: Progress) -> None:
    """Collapses edges until so many faces are left, or nothing more can be done.

    What was refused may be possible after others have gone: the heap is filled again as long as
    that brings something.
    """
    number = state.number
    begin = int(number[FACES])
    total = begin - faces
    heap = Heap.of(state.triangle.size + 64)
    for limits in (CAREFUL, CARELESS):
        state.limits[:] = limits
        made = -1
        while number[FACES] > faces and number[MADE] > made:
            made = int(number[MADE])
            fill(state, heap)
            while number[FACES] > faces and number[ENTRIES] > 0:
                collapse_edges(state, heap, max(faces, int(number[FACES]) - total // PARTS - 1))
                progress(min(begin - int(number[FACES]), total), total, "faces collapsed")


def _result(mesh: Mesh, surface: Surface, state: State, options: SimplifyOptions) -> Simplified:
    alive = np.flatnonzero(state.triangle[:, 0] >= 0)
    source = surface.source[alive]
    used, triangles = np.unique(state.triangle[alive], return_inverse=True)
    points = mesh.points[surface.given[used]].astype(np.float64)
    moved = state.moved[used]
    points[moved] = state.point[used[moved]] * surface.scale + surface.centre
    # The corner that each corner has its attributes from.
    corner = surface.corner[state.wedge[alive]]
    face, side = surface.source[corner // 3], corner % 3
    left = Mesh(
        points,
        triangles.reshape(-1, 3).astype(np.int32),
        None if mesh.material is None else mesh.material[source],
        None if mesh.uv is None else mesh.uv[face, side],
        None if mesh.colors is None else mesh.colors[face, side],
    )
    turned = 0
    if len(source) > options.faces:
        edges = edges_of(triangles.reshape(-1, 3), len(used))
        turned = int((edges.faces == 2).sum()) - len(edges.pairs[0])
    notes = too_many(len(source), options.faces, turned)
    return Simplified(left, source, float(np.sqrt(state.worst[0])) * surface.scale, notes)
