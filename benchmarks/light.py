"""Measures what light costs: bytes of lightmaps and seconds of baking, and what accuracy costs.

    python benchmarks/light.py [MODEL…] [--jobs 2] [--accuracy]

Each model is built without light and with `--light bake`. *Textures* are the bytes of the model's
`.ptm`s; *lightmaps* those of the lightmaps' `.ptm`s, and *geometry* by how much more the GLBs have
with gzip. The first room is that of `ptm build-scene`. With `--accuracy`, the lightmaps of each
model at several densities and numbers of rays: the error is the root mean square from the light by
`REFERENCE` rays at points of the surfaces, of 255, as a client looks it up.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scenes import model_file

from ptmtools.arrays import Floats, areas
from ptmtools.light.cells import ABOVE, COVERED, Baking, exposed
from ptmtools.light.looks import LightImage, lookup
from ptmtools.light.occlusion import Surroundings, light, normals, points_on, spread_over, turns
from ptmtools.light.options import LightOptions
from ptmtools.output.content import Geometry
from ptmtools.output.pieces import pieces_of
from ptmtools.output.served import on_link
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stage import Artifacts
from ptmtools.pipeline.stages import APO, CELLS, EMIT, LIGHT, TEXTURES

#: Rays of the reference, and its points.
REFERENCE, POINTS = 1024, 2000
DENSITIES, SAMPLES = (2.5, 5.0, 10.0, 20.0), (16, 64, 256)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("models", nargs="*", default=["museum", "hospital", "office", "gallery"])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--accuracy", action="store_true")
    arguments = parser.parse_args()
    if arguments.accuracy:
        for model in arguments.models:
            accuracy(model_file(model))
        return
    print("| model | lightmaps | texels | s | textures, kB | lightmaps, kB | of textures ", end="")
    print("| geometry, kB | first room, kB | with light |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for model in arguments.models:
        print(row(model, model_file(model), arguments.jobs), flush=True)


def row(name: str, model: Path, jobs: int) -> str:
    """A row of the first table."""
    with tempfile.TemporaryDirectory() as folder:
        measured: list[dict[str, Any]] = []
        for light in ("none", "bake"):
            db = Path(folder, light)
            report = build_scene(model, db, LightOptions(light), workers=jobs)
            stages = {stage.stage: stage for stage in report.stages}
            glbs = (db / "www/gltf").glob("*.glb")
            measured.append({
                "geometry": sum(on_link(file.read_bytes()) for file in glbs),
                "room": stages[EMIT.name].counts["visit"]["first_room"],
                "textures": stages[TEXTURES.name].counts["ptm_bytes"],
                "light": stages.get(LIGHT.name),
            })  # fmt: skip
    plain, lit = measured
    counts = lit["light"].counts
    share = counts["ptm_bytes"] / max(plain["textures"], 1)
    numbers = (plain["textures"], counts["ptm_bytes"])
    return (
        f"| {name} | {counts['lightmaps']:,} | {counts['texels']:,} | {lit['light'].seconds:.1f} "
        f"| {numbers[0] / 1e3:,.0f} | {numbers[1] / 1e3:,.0f} | {share:.1%} "
        f"| {(lit['geometry'] - plain['geometry']) / 1e3:,.0f} "
        f"| {plain['room'] / 1e3:,.0f} | {lit['room'] / 1e3:,.0f} |"
    )


def accuracy(model: Path) -> None:
    """The second table."""
    with tempfile.TemporaryDirectory() as folder:
        build_scene(model, folder, until=CELLS)
        artifacts = Artifacts(open_database(folder))
        scene, cells = artifacts[APO], artifacts[CELLS]
    glass = np.array([m.opacity < 1 and m.image < 0 for m in scene.materials])
    pieces = pieces_of(Geometry(scene, cells), cells, glass, 1 / LightOptions().light_density)
    around = Surroundings.of(scene)
    print(f"| {model.stem}: texels per metre | rays | s, one processor | texels | error |")
    print("|--:|--:|--:|--:|--:|")
    for density in DENSITIES:
        for samples in SAMPLES:
            options = LightOptions("bake", density, samples)
            began, texels, square, count = time.process_time(), 0, 0.0, 0
            results = [Baking(around, options).light(piece) for piece in pieces]
            seconds = time.process_time() - began
            for piece, result in zip(pieces, results, strict=True):
                if result.texels is None:
                    continue
                texels += result.texels.size
                off = errors(around, piece.corner.astype(np.float64), result, options)
                square, count = square + float((off**2).sum()), count + len(off)
            error = 255 * np.sqrt(square / max(count, 1))
            print(f"| {density:g} | {samples} | {seconds:.1f} | {texels:,} | {error:.2f} |")
            sys.stdout.flush()


def errors(around: Surroundings, corner: Floats, result: Any, options: LightOptions) -> Floats:
    """(n,) differences of the lightmap of a cell from the reference, of points that are not
    covered."""
    area = areas(corner)
    face = spread_over(area, np.zeros(len(corner), np.int64), np.array([0]), POINTS)[0]
    number = np.arange(POINTS)
    point = points_on(corner[face], number)
    both = [
        light(around, point, way * normals(corner)[face], turns(POINTS), REFERENCE,
              options.light_reach, ABOVE)
        for way in (1, -1)
    ]  # fmt: skip
    a = corner[face, 0]
    u, v, w = corner[face, 1] - a, corner[face, 2] - a, point - a
    uu, uv, vv = (np.einsum("nk,nk->n", p, q) for p, q in ((u, u), (u, v), (v, v)))
    wu, wv = (np.einsum("nk,nk->n", w, q) for q in (u, v))
    det = uu * vv - uv * uv
    second, third = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    share = np.stack([1 - second - third, second, third], axis=1)
    at = np.einsum("nk,nkx->nx", share, result.uv[face].astype(np.float64))
    seen = lookup(LightImage(result.texels, ("clamp", "clamp")), at)
    # The side that was baked is the nearer one.
    off = np.abs(exposed(np.stack(both)) - seen)
    fair = np.max(both, axis=0) > COVERED
    return np.asarray(off.min(axis=0)[fair])


if __name__ == "__main__":
    main()
