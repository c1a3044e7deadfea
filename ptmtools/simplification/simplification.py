"""Simplifies a surface by edge collapses in ascending order of their error.

After Garland & Heckbert, "Surface simplification using quadric error metrics", 1997, with the
attributes of Hoppe, "New quadric metric for simplifying meshes with appearance attributes", 1999.

Rejected variants (`benchmarks/simplification.py`; other simplifiers:
docs/design/simplification.md):

- A larger weight of the midpoint (`collapse_kernels.MIDPOINT_WEIGHT`): a factor of 1,000 gives 1.13
  times the mean distance (100,000 faces); a weight of zero leaves the optimum of flat regions
  undefined.
- An unconditional test for thin faces: on flat walls it rejects collapses of zero cost in favour of
  expensive ones. The test now rejects a thin face only if its normal turns, and only at first.
- Penalties instead of constraints (seams as steep quadrics, as for boundaries in 1997): texture
  coordinates are then inexact.

pymeshlab, the tool of the paper on octree textures, serves for comparison and on request. It is
GPL-3 and needs libGL, so one function imports it. It supports neither attributes nor source faces
nor errors; source faces pass through it as a quality of faces, which its collapses preserve.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.lazy import pymeshlab_absence
from ptmtools.progress import Progress, silent
from ptmtools.simplification.collapse_kernels import collapse_edges, fill_heap
from ptmtools.simplification.legality_kernels import RELAXED_LIMITS, STRICT_LIMITS
from ptmtools.simplification.model import Mesh, Simplified, SimplifyOptions, missed_target_notes
from ptmtools.simplification.quadrics import attributes, vertex_quadrics, wedge_quadrics
from ptmtools.simplification.state_kernels import (
    CLOSE_HANDLES,
    COLLAPSES,
    DROP_PARTS,
    ENTRIES,
    FACES,
    KEEP_TOPOLOGY,
    MAX_EDGE_FACES,
    TOPOLOGY,
    CollapseState,
    Heap,
    link_corners,
)
from ptmtools.simplification.surface import WeldedSurface, check_mesh, edges_of, surface_of
from ptmtools.simplification.topology import (
    FACES_PER_HANDLE,
    MAX_IRREDUCIBLE_SHARE,
    fill_small_holes,
    parts_of,
    topology,
)


def by_meshlab(mesh: Mesh, surface: WeldedSurface, faces: int) -> Simplified:
    """Simplifies a plain mesh by pymeshlab to about ``faces`` faces; the error is NaN.

    Raises
    ------
    InputError: PTM-I111 the mesh has materials, texture coordinates or colours.
    MissingComponentError: PTM-M100 pymeshlab cannot be used.
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
        Mesh(points, triangles), source, float("nan"), missed_target_notes(len(triangles), faces)
    )


#: Number of progress reports.
PROGRESS_STEPS = 50

DEFAULTS = SimplifyOptions()


def simplify(
    mesh: Mesh, options: SimplifyOptions = DEFAULTS, progress: Progress = silent
) -> Simplified:
    """Simplifies a mesh to at most ``options.faces`` faces, where seams and boundaries allow it.

    A mesh with at most that many faces is returned unchanged.

    Raises
    ------
    ValueError: arrays do not match, or a number is not finite.
    InputError, MissingComponentError: see `by_meshlab`; method ``meshlab`` only.
    """
    check_mesh(mesh)
    count = len(mesh.triangles)
    if count <= options.faces:
        return Simplified(mesh, np.arange(count, dtype=np.int32), 0.0)
    surface = surface_of(mesh)
    if options.method == "meshlab":
        return by_meshlab(mesh, surface, options.faces)
    filled = None if options.keep_parts else fill_small_holes(mesh, surface, options.faces)
    if filled is None:
        return _simplify_surface(mesh, surface, options, progress)
    simplified = _simplify_surface(filled.mesh, surface_of(filled.mesh), options, progress)
    note = f"{filled.holes:,} small holes are filled: they would hold many of the faces"
    source = filled.source[simplified.source].astype(np.int32)
    return replace(simplified, source=source, notes=(note, *simplified.notes))


def _simplify_surface(
    mesh: Mesh, surface: WeldedSurface, options: SimplifyOptions, progress: Progress
) -> Simplified:
    before = topology(surface)
    state = _initial_state(mesh, surface)
    max_error = options.error / surface.scale
    state.errors[1] = max_error * max_error
    irreducible = (
        FACES_PER_HANDLE * before.handles if options.keep_parts else before.irreducible_faces
    )
    if irreducible > MAX_IRREDUCIBLE_SHARE * options.faces:
        state.counters[TOPOLOGY] = CLOSE_HANDLES if options.keep_parts else DROP_PARTS
    _collapse_all(state, options.faces, progress)
    result = _result(mesh, surface, state, options)
    if state.counters[TOPOLOGY] == KEEP_TOPOLOGY:
        return result
    # A part is gone if it is the source of no face.
    part = np.empty(len(mesh.triangles), np.int64)
    part[surface.source] = parts_of(
        edges_of(surface.triangle, len(surface.point)), len(surface.source)
    )
    parts = len(np.unique(part[result.source]))
    if parts == before.parts:
        return result
    gone = f"{before.parts - parts:,} of {before.parts:,} parts are gone"
    return replace(result, notes=(f"{gone}: they would hold many of the faces", *result.notes))


def _initial_state(mesh: Mesh, surface: WeldedSurface) -> CollapseState:
    attribute = attributes(mesh, surface)
    vertices, corners = len(surface.point), surface.triangle.size
    head, tail = np.full(vertices, -1, np.int32), np.full(vertices, -1, np.int32)
    next_corner = np.empty(corners, np.int32)
    link_corners(surface.triangle, head, tail, next_corner)
    return CollapseState(
        point=surface.point,
        triangle=surface.triangle,
        constraint=surface.constraint,
        wedge=surface.wedge,
        freedom=surface.freedom,
        quadric=vertex_quadrics(surface),
        wedge_quadric=wedge_quadrics(mesh, surface, attribute),
        attribute=attribute,
        head=head,
        tail=tail,
        next_corner=next_corner,
        version=np.zeros(vertices, np.int32),
        mark=np.zeros(vertices, np.int64),
        moved=np.zeros(vertices, bool),
        counters=np.array([len(surface.triangle), 0, 0, 0, 0, 0]),
        optimum=np.empty(3),
        shared=np.empty((MAX_EDGE_FACES, 6), np.int32),
        edge_cost=np.empty(2),
        turn_limits=np.array(STRICT_LIMITS),
        errors=np.zeros(3),
    )


def _collapse_all(state: CollapseState, faces: int, progress: Progress) -> None:
    """Collapses edges until ``faces`` faces are left or no legal collapse remains.

    Collapses that were illegal may become legal after others, so the heap is rebuilt until a pass
    makes no collapse; then the relaxed limits apply.
    """
    counters = state.counters
    begin = int(counters[FACES])
    total = begin - faces
    heap = Heap.empty(state.triangle.size + 64)
    for turn_limits in (STRICT_LIMITS, RELAXED_LIMITS):
        state.turn_limits[:] = turn_limits
        previous = -1
        while counters[FACES] > faces and counters[COLLAPSES] > previous:
            previous = int(counters[COLLAPSES])
            fill_heap(state, heap)
            while counters[FACES] > faces and counters[ENTRIES] > 0:
                collapse_edges(
                    state, heap, max(faces, int(counters[FACES]) - total // PROGRESS_STEPS - 1)
                )
                progress(min(begin - int(counters[FACES]), total), total, "faces collapsed")


def _result(
    mesh: Mesh, surface: WeldedSurface, state: CollapseState, options: SimplifyOptions
) -> Simplified:
    remaining = np.flatnonzero(state.triangle[:, 0] >= 0)
    source = surface.source[remaining]
    used, triangles = np.unique(state.triangle[remaining], return_inverse=True)
    points = mesh.points[surface.source_point[used]].astype(np.float64)
    moved = state.moved[used]
    points[moved] = state.point[used[moved]] * surface.scale + surface.centre
    # Source corner of the attributes of each corner.
    corner = surface.corner[state.wedge[remaining]]
    face, side = surface.source[corner // 3], corner % 3
    simplified = Mesh(
        points,
        triangles.reshape(-1, 3).astype(np.int32),
        None if mesh.material is None else mesh.material[source],
        None if mesh.uv is None else mesh.uv[face, side],
        None if mesh.colors is None else mesh.colors[face, side],
    )
    inconsistent = 0
    if len(source) > options.faces:
        edges = edges_of(triangles.reshape(-1, 3), len(used))
        inconsistent = int((edges.faces == 2).sum()) - len(edges.pairs[0])
    notes = missed_target_notes(len(source), options.faces, inconsistent)
    return Simplified(simplified, source, float(np.sqrt(state.errors[0])) * surface.scale, notes)
