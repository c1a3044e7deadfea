"""The experiment of baked light: what clients look up in lightmaps, beside the light at points.

The reference is the light by far more rays, and of all lamps, at random points of the surfaces of a
few of the largest cells, without texels, smoothing, codes and lossy images. What is covered, as a
wall by a picture, does not count: lightmaps have the light of the neighbours there.

The error is the mean difference of luminance in stops, |log2 (a / b)|: the eye judges ratios, and a
few points in hidden corners that are 40 times as bright as they should be do not outweigh all
others, as in the mean of relative differences and in root mean squares. Light of less than `DIM` of
the usual one counts as this.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, areas
from ptmtools.light.cells import CellLight, LightBaking
from ptmtools.light.looks import LightImage, lookup
from ptmtools.light.model import HUE, CellSurfaces, coded_light, lossy_codes, scale_hue
from ptmtools.output.geometry import Geometry
from ptmtools.output.pieces import pieces_of
from ptmtools.pipeline.stages import CELLS, LIGHT, SCENE
from ptmtools.pipeline.stages.light import QUALITY, light_baking, true_works, unlit_faces
from ptmtools.pipeline.stages.scene import lights_of, scene_origin
from ptmtools.scene.colors import luminance, to_linear
from ptmtools_lab.tradeoff.experiment import (
    Experiment,
    Measurement,
    Setting,
    Subject,
    time_work,
)

#: Cells that stand for all, the largest, and points of each.
TRIED, POINTS = 4, 2_000
#: Rays of the reference.
MOST = 4_096
#: The least light that counts, as a share of the usual one.
DIM = 0.01


def prepare_lightmaps(subject: Subject, limit: int = MOST) -> Experiment:
    """See `EXPERIMENTS`. The light is baked, even if the database has that of its model."""
    artifacts = subject.artifacts
    scene, lights = artifacts[SCENE], lights_of(artifacts)
    options = replace(subject.options(LIGHT), light="bake")
    works = true_works(scene, options.true_colours, painted=False)
    unlit = unlit_faces(scene, lights, works, painted=False)
    geometry, replaced = Geometry(scene, artifacts[CELLS]), scene_origin(artifacts).objects

    def pieces(density: float) -> list[CellSurfaces]:
        return pieces_of(geometry, artifacts[CELLS], unlit, 1 / density, replaced)

    fine = pieces(options.light_density)
    # Small ones may be gaps out of sight.
    size = np.array([areas(p.corner[~p.glass].astype(np.float64)).sum() for p in fine])
    chosen = [n for n in np.argsort(-size, kind="stable")[:TRIED].tolist() if size[n] > 0]
    baking = light_baking(artifacts, options, None, lights, fine)
    return lightmap_experiment(baking, pieces, chosen, limit)


def lightmap_experiment(
    baking: LightBaking,
    pieces: Callable[[float], list[CellSurfaces]],
    cells: Sequence[int],
    limit: int,
) -> Experiment:
    """The experiment of the texels and rays of the lightmaps of some cells. ``pieces``: of all
    cells, for texels to the metre; ``limit``: rays of the reference."""
    recorded, building = baking.options, baking.building
    assert building is not None
    least = DIM * building.usual
    random = np.random.default_rng(0)
    places: list[tuple[Ints, Floats]] = []
    halves: list[Floats] = [np.zeros((2, 0))]
    for piece in (pieces(recorded.light_density)[cell] for cell in cells):
        corner = piece.corner.astype(np.float64)
        area = np.where(piece.glass, 0.0, areas(corner))
        face = random.choice(len(area), POINTS, p=area / area.sum())
        share = random.dirichlet((1, 1, 1), POINTS)
        point = np.einsum("nk,nkx->nx", share, corner[face])
        near = 0.5 / recorded.light_density
        look = building.look(corner, baking.sides(corner, piece), limit // 2, near)
        look = replace(look, lamps=building.lamps)
        twice = np.stack([look(face, point, random.random(POINTS)) for _ in range(2)])
        half = luminance(twice.astype(np.float64))
        sound = ~np.isnan(half).any(axis=0)
        places.append((face[sound], share[sound]))
        halves.append(np.maximum(half[:, sound], least))
        replace(baking, options=replace(recorded, light_samples=1)).light(piece)  # compiles it
    first, second = np.concatenate(halves, axis=1)
    truth = (first + second) / 2

    def measure(setting: Setting) -> Measurement:
        options = replace(recorded, **setting.knobs)
        chosen = [pieces(options.light_density)[cell] for cell in cells]
        with_options = replace(baking, options=options)
        made, seconds = time_work(lambda: [with_options.light(piece) for piece in chosen])
        images = [b"" if k.texels is None else lossy_codes(k.texels, QUALITY)[1] for k in made]
        rows = zip(made, images, chosen, places, strict=True)
        shown = np.concatenate(
            [_shown_light(light, image, piece, *place) for light, image, piece, place in rows]
        )
        off = np.abs(np.log2(np.maximum(luminance(shown), least) / truth))
        return Measurement(
            seconds=seconds,
            work=float(sum(map(len, images))),
            error=float(off.mean()),
            worst=float(np.percentile(off, 95)),
            more={
                "texels": float(sum(0 if k.texels is None else k.texels[..., 0].size for k in made))
            },
        )

    settings = [
        Setting(f"--light-density {n:g}", {"light_density": n}, "density")
        for n in (2.5, 5.0, 10.0, 20.0)
    ]
    # Rays do not change the bytes.
    settings += [
        Setting(f"--light-samples {n}", {"light_samples": n})
        for n in (4, 8, 16, 32, 64, 256)
        if n < limit
    ]
    return Experiment(
        f"bytes of the lightmaps of {len(cells)} cells",
        "mean difference of luminance, stops",
        settings if cells else [],
        measure,
        float(np.abs(np.log2(first / second)).mean() / 2) if cells else 0.0,
        units={"work": "B", "error": "stops"},
    )


def _shown_light(
    light: CellLight, image: bytes, piece: CellSurfaces, face: Ints, share: Floats
) -> Floats:
    """(n, 3) the light that clients show at places of (n,) faces."""
    vertex = light.white * to_linear(light.vertex[face] / 255)
    at_vertices = np.einsum("nk,nkc->nc", share, vertex)
    if not image:
        return np.asarray(at_vertices)
    at = np.einsum("nk,nkx->nx", share, light.uv[face].astype(np.float64))
    codes = [lookup(LightImage(channel, ("clamp", "clamp")), at) for channel in _channels(image)]
    code = scale_hue(255 * np.stack(codes, axis=1).astype(np.float64), 1 / HUE)
    mapped = coded_light(code, light.white)
    return np.where(piece.dense[face, None], at_vertices, mapped)


def _channels(image: bytes) -> NDArray[np.uint8]:
    """(3, h, w) the codes of the image of a lightmap."""
    from PIL import Image

    with Image.open(io.BytesIO(image)) as opened:
        return np.moveaxis(np.asarray(opened.convert("RGB")), 2, 0).copy()
