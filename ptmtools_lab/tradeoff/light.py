"""The experiment of baked light: what clients look up in lightmaps, beside the light at points.

The reference is the light by far more rays at random points of the surfaces of a few cells, without
texels and without smoothing. What is covered, as a wall by a picture, does not count: lightmaps
have the light of the neighbours there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ptmtools.arrays import Floats, Ints, areas
from ptmtools.light.cells import ABOVE, COVERED, WHITE, CellLight, LightBaking, expose
from ptmtools.light.lamps import lamps_of
from ptmtools.light.looks import LightImage, lookup
from ptmtools.light.mixing import light_mix
from ptmtools.light.model import CellSurfaces
from ptmtools.light.occlusion import Occluders
from ptmtools.output.geometry import Geometry
from ptmtools.output.pieces import pieces_of
from ptmtools.pipeline.stages import CELLS, LIGHT, SCENE
from ptmtools.pipeline.stages.light import unlit_materials
from ptmtools.pipeline.stages.scene import lights_of, scene_origin
from ptmtools_lab.tradeoff.experiment import (
    Experiment,
    Measurement,
    Setting,
    Subject,
    decibels,
    time_work,
)

#: Cells that stand for all, and points of each.
TRIED, POINTS = 4, 2_000
#: Rays of the reference.
MOST = 4_096


def prepare_lightmaps(subject: Subject, limit: int = MOST) -> Experiment:
    """See `EXPERIMENTS`. The light is baked, even if the database has that of its model."""
    artifacts = subject.artifacts
    scene, lights = artifacts[SCENE], lights_of(artifacts)
    options = replace(subject.options(LIGHT), light="bake")
    dark = unlit_materials(scene, lights, painted=False)
    geometry, replaced = Geometry(scene, artifacts[CELLS]), scene_origin(artifacts).objects

    def pieces(density: float) -> list[CellSurfaces]:
        return pieces_of(geometry, artifacts[CELLS], dark, 1 / density, replaced)

    around, fine = Occluders.from_scene(scene), pieces(options.light_density)
    mix = light_mix(around, fine, lamps_of(scene, lights), options, ABOVE, WHITE)
    lit = [n for n, piece in enumerate(fine) if not piece.glass.all()]
    chosen = np.unique(np.linspace(0, len(lit) - 1, min(TRIED, len(lit))).astype(int)).tolist()
    cells = [lit[n] for n in chosen]
    return lightmap_experiment(LightBaking(around, options, mix), pieces, cells, limit)


def lightmap_experiment(
    baking: LightBaking,
    pieces: Callable[[float], list[CellSurfaces]],
    cells: Sequence[int],
    limit: int,
) -> Experiment:
    """The experiment of the texels and rays of the lightmaps of some cells. ``pieces``: of all
    cells, for texels to the metre; ``limit``: rays of the reference."""
    recorded, random = baking.options, np.random.default_rng(0)
    exact = replace(baking, options=replace(recorded, light_samples=limit))
    places: list[tuple[Ints, Floats]] = []
    truth, again = [], []
    for piece in (pieces(recorded.light_density)[cell] for cell in cells):
        corner = piece.corner.astype(np.float64)
        area = np.where(piece.glass, 0.0, areas(corner))
        face = random.choice(len(area), POINTS, p=area / area.sum())
        share = random.dirichlet((1, 1, 1), POINTS)
        point = np.einsum("nk,nkx->nx", share, corner[face])
        look = exact.look(corner, exact.sides(corner, piece.side), piece.face)
        first, second = (look(face, point, random.random(POINTS)) for _ in range(2))
        open_to = first >= COVERED
        places.append((face[open_to], share[open_to]))
        truth.append(expose(first[open_to]))
        again.append(expose(second[open_to]))
        replace(baking, options=replace(recorded, light_samples=1)).light(piece)  # compiles it
    right = np.concatenate([np.zeros(0), *truth])
    noise = 255 * (np.concatenate([np.zeros(0), *again]) - right)

    def measure(setting: Setting) -> Measurement:
        options = replace(recorded, **setting.knobs)
        chosen = [pieces(options.light_density)[cell] for cell in cells]
        with_options = replace(baking, options=options)
        made, seconds = time_work(lambda: [with_options.light(piece) for piece in chosen])
        rows = zip(made, chosen, places, strict=True)
        shown = np.concatenate([_shown_light(light, piece, *place) for light, piece, place in rows])
        off = np.abs(255 * (shown - right))
        error = float(np.sqrt(np.square(off).mean()))
        return Measurement(
            seconds=seconds,
            work=float(sum(0 if k.texels is None else k.texels.size for k in made)),
            error=error,
            worst=float(np.percentile(off, 95)),
            more={"PSNR": decibels(error)},
        )

    values = {"density": (2.5, 5.0, 10.0, 20.0), "samples": (4, 16, 64, 256)}
    settings = [
        Setting(f"--light-{name} {value:g}", {f"light_{name}": value}, name)
        for name, some in values.items()
        for value in some
        if name != "samples" or value < limit
    ]
    return Experiment(
        f"texels of the lightmaps of {len(cells)} cells",
        "RMS error of linear light, of 255",
        settings if cells else [],
        measure,
        float(np.sqrt(np.square(noise).mean() / 2)) if cells else 0.0,
        units={"PSNR": "dB"},
    )


def _shown_light(light: CellLight, piece: CellSurfaces, face: Ints, share: Floats) -> Floats:
    """(n,) the light, 0 to 1, that clients show at places of (n,) faces."""
    at_vertices = np.einsum("nk,nk->n", share, light.vertex[face] / 255)
    if light.texels is None:
        return np.asarray(at_vertices)
    at = np.einsum("nk,nkx->nx", share, light.uv[face].astype(np.float64))
    mapped = lookup(LightImage(light.texels, ("clamp", "clamp")), at)
    return np.where(piece.dense[face], at_vertices, mapped)
