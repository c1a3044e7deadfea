"""The storeys of a building, and horizontal sections of triangles, polygons and leaves.

Storeys follow from the floor of leaves that are mostly under a ceiling: not from roofs, terrain or
furniture. The range of heights with most of that floor is a storey; so is the one with most of the
rest, until little is left, such as landings. Storeys that the model names come first. A range is
as high as the section is above a floor, so that the section cuts all its rooms; a storey's floor is
the median of its range. Floor that is in no cell counts too. A building without ceilings has one
storey, since the floor of a second one would be a ceiling of the first. Tried and rejected: the
lowest heights of leaves, some of which begin on car roofs, over doors and on roofs.

Plan coordinates are (x, z). A corner in the cutting plane counts as above it, so a section through
a floor's own height is that of the walls that stand on it, and no corner is met twice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ptmtools.arrays import Floats, normals
from ptmtools.cells.model import Cells
from ptmtools.cells.structure import Surroundings
from ptmtools.scene.model import Scene


def triangle_section(corners: Floats, height: float) -> Floats:
    """(m, 2, 2) segments in which (n, 3, 3) triangles meet the plane; horizontal ones have none."""
    above = corners[:, :, 1] >= height
    lone = above.sum(axis=1)
    cut = np.flatnonzero((lone == 1) | (lone == 2))
    corners, above = corners[cut], above[cut]
    # The only corner on its side of the plane; both crossings lie on its edges.
    apex = np.where(lone[cut] == 1, above.argmax(axis=1), above.argmin(axis=1))
    row = np.arange(len(cut))
    tip = corners[row, apex]
    ends = [_crossing(tip, corners[row, (apex + k) % 3], height) for k in (1, 2)]
    return np.stack(ends, axis=1)


def polygon_section(polygon: Floats, height: float) -> Floats | None:
    """(2, 2) segment in which a convex (n, 3) polygon meets the plane, or None."""
    following = np.roll(polygon, -1, axis=0)
    change = (polygon[:, 1] >= height) != (following[:, 1] >= height)
    if change.sum() != 2:
        return None
    return _crossing(polygon[change], following[change], height)


def leaf_section(cells: Cells, leaf: int, height: float) -> Floats:
    """(n, 2) convex polygon in which a leaf meets the plane, counter-clockwise in (x, z); (0, 2)
    if it does not."""
    points = cells.leaf_points(leaf)
    if not points[:, 1].min() <= height < points[:, 1].max():
        return np.zeros((0, 2))
    first, last = cells.leaf_face_start[leaf : leaf + 2].tolist()
    loop = cells.face_start[first : last + 1]
    index = cells.face_index[loop[0] : loop[-1]]
    following = np.roll(index, -1)
    following[loop[1:] - 1 - loop[0]] = index[loop[:-1] - loop[0]]
    start, end = cells.leaf_point[index], cells.leaf_point[following]
    # Each edge stands in two loops, upwards in one of them.
    upward = (start[:, 1] < height) & (end[:, 1] >= height)
    corners = _crossing(start[upward], end[upward], height)
    if len(corners) < 3:
        return np.zeros((0, 2))
    centre = corners.mean(axis=0)
    around = np.argsort(np.arctan2(*(corners - centre).T[::-1]), kind="stable")
    return corners[around]


def area(polygon: Floats) -> float:
    """m² of a (n, 2) polygon, positive if counter-clockwise."""
    if len(polygon) < 3:
        return 0.0
    a, b = polygon - polygon[0], np.roll(polygon, -1, axis=0) - polygon[0]
    return float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def _crossing(a: Floats, b: Floats, height: float) -> Floats:
    """(n, 2) where the segments from ``a`` to ``b``, with ends on both sides, meet the plane."""
    share = (height - a[:, 1]) / (b[:, 1] - a[:, 1])
    return (a + share[:, None] * (b - a))[:, [0, 2]]


#: A storey that the model does not name has at least this share of the area of the largest one.
_LEAST_SHARE = 0.15
#: In a building without ceilings, at most this share of the floor between walls is under one; about
#: as many pieces of floor tell it.
_ROOFLESS_SHARE, _SAMPLES = 0.05, 4096
#: A storey has the model's name for one that is nearer than half of this, metres.
_NAME_GAP = 1.5


def storeys(scene: Scene, cells: Cells, height: float) -> list[float]:
    """The floors' heights, ascending; at least one if there are leaves; ``height`` of the section
    above a floor, metres."""
    level, size, roofed = _rooms_floor(scene, cells)
    order = np.argsort(level, kind="stable")
    level, size = level[order], size[order]
    named = [np.array([storey.height]) for storey in scene.storeys]
    floors: list[float] = []
    least, share = 0.0, _LEAST_SHARE if roofed else 1.0
    while size.any():
        middle = named.pop(0) if named else level
        total = np.append(0.0, np.cumsum(size))
        below = total[np.searchsorted(level, middle - height / 2)]
        within = total[np.searchsorted(level, middle + height / 2, "right")] - below
        best = int(within.argmax())
        if within[best] > (least if middle is level else 0.0):
            median = np.searchsorted(total[1:], below[best] + within[best] / 2)
            floors.append(float(level[median]))
            size[abs(level - floors[-1]) <= height / 2] = 0.0
            least = max(least, share * float(within[best]))
        elif middle is level:
            break
    lowest = cells.leaf_point[:, 1].min(initial=np.inf)
    return sorted(floors) or [float(lowest)] * bool(cells.leaf_count)


def _rooms_floor(scene: Scene, cells: Cells) -> tuple[Floats, Floats, bool]:
    """(n,) heights, metres, and (n,) areas in plan, m², of floor under a ceiling, and true; or of
    all floor, and false, in a building without ceilings. Where eyes may be anywhere, the bottom of
    each leaf is a floor."""
    floor = np.concatenate([cells.eye_floor, cells.left_out])
    body = floor.mean(axis=1)
    level, size = body[:, 1].copy(), abs(normals(floor)[:, 1]) / 2
    body[:, 1] += cells.walker.middle
    if cells.eyes.everywhere and cells.leaf_count:
        start, up = cells.leaf_point_start, cells.leaf_point[:, 1]
        middle = np.add.reduceat(cells.leaf_point, start[:-1]) / np.diff(start)[:, None]
        low, high = np.minimum.reduceat(up, start[:-1]), np.maximum.reduceat(up, start[:-1])
        body, level = np.concatenate([body, middle]), np.append(level, low)
        size = np.append(size, cells.leaf_volumes() / (high - low))
    around = Surroundings(scene.corners, scene.tolerance)
    covered, leaf = around.cover(body), cells.locate_leaf(body) + 1
    mostly = np.bincount(leaf, size * covered) >= np.bincount(leaf, size) / 2
    counts = np.where(leaf > 0, mostly[leaf], covered)
    some = slice(None, None, -(-len(body) // _SAMPLES) or 1)
    walled = around.enclose(body[some], roofed=False)
    if size[some][counts[some]].sum() <= _ROOFLESS_SHARE * size[some][walled].sum():
        return level, size, False
    return level[counts], size[counts], True


def storey_names(scene: Scene, floors: Sequence[float]) -> list[str]:
    """The name of the storey on each of all ``floors``: the model's, else its number; "" for the
    only one if the model does not name it."""
    names = [_name_of(scene, floor) for floor in floors]
    if len(floors) > 1:
        names = [name or f"Storey {number}" for number, name in enumerate(names, 1)]
    return names


def _name_of(scene: Scene, floor: float) -> str:
    """The name of the storey that is nearest to a floor, the lower of two; "" if the model names
    none that is near."""
    near = [(abs(storey.height - floor), storey.name) for storey in scene.storeys]
    distance, name = min(near, key=lambda pair: pair[0], default=(np.inf, ""))
    return name if distance < _NAME_GAP / 2 else ""


def main_floors(floors: Floats, sizes: Floats, gap: float) -> Floats:
    """The heights of storeys, ascending: that of (n,) ``floors`` with the most area on it, the
    lowest of equal ones, then the next that is more than ``gap`` metres from it, and so on."""
    height, floor = np.unique(np.round(floors, 2), return_inverse=True)
    waiting = height[np.argsort(-np.bincount(floor, sizes), kind="stable")]
    heights = []
    while len(waiting):
        heights.append(waiting[0])
        waiting = waiting[abs(waiting - waiting[0]) > gap]
    return np.sort(np.array(heights))


def storey_of(floors: Sequence[float], height: float) -> int:
    """The storey of a height, given all ``floors``: the nearest one below."""
    return max(0, int(np.searchsorted(floors, height, side="right")) - 1)


def cut_height(cells: Cells, floor: float, height: float) -> float:
    """The height of a storey's section: ``height`` above its floor, at most half way up."""
    top = float(np.max(cells.leaf_point[:, 1], initial=floor))
    return min(floor + height, (floor + top) / 2)
