"""Measures what light costs: bytes of lightmaps, and seconds of baking beside other stages.

    python benchmarks/light.py [MODEL…] [--jobs 2] [--model]

Each model is built without light and with `--light bake`. *Textures* are the bytes of the previews
of the model's images, *lightmaps* all served bytes of the lightmaps, and *geometry* by how much
more the GLBs have with gzip. The first room is that of `ptm build-scene`. `ptm tradeoff DB --stage
light` measures accuracy.

With `--model`, each model becomes a glTF with one lightmap of `SIDE` texels, of its ambient
obscurance, and a database of it has default options: the bytes of the lightmaps against those of
the PNG in the glTF, and the error of the light at points of the surfaces, of 255.
"""

from __future__ import annotations

import argparse
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scenes import model_file

from ptmtools.arrays import Floats, areas
from ptmtools.light.atlas import unwrap
from ptmtools.light.looks import LightImage, PaintedLight, lookup
from ptmtools.light.model import coded_light
from ptmtools.light.occlusion import Occluders, points_on, spread_over, turns
from ptmtools.light.options import LightOptions
from ptmtools.output.geometry import Geometry
from ptmtools.output.gltf import pack
from ptmtools.output.pieces import pieces_of
from ptmtools.output.served import on_link, read_served
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stages import CELLS, EMIT, LIGHT, SCENE, TEXTURES
from ptmtools.scene import ingest
from ptmtools.texture import load_image
from ptmtools.texture.images import png_bytes
from ptmtools_systems.campus.lightmaps import bake
from ptmtools_systems.campus.obscurance import RayLight

#: Points of a cell.
POINTS = 2000
#: Texels of the lightmap of a glTF; rays of a texel, and metres beyond which nothing occludes.
SIDE, RAYS, REACH = 2048, 64, 3.0
#: Light of a texel without any, as a share of white.
DARK = 0.15


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("models", nargs="*", default=["museum", "hospital", "office", "gallery"])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--model", action="store_true")
    arguments = parser.parse_args()
    if arguments.model:
        print("| model | lightmaps | PNG of the glTF, kB | lightmaps, kB | of the PNG | error |")
        print("|---|--:|--:|--:|--:|--:|")
        for model in arguments.models:
            print(redrawn_row(model_file(model)), flush=True)
        return
    print("| model | lightmaps | texels | s of light | s of all others | textures, kB ", end="")
    print("| lightmaps, kB | of textures | geometry, kB | first room, kB | with light |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for model in arguments.models:
        print(cost_row(model, model_file(model), arguments.jobs), flush=True)


def cost_row(name: str, model: Path, jobs: int) -> str:
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
                "textures": stages[TEXTURES.name].counts["preview_bytes"],
                "others": sum(s.seconds for s in report.stages if s.stage != LIGHT.name),
                "light": stages.get(LIGHT.name),
            })  # fmt: skip
    plain, lit = measured
    counts = lit["light"].counts
    share = counts["bytes"] / max(plain["textures"], 1)
    return (
        f"| {name} | {counts['lightmaps']:,} | {counts['texels']:,} | {lit['light'].seconds:.1f} "
        f"| {lit['others']:.1f} | {plain['textures'] / 1e3:,.0f} | {counts['bytes'] / 1e3:,.0f} "
        f"| {share:.1%} | {(lit['geometry'] - plain['geometry']) / 1e3:,.0f} "
        f"| {plain['room'] / 1e3:,.0f} | {lit['room'] / 1e3:,.0f} |"
    )


def redrawn_row(model: Path) -> str:
    """A row of the second table."""
    scene = ingest(model)
    corner, area = scene.corners, areas(scene.corners)
    atlas = unwrap(scene.points, scene.triangles, (SIDE,), padding=1, purpose="the benchmark")
    look = RayLight(Occluders.from_scene(scene), corner, RAYS, REACH)
    (baked,) = bake(look, corner, atlas, look.grain, (SIDE,))
    texels = np.rint(255 * (DARK + (1 - DARK) * baked.value)).astype(np.uint8)
    image = png_bytes(texels[:, :, None])
    with tempfile.TemporaryDirectory() as folder:
        lit, db = Path(folder, "lit.glb"), Path(folder, "db")
        lit.write_bytes(lit_glb(corner, atlas.uv, image))
        report = build_scene(lit, db)
        (stage,) = (stage for stage in report.stages if stage.stage == LIGHT.name)
        artifacts, served = Artifacts(open_database(str(db))), read_served(db)
        light, scene, cells = artifacts.stored(LIGHT), artifacts[SCENE], artifacts[CELLS]
        assert light is not None
        rows = (row for row in served.index["textures"] if "light" in row)
        codes = {
            row["light"]: load_image(served.file(row["previews"][-1]["file"])).array()[..., 0]
            for row in rows
        }
    geometry = Geometry(scene, cells)
    painted = LightImage(texels, ("clamp", "clamp"))
    source_light = PaintedLight(
        corner, atlas.uv, np.zeros(len(area), np.int32), (painted,), np.arange(len(area))
    )
    square, count = 0.0, 0
    for cell, piece in enumerate(
        pieces_of(geometry, cells, np.zeros(len(scene.triangles), np.bool_), 1.0)
    ):
        span = slice(*geometry.triangle_start[geometry.cell_start[cell : cell + 2]].tolist())
        mapped = light.mapped[geometry.cell_start[cell] + piece.shape]
        if not mapped.any():
            continue
        share = areas(piece.corner[mapped].astype(np.float64))
        face = spread_over(share, np.zeros(len(share), np.int64), np.array([0]), POINTS)[0]
        number = np.arange(POINTS)
        flat = np.pad(light.uv[span][mapped], [(0, 0), (0, 0), (0, 1)]).astype(np.float64)
        place = points_on(flat[face], number)[:, :2]
        code = 255 * lookup(LightImage(codes[cell], ("clamp", "clamp")), place)
        point = points_on(piece.corner[mapped][face].astype(np.float64), number)
        truth = source_light(piece.face[mapped][face], point, turns(POINTS))[:, 0]
        square += float(((coded_light(code, light.white[cell]) - truth) ** 2).sum())
        count += POINTS
    error = 255 * np.sqrt(square / max(count, 1))
    size = stage.counts["bytes"]
    return (
        f"| {model.stem} | {stage.counts['lightmaps']} | {len(image) / 1e3:,.0f} "
        f"| {size / 1e3:,.0f} | {size / len(image):.2f} | {error:.2f} |"
    )


def lit_glb(corner: Floats, uv: Floats, image: bytes) -> bytes:
    """A GLB of (T, 3, 3) faces with a lightmap, a PNG, at (T, 3, 2) coordinates."""
    place = uv.astype("<f4") * np.float32([1, -1]) + np.float32([0, 1])
    data = [corner.astype("<f4").tobytes(), place.tobytes(), image]
    start = np.cumsum([0, *map(len, data)]).tolist()
    count = 3 * len(corner)
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "building", "mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_1": 1}, "material": 0}]}
        ],
        "materials": [{"doubleSided": True, "occlusionTexture": {"index": 0, "texCoord": 1}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 2, "mimeType": "image/png"}],
        "buffers": [{"byteLength": start[-1]}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": a, "byteLength": b - a} for a, b in pairwise(start)
        ],
        "accessors": [
            {"bufferView": k, "componentType": 5126, "count": count, "type": f"VEC{3 - k}"}
            for k in (0, 1)
        ],
    }
    return pack(document, b"".join(data))


if __name__ == "__main__":
    main()
