"""Buildings carved out of a block, their files and expectations. Metres, Z up, as in
tests/scene/buildings.py."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.orientation.space import to_world
from tests.scene.buildings import Point, box, inside_out, sheet, welded

Box = tuple[Point, Point]


def room(x0: float, y0: float, x1: float, y1: float, low: float = 0, high: float = 2.8) -> Box:
    """A room over a rectangle in plan."""
    return (x0, y0, low), (x1, y1, high)


def carved(
    rooms: Sequence[Box], holes: Sequence[Box] = (), solids: Sequence[Box] = (), wall: float = 0.2
) -> Floats:
    """(T, 3, 3) triangles of a block that ends ``wall`` beyond all rooms, less rooms and holes,
    with solids put into them; each faces the air."""
    # Rounded, or walls of 1e-16 m part what is to touch.
    every = np.round(np.array([*rooms, *holes, *solids], dtype=np.float64), 9)
    hollow, kept = every[: len(rooms) + len(holes)], every[len(rooms) + len(holes) :]
    inner = every[: len(rooms)]
    block = np.array([[inner[:, 0].min(axis=0) - wall, inner[:, 1].max(axis=0) + wall]])
    corners = np.concatenate([every, block]).reshape(-1, 3)
    corners = np.vstack([corners, corners.min(axis=0) - 1, corners.max(axis=0) + 1])
    lines = [np.unique(corners[:, axis]) for axis in range(3)]
    middles = np.stack(np.meshgrid(*((c[1:] + c[:-1]) / 2 for c in lines), indexing="ij"), axis=-1)
    full = (_within(middles, block) & ~_within(middles, hollow)) | _within(middles, kept)
    faces = []
    for axis in range(3):
        step = np.diff(full.astype(np.int8), axis=axis)
        at = np.argwhere(step)
        u, v = (axis + 1) % 3, (axis + 2) % 3
        quad = np.empty((len(at), 4, 3))
        quad[:, :, axis] = lines[axis][at[:, axis] + 1, None]
        quad[:, :, u] = lines[u][at[:, u, None] + [0, 1, 1, 0]]
        quad[:, :, v] = lines[v][at[:, v, None] + [0, 0, 1, 1]]
        solid_above = step[tuple(at.T)] > 0
        quad[solid_above] = quad[solid_above, ::-1]
        faces.append(quad[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3))
    return np.concatenate(faces)


def _within(points: Floats, boxes: Floats) -> Bools:
    """(...,) whether (..., 3) points are in any of (n, 2, 3) boxes."""
    inside = np.zeros(points.shape[:-1], dtype=bool)
    for low, high in boxes:
        inside |= ((points > low) & (points < high)).all(axis=-1)
    return inside


def prism(profile: Sequence[tuple[float, float]], y0: float, y1: float) -> Floats:
    """A solid with a convex profile of (x, z), counter-clockwise with x to the right and z up."""
    near, far = ([(x, y, z) for x, z in profile] for y in (y0, y1))
    around = range(len(profile))
    sides = [sheet(near[i - 1], far[i - 1], far[i], near[i]) for i in around]
    ends = [[[end[0], end[i - 1], end[i]] for i in around[2:]] for end in (near, far)]
    return np.concatenate([*sides, np.array(ends[0]), inside_out(np.array(ends[1]))])


def flight(
    start: tuple[float, float],
    width: tuple[float, float],
    foot: float,
    rise: float,
    treads: int,
    bottom: float = 0.0,
) -> Floats:
    """Solid steps from ``start[0]`` to ``start[1]`` along x, which may run backwards, over a width
    in y; the first tread is a rise above ``foot``, and all stand on ``bottom``."""
    edge = np.linspace(*start, treads + 1)
    return np.concatenate(
        [
            box(
                (min(a, b), width[0], bottom),
                (max(a, b), width[1], foot + rise * (i + 1)),
            )
            for i, (a, b) in enumerate(pairwise(edge))
        ]
    )


def moved(triangles: Floats, x: float) -> Floats:
    """The same so many metres along x."""
    return triangles + [x, 0.0, 0.0]


def turned(triangles: Floats) -> Floats:
    """The same with x and y exchanged."""
    return triangles[:, ::-1, [1, 0, 2]]


def write(path: Path, parts: Iterable[tuple[str, Floats]]) -> Path:
    """An OBJ file of named parts, those called glass… of glass, or a GLB file of all of them, whose
    faces have no backs; with the numbers as they are."""
    names, triangles = zip(*parts, strict=True)
    points, faces = welded(np.concatenate(triangles))
    if path.suffix == ".glb":
        import trimesh

        mesh = trimesh.Trimesh(points, faces, process=False)
        path.write_bytes(trimesh.exchange.gltf.export_glb(trimesh.Scene(mesh)))
        return path
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    starts = np.cumsum([0, *map(len, triangles)])
    glazed = any(name.startswith("glass") for name in names)
    if glazed:
        path.with_suffix(".mtl").write_text("newmtl solid\nKd 1 1 1\nnewmtl glass\nd 0.2\n")
        lines.insert(0, f"mtllib {path.stem}.mtl")
    for name, first, last in zip(names, starts[:-1], starts[1:], strict=True):
        lines.append(f"o {name}")
        if glazed:
            lines.append(f"usemtl {'glass' if name.startswith('glass') else 'solid'}")
        lines += [f"f {a} {b} {c}" for a, b, c in (faces[first:last] + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


#: Rooms are not divided where that would save downloading.
WHOLE = {"gain": 1.0}
#: What a user says of the files here; without, it is guessed.
AXES = {"up": "z", "unit": "m"}


@dataclass(frozen=True)
class BuildingCase:
    """A building and its expected cells. Points are those of the model, before ``scale`` and
    ``offset``."""

    #: Triangles, or triangles by the names of objects.
    model: Floats | dict[str, Floats]
    #: Eyes of visitors, in standing leaves unless that is left open.
    eyes: dict[str, Point]
    #: Eyes in one cell, for all cells where one can stand; None: every eye has a cell of its own.
    rooms: tuple[str, ...] | None = None
    #: There may be more such cells.
    more: bool = False
    #: Visible points where one cannot stand; in the room of these eyes, if that is fixed.
    seen: Mapping[Point, str | None] = field(default_factory=dict)
    #: Points in no cell.
    gone: tuple[Point, ...] = ()
    #: Pairs of eyes whose cells see each other, or do not.
    sees: tuple[str, ...] = ()
    blind: tuple[str, ...] = ()
    closed: bool = True
    #: Groups that are unreachable from the start, kept, and reported.
    cut_off: int = 0
    notes: tuple[str, ...] = ()
    options: Mapping[str, Any] = field(default_factory=lambda: WHOLE)
    ingest: Mapping[str, Any] = field(default_factory=lambda: AXES)
    file: str = "model.obj"
    #: Whether faces have backs; None: as the file says.
    backs: bool | None = None
    scale: float = 1.0
    offset: Point = (0.0, 0.0, 0.0)

    def scene(self, folder: Path) -> Scene:
        parts = self.model if isinstance(self.model, dict) else {"building": self.model}
        placed = [(name, part * self.scale + self.offset) for name, part in parts.items()]
        scene = ingest(write(folder / self.file, placed), IngestOptions(**self.ingest))
        if self.backs is None:
            return scene
        return replace(scene, two_sided=np.full(len(scene.triangles), self.backs))

    def in_world(self, scene: Scene, points: Iterable[Point]) -> Floats:
        at = np.array([*points], dtype=np.float64).reshape(-1, 3) * self.scale + self.offset
        return to_world(at, scene.space)
