"""Cost and error of simplification: `python benchmarks/simplification.py`

Made statues (a sphere blown up from a cube, with seeded waves and folds; ``--shape squashed`` to
make it flat and long, ``column`` for the sample column, which has thousands of handles, ``holed``
for a twentieth of the faces missing, ``littered`` for thousands of small parts around it)
become 10,000 faces, by our collapses (``quadric``), by fast-simplification (``fast``) and by
pymeshlab (``meshlab``), each in a process of its own; one that is not installed is left out. Times
are the processor's, the least of some runs, without compiling; memory is the peak beyond what the
process held.

Errors are against the given mesh, both ways, at points strewn evenly over the one (seeded): the
way along the normal to the other, by Embree, and the angle between the normals there. Distances are
in millionths of the box's diagonal. Behind each figure stands its ratio to that of ``quadric``.

``--painted`` gives the statues six charts of texture, one for each side of the cube, and prints
what that costs ``quadric``, and how far the texture is from where it was.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from math import ceil, sqrt
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "sample_data")]

from memory import with_peak  # noqa: E402

from ptmtools.arrays import Floats  # noqa: E402
from ptmtools.simplification import Mesh, SimplifyOptions, simplify  # noqa: E402

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
    from make_statues import StatueOptions, make_statue

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


def statue(faces: int, shape: str, painted: bool = False, seed: int = 1) -> Mesh:
    """About ``faces`` faces: waves from a third of the size to a hundredth, and folds."""
    if shape == "column":
        return column(faces)
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


def by_quadric(mesh: Mesh, faces: int) -> tuple[Floats, Any]:
    found = simplify(mesh, SimplifyOptions(faces)).mesh
    return found.points, found.triangles


def by_fast(mesh: Mesh, faces: int) -> tuple[Floats, Any]:
    import fast_simplification

    return fast_simplification.simplify(mesh.points, mesh.triangles, target_count=faces)


def by_meshlab(mesh: Mesh, faces: int) -> tuple[Floats, Any]:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.points, mesh.triangles))
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=faces)
    found = meshes.current_mesh()
    return found.vertex_matrix(), found.face_matrix()


SHAPES = ("round", "squashed", "column", "holed", "littered")
METHODS: dict[str, tuple[Callable[[Mesh, int], tuple[Floats, Any]], str]] = {
    "quadric": (by_quadric, "numba"),
    "fast": (by_fast, "fast_simplification"),
    "meshlab": (by_meshlab, "pymeshlab"),
}


def timed(method: str, given: int, shape: str, faces: int, runs: int) -> tuple[Mesh, float, int]:
    """What a method makes, its least seconds, and its peak bytes."""
    work = METHODS[method][0]
    work(statue(3000, shape), 1000)
    mesh = statue(given, shape)
    # Later runs use again what the first one took from the system.
    _, peak = with_peak(lambda: work(mesh, faces))
    seconds = []
    for _ in range(runs):
        begin = time.process_time()
        points, triangles = work(mesh, faces)
        seconds.append(time.process_time() - begin)
    return Mesh(points, np.asarray(triangles, np.int32)), min(seconds), peak


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
        found = hit["primID"]
        cosine = (facing[found] * normals).sum(axis=1)
        far = np.abs(hit["tfar"] - back)
        nearer = (found >= 0) & (cosine > 0) & (far < way)
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
    """Mean, 95th and 99.9th percentile of how far the texture is from where it was, over points of
    the given mesh."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    assert given.uv is not None
    assert found.uv is not None
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, found.points.astype(np.float32), found.triangles)
    rng = np.random.default_rng(5)
    face = rng.integers(0, len(given.triangles), SAMPLES)
    corner = given.points[given.triangles[face]]
    point, uv = corner.mean(axis=1), given.uv[face].mean(axis=1)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    normal /= area[:, None]
    edges = given.uv[face][:, 1:] - given.uv[face][:, :1]
    scale = np.sqrt(area / np.abs(np.linalg.det(edges)))
    way, shift = np.full(len(point), np.inf), np.zeros(len(point))
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
        same = np.abs(there[:, 0] // 2 - uv[:, 0] // 2) == 0
        way[nearer] = far[nearer]
        shift[nearer] = np.where(same, np.linalg.norm(there - uv, axis=1) * scale, np.nan)[nearer]
    away = shift[np.isfinite(way) & np.isfinite(shift)]
    away = away / np.linalg.norm(np.ptp(given.points, axis=0)) * 1e6
    return [away.mean(), np.percentile(away, 95), np.percentile(away, 99.9)]


def print_painted(asked: argparse.Namespace) -> None:
    """The table of what textures cost."""
    print("| faces | charts | left | s | mean | 95 % | 99.9 % | shift | 95 % | 99.9 % |")
    print("|---" * 10 + "|")
    for count in asked.faces:
        for painted in (False, True):
            given = statue(count, asked.shape, painted)
            begin = time.process_time()
            found = simplify(given, SimplifyOptions(asked.to)).mesh
            row = [time.process_time() - begin, *figures(given, found)[:3]]
            row += texture_shift(given, found) if painted else []
            head = f"| {len(given.triangles):,} | {6 * painted} | {len(found.triangles):,} "
            cells = [f"{x:,.3g}" for x in row] + [""] * (7 - len(row))
            print(head + "".join(f"| {cell} " for cell in cells) + "|", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--faces", type=int, nargs="+", default=[100_000, 1_000_000])
    parser.add_argument("--to", type=int, default=10_000)
    parser.add_argument("--shape", choices=SHAPES, default="round")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--runs", type=int, default=2)
    parser.add_argument("--painted", action="store_true", help="what textures cost")
    asked = parser.parse_args()
    if asked.painted:
        for painted in (False, True):
            simplify(statue(3000, asked.shape, painted), SimplifyOptions(1000))
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
                found, seconds, peak = work.result()
            row = [seconds, peak / 1e6, *figures(given, found)]
            first = first or row
            cells = [f"{x:,.3g} ({x / y:.2f})" for x, y in zip(row, first, strict=True)]
            head = f"| {len(given.triangles):,} | `{method}` | {len(found.triangles):,} "
            print(head + "".join(f"| {cell} " for cell in cells) + "|", flush=True)


if __name__ == "__main__":
    main()
