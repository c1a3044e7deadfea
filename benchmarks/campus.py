"""What a campus weighs and costs, beside the paper's tables.

    python benchmarks/campus.py MODEL [--lightmaps bake] [--samples 64] [-j 0] [--keep DIR]

Builds a campus of any model and prints, as Markdown: faces and error by level of detail; average KB
(of 1024 bytes) by size and channel of textures beside the paper's table 1, and what those cost that
are larger than their source; the presets; seconds by phase.

The error is measured on what was written: of each object points spread over the finest mesh by
area, and from each the nearest point of the coarsest that rays along the normal of its face and
along the axes find, which is an upper bound. In metres, and as a share of the diagonal of the
object's box. Points from which no ray finds anything are counted.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from campus_light import say_light
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from ptmtools.arrays import Floats
from ptmtools.campus import CampusOptions, make_campus
from ptmtools.campus.building import Made
from ptmtools.campus.meshes import read_mesh
from ptmtools.campus.model import CampusObject
from ptmtools.campus.occlusion import normals
from ptmtools.campus.summary import kinds
from ptmtools.executors import open_executor
from ptmtools.scene import IngestOptions

#: Points of each object.
POINTS = 2000
WORDS = {"d": "diffuse", "a": "alpha", "m": "mask", "l": "lightmap"}


def corners(folder: Path, file: str) -> Floats:
    """(T, 3, 3) of a mesh."""
    parts = read_mesh((folder / file).read_bytes())
    return np.concatenate([part.point[part.triangle] for part in parts])


def error(folder: Path, each: CampusObject) -> Floats:
    """(n,) metres from points of the finest mesh of an object to the coarsest."""
    fine, coarse = (corners(folder, each.meshes[lod].file) for lod in (-1, 0))
    middle = fine.reshape(-1, 3).mean(axis=0)
    random = np.random.default_rng(0)
    across = np.cross(fine[:, 1] - fine[:, 0], fine[:, 2] - fine[:, 0])
    area = np.linalg.norm(across, axis=1)
    if not area.sum() > 0:
        return np.zeros(1)
    face = random.choice(len(fine), POINTS, p=area / area.sum())
    share = np.sort(random.random((POINTS, 2)), axis=1)
    share = np.diff(share, axis=1, prepend=0, append=1)
    point = np.einsum("nk,nkx->nx", share, fine[face]) - middle
    tree = EmbreeScene(robust=True)
    TriangleMesh(tree, (coarse - middle).astype(np.float32))
    best = np.full(POINTS, np.inf)
    ways = [normals(fine)[face], *(np.tile(axis, (POINTS, 1)) for axis in np.eye(3))]
    for way in [*ways, *(-way for way in ways)]:
        # A little back, so that what lies in the same place is hit.
        back = 1e-3
        start = (point - back * way).astype(np.float32)
        found = tree.run(start, way.astype(np.float32), output=True)
        hit = np.where(found["primID"] >= 0, np.abs(found["tfar"] - back), np.inf)
        best = np.minimum(best, hit)
    return best


def say_levels(folder: Path, made: Made) -> None:
    campus = made.campus
    print("| level | faces | faces an object | bytes | greatest error of a step |")
    print("|---|---|---|---|---|")
    for lod in range(campus.lods):
        level = [each.meshes[lod] for each in campus.objects]
        faces, held = sum(m.faces for m in level), sum(m.bytes for m in level)
        worst = max(m.error for m in level)
        print(f"| {lod} | {faces:,} | {faces / len(level):,.0f} | {held:,} | {worst:.3g} m |")
    simplified = [e for e in campus.objects if e.meshes[0].faces < e.meshes[-1].faces]
    if not simplified:
        return
    shares, metres = [], []
    for each in simplified:
        found = error(folder, each)
        box = np.array(each.box)
        metres.append(found)
        shares.append(found / np.linalg.norm(box[3:] - box[:3]))
    every, relative = np.concatenate(metres), np.concatenate(shares)
    lost = np.isinf(every).mean()
    every, relative = every[np.isfinite(every)], relative[np.isfinite(relative)]
    metre, share = np.percentile(every, 95), np.percentile(relative, 95)
    print(
        f"\nsimplified: {len(simplified):,} of {len(campus.objects):,} objects; from the finest "
        f"mesh to the coarsest: mean {every.mean():.3g} m, 95 % within {metre:.3g} m; of the "
        f"diagonal: mean {relative.mean():.2%}, 95 % within {share:.2%}; "
        f"nothing found from {lost:.2%}"
    )


def say_textures(made: Made) -> None:
    print("\n| textures | size | files | average KB | paper | larger than their source |")
    print("|---|---|---|---|---|---|")
    for kind in kinds(made.campus):
        print(
            f"| {WORDS[kind.channel]} | {kind.size}² | {kind.files:,} | {kind.average:.2f} | "
            f"{kind.paper:.2f} | {kind.enlarged:,} B |"
        )
    if made.covered:
        share = made.computed / made.covered
        print(
            f"\nof {made.covered:,} texels of lightmaps on faces, {share:.1%} were computed by rays"
        )


def say_presets(made: Made) -> None:
    campus = made.campus
    print(f"\nstart: {campus.start:,} bytes")
    print("\n| preset | diffuse / light | bytes | to load |")
    print("|---|---|---|---|")
    for preset in campus.presets:
        sizes = f"{preset.diffuse} / {preset.light}"
        print(f"| {preset.name} | {sizes} | {preset.bytes:,} | {preset.download:,} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("model")
    parser.add_argument("--lightmaps", choices=["bake", "model", "none"], default="bake")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--ratio", type=float, default=CampusOptions().ratio)
    parser.add_argument("--unit", default=None)
    parser.add_argument("-j", "--jobs", type=int, default=0)
    parser.add_argument("--keep", help="write the campus here")
    given = parser.parse_args()
    options = CampusOptions(lightmaps=given.lightmaps, samples=given.samples, ratio=given.ratio)
    with tempfile.TemporaryDirectory() as held, open_executor(given.jobs) as executor:
        folder = Path(given.keep or Path(held) / "campus")
        reading = IngestOptions(unit=given.unit)
        made = make_campus(given.model, folder, options, reading, executor, force=True)
        objects = len(made.campus.objects)
        print(f"{Path(given.model).name}: {objects:,} objects, {executor.workers} workers\n")
        say_levels(folder, made)
        if given.lightmaps == "bake":
            say_light(folder, made, options.reach)
    say_textures(made)
    say_presets(made)
    print("\n| phase | s |")
    print("|---|---|")
    for phase, seconds in made.seconds.items():
        print(f"| {phase} | {seconds:.1f} |")
    for note in made.notes:
        print(f"\nnote: {note}")


if __name__ == "__main__":
    main()
