"""An octree texture beside a baked normal map: bytes against error, in one table.

    python benchmarks/apo_normal_map.py [FILE...] [--triangles 50000] [--faces 10000]
        [--error 0.05] [--sizes 64 128 256 512 1024 2048]
        [--distances 1 2 4 8]

Without files, the statues of sample_data/make_statues.py. The rival: the same simplified mesh is
unwrapped by xatlas (`pip install xatlas`), and normals in the space of the object are baked by the
rule by which the octree's samples are taken (`ptmtools.apo.casting`); texels beside the charts are
filled from those within. Its sizes are those of the PNG (Pillow, optimised) and of the `.ptm`.

The error is the angle between what a client shows and the source's own normal (smoothed below 40°),
where the rays of six cameras around, 512 pixels a side, hit both meshes. A client of the octree
stops where nodes become smaller than pixels; one of the map filters between texels and levels. The
source's normal is taken at one point of a pixel, so that far away, where a pixel covers many
triangles, neither can come near 0: both show a mean.

"At equal error" reads between the sizes of the map, on logarithmic scales; – where no level of the
octree is within the errors of the maps. The octree's error ends near the bound that it was made
with (0.05 is 2.9°): a lower one is what compares with large maps.
"""

from __future__ import annotations

import argparse
import io
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "sample_data")]

from ptmtools.apo.casting import Source, nearest  # noqa: E402
from ptmtools.apo.files import streamed  # noqa: E402
from ptmtools.apo.making import Made, Simple, make_apo, welded  # noqa: E402
from ptmtools.apo.model import ApoOptions, Octree  # noqa: E402
from ptmtools.apo.normals import corner_normals  # noqa: E402
from ptmtools.apo.rays import hits, interpolated, seen, weights  # noqa: E402
from ptmtools.apo.traversal import look_up, stop_depth  # noqa: E402
from ptmtools.apo.view import view_of  # noqa: E402
from ptmtools.arrays import Bools, Floats, Ints  # noqa: E402
from ptmtools.executors.serial import Serial  # noqa: E402
from ptmtools.scene import IngestOptions, ingest  # noqa: E402
from ptmtools.texture import EncodeOptions, encode  # noqa: E402

#: Cameras around, azimuth and elevation, degrees; pixels of a side.
CAMERAS = ((0, 10), (60, 35), (120, -20), (180, 10), (240, 35), (300, -20))
SIDE = 512
#: Texels between charts at the size that they are packed for, and rounds of filling beside them.
PADDING, PACKED, ROUNDS = 4, 1024, 4
#: Points that are cast from at a time.
PART = 1 << 18


@dataclass(frozen=True)
class Sights:
    """Pixels of views from one distance: where they show the simplified mesh, in the cube.

    Attributes
    ----------
    place: (n, 3), and ``beside``, ``below`` of the other pixels of the quad (`rays.Seen`).
    triangle: (n,) of the simplified mesh.
    step: (n,) between pixels, as a share of the cube.
    truth: (n, 3) unit normals of the source there.
    """

    place: Floats
    beside: Floats
    below: Floats
    triangle: Ints
    step: Floats
    truth: Floats


#: What a client shows: unit normals (n, 3) of the pixels.
Show = Callable[[Sights], Floats]


@dataclass(frozen=True)
class Error:
    """Degrees over all pixels from one distance, in diameters."""

    distance: float
    mean: float
    p95: float
    pixels: int


def sights(
    source: Source, simple: Simple, low: Floats, side: float, distance: float, pixels: int = SIDE
) -> Sights:
    """What is seen of both meshes from all cameras; the source is in the cube already."""
    corners = ((simple.points - low) / side)[simple.triangles]
    source_corners = source.points[source.triangles].astype(np.float64)
    parts: list[tuple[Any, ...]] = []
    for azimuth, elevation in CAMERAS:
        view = view_of(
            corners.reshape(-1, 3), azimuth, elevation, distance, width=pixels, height=pixels
        )
        sight = seen(corners, view)
        rays = view.rays(sight.column, sight.row)
        met = hits(source_corners, np.broadcast_to(view.eye, rays.shape), rays)
        both = met >= 0
        met, rays = met[both], rays[both]
        of = source_corners[met]
        across = np.cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0])
        far = ((of[:, 0] - view.eye) * across).sum(1) / (rays * across).sum(1)
        weight = weights(of, view.eye + far[:, None] * rays)
        truth = interpolated(weight, source.normals[met].astype(np.float64))
        row = sight.place, sight.beside, sight.below, sight.triangle, sight.step
        parts.append((*(each[both] for each in row), truth))
    return Sights(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def error_of(shown: Floats, sight: Sights, distance: float) -> Error:
    cosine = (shown * sight.truth).sum(axis=1).clip(-1, 1)
    angle = np.degrees(np.arccos(cosine))
    return Error(distance, float(angle.mean()), float(np.percentile(angle, 95)), len(angle))


def normal_error(
    source: Source,
    simple: Simple,
    low: Floats,
    side: float,
    show: Show,
    distances: Iterable[float] = (1, 2, 4, 8),
) -> list[Error]:
    """The errors of one way to show the normals; to compare several, take `sights` once."""
    found = []
    for distance in distances:
        sight = sights(source, simple, low, side, distance)
        found.append(error_of(show(sight), sight, distance))
    return found


def octree_shows(octree: Octree, levels: int | None = None) -> Show:
    """As a client shows its first levels."""
    return lambda sight: look_up(octree, sight.place, levels, stop_depth(sight.step)).normals


def own_shows(simple: Simple, low: Floats, side: float) -> Show:
    """The simplified mesh's own normals, before anything else has come."""
    corners = ((simple.points - low) / side)[simple.triangles]

    def show(sight: Sights) -> Floats:
        weight = weights(corners[sight.triangle], sight.place)
        normals = simple.normals[simple.triangles].astype(np.float64)
        return interpolated(weight, normals[sight.triangle])

    return show


@dataclass(frozen=True)
class Unwrapped:
    """(T, 3, 2) texture coordinates of the corners of the simplified mesh's triangles, 0 to 1, how
    many points it has with seams cut, and the share of the texture that charts cover."""

    uv: Floats
    points: int
    used: float


def unwrap(simple: Simple) -> Unwrapped:
    try:
        import xatlas
    except ImportError:
        sys.exit("the rival needs xatlas: pip install xatlas")

    atlas = xatlas.Atlas()
    atlas.add_mesh(simple.points.astype(np.float32), simple.triangles.astype(np.uint32))
    packing = xatlas.PackOptions()
    packing.padding, packing.resolution, packing.bilinear = PADDING, PACKED, True
    atlas.generate(pack_options=packing)
    mapping, triangles, uv = atlas[0]
    # xatlas keeps the order of triangles; several atlases would not do.
    assert atlas.atlas_count == 1
    assert (mapping[triangles] == simple.triangles).all()
    return Unwrapped(uv[triangles].astype(np.float64), len(mapping), float(atlas.utilization))


def bake(source: Source, simple: Simple, low: Floats, side: float, uv: Floats, size: int) -> Any:
    """The (size, size, 3) uint8 normal map; row 0 has v = 0."""
    flat = np.pad(uv, ((0, 0), (0, 0), (0, 1)))
    at = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(at, at)
    places = np.stack([x.ravel(), y.ravel(), np.zeros(size * size)], axis=1)
    down = np.broadcast_to([0.0, 0.0, -1.0], places.shape)
    triangle = hits(flat, places + [0, 0, 1], down)
    texels = np.flatnonzero(triangle >= 0)
    corners = ((simple.points - low) / side)[simple.triangles]
    own = simple.normals[simple.triangles].astype(np.float64)
    found = np.zeros((size * size, 3))
    for first in range(0, len(texels), PART):
        part = texels[first : first + PART]
        of = triangle[part]
        weight = weights(flat[of], places[part])
        point = (weight[:, :, None] * corners[of]).sum(axis=1)
        normal = interpolated(weight, own[of])
        hit = nearest(source, point, normal)
        met = hit.triangle >= 0
        normals = source.normals[hit.triangle[met]].astype(np.float64)
        normal[met] = interpolated(hit.weight[met].astype(np.float64), normals)
        found[part] = normal
    covered = (triangle >= 0).reshape(size, size)
    filled = fill(found.reshape(size, size, 3), covered)
    return np.rint((filled / 2 + 0.5) * 255).astype(np.uint8)


def fill(normals: Floats, covered: Bools) -> Floats:
    """Texels that no chart covers take the mean of those beside them, some rounds, and then of ever
    larger squares."""
    normals, covered = normals * covered[..., None], covered.copy()
    for _ in range(ROUNDS):
        padded, there = np.pad(normals, ((1, 1), (1, 1), (0, 0))), np.pad(covered, 1) * 1.0
        h, w = covered.shape
        total, count = np.zeros_like(normals), np.zeros(covered.shape)
        for dy in range(3):
            for dx in range(3):
                total += padded[dy : dy + h, dx : dx + w]
                count += there[dy : dy + h, dx : dx + w]
        new = ~covered & (count > 0)
        normals[new] = _units(total[new])
        covered |= new
    if covered.all() or len(covered) == 1:
        return normals
    h, w = covered.shape
    total = normals.reshape(h // 2, 2, w // 2, 2, 3).sum(axis=(1, 3))
    below = fill(_units(total), covered.reshape(h // 2, 2, w // 2, 2).any(axis=(1, 3)))
    spread = np.repeat(np.repeat(below, 2, axis=0), 2, axis=1)
    return np.where(covered[..., None], normals, spread)


def _units(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def map_shows(
    image: NDArray[np.uint8], simple: Simple, low: Floats, side: float, uv: Floats
) -> Show:
    """As graphics hardware shows it: linear within and between levels, of which each is the mean of
    the next, rounded (the levels of a `.ptm` are rounded down, which turns normals a little)."""
    levels = [image]
    while len(levels[-1]) > 1:
        a = levels[-1].astype(np.int64)
        four = a[::2, ::2] + a[1::2, ::2] + a[::2, 1::2] + a[1::2, 1::2]
        levels.append(((four + 2) // 4).astype(np.uint8))
    corners = ((simple.points - low) / side)[simple.triangles]
    size = len(image)

    def at(place: Floats, triangle: Ints) -> Floats:
        weight = weights(corners[triangle], np.nan_to_num(place, posinf=0, neginf=0))
        return np.asarray((weight[:, :, None] * uv[triangle]).sum(axis=1))

    def show(sight: Sights) -> Floats:
        here = at(sight.place, sight.triangle)
        steps = [
            np.linalg.norm(at(q, sight.triangle) - here, axis=1) * size
            for q in (sight.beside, sight.below)
        ]
        detail = np.log2(np.maximum(np.maximum(*steps), 1.0)).clip(0, len(levels) - 1)
        low_level = np.floor(detail).astype(np.int64)
        share = (detail - low_level)[:, None]
        total = np.zeros((len(here), 3))
        for k, level in enumerate(levels):
            for of, part in ((low_level, 1 - share), (low_level + 1, share)):
                chosen = of == k
                total[chosen] += part[chosen] * bilinear(level, here[chosen])
        return _units(total / 127.5 - 1)

    return show


def bilinear(level: NDArray[np.uint8], uv: Floats) -> Floats:
    size = len(level)
    at = uv * size - 0.5
    first = np.floor(at).astype(np.int64)
    part = at - first
    low, high = first.clip(0, size - 1), (first + 1).clip(0, size - 1)
    (x, y), (x1, y1) = low.T, high.T
    u, v = part[:, :1], part[:, 1:]
    upper = level[y, x] * (1 - u) + level[y, x1] * u
    under = level[y1, x] * (1 - u) + level[y1, x1] * u
    return np.asarray(upper * (1 - v) + under * v)


def map_bytes(image: NDArray[np.uint8]) -> dict[str, int]:
    """Of the map as a file."""
    png = io.BytesIO()
    Image.fromarray(image).save(png, "PNG", optimize=True)
    sizes = {"PNG": png.tell()}
    for profile in ("fast", "small"):
        sizes[f".ptm {profile}"] = len(encode(image, EncodeOptions(profile=profile), threads=2))
    return sizes


def at_error(rows: list[tuple[int, float]], error: float) -> float | None:
    """The bytes at which rows of (bytes, error) come to an error, between their own."""
    for (small, worse), (large, better) in pairwise(rows):
        if better <= error <= worse:
            part = np.log(worse / error) / np.log(worse / better) if worse > better else 0.0
            return float(np.exp(np.log(small) + part * np.log(large / small)))
    return None


def compare(name: str, made: Made, source: Source, given: argparse.Namespace) -> None:
    """Prints the table of one mesh."""
    octree, simple = made.octree, made.mesh
    low, side = octree.low, octree.side
    views = {d: sights(source, simple, low, side, d, given.pixels) for d in given.distances}

    def line(what: str, size: str, show: Show) -> list[Error]:
        found = [error_of(show(view), view, d) for d, view in views.items()]
        cells = "".join(f"{e.mean:8.2f}{e.p95:8.1f}" for e in found)
        print(f"{what:<22}{size:>34}{cells}", flush=True)
        return found

    heads = "".join(f"{f'{d:g} diameters':>16}" for d in given.distances)
    print(f"\n{name}: {made.source:,} triangles to {len(simple.triangles):,}")
    print(f"{'degrees: mean, 95 %':<22}{'bytes':>34}{heads}")
    line("the mesh's own", "0", own_shows(simple, low, side))
    ends = streamed(octree.texels, octree)[1]["ends"]
    trees = []
    for levels in range(min(4, octree.levels), octree.levels + 1):
        found = line(
            f"octree, {levels} levels", f"{ends[levels - 1]:,}", octree_shows(octree, levels)
        )
        trees.append((levels, ends[levels - 1], found))
    start = time.perf_counter()
    unwrapped = unwrap(simple)
    seconds = time.perf_counter() - start
    maps = []
    for size in given.sizes:
        image = bake(source, simple, low, side, unwrapped.uv, size)
        sizes = map_bytes(image)
        told = " ".join(f"{sizes[kind]:,}" for kind in sizes)
        found = line(f"map, {size}²", told, map_shows(image, simple, low, side, unwrapped.uv))
        maps.append((sizes, found))
    more = 8 * unwrapped.points + 32 * (unwrapped.points - len(simple.points))
    print(
        f"maps: {', '.join(sizes)}; unwrapped in {seconds:.1f} s, {unwrapped.used:.0%} covered; "
        f"texture coordinates and points at seams are {more:,} bytes more in the mesh's file"
    )
    for k, distance in enumerate(given.distances):
        for kind in sizes:
            rows = [(sizes[kind], found[k].mean) for sizes, found in maps]
            ratios = [
                f"{levels} levels {size / equal:.1f}"
                for levels, size, found in trees
                if (equal := at_error(rows, found[k].mean))
            ]
            print(
                f"at equal mean error from {distance:g} diameters, octree over {kind}: "
                f"{', '.join(ratios) or '–'}"
            )


def prepared(points: Floats, triangles: Ints, octree: Octree) -> Source:
    """The source in the octree's cube, as the octree was made of it."""
    normals = corner_normals(points, triangles).astype(np.float32)
    inside = ((points - octree.low) / octree.side).astype(np.float32)
    return Source(inside, triangles.astype(np.int32), normals)


def main() -> None:
    """Prints a table for each mesh."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = ApoOptions()
    add = parser.add_argument
    add("files", nargs="*", type=Path)
    add("--only", action="append", help="of the statues, without files")
    add("--triangles", type=int, default=50_000)
    add("--faces", type=int, default=default.faces)
    add("--error", type=float, default=default.error)
    add("--depth", type=int, default=default.depth)
    add("--sizes", type=int, nargs="+", default=[64, 128, 256, 512, 1024, 2048])
    add("--distances", type=float, nargs="+", default=[1, 2, 4, 8])
    add("--pixels", type=int, default=SIDE)
    given = parser.parse_args()
    options = ApoOptions(faces=given.faces, error=given.error, depth=given.depth)
    import tempfile

    from make_statues import STATUES, StatueOptions, make_statue
    from statue_parts.files import ply

    with tempfile.TemporaryDirectory() as folder:
        files = list(given.files)
        for name in [] if files else given.only or STATUES:
            statue = make_statue(name, StatueOptions(given.triangles))
            files.append(Path(folder, f"{name}.ply"))
            files[-1].write_bytes(ply(statue.points, statue.triangles, None, name))
        for file in files:
            scene = ingest(file, IngestOptions(unit="m", up="y"))
            start = time.perf_counter()
            made = make_apo(scene, options, Serial())
            seconds = time.perf_counter() - start
            points, triangles = welded(scene.points, scene.triangles)
            compare(file.stem, made, prepared(points, triangles, made.octree), given)
            print(f"the octree was made in {seconds:.1f} s")


if __name__ == "__main__":
    main()
