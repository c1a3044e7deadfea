"""Ceilings: how much of a building has one, and where rooms without one end.

Cells of a model without ceilings would end at its top, and a visitor of one room would see all
others through the gap above walls whose heights differ by centimetres. So a level plane, the
**ceiling**, at the lowest top of the walls around the open floor splits the building first. It
hides nothing. But a straight line that leads up through it never leads down again, so rooms see
one another through their doorways only; space above it belongs to cells of its own, and what is
there is seen from wherever a line leads to it.

Lowering the top of the model to that plane was rejected: what is above would be visible past every
portal. So was a plane for each room: walls of one height, but for centimetres, are the usual case.
"""

from __future__ import annotations

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, normals
from ptmtools.cells.options import Walker
from ptmtools.cells.polyhedron import Polyhedron, section
from ptmtools.cells.portals import FLOOR_COSINE, plumb
from ptmtools.cells.structure import Frame, Structure, WallPlane
from ptmtools.tolerance import Tolerance, ranked

#: The largest floor triangles, this many, represent the whole floor.
FLOOR_SAMPLES = 400
#: Surfaces nearer to one another than head room, metres, or this share of the model's height, are
#: the two sides of a slab, or furniture.
HEAD_ROOM, SLAB_SHARE = 1.5, 1 / 3
#: A model is open above if less than this share of its floor has a surface above it.
ROOFED = 0.5
#: Heights of floors, metres, that are compared together.
_STOREY = 0.5
#: This share of the length of walls may end below the ceiling,
_LOWER = 0.02
#: and at least this one ends at most so far above it, metres: else nothing is a room's height.
_ALIKE, _SPREAD = 0.25, 0.5
#: A wall leans by less than this (sine).
_LEANS = 0.02


def roofed_share(corners: Floats, floor_area: float) -> float:
    """Share of the floor of (T, 3, 3) triangles, by area, that has a surface above it (1 without
    any floor). See `_floors`."""
    _, area, covered = _floors(corners, floor_area)
    total = float(area.sum())
    return float(area[covered].sum()) / total if total else 1.0


def _floors(corners: Floats, floor_area: float) -> tuple[Floats, Floats, Bools]:
    """(n,) heights and (n,) areas of floor triangles, m and m², and (n,) whether a surface is above
    each.

    Floor is every level triangle of at least a tenth of ``floor_area`` m²; of triangles above one
    another only the lowest is floor, the others are ceilings.
    """
    normal = normals(corners)
    area = np.linalg.norm(normal, axis=1) / 2
    level = np.abs(normal[:, 1]) >= FLOOR_COSINE * 2 * area
    floor = np.flatnonzero(level & (area >= floor_area / 10))
    order = floor[ranked(area[floor])][:FLOOR_SAMPLES]
    height = float(np.ptp(corners[:, :, 1])) if len(corners) else 0.0
    apart = min(HEAD_ROOM, SLAB_SHARE * height)
    walkable = corners[level]
    low, high = walkable.min(axis=1), walkable.max(axis=1)
    rows: list[tuple[float, float, bool]] = []
    for triangle in order:
        eye = corners[triangle].mean(axis=0)
        around = (low <= eye) & (eye <= high)
        heights = plumb(eye, walkable[around[:, 0] & around[:, 2]])
        if not np.any(heights < -apart):
            covered = bool(np.any(heights > apart))
            rows.append((float(eye[1]), float(area[triangle]), covered))
    at, size, covers = np.array(rows).reshape(-1, 3).T
    return at, size, covers > 0


def ceiling_height(
    structure: Structure, walls: list[WallPlane], walker: Walker, floor_area: float
) -> float | None:
    """The height, metres in world coordinates, at which rooms of a building without ceilings end;
    None for buildings with ceilings, and where walls have no common height."""
    at, area, covered = _floors(structure.corners, floor_area)
    if not area.sum() or area[covered].sum() >= ROOFED * area.sum():
        return None
    at, area = at[~covered], area[~covered]
    storey, row = np.unique(np.floor(at / _STOREY), return_inverse=True)
    main = int(np.argmax(np.bincount(row, area, len(storey))))
    eyes = float(at[row == main].max()) + walker.reach
    top, length = _tops(walls, eyes)
    if not length.sum():
        return None
    lower = np.cumsum(length) - length
    height = top[np.flatnonzero(lower <= _LOWER * length.sum())[-1]]
    alike = (top >= height) & (top <= height + _SPREAD)
    return float(height) if length[alike].sum() >= _ALIKE * length.sum() else None


def _tops(walls: list[WallPlane], eyes: float) -> tuple[Floats, Floats]:
    """(n,) tops, ascending, and (n,) lengths of the upright walls that reach from below the height
    of ``eyes`` to above it, metres."""
    rows = [(eyes, 0.0)]
    for wall in walls:
        if abs(wall.frame.plane[1]) < _LEANS:
            for part in shapely.get_parts(wall.walls):
                points = wall.frame.to_space(shapely.get_coordinates(part))
                low, high = points.min(axis=0), points.max(axis=0)
                if low[1] <= eyes < high[1]:
                    rows.append((float(high[1]), float(np.hypot(*(high - low)[[0, 2]]))))
    top, length = np.array(sorted(rows)).T
    return top, length


def ceiling_plane(
    height: float, structure: Structure, body: Polyhedron, tolerance: Tolerance
) -> WallPlane | None:
    """The level plane at a height, whose fragment is all of a body's section, and what blocks in
    it; None if it leaves no room above or below."""
    low, high = body.points[:, 1].min(), body.points[:, 1].max()
    if min(height - low, high - height) < tolerance.thin:
        return None
    frame = Frame.of(np.array([0.0, 1.0, 0.0, -height]))
    near = structure.nearby.between(frame.plane, -tolerance.plane, tolerance.plane)
    blocking = structure.united(frame, near[structure.lie_in(frame.plane, near)])
    outline = section(body, frame.plane, tolerance.rounding)
    return WallPlane(frame, shapely.Polygon(frame.to_plane(outline)), blocking)
