"""Measures transported light against the path tracer: what patches, passes and rays are worth.

    python benchmarks/light_transport.py [MODEL …] [--views 3] [--noise 3] [--width 320]
        [--height 180]

`ptmtools.light.transport` computes the light of the model's file (`lit_model`); each pixel of a
view then gathers it by itself, without lightmaps, and is drawn with the model's colours beside the
diffuse reference of ``light_reference.py``, with the same exposure and curve. One row varies one
number of the first: the size of patches, the passes, the rays of a pixel. Seconds are those of one
processor, for the building, and for a hundred thousand points.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, replace
from time import process_time

import numpy as np
from light_reference import (
    FOLDER,
    EyeView,
    PathTracer,
    database_of,
    displayed,
    exposure_of,
    model_of,
    rms,
    views_of,
)
from lit_model import CEILINGS, LitModel
from numpy.typing import NDArray
from PIL import Image

from ptmtools.arrays import Floats, Ints
from ptmtools.light.lamps import Lamps, direct_light, lamps_of
from ptmtools.light.occlusion import Occluders, normals, turns
from ptmtools.light.patches import LightPatches
from ptmtools.light.transport import PASSES, Daylight, transport
from ptmtools.scene.lights import Lights
from ptmtools.scene.model import Material
from ptmtools_lab.measures import flip

#: Points of a patch at which lamps are looked for, and shadow rays of each; of a pixel.
_POINTS, _SHADOWS, _PIXEL_SHADOWS = 4, 4, 8


@dataclass(frozen=True)
class TransportSetting:
    """Metres of a patch, passes, and rays of a pixel."""

    patch: float = 0.4
    passes: int = PASSES
    rays: int = 64


SETTINGS = (
    TransportSetting(),
    *(TransportSetting(patch=metres) for metres in (0.2, 0.8)),
    *(TransportSetting(passes=count) for count in (1, 2, 4, 8, 16)),
    *(TransportSetting(rays=count) for count in (16, 256)),
)


class TransportedView:
    """The transported light of a model, seen from anywhere."""

    def __init__(self, model: LitModel, setting: TransportSetting) -> None:
        self._model, self._rays = model, setting.rays
        scene = model.scene
        self._faces = np.flatnonzero(scene.opaque)
        self._around = Occluders.from_scene(scene)
        self._lamps = lamps_of_model(model)
        begin = process_time()
        both = np.ones((len(self._faces), 2), np.bool_)
        patches = LightPatches.of_faces(scene.corners[self._faces], both, setting.patch)
        mean = [model.color(material).mean(axis=(0, 1)) for material in scene.materials]
        albedo = np.array(mean, np.float64)[scene.triangle_material[self._faces]]
        self._field = transport(
            self._around,
            patches,
            albedo,
            self._direct_on(patches),
            Daylight(*model.daylight),
            passes=setting.passes,
        )
        self.seconds, self._gathering, self._points = process_time() - begin, 0.0, 0
        self.count = patches.count

    @property
    def gathering(self) -> float:
        """Seconds for a hundred thousand points."""
        return 1e5 * self._gathering / max(self._points, 1)

    def draw(self, view: EyeView, size: tuple[int, int]) -> Floats:
        """(height, width, 3) linear light."""
        eye, way = eye_rays(view, size)
        start = np.repeat((eye - self._around.middle)[None], len(way), axis=0)
        hit = self._around.tree.run(start.astype(np.float32), way, output=True)
        shown = hit["primID"] >= 0
        face = self._faces[hit["primID"][shown]]
        point = eye + way[shown] * hit["tfar"][shown, None].astype(np.float64)
        normal = normals(self._model.scene.corners[face])
        normal *= np.where(np.einsum("nx,nx->n", normal, way[shown]) > 0, -1, 1)[:, None]
        begin, spread = process_time(), turns(len(point))
        light = self._field.gather(point, normal, spread, self._rays).light
        light = light + self._direct(point, normal, spread, _PIXEL_SHADOWS)
        self._gathering += process_time() - begin
        self._points += len(point)
        picture = np.where(way[:, 1:2] >= 0, *self._model.daylight)
        picture[shown] = self._base(face, hit["u"][shown], hit["v"][shown]) * light
        picture[shown] += luminous(self._model)[face]
        return picture.reshape(size[1], size[0], 3)

    def _direct_on(self, patches: LightPatches) -> Floats:
        """(patches, 3) the light of lamps, as `transport` takes it."""
        face, side, number = patches.faces()
        normal = normals(patches.corner)[face] * np.where(side == 0, 1.0, -1.0)[:, None]
        spread, light = turns(len(face)), np.zeros((len(face), 3))
        for k in range(_POINTS):
            point = patches.points(
                face, number, (spread + k / _POINTS) % 1, (3 * spread + k / 2) % 1
            )
            light += self._direct(point, normal, spread, _SHADOWS) / _POINTS
        return light

    def _direct(self, point: Floats, normal: Floats, turn: Floats, rays: int) -> Floats:
        return direct_light(self._around, self._lamps, point, normal, turn, rays)

    def _base(self, face: Ints, u: NDArray[np.float32], v: NDArray[np.float32]) -> Floats:
        """(n, 3) reflectance of faces at barycentric coordinates, by the nearest texel."""
        scene = self._model.scene
        share = np.stack([1 - u - v, u, v], axis=1)
        uv = np.einsum("nk,nkx->nx", share, scene.uv[face]) % 1.0
        base = np.empty((len(face), 3))
        material = scene.triangle_material[face]
        for k in np.unique(material).tolist():
            texels, chosen = self._model.color(scene.materials[k]), material == k
            height, width, _ = texels.shape
            column = np.minimum((uv[chosen, 0] * width).astype(int), width - 1)
            row = np.minimum(((1 - uv[chosen, 1]) * height).astype(int), height - 1)
            base[chosen] = texels[row, column]
        return base


def luminous(model: LitModel) -> Floats:
    """(T, 3) nits of each face."""
    emission = np.array([model.emission(material) for material in model.scene.materials])
    glow = emission[model.scene.triangle_material]
    glow[model.ceilings] = CEILINGS
    return np.asarray(glow)


def lamps_of_model(model: LitModel) -> Lamps:
    """The lamps of a model, and its surfaces that glow, with a material for each radiance."""
    scene = model.scene
    radiance, number = np.unique(luminous(model), axis=0, return_inverse=True)
    glowing = replace(
        scene,
        materials=tuple(Material("glow") for _ in radiance),
        triangle_material=number.ravel().astype(scene.triangle_material.dtype),
    )
    lights = replace(Lights.none(len(radiance)), glow=radiance.astype(np.float32))
    if scene.lights:
        lights = replace(lights, lamps=scene.lights.lamps)
    return lamps_of(glowing, lights)


def eye_rays(view: EyeView, size: tuple[int, int]) -> tuple[Floats, NDArray[np.float32]]:
    """The eye, and (pixels, 3) unit vectors through the middles of pixels."""
    eye = np.array(view.eye)
    ahead = np.array(view.look) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 1, 0])
    right /= np.linalg.norm(right)
    width, height = size
    half = math.tan(math.radians(view.field) / 2)
    x = half * width / height * ((np.arange(width) + 0.5) / width * 2 - 1)
    y = half * (1 - (np.arange(height) + 0.5) / height * 2)
    way = ahead + x[None, :, None] * right + y[:, None, None] * np.cross(right, ahead)
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    return eye, np.ascontiguousarray(way.reshape(-1, 3), np.float32)


def compare(name: str, given: argparse.Namespace) -> None:
    """Prints the table of a model, and draws the first setting beside the reference."""
    file = model_of(name)
    model, size = LitModel(file), (given.width, given.height)
    views = views_of(name, database_of(name, file, "none"), given.views)
    tracer = PathTracer(model, matt=True)
    truth = [tracer.trace(view, size, given.noise)[0] for view in views]
    print(f"\n## {name}\n\n| patch, m | passes | rays | patches | s | s / 100,000 | RMS | FLIP |")
    print(f"|{'--:|' * 8}")
    for setting in SETTINGS:
        transported, errors = TransportedView(model, setting), []
        for k, (view, light) in enumerate(zip(views, truth, strict=True)):
            exposure = exposure_of(light)
            pair = displayed(light, exposure), displayed(transported.draw(view, size), exposure)
            errors.append((rms(*pair), flip(*pair)))
            if setting is SETTINGS[0]:
                beside = np.rint(np.concatenate(pair, axis=1)).astype(np.uint8)
                Image.fromarray(beside).save(FOLDER / f"{file.stem}-transport-{k}.png")
        error, difference = np.mean(errors, axis=0)
        print(
            f"| {setting.patch} | {setting.passes} | {setting.rays} | {transported.count:,} | "
            f"{transported.seconds:.1f} | {transported.gathering:.2f} | {error:.1f} | "
            f"{difference:.3f} |",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="*", default=["lit-hall"])
    parser.add_argument("--views", type=int, default=3)
    parser.add_argument("--noise", type=float, default=3.0)
    parser.add_argument("--width", type=int, default=320)
    parser.add_argument("--height", type=int, default=180)
    given = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in given.models:
        compare(name, given)


if __name__ == "__main__":
    main()
