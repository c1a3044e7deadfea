"""From a scene to convex cells, portals and cut geometry (paper §3).

1. Walls propose planes (`structure`), the planes split the root box into convex leaves (`bsp`),
   what no wall covers between two leaves is a portal (`portals`).
2. A flood through the portals finds what somebody can reach (`reach`). The first root box is wider
   than the model: if the flood never meets it, the model is closed and everything else is dropped.
   If it does, the model is open; the root box is then clipped to the walls and the subdivision done
   again, so that the open space over low walls does not join everything to everything
   (`division`).
3. The geometry is cut to the leaves, and each piece gets its owners (`ownership`); the leaves that
   are reached are put together with it (`assembly`).
4. What cannot be seen from where one can stand (`standing`) is left out (`seen`). Each of the
   other leaves is a cell, or the leaves of a room are (`grouping`).
5. Pieces of the geometry with the same owners are joined again (`joining`).

A world in which nothing is seen is a mistake in the model, and not a result.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ptmtools.arrays import Floats, normals
from ptmtools.cells.diagnostics import (
    of_detail,
    of_doors,
    of_leaves,
    of_no_doors,
    of_triangles,
    of_undecided,
    of_unreached,
)
from ptmtools.cells.division import (
    Building,
    Space,
    assembled,
    bounds,
    divide,
    divide_inside,
    kept_names,
)
from ptmtools.cells.joining import joined
from ptmtools.cells.model import Cells
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.ownership import cut_to_leaves
from ptmtools.cells.planar import count, counting
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.portals import ROOFED, roofed_share
from ptmtools.cells.roles import matches
from ptmtools.cells.rooms import grouped
from ptmtools.cells.sight import seen_from_places
from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError
from ptmtools.parallel import Executor
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.scene.orientation import main_axes
from ptmtools.tolerance import Tolerance


def check_seen(scene: Scene, cells: Cells) -> None:
    """Raises InputError PTM-I304 if from nowhere in the cells a face of the scene is seen."""
    if _something_seen(scene, cells):
        return
    if scene.two_sided.all():
        raise InputError(
            "PTM-I304",
            "no face of the model lies in or around a cell",
            remedy="give a --viewpoint X,Y,Z inside a room",
        )
    raise InputError(
        "PTM-I304",
        "nothing of the model is visible from inside: no face around its cells is turned towards "
        "them or has a back",
        remedy="give --two-sided to draw every face from both sides, or turn the normals",
    )


def _something_seen(scene: Scene, cells: Cells) -> bool:
    """Whether some face is two-sided or faces the box around its cell. In doubt it does: what lies
    in a side of the root box is emitted with the cell there, whichever way it looks."""
    piece, cell = cells.emitted(scene.two_sided)
    if not len(piece) or scene.two_sided[cells.triangle_source[piece]].any():
        return len(piece) > 0
    low, high = np.full((2, cells.cell_count, 3), [[[np.inf]], [[-np.inf]]])
    starts = cells.leaf_point_start[:-1]
    kept = cells.leaf_cell >= 0
    of = cells.leaf_cell[kept]
    np.minimum.at(low, of, np.minimum.reduceat(cells.leaf_point, starts)[kept])
    np.maximum.at(high, of, np.maximum.reduceat(cells.leaf_point, starts)[kept])
    corners = cells.vertex[cells.triangle[piece]]
    facing = normals(corners)
    furthest = np.where(facing > 0, high[cell], low[cell])
    ahead = np.einsum("nk,nk->n", furthest - corners[:, 0], facing)
    return bool((ahead > cells.tolerance.thin * np.linalg.norm(facing, axis=1)).any())


#: How far the first root box stands off the model, as a share of the model's extent.
BOX_MARGIN = 0.01
#: So many triangles take as long to subdivide as two processes to start.
LARGE = 4000


def subdivide(
    scene: Scene,
    options: SubdivideOptions | None = None,
    progress: Progress = silent,
    executor: Executor | None = None,
) -> Cells:
    """Subdivide a scene into convex leaves, and those into cells.

    An ``executor`` subdivides the second root box in the background while the first is subdivided
    here; without one it is done after the first, if the model proves to be open.

    Raises
    ------
    InputError: PTM-I111 if an option is out of range or a viewpoint lies in no leaf, PTM-I302
        if a name pattern matches nothing, PTM-I247 if the scene is a single triangle, PTM-I304 if
        nothing of it would be seen, PTM-I305 if much is left out and must not be.
    """
    options = options or SubdivideOptions()
    _check(scene, options)
    with counting() as undecided:
        cells = _subdivided(scene, options, progress, executor or Executor())
    cells = replace(cells, notes=(*cells.notes, *of_undecided(undecided)))
    check_seen(scene, cells)
    return cells


def _subdivided(
    scene: Scene, options: SubdivideOptions, progress: Progress, executor: Executor
) -> Cells:
    axes = main_axes(scene.corners)
    building = Building.of(scene, options)
    corners, tolerance = building.structure.corners, building.structure.tolerance
    low, high = bounds(scene.corners @ axes.T)
    margin = BOX_MARGIN * tolerance.extent
    wide = Polyhedron.box(low - margin, high + margin)
    wide = replace(wide, points=wide.points @ axes)
    tight = _thickened(*bounds(corners if len(corners) else scene.corners), tolerance)
    notes = of_detail(scene, building.structure.detail)
    clipped = executor.submit(divide_inside, building, tight, long=len(scene.triangles) >= LARGE)
    try:
        space = divide(building, wide, progress)
        if not space.closed:
            roofed = roofed_share(corners, options.wall_area)
            notes.append(_open_note(space, roofed, tight))
            space = replace(clipped.result(), closed=False)
    finally:
        clipped.cancel()
    opened = building.doors.triangles(space.doors)
    if options.doors != "closed":
        notes += of_doors(building.doors.leaves, space.doors, options.doors == "hidden")
        if space.beyond.rooms or space.beyond.outside:
            notes += of_no_doors(scene, building.doors.leaves)
    notes += of_unreached(space.beyond, options.reach == "all", space.place, options.strict)
    if space.tree.unsplit:
        notes.append(
            Warned(
                f"the limit of {options.max_leaves:,} leaves was reached: {space.tree.unsplit:,} "
                "of them contain walls that do not divide them, so what is behind these walls "
                "counts as visible; raise --max-leaves"
            )
        )
    pieces = cut_to_leaves(scene, space.tree, tolerance)
    owner = kept_names(space.reached)[pieces.leaf]
    cells = assembled(scene, building, space, pieces, owner, notes)
    name = np.append(kept_names(seen_from_places(cells, executor)), np.int32(-1))
    cells = replace(cells, leaf_cell=name[:-1], triangle_cell=name[cells.triangle_cell])
    said = [*of_leaves(cells, space.reached), *of_triangles(scene, pieces, name[owner])]
    cells = grouped(replace(cells, notes=(*cells.notes, *said)), options)
    owner = np.append(cells.leaf_cell, np.int32(-1))[owner]
    if options.doors == "hidden":
        owner[np.isin(pieces.source, opened)] = -1
    count(space.undecided)
    return replace(cells, **vars(joined(scene, pieces, owner, tolerance)), opened=opened)


def _check(scene: Scene, options: SubdivideOptions) -> None:
    if len(scene.triangles) < 2:
        raise InputError(
            "PTM-I247",
            "a single triangle is not a room",
            remedy="give a model with floors and walls",
        )
    names = (*scene.objects, *(material.name for material in scene.materials))
    for pattern in (*options.structural, *options.detail, *options.door):
        if not any(matches(name, (pattern,)) for name in names):
            raise InputError(
                "PTM-I302",
                f"no object or material is called {pattern!r}",
                remedy="names are matched with * and ?, upper and lower case distinct",
            )


def _thickened(low: Floats, high: Floats, tolerance: Tolerance) -> Floats:
    """A box that is flat nowhere: a scene that is only a floor still has one cell above it."""
    flat = high - low < tolerance.thin
    return np.array([low, np.where(flat, low + BOX_MARGIN * tolerance.extent, high)])


def _open_note(space: Space, roofed: float, box: Floats) -> str:
    if roofed < ROOFED:
        what = f"open above: {1 - roofed:.0%} of the floor has no ceiling"
    elif not space.reached.any():
        what = "open: no room is closed off from the outside"
    else:
        what = "open: the outside can be reached from the rooms (windows, doors or gaps)"
    size = " × ".join(f"{s:.2f}" for s in box[1] - box[0])
    note = f"the model is {what}; cells end at the bounding box of its walls, {size} m"
    return Warned(note) if roofed < ROOFED else note
