"""Two rooms with a door between them, and what is asked of their cells.

Rooms are 4 m high and lie along x; A ends at x = 4, B begins at x = 4.2, and the doorway between
them is 1 m wide and 2.1 m high unless a test says otherwise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ptmtools.cells import Cells, SubdivideOptions
from ptmtools.cells.doors import Doors
from ptmtools.cells.fabric import Fabric
from ptmtools.cells.search import connect
from ptmtools.cells.structure import Structure
from ptmtools.scene.model import Scene
from ptmtools.visibility import compute_pvs
from tests.cells.conftest import box, panel
from tests.conftest import scene_of

Faces = list[list[list[float]]]
Hole = tuple[float, float, float, float]
HOLE: Hole = (0, 2.1, -0.5, 0.5)
OPEN = SubdivideOptions(doors="open")
A, B, OUT = (1.0, 1.0, 1.2), (7.0, 1.0, 1.2), (-3.0, 1.0, 1.2)


def solid(low: tuple[float, ...], high: tuple[float, ...]) -> Faces:
    """The faces of a box seen from outside."""
    return [face[::-1] for face in box(low, high)]


def reveals(x0: float, x1: float, hole: Hole) -> Faces:
    """The sides, top and floor of a doorway through a wall across x."""
    y0, y1, z0, z1 = hole
    upright = [[[x0, y0, z], [x0, y1, z], [x1, y1, z], [x1, y0, z]] for z in (z0, z1)]
    return upright + [[[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]] for y in (y0, y1)]


def wall(x0: float, x1: float, hole: Hole | None) -> Faces:
    """A wall across x, with a doorway."""
    return panel(x0, hole) + panel(x1, hole) + (reveals(x0, x1, hole) if hole else [])


def leaf(x: float, hole: Hole = HOLE, thickness: float = 0.04, gap: float = 0.0) -> Faces:
    """A door leaf that fills a doorway but for a gap, from x on."""
    y0, y1, z0, z1 = hole
    return solid((x, y0 + gap, z0 + gap), (x + thickness, y1 - gap, z1 - gap))


def sheet(x: float, hole: Hole = HOLE) -> Faces:
    """A leaf without thickness."""
    y0, y1, z0, z1 = hole
    return [[[x, y0, z0], [x, y1, z0], [x, y1, z1], [x, y0, z1]]]


def rooms(hole: Hole | None = HOLE, entrance: Hole | None = None) -> Faces:
    """Rooms A and B and the wall between them; with an entrance through A's other wall, or none."""
    a, b = box((0, 0, -2), (4, 4, 2), "-x +x"), box((4.2, 0, -2), (8.2, 4, 2), "-x")
    front = wall(-0.2, 0, entrance) if entrance else panel(0, None)
    return a + b + front + wall(4, 4.2, hole)


def scene(*things: Faces, **called: Faces) -> Scene:
    """A scene of things, the named ones called so; ``_`` in a name is kept."""
    every = [("masonry", things_of) for things_of in things] + list(called.items())
    faces = [face for _, thing in every for face in thing]
    objects = [name for name, thing in every for _ in thing]
    made = scene_of(faces, objects)
    # One object for each name, not for each face.
    names = tuple(dict.fromkeys(objects))
    place = np.array([names.index(name) for name in made.objects], dtype=np.int32)
    return replace(made, objects=names, triangle_object=place[made.triangle_object])


def together(cells: Cells, *points: tuple[float, float, float]) -> bool:
    """Whether all points are in cells that hang together through portals."""
    at = cells.locate_leaf(np.array(points))
    ends = cells.portal_leaf.astype(np.int64)
    group = connect(cells.leaf_count, ends)
    return bool((at >= 0).all() and len(set(group[at])) == 1)


def see(cells: Cells, one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    pvs = compute_pvs(cells)
    a, b = cells.locate(np.array([one, other]))
    return bool(b in pvs.cell[pvs.start[a] : pvs.start[a + 1]])


def leaf_names(scene: Scene, **options: object) -> list[str]:
    """The names of the door leaves of a scene."""
    chosen = SubdivideOptions(**options)  # type: ignore[arg-type]
    tolerance = scene.tolerance.for_walls(chosen.wall_thickness)
    fabric = Fabric.from_scene(scene, chosen)
    doors, _ = Doors.recognise(fabric, Structure.from_fabric(fabric, tolerance))
    return [door.name for door in doors.leaves]


def said(cells: Cells) -> list[str]:
    return [note for note in cells.notes if "door lea" in note]


PAIR: Faces = leaf(4.05, (0, 2.1, -0.9, -0.002)) + leaf(4.05, (0, 2.1, 0.002, 0.9))
WIDE: Hole = (0, 2.1, -0.9, 0.9)
PANELS: Faces = [
    face
    for x in (4.09, 4.04)
    for y in (0.2, 1.1)
    for face in solid((x, y, -0.4), (x + 0.01, y + 0.8, 0.4))
]
