"""Compares displayed pictures with path-traced ones: how far light is from what it would be.

    python benchmarks/light_reference.py [lit-hall museum hospital FILE …] [--views 6] [--noise 2]
        [--width 320] [--height 180] [--light none auto] [--out FOLDER]

Mitsuba 3 traces the reference with all bounces, from the model's own file (`lit_model`). Panes let
light pass but for their opacity. Ceilings that glow by default light, but do not show it. Each view
is traced in passes, and Open Image Denoise removes grain, until the standard error of the displayed
picture is at most ``--noise`` of 255, or there are as many passes as `_PASSES` allows.

The reference has the exposure that is best for each picture, and white balanced as in the picture's
cell; then come the curve Khronos PBR Neutral and sRGB. Pictures of ``ptm render`` have twice the
size, and 2 × 2 pixels are averaged: a reference of that size would take four times as long. *matt*
is the same reference with all surfaces diffuse, beside the picture without reflections: the part of
the difference that is light alone. The tables give the root mean square of 255 and FLIP, and the
noise of the references; pictures lie beside each other in ``--out``.

Needs ``mitsuba`` and ``pyoidn`` (extra ``reference``). Mitsuba's compiled variant is used where
``DRJIT_LIBLLVM_PATH`` names LLVM 16 or later (Debian: ``apt install libllvm19``); else the scalar
one. A view takes one to three minutes of a processor.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from lit_model import CEILINGS, LitModel, PathLamp
from numpy.typing import NDArray
from PIL import Image
from scenes import ROOT, model_file

from ptmtools.arrays import Floats, Singles
from ptmtools.output.served import Served, read_served
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.rendering.tone import neutral, tone_at
from ptmtools.scene.colors import luminance, to_linear, to_srgb
from ptmtools.scene.model import Material
from ptmtools_lab.measures import flip

FOLDER = ROOT / "build/bench/light"
#: Models that `ptm sample` writes: command and file.
SAMPLES = {
    "lit-hall": ("lit-hall --scale 0.5", "lit_hall.glb"),
    "museum": ("museum", "museum.obj"),
}
#: Eyes and points to look at in the lit hall: each room, a doorway, the showcase, the figure.
LIT_HALL = (
    ((-6.5, 1.7, 2.5), (-13.2, 1.5, -3.0)),
    ((-10.0, 1.7, -2.5), (-12.5, 1.4, 4.0)),
    ((1.0, 1.7, 2.5), (-4.0, 1.2, -3.0)),
    ((4.5, 1.7, 2.5), (1.5, 1.3, -3.5)),
    ((6.0, 1.7, 0.0), (13.0, 1.5, -1.0)),
    ((-4.5, 1.6, -3.0), (-2.7, 1.5, -1.4)),
)
#: Bounces; paths of a pixel in a pass; least and most passes.
_DEPTH, _PATHS, _PASSES = 12, 16, (4, 32)
#: Rows of the environment above the horizon.
_ENVIRONMENT = 32
#: The mean of log luminance that exposure aims at, a share of white.
KEY = 0.3


@dataclass(frozen=True)
class EyeView:
    """A view: eye and point to look at, world metres; vertical field of view, degrees."""

    eye: tuple[float, ...]
    look: tuple[float, ...]
    field: float = 60.0


def displayed(light: Floats, exposure: float) -> Floats:
    """The picture of linear light, 0 to 255."""
    radiance = np.maximum(light, 0) * exposure
    return 255 * to_srgb(neutral(radiance.reshape(-1, 3)).reshape(radiance.shape))


def exposure_of(light: Floats) -> float:
    """The factor that takes the mean of the log luminance to `KEY`; extremes do not count."""
    bright = luminance(light)
    low, high = np.maximum(np.quantile(bright, (0.02, 0.98)), 1e-6)
    return float(KEY / np.exp(np.log(np.clip(bright, low, high)).mean()))


def exposure_like(light: Floats, picture: Floats) -> float:
    """The factor of linear light whose displayed picture is nearest to another."""
    best = exposure_of(light)
    for ratio in (1.5, 1.2, 1.05):
        tries = [best * ratio**k for k in range(-4, 5)]
        best = min(tries, key=lambda factor: rms(displayed(light, factor), picture))
    return best


def balance_of(database: Served, view: EyeView) -> Floats:
    """(3,) factors that balance white where a picture is drawn; a display of either light."""
    tone = tone_at(database, np.array(view.eye))
    factors = tone.exposure if tone else np.ones(3)
    return np.asarray(factors / luminance(factors))


class PathTracer:
    """Mitsuba's scene of a model; with ``matt``, all surfaces are diffuse and panes are absent."""

    def __init__(self, model: LitModel, *, matt: bool) -> None:
        import mitsuba

        compiled = bool(os.environ.get("DRJIT_LIBLLVM_PATH"))
        mitsuba.set_variant("llvm_ad_rgb" if compiled else "scalar_rgb")
        self._mitsuba, self._model, self._matt = mitsuba, model, matt
        # Light of lamps passes panes in the integrator for volumes only.
        panes = not matt and any(m.transparent and m.image < 0 for m in model.scene.materials)
        light = {"type": "volpath" if panes else "path", "max_depth": _DEPTH}
        guides = "albedo:albedo,normal:sh_normal"
        self._integrator = mitsuba.load_dict({"type": "aov", "aovs": guides, "light": light})
        self.seconds = 0.0
        with tempfile.TemporaryDirectory() as folder:
            self._traced = mitsuba.load_dict(self._description(Path(folder)))
            self._ceilings = None
            if model.ceilings.any():
                ceilings = self._description(Path(folder), ceilings_alone=True)
                self._ceilings = mitsuba.load_dict(ceilings)

    def trace(self, view: EyeView, size: tuple[int, int], noise: float) -> tuple[Floats, float]:
        """(height, width, 3) linear light, and the standard error of its picture, of 255. A view
        that was traced before is read."""
        tracing = _DEPTH, _PATHS, _PASSES, noise
        ceilings = (CEILINGS, int(self._model.ceilings.sum())) if self._ceilings else None
        glow = self._model.daylight, ceilings
        key = repr((self._model.digest, glow, self._matt, view, size, tracing))
        file = FOLDER / "traced" / f"{sha256(key.encode()).hexdigest()[:16]}.npz"
        if file.is_file():
            with np.load(file) as stored:
                return stored["light"], float(stored["error"])
        light, error = self._trace(view, size, noise)
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(file, light=light, error=error)
        return light, error

    def _trace(self, view: EyeView, size: tuple[int, int], noise: float) -> tuple[Floats, float]:
        begin = process_time()
        passes: list[Floats] = []
        shine = self._shine(view, size)
        least, most = _PASSES
        error = math.inf
        while error > noise and len(passes) < most:
            sensor = self._mitsuba.load_dict(self._sensor(view, size))
            picture = self._mitsuba.render(
                self._traced,
                sensor=sensor,
                integrator=self._integrator,
                spp=_PATHS,
                seed=len(passes),
            )
            passes.append(np.nan_to_num(np.array(picture, np.float32)))
            passes[-1][..., :3] = np.maximum(passes[-1][..., :3] - shine, 0)
            light = denoise(np.mean(passes, axis=0))
            if len(passes) >= least:
                exposure = exposure_of(light)
                halves = [denoise(np.mean(passes[k::2], axis=0)) for k in (0, 1)]
                # Half of the difference of two halves is one sample of the error of their mean.
                error = rms(*(displayed(half, exposure) for half in halves)) / 2
        self.seconds += process_time() - begin
        return light, error

    def _shine(self, view: EyeView, size: tuple[int, int]) -> Floats | float:
        """(height, width, 3) what ceilings that glow show by themselves."""
        if self._ceilings is None:
            return 0.0
        picture = self._mitsuba.render(
            self._ceilings,
            sensor=self._mitsuba.load_dict(self._sensor(view, size)),
            integrator=self._mitsuba.load_dict({"type": "path", "max_depth": 1}),
            spp=4 * _PATHS,
        )
        return np.array(picture, np.float32)

    def _description(self, folder: Path, *, ceilings_alone: bool = False) -> dict[str, Any]:
        """The scene for Mitsuba; with ``ceilings_alone``, nothing else sends light."""
        model = self._model
        description: dict[str, Any] = {"type": "scene"}
        for k, material in enumerate(model.scene.materials):
            pane = material.transparent and material.image < 0
            if pane and self._matt:
                continue
            for glowing in (False, True):
                faces = (model.scene.triangle_material == k) & (model.ceilings == glowing)
                if not faces.any():
                    continue
                shape = self._shape(folder / f"{k}-{glowing}.ply", np.flatnonzero(faces))
                shape["bsdf"] = _pane(material) if pane else self._surface(material)
                radiance = CEILINGS if glowing else model.emission(material)
                if radiance.any() and (glowing or not ceilings_alone):
                    shape["emitter"] = {"type": "area", "radiance": rgb(radiance)}
                description[f"material_{k}_{glowing}"] = shape
        if ceilings_alone:
            return description
        # The sky above the horizon, and the ground below it.
        around = np.repeat(np.array(model.daylight, np.float32), _ENVIRONMENT, axis=0)
        bitmap = self._mitsuba.Bitmap(np.repeat(around[:, None], 2 * len(around), axis=1))
        description["sky"] = {"type": "envmap", "bitmap": bitmap}
        for k, lamp in enumerate(model.lamps):
            description[f"lamp_{k}"] = self._emitter(lamp)
        return description

    def _shape(self, file: Path, chosen: NDArray[np.intp]) -> dict[str, Any]:
        count = len(chosen)
        mesh = self._mitsuba.Mesh(
            file.stem, 3 * count, count, has_vertex_normals=True, has_vertex_texcoords=True
        )
        fields = self._mitsuba.traverse(mesh)
        fields["vertex_positions"] = self._model.scene.corners[chosen].ravel().astype(np.float32)
        fields["vertex_normals"] = self._model.normal[chosen].ravel().astype(np.float32)
        fields["vertex_texcoords"] = self._model.scene.uv[chosen].ravel().astype(np.float32)
        fields["faces"] = np.arange(3 * count, dtype=np.uint32)
        fields.update()
        mesh.write_ply(str(file))
        return {"type": "ply", "filename": str(file)}

    def _surface(self, material: Material) -> dict[str, Any]:
        metallic, roughness = self._model.polish(material)
        texels = self._model.color(material)
        color: dict[str, Any] = rgb(texels[0, 0])
        if material.image >= 0:
            color = {
                "type": "bitmap",
                "bitmap": self._mitsuba.Bitmap(np.ascontiguousarray(texels[::-1])),
                "raw": True,
                "wrap_mode": "repeat" if material.wrap_s == "repeat" else "clamp",
            }
        surface: dict[str, Any] = {"type": "diffuse", "reflectance": color}
        if not self._matt and (roughness < 1 or metallic > 0):
            surface = {
                "type": "principled",
                "base_color": color,
                "metallic": metallic,
                "roughness": max(roughness, 0.03),
                "specular": 0.5,
            }
        return {"type": "twosided", "surface": surface}

    def _emitter(self, lamp: PathLamp) -> dict[str, Any]:
        transform, color = self._mitsuba.ScalarTransform4f, rgb(lamp.color)
        if lamp.kind == "directional":
            return {"type": lamp.kind, "direction": lamp.way.tolist(), "irradiance": color}
        if lamp.kind == "point":
            return {"type": lamp.kind, "position": lamp.place.tolist(), "intensity": color}
        up = [0, 1, 0] if abs(lamp.way[1]) < 0.99 else [1, 0, 0]
        return {
            "type": "spot",
            "to_world": transform().look_at(
                lamp.place.tolist(), (lamp.place + lamp.way).tolist(), up
            ),
            "intensity": color,
            "beam_width": math.degrees(lamp.cone[0]),
            "cutoff_angle": math.degrees(lamp.cone[1]),
        }

    def _sensor(self, view: EyeView, size: tuple[int, int]) -> dict[str, Any]:
        eye, look = list(view.eye), list(view.look)
        return {
            "type": "perspective",
            "fov_axis": "y",
            "fov": view.field,
            "near_clip": 0.02,
            "to_world": self._mitsuba.ScalarTransform4f().look_at(eye, look, [0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": size[0],
                "height": size[1],
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": "independent", "sample_count": _PATHS},
        }


def denoise(picture: NDArray[np.float32]) -> Floats:
    """(h, w, 3) light of (h, w, 9) light, albedo and normal, by Open Image Denoise."""
    import pyoidn

    device = pyoidn.Device()
    device.commit()
    work = pyoidn.Filter(device, "RT")
    height, width, _ = picture.shape
    result = np.zeros((height, width, 3), np.float32)
    parts = [np.ascontiguousarray(picture[..., k : k + 3]) for k in (0, 3, 6)]
    names = (pyoidn.OIDN_IMAGE_COLOR, pyoidn.OIDN_IMAGE_ALBEDO, pyoidn.OIDN_IMAGE_NORMAL)
    for name, part in zip((*names, pyoidn.OIDN_IMAGE_OUTPUT), (*parts, result), strict=True):
        work.set_image(name, part, pyoidn.OIDN_FORMAT_FLOAT3, width, height)
    work.set_bool("hdr", True)
    work.commit()
    work.execute()
    return result.astype(np.float64)


def _pane(material: Material) -> dict[str, Any]:
    """A polished sheet that is there by its opacity: light passes without refraction."""
    gloss = {
        "type": "principled",
        "base_color": rgb(to_linear(np.array(material.color))),
        "roughness": 0.03,
        "specular": 0.5,
    }
    sheet = {"type": "twosided", "surface": gloss}
    return {"type": "mask", "opacity": max(material.opacity, 0.04), "sheet": sheet}


def rgb(color: Floats | Singles) -> dict[str, Any]:
    """A colour of Mitsuba."""
    return {"type": "rgb", "value": [float(c) for c in color]}


def rms(first: Floats, second: Floats) -> float:
    """The root mean square of the difference."""
    return float(np.sqrt(np.mean((first - second) ** 2)))


def ptm(*words: object) -> None:
    """Runs a command; its output is shown if it fails."""
    command = [sys.executable, "-m", "ptmtools", *map(str, words)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode:
        sys.exit(f"{' '.join(command)}: exit status {result.returncode}\n{result.stderr}")


def model_of(name: str) -> Path:
    """The file of a model, which is written if it is a missing sample."""
    if name not in SAMPLES:
        return model_file(name)
    words, file = SAMPLES[name]
    folder = FOLDER / name
    if not (folder / file).is_file():
        ptm("sample", *words.split(), "-o", folder)
    return folder / file


def database_of(name: str, model: Path, light: str) -> Path:
    """A database of a model with this option of light, built if it is missing."""
    target = FOLDER / f"{Path(name).stem}-{light}.db"
    # Pictures are compared in the light of their rooms.
    lit = [] if light == "none" else ["--true-colours", "none"]
    ptm("build-scene", model, "-o", target, "--light", light, *lit)
    return target


def views_of(name: str, database: Path, count: int) -> list[EyeView]:
    """The first viewpoints of a database; of the lit hall those of `LIT_HALL`."""
    if name == "lit-hall":
        return [EyeView(eye, look) for eye, look in LIT_HALL[:count]]
    hints = json.loads((database / "www/hints.json").read_text())
    views = []
    for point in hints["viewpoints"][:count]:
        look = np.array(point["position"]) + point["direction"]
        field = math.degrees(point["fieldOfView"])
        views.append(EyeView(tuple(point["position"]), tuple(look.tolist()), field))
    return views


def render(served: Served, view: EyeView, size: tuple[int, int]) -> list[Floats]:
    """The picture of ``ptm render``, 0 to 255, and that without reflections, drawn at twice the
    size."""
    eye, look = tuple(view.eye), (view.look[0], view.look[1], view.look[2])
    options = ViewOptions(
        eye=eye, look=look, field_of_view=view.field, width=2 * size[0], height=2 * size[1]
    )
    matt = replace(served, surfaces=replace(served.surfaces, gloss=None))
    blocks = size[1], 2, size[0], 2, 3
    return [
        draw_view(database, options).reshape(blocks).mean((1, 3)) for database in (served, matt)
    ]


def compare(name: str, given: argparse.Namespace) -> None:
    """Prints the table of a model, and writes its pictures beside each other."""
    model = model_of(name)
    databases = {light: database_of(name, model, light) for light in given.light}
    size = given.width, given.height
    views = views_of(name, next(iter(databases.values())), given.views)
    served = {light: read_served(database) for light, database in databases.items()}
    lit = LitModel(model)
    whole, matt = (PathTracer(lit, matt=matt) for matt in (False, True))
    kinds = "whole", "without reflections", "matt"
    columns = [f"{light}: {kind}" for light in databases for kind in kinds]
    print(
        f"\n## {name}\n\n| view | noise | {' | '.join(columns)} |\n|---|--:|{'--:|' * len(columns)}"
    )
    table = []
    for k, view in enumerate(views):
        (all_light, error), (matt_light, matt_error) = (
            tracer.trace(view, size, given.noise) for tracer in (whole, matt)
        )
        row, beside = [], []
        for database in served.values():
            shown, plain = render(database, view, size)
            whites = balance_of(database, view)
            pairs = [(all_light * whites, shown), (all_light * whites, plain)]
            pairs.append((matt_light * whites, plain))
            truths = [displayed(light, exposure_like(light, picture)) for light, picture in pairs]
            row += [
                (rms(truth, picture), flip(truth, picture))
                for truth, (_, picture) in zip(truths, pairs, strict=True)
            ]
            beside = [shown, truths[0], plain, truths[2]]
        table.append(row)
        print(f"| {k} | {max(error, matt_error):.1f} | {' | '.join(cells_of(row))} |", flush=True)
        picture = np.rint(np.concatenate(beside, axis=1)).astype(np.uint8)
        Image.fromarray(picture).save(given.out / f"{Path(name).stem}-{k}.png")
    means = [tuple(map(float, pair)) for pair in np.mean(table, axis=0)]
    print(f"| **mean** | | {' | '.join(cells_of(means))} |")
    print(f"\n{whole.seconds + matt.seconds:.0f} s of path tracing (CPU)")


def cells_of(row: Sequence[tuple[float, ...]]) -> list[str]:
    """Cells of a table: root mean square, FLIP."""
    return [f"{error:.1f} / {difference:.3f}" for error, difference in row]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="*", default=["lit-hall", "museum", "hospital"])
    parser.add_argument("--views", type=int, default=6)
    parser.add_argument("--noise", type=float, default=2.0)
    parser.add_argument("--width", type=int, default=320)
    parser.add_argument("--height", type=int, default=180)
    parser.add_argument("--light", nargs="*", default=["none", "auto"])
    parser.add_argument("--out", type=Path, default=FOLDER / "pictures")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    print("RMS of 255 / FLIP against the path-traced picture: whole, and of matt surfaces")
    for name in given.models:
        compare(name, given)


if __name__ == "__main__":
    main()
