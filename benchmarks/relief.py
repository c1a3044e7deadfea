"""Relief of scanned statues: bytes against error of octree textures and normal maps.

    python benchmarks/relief.py [NAME …] [--triangles 200000] [--faces 2000]

The statues are those of `ptm sample statues`, simplified as by ``--apo``. Of each form one
line for each number of levels, or side of the map: bytes of the stream or of the `.ptm`, and the
mean angle to the source's own normals at 100,000 points of the simplified mesh, degrees, as a
client shows it that stands near (a map with bilinear filtering). The last lines compare bytes at
the same mean angle, between the sides of the map on logarithmic scales.
"""

from __future__ import annotations

import argparse
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from ptmtools_samples.options import STATUES, StatueOptions  # noqa: E402
from ptmtools_samples.statues.model import make_statue  # noqa: E402

from ptmtools.arrays import Floats  # noqa: E402
from ptmtools.executor import Executor  # noqa: E402
from ptmtools.simplification import Mesh, SimplifyOptions, simplify  # noqa: E402
from ptmtools.texture import EncodeOptions, encode  # noqa: E402
from ptmtools_systems.apo.files import encode_stream  # noqa: E402
from ptmtools_systems.apo.making import octree_around, smooth, weld  # noqa: E402
from ptmtools_systems.apo.model import ApoOptions  # noqa: E402
from ptmtools_systems.apo.normal_map import Baking, look_up_normals, normal_map  # noqa: E402
from ptmtools_systems.apo.sampling import interpolate  # noqa: E402
from ptmtools_systems.apo.traversal import look_up  # noqa: E402

#: Points at which forms are compared, and sides of the maps as powers of two.
POINTS, SIDES = 100_000, range(6, 12)
#: No bound: the other limits decide.
_ALL = 1000.0

Row = tuple[str, int, float]


def mean_angle(shown: Floats, truth: Floats) -> float:
    """Degrees."""
    cosine = (shown * truth).sum(axis=1).clip(-1, 1)
    return float(np.degrees(np.arccos(cosine)).mean())


def rows_of(name: str, triangles: int, faces: int) -> tuple[list[Row], list[Row]]:
    """Name, bytes and error of the levels of the octree, and of the maps."""
    made = make_statue(name, StatueOptions(triangles))
    points, corners = weld(made.points.astype(np.float64), made.triangles.astype(np.int32))
    simplified = simplify(Mesh(points, corners), SimplifyOptions(faces)).mesh
    mesh = smooth(simplified.points, simplified.triangles)
    baking, cube = Baking.from_mesh(mesh, points, corners)
    compared = baking.comparison(POINTS)
    q = interpolate(baking.corner, compared.points)
    own = interpolate(mesh.normals[mesh.triangles].astype(np.float64), compared.points)
    own /= np.linalg.norm(own, axis=1, keepdims=True)
    print(
        f"\n{name}: {len(corners):,} triangles to {len(mesh.triangles):,}; "
        f"the mesh's own normals {mean_angle(own, compared.normal):.2f}°"
    )
    octree, _ = octree_around(mesh, points, corners, ApoOptions(faces=faces), None, Executor())
    q = (cube.low + cube.side * q - octree.low) / octree.side
    ends = encode_stream(octree.texels, octree)[1]["ends"]
    levels = [
        (f"octree, {k + 1} levels", end, look_up(octree, q, k + 1).normals)
        for k, end in enumerate(ends)
        if k >= 5
    ]
    maps = []
    for depth in SIDES:
        options = ApoOptions(faces=faces, error=0.0, depth=depth, density=_ALL)
        relief = normal_map(mesh, points, corners, options)
        uv = interpolate(relief.uv.astype(np.float64), compared.points)
        shown = look_up_normals(relief.texels, uv, relief.frame[compared.points.triangle])
        size = len(encode(relief.texels, EncodeOptions(), threads=2))
        maps.append((f"map, {2**depth}²", size, shown))
    truth = compared.normal
    return (
        [(what, size, mean_angle(shown, truth)) for what, size, shown in levels],
        [(what, size, mean_angle(shown, truth)) for what, size, shown in maps],
    )


def at_error(maps: list[Row], error: float) -> float | None:
    """The bytes at which a map has an error; None beyond the sides."""
    for (_, small, worse), (_, large, better) in pairwise(maps):
        if better <= error <= worse:
            part = np.log(worse / error) / np.log(worse / better)
            return float(np.exp(np.log(small) + part * np.log(large / small)))
    return None


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(prog="python benchmarks/relief.py")
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--triangles", type=int, default=200_000)
    parser.add_argument("--faces", type=int, default=2_000)
    given = parser.parse_args()
    for name in given.names or STATUES:
        levels, maps = rows_of(name, given.triangles, given.faces)
        print("| form | bytes | mean angle |\n|---|---|---|")
        for what, size, error in [*levels, *maps]:
            print(f"| {what} | {size:,} | {error:.2f} |")
        pairs = [(what, size, at_error(maps, error)) for what, size, error in levels]
        ratios = [f"{what} {size / other:.1f}" for what, size, other in pairs if other]
        print(
            f"bytes over those of a map of the same error: {', '.join(ratios) or '–'}", flush=True
        )


if __name__ == "__main__":
    main()
