"""Fewer faces for the same surface: edges collapse, the one that changes it least first."""

from __future__ import annotations

import numpy as np

from ptmtools.progress import Progress, silent
from ptmtools.simplification.collapse_kernels import collapse_edges, fill
from ptmtools.simplification.heap_kernels import Heap
from ptmtools.simplification.legality_kernels import CAREFUL, CARELESS
from ptmtools.simplification.model import Mesh, Simplified, SimplifyOptions
from ptmtools.simplification.quadrics import attributes, vertex_quadrics, wedge_quadrics
from ptmtools.simplification.state_kernels import (
    ENTRIES,
    FACES,
    MADE,
    MOST_AT_EDGE,
    State,
    link_corners,
)
from ptmtools.simplification.surface import Surface, check, surface_of

#: Progress is told after so many parts of the work.
PARTS = 50

DEFAULTS = SimplifyOptions()


def simplify(
    mesh: Mesh, options: SimplifyOptions = DEFAULTS, progress: Progress = silent
) -> Simplified:
    """A mesh with at most ``options.faces`` faces, where seams and borders allow it.

    A mesh that has no more is returned as it is. Raises ValueError for arrays that do not fit each
    other, and for numbers that are not finite.
    """
    check(mesh)
    count = len(mesh.triangles)
    if count <= options.faces:
        return Simplified(mesh, np.arange(count, dtype=np.int32), 0.0)
    surface = surface_of(mesh)
    state = _state(mesh, surface)
    _collapse(state, options.faces, progress)
    return _result(mesh, surface, state, options)


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
        number=np.array([len(surface.triangle), 0, 0, 0]),
        place=np.empty(3),
        shared=np.empty((MOST_AT_EDGE, 6), np.int32),
        shown=np.empty(2),
        limits=np.array(CAREFUL),
        worst=np.zeros(1),
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
    notes: tuple[str, ...] = ()
    if len(source) > options.faces:
        notes = (
            f"{len(source):,} faces are left, not {options.faces:,}: borders, seams and parts that "
            "cannot be fewer do not allow it",
        )
    return Simplified(left, source, float(np.sqrt(state.worst[0])) * surface.scale, notes)
