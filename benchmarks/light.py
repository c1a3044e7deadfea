"""Measures what light costs: bytes of lightmaps and seconds of baking, and what accuracy costs.

    python benchmarks/light.py [MODEL…] [--jobs 2] [--accuracy | --parts | --model | --vertices]

Each model is built without light and with `--light bake`. *Textures* are the bytes of the model's
`.ptm`s; *lightmaps* those of the lightmaps' `.ptm`s, and *geometry* by how much more the GLBs have
with gzip. The first room is that of `ptm build-scene`. With `--accuracy`, the lightmaps of each
model at several densities and numbers of rays: the error is the root mean square from the light by
`REFERENCE` rays at points of the surfaces, of 255, as a client looks it up.

With `--parts`, what the sky and lamps cost beside ambient light: seconds of one processor, and
bytes of the lightmaps' `.ptm`s. The lamps are panels of 0.6 m below the ceilings, one in each cell.

With `--model`, each model becomes a glTF with one lightmap of `SIDE` texels, and a database of it
has default options: the bytes of the lightmaps' `.ptm`s against those of the PNG in the glTF, and
the error of the light at points of the surfaces, of 255.

With `--vertices`, what the rays of objects with light at vertices cost: seconds of one processor,
and the root mean square, of 255, of interpolated light from the light by `REFERENCE` rays, at
points spread evenly over these objects. The last row of each model is the default.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ptmtools.light.mixing import LightMix, light_mix
from scenes import model_file

from ptmtools.arrays import Bools, Floats, areas
from ptmtools.cells.model import Cells
from ptmtools.light.atlas import unwrap
from ptmtools.light.cells import ABOVE, COVERED, WHITE, LightBaking, encode, expose
from ptmtools.light.lamps import lamps_of
from ptmtools.light.lightmap import bake
from ptmtools.light.looks import LightImage, PaintedLight, RayLight, lookup
from ptmtools.light.model import CellSurfaces
from ptmtools.light.occlusion import Occluders, light, normals, points_on, spread_over, turns
from ptmtools.light.options import LightOptions
from ptmtools.output.geometry import Geometry
from ptmtools.output.gltf import pack
from ptmtools.output.pieces import pieces_of
from ptmtools.output.served import on_link
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.encoding import TextureOptions, encode_texels
from ptmtools.pipeline.stages import CELLS, EMIT, LIGHT, SCENE, TEXTURES
from ptmtools.pipeline.stages.light import lightmap_files
from ptmtools.scene import Scene, ingest
from ptmtools.scene.lights import Lights
from ptmtools.scene.model import Material
from ptmtools.texture import decode
from ptmtools.texture.images import png_bytes

#: Rays of the reference, and its points.
REFERENCE, POINTS = 1024, 2000
#: Texels of the lightmap of a glTF.
SIDE = 2048
DENSITIES, SAMPLES = (2.5, 5.0, 10.0, 20.0), (16, 64, 256)
#: Points of a building at which light at vertices is examined.
ON_OBJECTS = 20_000


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("models", nargs="*", default=["museum", "hospital", "office", "gallery"])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--accuracy", action="store_true")
    parser.add_argument("--parts", action="store_true")
    parser.add_argument("--model", action="store_true")
    parser.add_argument("--vertices", action="store_true")
    arguments = parser.parse_args()
    for chosen, table in (
        (arguments.accuracy, accuracy),
        (arguments.parts, parts),
        (arguments.model, of_the_model),
        (arguments.vertices, at_vertices),
    ):
        if chosen:
            for model in arguments.models:
                table(model_file(model))
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
    scene, cells = cut(model)
    glass = np.array([m.opacity < 1 and m.image < 0 for m in scene.materials])
    pieces = pieces_of(Geometry(scene, cells), cells, glass, 1 / LightOptions().light_density)
    around = Occluders.from_scene(scene)
    print(f"| {model.stem}: texels per metre | rays | s, one processor | texels | error |")
    print("|--:|--:|--:|--:|--:|")
    for density in DENSITIES:
        for samples in SAMPLES:
            options = LightOptions("bake", density, samples)
            began, texels, square, count = process_time(), 0, 0.0, 0
            results = [LightBaking(around, options).light(piece) for piece in pieces]
            seconds = process_time() - began
            for piece, result in zip(pieces, results, strict=True):
                if result.texels is None:
                    continue
                texels += result.texels.size
                off = errors(around, piece.corner.astype(np.float64), result, options)
                square, count = square + float((off**2).sum()), count + len(off)
            error = 255 * np.sqrt(square / max(count, 1))
            print(f"| {density:g} | {samples} | {seconds:.1f} | {texels:,} | {error:.2f} |")
            sys.stdout.flush()


def cut(model: Path) -> tuple[Scene, Cells]:
    """The scene of a model, and its cells."""
    with tempfile.TemporaryDirectory() as folder:
        build_scene(model, folder, until=CELLS)
        artifacts = Artifacts(open_database(folder))
        return artifacts[SCENE], artifacts[CELLS]


def parts(model: Path) -> None:
    """The third table."""
    scene, cells = cut(model)
    glass = np.array([m.opacity < 1 and m.image < 0 for m in scene.materials])
    pieces = pieces_of(Geometry(scene, cells), cells, glass, 1 / LightOptions().light_density)
    options, lit = LightOptions("bake"), with_panels(scene, cells)
    print(f"| {model.stem} | patches of lamps | slope | s, one processor | of ambient | .ptm, kB |")
    print("|---|--:|--:|--:|--:|--:|")
    least = 0.0
    for name, of, glowing in (("ambient", scene, None), ("+ sky", scene, None), ("+ lamps", *lit)):
        around, began = Occluders.from_scene(of), process_time()
        mix = LightMix()
        if name != "ambient":
            mix = light_mix(around, pieces, lamps_of(of, glowing), options, ABOVE, WHITE)
        results = [LightBaking(around, options, mix).light(piece) for piece in pieces]
        seconds = process_time() - began
        least = least or seconds
        size = sum(ptm_bytes(r.texels) for r in results if r.texels is not None)
        lamps = 0 if mix.lamps is None else len(mix.lamps)
        print(f"| {name} | {lamps} | {mix.slope:.2f} | {seconds:.1f} | {seconds / least:.2f} "
              f"| {size / 1e3:,.0f} |", flush=True)  # fmt: skip


def ptm_bytes(texels: NDArray[np.uint8]) -> int:
    """The bytes of a lightmap as stored."""
    return len(encode_texels(TextureOptions(fallback=False), "light", texels[:, :, None])[0][1])


def with_panels(scene: Scene, cells: Cells) -> tuple[Scene, Lights]:
    """The scene with a panel that glows below the ceiling of each cell, and its lights."""
    middle = []
    for cell in range(cells.cell_count):
        own = np.flatnonzero(cells.leaf_cell == cell)
        rows = [cells.leaf_point[slice(*cells.leaf_point_start[k : k + 2])] for k in own]
        corner = np.concatenate(rows)
        middle.append((corner.min(axis=0) + corner.max(axis=0)) / 2)
    place = np.array(middle)
    place[:, 1] = Occluders.from_scene(scene).upright(place, 20.0, 1.0) - 0.02
    panel = 0.3 * np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    points = (place[:, None] + panel).reshape(-1, 3)
    first = len(scene.points) + 4 * np.arange(len(place))[:, None, None]
    triangles = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    new, materials = len(triangles), len(scene.materials)
    longer = replace(
        scene,
        points=np.concatenate([scene.points, points]),
        triangles=np.concatenate([scene.triangles, triangles]).astype(np.int32),
        uv=np.concatenate([scene.uv, np.zeros((new, 3, 2))]),
        triangle_object=np.append(scene.triangle_object, np.zeros(new, np.int32)),
        triangle_material=np.append(scene.triangle_material, np.full(new, materials, np.int32)),
        two_sided=np.append(scene.two_sided, np.zeros(new, np.bool_)),
        materials=(*scene.materials, Material("panel")),
        colors=None,
    )
    glow = Lights.none(materials + 1).glow
    glow[-1] = 1
    return longer, replace(Lights.none(materials + 1), glow=glow)


def of_the_model(model: Path) -> None:
    """The fourth table."""
    scene = ingest(model)
    corner, area = scene.corners, areas(scene.corners)
    atlas = unwrap(scene.points, scene.triangles, (SIDE,), padding=1, purpose="the benchmark")
    look = RayLight(
        Occluders.from_scene(scene), corner, LightOptions().light_samples, 3.0, above=ABOVE
    )
    texels = encode(bake(look, corner, atlas, look.grain, (SIDE,))[0].value)
    image = png_bytes(texels[:, :, None])
    with tempfile.TemporaryDirectory() as folder:
        lit = Path(folder, "lit.glb")
        lit.write_bytes(lit_glb(corner, atlas.uv, image))
        report = build_scene(lit, Path(folder, "db"), until=LIGHT)
        (stage,) = (stage for stage in report.stages if stage.stage == LIGHT.name)
        artifacts = Artifacts(open_database(str(Path(folder, "db"))))
        light, files = artifacts.stored(LIGHT), {}
        assert light is not None
        for cell, name in lightmap_files(light).items():
            files[cell] = decode(Path(folder, "db/www", name).read_bytes())[:, :, 0]
        scene, cells = artifacts[SCENE], artifacts[CELLS]
    geometry = Geometry(scene, cells)
    pieces = pieces_of(geometry, cells, np.zeros(1, np.bool_), 1.0)
    painted = LightImage(texels, ("clamp", "clamp"))
    square, count = 0.0, 0
    for cell, piece in enumerate(pieces):
        rows = slice(*geometry.triangle_start[geometry.cell_start[cell : cell + 2]].tolist())
        own = light.mapped[geometry.cell_start[cell] + piece.shape]
        if not own.any():
            continue
        share = areas(piece.corner[own].astype(np.float64))
        face = spread_over(share, np.zeros(len(share), np.int64), np.array([0]), POINTS)[0]
        number = np.arange(POINTS)
        flat = [np.pad(k, [(0, 0), (0, 0), (0, 1)]) for k in (light.uv[rows][own], atlas.uv)]
        seen = lookup(LightImage(files[cell], ("clamp", "clamp")),
                      points_on(flat[0][face].astype(np.float64), number)[:, :2])  # fmt: skip
        point = points_on(piece.corner[own][face].astype(np.float64), number)
        source = piece.face[own][face]
        there = PaintedLight(scene.corners, atlas.uv, np.zeros(len(area), np.int32), (painted,),
                        np.arange(len(area)))(source, point, turns(POINTS))  # fmt: skip
        square, count = square + float(((seen - there) ** 2).sum()), count + POINTS
    error = 255 * np.sqrt(square / max(count, 1))
    print("| model | lightmaps | PNG of the glTF, kB | .ptm, kB | of the PNG | error |")
    print("|---|--:|--:|--:|--:|--:|")
    size = stage.counts["ptm_bytes"]
    print(f"| {model.stem} | {stage.counts['lightmaps']} | {len(image) / 1e3:,.0f} "
          f"| {size / 1e3:,.0f} | {size / len(image):.2f} | {error:.2f} |", flush=True)  # fmt: skip


def at_vertices(model: Path) -> None:
    """The fifth table."""
    scene, cells = cut(model)
    glass = np.array([m.opacity < 1 and m.image < 0 for m in scene.materials])
    pieces = pieces_of(Geometry(scene, cells), cells, glass, 1 / LightOptions().light_density)
    around, options = Occluders.from_scene(scene), LightOptions("bake")
    mix = light_mix(around, pieces, lamps_of(scene, None), options, ABOVE, WHITE)
    objects = [part(piece, piece.dense & ~piece.glass) for piece in pieces]
    objects = [piece for piece in objects if len(piece.corner)]
    print("| model | triangles | rays from a texel | s, one processor | error |")
    print("|---|--:|--:|--:|--:|")
    if not objects:
        print(f"| {model.stem} | 0 | – | – | – |", flush=True)
        return
    exact = LightBaking(around, replace(options, light_samples=REFERENCE), mix)
    count = np.array([len(piece.corner) for piece in objects])
    area = areas(np.concatenate([piece.corner for piece in objects]).astype(np.float64))
    face = spread_over(area, np.zeros(len(area), np.int64), np.array([0]), ON_OBJECTS)[0]
    start = np.cumsum([0, *count.tolist()])
    shares = points_on(np.broadcast_to(np.eye(3), (ON_OBJECTS, 3, 3)), np.arange(ON_OBJECTS))
    places = []
    for piece, (a, b) in zip(objects, pairwise(start.tolist()), strict=True):
        here = (face >= a) & (face < b)
        own, share = face[here] - a, shares[here]
        corner = piece.corner.astype(np.float64)
        look = exact.look(corner, exact.sides(corner, piece.side), piece.face)
        point = np.einsum("nk,nkx->nx", share, corner[own])
        places.append((own, share, expose(look(own, point, turns(len(own))))))
    for samples in (2 * options.light_samples, options.light_samples):
        baking, began = (
            LightBaking(around, replace(options, light_samples=samples), mix),
            process_time(),
        )
        results = [baking.light(piece) for piece in objects]
        seconds, square = process_time() - began, 0.0
        for result, (own, share, truth) in zip(results, places, strict=True):
            seen = np.einsum("nk,nk->n", share, result.vertex[own] / 255)
            square += float(((seen - truth) ** 2).sum())
        error = 255 * np.sqrt(square / ON_OBJECTS)
        print(f"| {model.stem} | {count.sum():,} | {samples} | {seconds:.1f} | {error:.2f} |",
              flush=True)  # fmt: skip


def part(piece: CellSurfaces, chosen: Bools) -> CellSurfaces:
    """The chosen surfaces of a piece."""
    return CellSurfaces(*(getattr(piece, field.name)[chosen] for field in fields(CellSurfaces)))


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


def errors(around: Occluders, corner: Floats, result: Any, options: LightOptions) -> Floats:
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
    off = np.abs(expose(np.stack(both)) - seen)
    fair = np.max(both, axis=0) > COVERED
    return np.asarray(off.min(axis=0)[fair])


if __name__ == "__main__":
    main()
