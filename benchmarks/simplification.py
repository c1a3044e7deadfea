"""Cost and error of simplification: `python benchmarks/simplification.py`

Each method reduces generated statues (a sphere from a cube, with seeded waves and folds; ``--shape
squashed`` is flat and long, ``column`` the sample column with thousands of handles, ``holed`` lacks
a twentieth of the faces, ``littered`` has thousands of small parts around it) to 10,000 faces in a
separate process; methods that are not installed are left out:

- ``quadric``: ptmtools;
- ``fast``: fast-simplification;
- ``meshlab``: pymeshlab;
- ``meshopt``: meshoptimizer's simplifier with attributes, by almeshopt (`pip install almeshopt`,
  x86-64 with AVX2); vertices keep their positions;
- ``update``: the same with variable positions and attributes (``meshopt_simplifyWithUpdate``);
- ``pruned``: ``update`` with the option to drop parts.

Times are processor seconds, the minimum of several runs, without compilation; memory is the peak
above that of the process before. Errors are measured against the given mesh, in both directions, at
evenly distributed (seeded) points: the distance along the normal, by Embree, and the angle between
the normals. Distances are in millionths of the diagonal of the bounding box. Ratios to ``quadric``
are in parentheses.

``--painted`` compares the methods that support textures: statues with six charts, one for each side
of the cube; ``--shape wall``, a wall of bricks with windows; ``--shape furniture``, shelves of
turned bowls and framed panes, each surface with a chart of its own. It adds the movement of the
texture, the share of the given surface without a counterpart in front of or behind it, and the
numbers of parts and handles. ``--model FILE`` does the same for the objects of a model, with the
objects of `ptm campus`.
"""

from __future__ import annotations

import argparse
import ctypes
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from math import ceil, sqrt
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from memory import with_peak  # noqa: E402

from ptmtools.arrays import Floats  # noqa: E402
from ptmtools.simplification import Mesh, SimplifyOptions, simplify  # noqa: E402
from ptmtools.simplification.surface import surface_of  # noqa: E402
from ptmtools.simplification.topology import topology  # noqa: E402

SAMPLES = 200_000
#: Parts beside the littered statue.
CHIPS = 10_000


def grid(n: int) -> Any:
    """(2 n², 3) triangles over (n + 1)² points."""
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def column(faces: int) -> Mesh:
    """The sample column, of whose flutes a million faces make thousands of handles."""
    from ptmtools_samples.options import StatueOptions
    from ptmtools_samples.statues.model import make_statue

    made = make_statue("column", StatueOptions(faces))
    return Mesh(made.points.astype(np.float64), made.triangles.astype(np.int32))


def littered(points: Floats, faces: Any, rng: np.random.Generator) -> tuple[Floats, Any]:
    """With cubes of a 500th of the size strewn about, of 12 faces each."""
    cube = np.array(list(np.ndindex(2, 2, 2))) * 0.004
    square = [[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5]]
    square += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    away = rng.normal(size=(CHIPS, 3))
    away *= 1.6 / np.linalg.norm(away, axis=1, keepdims=True)
    chips = (away[:, None] + cube).reshape(-1, 3)
    more = np.array(square) + 8 * np.arange(CHIPS)[:, None, None] + len(points)
    return np.concatenate([points, chips]), np.concatenate([faces, more.reshape(-1, 3)])


def wall(faces: int) -> Mesh:
    """A wall of bricks, material 0, with 8 x 6 windows, material 1, in its plane."""
    across, up = 17, 13
    cells = max(1, ceil(sqrt(faces / (2 * across * up))))
    u, v = np.meshgrid(np.arange(across * cells + 1.0), np.arange(up * cells + 1.0))
    points = np.stack([u.ravel(), v.ravel(), np.zeros(u.size)], axis=1) / cells
    at = np.arange(u.size).reshape(u.shape)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    square = np.floor(points[triangles].mean(axis=1))[:, :2].astype(int)
    within = (square % 2 == 1).all(axis=1)
    flat = points[triangles][:, :, :2]
    windows = flat - square[:, None] + [2.0, 0.0]
    uv = np.where(within[:, None, None], windows, flat / across)
    return Mesh(points, triangles.astype(np.int32), within.astype(np.int32), uv)


def furniture(faces: int) -> Mesh:
    """Shelves of 12 x 8: bowls turned from a profile, and framed panes, which are sheets.

    Each bowl has a seam along its side; frames are boxes. Material 1 is glass.
    """
    n = max(4, ceil(sqrt(faces / (96 * 3))))
    points: list[Floats] = []
    triangles, uvs, materials = [], [], []

    def sheet(place: Floats, chart: int, material: int) -> None:
        rows, columns = place.shape[0] - 1, place.shape[1] - 1
        at = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
        a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
        each = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
        v, u = np.meshgrid(
            np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij"
        )
        uv = np.stack([u.ravel() + 2 * chart, v.ravel()], axis=1)
        triangles.append(each + sum(map(len, points)))
        uvs.append(uv[each])
        materials.append(np.full(len(each), material, np.int32))
        points.append(place.reshape(-1, 3))

    def rectangle(origin: Floats, u: Floats, v: Floats, n: int) -> Floats:
        s, t = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
        return np.asarray(origin + s[..., None] * u + t[..., None] * v)

    rng = np.random.default_rng(2)
    chart = 0
    for i, j in np.ndindex(12, 8):
        corner = np.array([1.5 * i, 1.5 * j, 0.0])
        # A bowl: a profile around an axis; its last column lies on its first.
        height = np.linspace(0, 1, n + 1)
        wave = rng.uniform(2, 9)
        radius = 0.25 + 0.1 * np.sin(wave * height) + 0.02 * np.sin(4 * wave * height)
        angle = 2 * np.pi * np.r_[np.arange(2 * n), 0] / (2 * n)
        place = np.stack(np.broadcast_arrays(
            0.5 + radius[:, None] * np.cos(angle), height[:, None] + 0 * angle,
            radius[:, None] * np.sin(angle),
        ), axis=-1)  # fmt: skip
        sheet(place[:, ::-1] + corner, chart, 0)
        chart += 1
        # A frame behind it: six sides of a thin box, and a pane before it.
        low, size = corner + [0.0, 0.0, -0.6], np.diag([1.0, 1.0, 0.04])
        few = max(1, n // 6)
        for k in range(3):
            u, v = size[(k + 1) % 3], size[(k + 2) % 3]
            sheet(rectangle(low, v, u, few), chart, 0)
            sheet(rectangle(low + size[k], u, v, few), chart + 1, 0)
            chart += 2
        sheet(rectangle(low + [0.3, 0.3, 0.05], 0.4 * size[0], 0.4 * size[1], few), chart, 1)
        chart += 1
    return Mesh(
        np.concatenate(points), np.concatenate(triangles).astype(np.int32),
        np.concatenate(materials), np.concatenate(uvs),
    )  # fmt: skip


def statue(faces: int, shape: str, painted: bool = False, seed: int = 1) -> Mesh:
    """About ``faces`` faces: waves from a third of the size to a hundredth, and folds."""
    if shape in OTHERS:
        return OTHERS[shape](faces)
    n = ceil(sqrt(faces / 12))
    axis = np.tan(np.linspace(-np.pi / 4, np.pi / 4, n + 1))
    u, v = (each.reshape(-1) for each in np.meshgrid(axis, axis))
    sides: list[Floats] = []
    triangles = []
    for k in range(3):
        for end in (-1, 1):
            side = np.empty((len(u), 3))
            side[:, k] = end
            side[:, (k + 1) % 3], side[:, (k + 2) % 3] = (u, v) if end > 0 else (v, u)
            triangles.append(grid(n) + len(sides) * len(u))
            sides.append(side)
    points = np.concatenate(sides)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    _, first, place = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    unit, faces_of = points[first], place.reshape(-1)[np.concatenate(triangles)]
    rng = np.random.default_rng(seed)
    height = np.zeros(len(unit))
    for i in range(48):
        along = rng.normal(size=3)
        along *= 2 * 1.08**i / np.linalg.norm(along)
        wave = np.sin(unit @ along + rng.uniform(0, 2 * np.pi))
        height += (np.abs(wave) if i % 4 == 0 else wave) / np.linalg.norm(along) ** 1.2
    made = unit * (1 + 0.12 * height)[:, None]
    if shape == "squashed":
        made *= [1.0, 0.3, 2.0]
    if shape == "holed":
        faces_of = faces_of[rng.random(len(faces_of)) >= 0.05]
    if shape == "littered":
        made, faces_of = littered(made, faces_of, rng)
    # Six charts side by side, each as its side of the cube.
    chart = np.stack([u, v], axis=1) / 2 + 0.5
    uv = np.concatenate([chart[grid(n)] + [2.0 * side, 0.0] for side in range(6)])
    return Mesh(made, faces_of.astype(np.int32), uv=uv if painted else None)


def by_quadric(mesh: Mesh, options: SimplifyOptions) -> Mesh:
    return simplify(mesh, options).mesh


def by_fast(mesh: Mesh, options: SimplifyOptions) -> Mesh:
    import fast_simplification

    return Mesh(
        *fast_simplification.simplify(mesh.points, mesh.triangles, target_count=options.faces)
    )


def by_meshlab(mesh: Mesh, options: SimplifyOptions) -> Mesh:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.points, mesh.triangles))
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=options.faces)
    result = meshes.current_mesh()
    return Mesh(result.vertex_matrix(), result.face_matrix())


def by_meshopt(
    mesh: Mesh, options: SimplifyOptions, *, update: bool = False, prune: bool = False
) -> Mesh:
    """By meshoptimizer, in a cube of side 1. Corners with the same place, material and texture
    coordinates are one vertex. Coordinates weigh as the distance by which the texture moves."""
    from almeshopt import SIMPLIFY_PRUNE, almeshopt_avx2

    low, size = mesh.points.min(axis=0), float(np.ptp(mesh.points, axis=0).max())
    corner = ((mesh.points - low) / size).astype(np.float32)[mesh.triangles].reshape(-1, 3)
    material = np.zeros(len(mesh.triangles)) if mesh.material is None else mesh.material
    uv = np.zeros((len(corner), 0)) if mesh.uv is None else mesh.uv.reshape(-1, 2)
    rows = np.column_stack([corner, np.repeat(material, 3), uv]).astype(np.float32)
    # Rows as single items of bytes: a sort of a million is ten times as fast. -0 is 0.
    items = np.ascontiguousarray(rows + 0).view(np.dtype((np.void, rows.shape[1] * 4))).ravel()
    _, first, index = np.unique(items, return_index=True, return_inverse=True)
    place, attribute = rows[first, :3].copy(), rows[first, 4:].copy()
    index, weight = index.astype(np.uint32).ravel(), np.zeros(0, np.float32)
    if mesh.uv is not None:
        area, painted = areas(corner.reshape(-1, 3, 3)).sum(), uv_areas(mesh.uv).sum()
        weight = np.full(2, np.sqrt(area / painted), np.float32)
    else:
        attribute = np.zeros((len(place), 1), np.float32)
    library = ctypes.CDLL(almeshopt_avx2.__file__)
    work = library.meshopt_simplifyWithUpdate if update else library.meshopt_simplifyWithAttributes
    work.restype = ctypes.c_size_t
    size_t = ctypes.c_size_t
    pointer = [ctypes.c_void_p(a.ctypes.data) for a in (index, place, attribute, weight)]
    given = [
        pointer[0], size_t(len(index)), pointer[1], size_t(len(place)), size_t(12),
        pointer[2], size_t(4 * attribute.shape[1]), pointer[3], size_t(len(weight)), None,
        size_t(3 * options.faces), ctypes.c_float(min(options.error / size, 1e30)),
        ctypes.c_uint(SIMPLIFY_PRUNE if prune else 0), None,
    ]  # fmt: skip
    left = work(*given) if update else work(pointer[0], *given)
    triangles = index[:left].reshape(-1, 3).astype(np.int32)
    return Mesh(
        place.astype(np.float64) * size + low,
        triangles,
        None if mesh.material is None else rows[first, 3][triangles[:, 0]].astype(np.int32),
        None if mesh.uv is None else attribute[triangles].astype(np.float64),
    )


def by_update(mesh: Mesh, options: SimplifyOptions) -> Mesh:
    return by_meshopt(mesh, options, update=True)


def by_pruned(mesh: Mesh, options: SimplifyOptions) -> Mesh:
    return by_meshopt(mesh, options, update=True, prune=True)


def areas(corner: Floats) -> Floats:
    """(T,) of triangles (T, 3, 3)."""
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return np.asarray(np.linalg.norm(across, axis=1) / 2)


def uv_areas(uv: Floats) -> Floats:
    """(T,) of triangles (T, 3, 2)."""
    return np.asarray(np.abs(np.linalg.det(uv[:, 1:] - uv[:, :1])) / 2)


OTHERS: dict[str, Callable[[int], Mesh]] = {
    "column": column, "wall": wall, "furniture": furniture,
}  # fmt: skip
SHAPES = ("round", "squashed", "holed", "littered", *OTHERS)
Work = Callable[[Mesh, SimplifyOptions], Mesh]
METHODS: dict[str, tuple[Work, str]] = {
    "quadric": (by_quadric, "numba"),
    "fast": (by_fast, "fast_simplification"),
    "meshlab": (by_meshlab, "pymeshlab"),
    "meshopt": (by_meshopt, "almeshopt"),
    "update": (by_update, "almeshopt"),
    "pruned": (by_pruned, "almeshopt"),
}
#: Those that know textures.
PAINTERS = ("quadric", "meshopt", "update", "pruned")


def timed(method: str, given: int, shape: str, faces: int, runs: int) -> tuple[Mesh, float, int]:
    """The result of a method, its least seconds, and its peak bytes."""
    work = METHODS[method][0]
    work(statue(3000, shape), SimplifyOptions(1000))
    mesh, options = statue(given, shape), SimplifyOptions(faces)
    # Later runs use again what the first one took from the system.
    _, peak = with_peak(lambda: work(mesh, options))
    seconds = []
    for _ in range(runs):
        begin = time.process_time()
        result = work(mesh, options)
        seconds.append(time.process_time() - begin)
    result = Mesh(np.asarray(result.points, float), np.asarray(result.triangles, np.int32))
    return result, min(seconds), peak


def strewn(mesh: Mesh, count: int, seed: int) -> tuple[Floats, Floats]:
    """Points spread evenly over a mesh, and the unit normals there."""
    rng = np.random.default_rng(seed)
    a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    total = np.cumsum(area)
    face = np.searchsorted(total, (np.arange(count) + rng.random(count)) / count * total[-1])
    face = np.minimum(face, len(area) - 1)
    s, t = rng.random(count), rng.random(count)
    s, t = np.where(s + t > 1, 1 - s, s)[:, None], np.where(s + t > 1, 1 - t, t)[:, None]
    points = a[face] + s * (b - a)[face] + t * (c - a)[face]
    return points, normal[face] / area[face][:, None]


def apart(one: Mesh, other: Mesh) -> tuple[Floats, Floats]:
    """How far it is from points of one mesh to the other along the normal, either way, and the
    angles between the normals there, in degrees. Points that meet nothing are left out."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, other.points.astype(np.float32), other.triangles)
    points, normals = strewn(one, SAMPLES, 3)
    a, b, c = (other.points[other.triangles[:, k]] for k in range(3))
    facing = np.cross(b - a, c - a)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), np.finfo(float).tiny)
    way, angle = np.full(len(points), np.inf), np.zeros(len(points))
    # Rays begin a little behind the point: it may lie in the other mesh.
    back = 1e-4 * np.ptp(other.points, axis=0).max()
    for side in (1.0, -1.0):
        origin = (points - side * back * normals).astype(np.float32)
        hit = scene.run(origin, (side * normals).astype(np.float32), output=True)
        actual = hit["primID"]
        cosine = (facing[actual] * normals).sum(axis=1)
        far = np.abs(hit["tfar"] - back)
        nearer = (actual >= 0) & (cosine > 0) & (far < way)
        way[nearer] = far[nearer]
        angle[nearer] = np.degrees(np.arccos(np.clip(cosine[nearer], -1, 1)))
    met = np.isfinite(way)
    return way[met], angle[met]


def figures(given: Mesh, found: Mesh) -> list[float]:
    """Mean and 95th percentile of distances, there and back, and the same of angles."""
    to, angle_to = apart(found, given)
    back, angle_back = apart(given, found)
    away = np.concatenate([to, back]) / np.linalg.norm(np.ptp(given.points, axis=0)) * 1e6
    angle = np.concatenate([angle_to, angle_back])
    return [
        away.mean(), np.percentile(away, 95), np.percentile(away, 99.9),
        angle.mean(), np.percentile(angle, 95),
    ]  # fmt: skip


def texture_shift(given: Mesh, found: Mesh) -> list[float]:
    """Mean, 95th and 99.9th percentile of the movement of the texture over points of the given
    mesh, where they meet the same chart; and the share of the given surface, in percent, that meets
    nothing within a hundredth of the diagonal."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    assert given.uv is not None
    assert found.uv is not None
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, found.points.astype(np.float32), found.triangles)
    rng = np.random.default_rng(5)
    area = areas(given.points[given.triangles])
    face = rng.choice(len(area), SAMPLES, p=area / area.sum())
    corner = given.points[given.triangles[face]]
    point, uv = corner.mean(axis=1), given.uv[face].mean(axis=1)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    scale = np.sqrt(area[face] / np.maximum(uv_areas(given.uv[face]), np.finfo(float).tiny))
    way, shift = np.full(len(point), np.inf), np.zeros(len(point))
    diagonal = float(np.linalg.norm(np.ptp(given.points, axis=0)))
    back = 1e-4 * np.ptp(given.points, axis=0).max()
    for side in (1.0, -1.0):
        origin = (point - side * back * normal).astype(np.float32)
        hit = scene.run(origin, (side * normal).astype(np.float32), output=True)
        # Embree's u and v belong to the second and the third corner.
        at = found.uv[hit["primID"]]
        a, b = hit["u"][:, None], hit["v"][:, None]
        there = at[:, 0] * (1 - a - b) + at[:, 1] * a + at[:, 2] * b
        far = np.abs(hit["tfar"] - back)
        nearer = (hit["primID"] >= 0) & (far < way)
        # Beside a seam the nearest point may be in the next chart.
        same = there[:, 0] // 2 == uv[:, 0] // 2
        way[nearer] = far[nearer]
        shift[nearer] = np.where(same, np.linalg.norm(there - uv, axis=1) * scale, np.nan)[nearer]
    near = way < diagonal / 100
    away = shift[near & np.isfinite(shift)] / diagonal * 1e6
    if not len(away):
        return [np.nan] * 3 + [100.0]
    return [away.mean(), *np.percentile(away, [95, 99.9]), 100 * (1 - near.mean())]


def cell(value: float, first: float) -> str:
    """A figure and its ratio to that of the first method; empty for NaN."""
    if np.isnan(value):
        return ""
    return f"{value:,.3g} ({value / first:.2f})" if first else f"{value:,.3g}"


def print_painted(asked: argparse.Namespace) -> None:
    """The table of what textures cost, and what becomes of parts and handles."""
    print("| faces | method | left | parts | handles "
          "| s | mean | 95 % | 99.9 % | shift | 95 % | 99.9 % | lost % |")  # fmt: skip
    print("|---" * 13 + "|")
    for name, given in painted_meshes(asked):
        first: list[float] = []
        # The objects of a model as `ptm campus` has them.
        faces = max(100, round(asked.share * len(given.triangles))) if asked.model else asked.to
        error = asked.error * float(np.linalg.norm(np.ptp(given.points, axis=0)))
        options = SimplifyOptions(faces, error, keep_parts=asked.keep_parts)
        counts = topology(surface_of(given))
        print(f"| {len(given.triangles):,} | {name} | | {counts.parts:,} | {counts.handles:,} "
              + "| " * 8 + "|")  # fmt: skip
        for method in asked.methods:
            work, package = METHODS[method]
            if method not in PAINTERS or find_spec(package) is None:
                continue
            begin = time.process_time()
            result = work(given, options)
            row = [time.process_time() - begin]
            if len(result.triangles):
                row += [*figures(given, result)[:3], *texture_shift(given, result)]
            else:
                row += [np.nan] * 6 + [100.0]
            if asked.model:  # its charts are unknown
                row[4:7] = [np.nan] * 3
            first = first or row
            counts = topology(surface_of(result))
            cells = [cell(x, y) for x, y in zip(row, first, strict=True)]
            print(f"| | `{method}` | {len(result.triangles):,} | {counts.parts:,} "
                  f"| {counts.handles:,} " + "".join(f"| {each} " for each in cells) + "|",
                  flush=True)  # fmt: skip


def painted_meshes(asked: argparse.Namespace) -> Iterator[tuple[str, Mesh]]:
    """The meshes to simplify, with names."""
    if not asked.model:
        for count in asked.faces:
            yield asked.shape, statue(count, asked.shape, painted=True)
        return
    from ptmtools.scene import ingest

    scene = ingest(asked.model)
    for k, name in enumerate(scene.objects):
        own = np.flatnonzero(scene.triangle_object == k)
        if len(own) < asked.least:
            continue
        used, corners = np.unique(scene.triangles[own], return_inverse=True)
        yield name, Mesh(
            scene.points[used], corners.reshape(-1, 3).astype(np.int32),
            scene.triangle_material[own].astype(np.int32), scene.uv[own],
        )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--faces", type=int, nargs="+", default=[100_000, 1_000_000])
    parser.add_argument("--to", type=int, default=10_000)
    parser.add_argument("--shape", choices=SHAPES, default="round")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--runs", type=int, default=2)
    parser.add_argument("--painted", action="store_true", help="what textures cost")
    parser.add_argument("--keep-parts", action="store_true", help="with --painted: drop no part")
    parser.add_argument("--error", type=float, default=np.inf, help="most, a share of the diagonal")
    parser.add_argument("--model", type=Path, help="simplify its objects instead of a statue")
    parser.add_argument("--share", type=float, default=0.1, help="of the faces of each object")
    parser.add_argument("--least", type=int, default=1000, help="faces of an object")
    asked = parser.parse_args()
    if asked.painted and asked.shape in ("column", "holed", "littered"):
        parser.error(f"--shape {asked.shape} has no texture")
    if asked.painted or asked.model:
        simplify(statue(3000, "round", painted=True), SimplifyOptions(1000))
        print_painted(asked)
        return
    print("| faces | method | left | s | MB | mean | 95 % | 99.9 % | angle | 95 % |")
    print("|---" * 10 + "|")
    for count in asked.faces:
        given = statue(count, asked.shape)
        first: list[float] = []
        for method in asked.methods:
            if find_spec(METHODS[method][1]) is None:
                continue
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
                work = process.submit(timed, method, count, asked.shape, asked.to, asked.runs)
                actual, seconds, peak = work.result()
            errors = figures(given, actual) if len(actual.triangles) else [np.nan] * 5
            row = [seconds, peak / 1e6, *errors]
            first = first or row
            cells = [cell(x, y) for x, y in zip(row, first, strict=True)]
            head = f"| {len(given.triangles):,} | `{method}` | {len(actual.triangles):,} "
            print(head + "".join(f"| {each} " for each in cells) + "|", flush=True)


if __name__ == "__main__":
    main()
