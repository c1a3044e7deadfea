"""Bakes the light of the building: a lightmap for each cell, encoded as a texture.

By default the light is that of the model's own lightmaps, or baked if it costs little beside the
images of the model. Lightmaps are encoded with the options of the textures, and clients fetch them
like textures.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.lazy import Lazy, component
from ptmtools.light.options import LightOptions
from ptmtools.output.names import cell_name
from ptmtools.pipeline.artifacts import Artifacts, Run
from ptmtools.pipeline.encoding import (
    TextureOptions,
    bake_textures,
    encode_image,
    ptm_file,
)
from ptmtools.pipeline.stage import Counts, Stage, complete
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.probes import (
    BakedBuilding,
    bake_probes,
    reflective_shapes,
    small_images,
)
from ptmtools.pipeline.stages.scene import (
    SCENE,
    image_digests,
    lights_of,
    rounded_image_bytes,
    scene_origin,
)
from ptmtools.pipeline.stages.textures import TEXTURES, stored_texture, texture_files
from ptmtools.quantities import count, size
from ptmtools.store.layout import LIGHTS, SERVED, arrays_of, sha256

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.cells.model import Cells
    from ptmtools.light.cells import CellLight, LightBaking
    from ptmtools.light.looks import PaintedLight
    from ptmtools.light.model import CellSurfaces, Light
    from ptmtools.output.geometry import Geometry
    from ptmtools.scene.lights import Lights
    from ptmtools.scene.model import Scene
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction
    from ptmtools.texture.sources import PtmSource

#: Lightmaps with less than this share of the texels to the metre that were asked for are reported.
_COARSE = 0.5
#: Decoded bytes of a lightmap of the model, which the scene stage has already decoded.
_MOST = 1 << 40
#: The input for the bytes of the images, as `rounded_image_bytes`.
_IMAGES = "bytes of images"
#: An input of a run that left out the lightmaps, as long as xatlas is not installed.
_ABSENT = "xatlas"


@dataclass(frozen=True)
class LitCells:
    """The shared input of all tasks."""

    baking: LightBaking
    options: TextureOptions


def bake_cell(
    shared: LitCells, task: tuple[int, CellSurfaces]
) -> tuple[tuple[CellLight, int], list[tuple[str, bytes]]]:
    """The light of a cell, with the bytes of its lightmap that are served, and the files of it as
    `encode_image` returns them; none without one."""
    import numpy as np

    from ptmtools.light.model import HUE, lossy_codes, scale_hue

    cell, piece = task
    light = shared.baking.light(piece)
    if light.texels is None:
        return (light, 0), []
    codes = scale_hue(light.texels, HUE).astype(np.float32)
    name, data = lossy_codes(codes, QUALITY)
    files = encode_image(shared.options, f"{lightmap_stem(cell)}.{name}", data)
    return (light, sum(len(part) for file, part in files if file.startswith(f"{SERVED}/"))), files


#: Quality of the images of lightmaps. (WebP 85 takes a quarter more bytes, and has blocks on smooth
#: walls.)
QUALITY = {"avif": 80, "webp": 90}


def lightmap_stem(cell: int) -> str:
    """The stem of the files of a lightmap; no image of a model has such a name."""
    return f"light~{cell_name(cell)}"


#: The counts of a building without light.
_NO_LIGHT = {"lightmaps": 0, "light": "none"}


def light_baking(
    artifacts: Artifacts,
    options: LightOptions,
    model_light: Lights | None,
    lights: Lights | None,
    pieces: list[CellSurfaces],
) -> LightBaking:
    """What the tasks share: the light of the model, if it is given, or that of the building."""
    import numpy as np

    from ptmtools.light.building import BuildingBaking
    from ptmtools.light.cells import LightBaking
    from ptmtools.scene.colors import luminance

    albedo = _reflectance(artifacts)
    grey = luminance(albedo).astype(np.float32)
    if model_light:
        return LightBaking(options, None, _paint(artifacts, model_light), grey)
    building = BuildingBaking(artifacts[SCENE], pieces, lights, albedo).light()
    return LightBaking(options, building, None, grey)


def _reflectance(artifacts: Artifacts) -> NDArray[np.float64]:
    """(T, 3) the mean colour of each face of the scene, linear light."""
    import numpy as np

    from ptmtools.light.reflectance import image_colors
    from ptmtools.scene.colors import to_linear

    def read(name: str) -> bytes:
        return artifacts.db.read_output(TEXTURES.name, name)

    def source(name: str) -> PtmSource:
        return artifacts.db.source(name, artifacts.db.output(TEXTURES.name, name))

    scene = artifacts[SCENE]
    means = []
    for name in texture_files(image_digests(artifacts)):
        steps = stored_texture(artifacts, name, source, read).steps
        mean = np.array(steps.detail.color) / 255
        # The mean of light is more than the light of the mean, by the second derivative.
        spread = (steps.errors[0] / 255) ** 2
        curve = 2.4 * 1.4 / 1.055**2 * ((mean + 0.055) / 1.055) ** 0.4
        means.append(np.clip(to_linear(mean) + curve * spread / 2, 0, 1))
    shown = image_colors(scene, small_images(artifacts), np.array(means).reshape(-1, 3))
    if (lights := lights_of(artifacts)) is not None:
        # They show their emission, and are dark themselves.
        shown[(lights.unlit & lights.glow.any(axis=1))[scene.triangle_material]] = 0
    return np.asarray(_tint(scene) * shown)


def _tint(scene: Scene) -> NDArray[np.float64]:
    """(T, 3) the colour of each face of the scene beside its image, linear light."""
    import numpy as np

    from ptmtools.scene.colors import to_linear

    colors = to_linear(np.array([m.color for m in scene.materials]).reshape(-1, 3))
    result = colors[scene.triangle_material]
    return result if scene.colors is None else result * to_linear(scene.colors / 255).mean(axis=1)


def _absence() -> MissingComponentError | None:
    """The error of lightmaps where xatlas is not installed."""
    try:
        component("xatlas", "PTM-M100", "lightmaps need xatlas", "light")
    except MissingComponentError as fault:
        return fault
    return None


def true_works(scene: Scene, true_colours: str, *, painted: bool) -> NDArray[np.bool_]:
    """(T,) the faces of works that are shown in true colours."""
    import numpy as np

    from ptmtools.tour.pictures import works_of

    if true_colours == "works" and not painted:
        return works_of(scene)
    return np.zeros(len(scene.triangles), np.bool_)


def unlit_faces(
    scene: Scene, lights: Lights | None, works: NDArray[np.bool_], *, painted: bool
) -> NDArray[np.bool_]:
    """(T,) the faces without light: those of ``works``, and those of materials that are seen
    through, whose colours contain it, without a lightmap of the model, or that glow."""
    import numpy as np

    from ptmtools.light.lamps import lamp_radiance

    dark = np.array([m.pane for m in scene.materials], np.bool_)
    if lights is not None:
        dark |= lights.unlit
        dark |= lights.map < 0 if painted else lamp_radiance(scene, lights).any(axis=1)
    return np.asarray(dark[scene.triangle_material] | works)


def _paint(artifacts: Artifacts, lights: Lights) -> PaintedLight:
    """The lightmaps of the model, for the faces of the scene with replaced objects."""
    import numpy as np

    from ptmtools.light.looks import LightImage, PaintedLight, red_texels

    scene = artifacts.original(SCENE)
    files = {lightmap.data for lightmap in lights.maps}
    decoded = {data: red_texels(data, _MOST, "lightmap") for data in files}
    images = tuple(LightImage(decoded[k.data], k.wrap, k.strength) for k in lights.maps)
    image = lights.map[scene.triangle_material]
    uv = lights.uv.astype(np.float64)
    return PaintedLight(scene.corners, uv, image, images, scene_origin(artifacts).triangle)


def _kind_of_light(baking: LightBaking) -> Mapping[str, Any]:
    """What the light consists of."""
    building = baking.building
    if building is None:
        return {"light": "model"}
    lamps = len(building.lamps)
    return {"light": "bake", "lamps": lamps, "sky": building.sky, "ceilings": building.ceilings}


def _exposures(cell_lights: Sequence[CellLight], cells: Cells) -> tuple[float, NDArray[np.float64]]:
    """The factor of all light with which the building has the usual exposure, and (C, 3) those of
    red, green and blue of cells: some of what is seen from a cell is in its neighbours."""
    import numpy as np

    from ptmtools.light.cells import FARTHEST

    wanted = np.array([light.exposure for light in cell_lights])
    balance = np.array([light.balance for light in cell_lights]).reshape(-1, 3)
    area = np.array([light.area for light in cell_lights])
    standing = area * (cells.standing if (area * cells.standing).any() else 1)
    if not standing.any():
        return 1.0, np.ones((len(area), 3))
    usual = float((standing * wanted).sum() / standing.sum())
    values = np.column_stack([wanted - usual, balance])
    total, weight = values * area[:, None], area.copy()
    for cell, near in enumerate(cells.adjacent()):
        # A large hall beside a small room is seen through a door.
        beside = np.minimum(area[near], area[cell]) / 4
        total[cell] += (values[near] * beside[:, None]).sum(axis=0)
        weight[cell] += beside.sum()
    wished = np.divide(total, weight[:, None], out=np.zeros_like(total), where=weight[:, None] > 0)
    limited = np.clip(wished[:, :1], -math.log(FARTHEST), math.log(FARTHEST))
    return math.exp(usual), np.exp(limited + wished[:, 1:])


def _notes(lights: list[CellLight]) -> Iterator[str]:
    if crowded := sum(light.crowded for light in lights):
        yield (
            f"the lightmaps of {count(crowded, 'cell')} have too many parts to keep them all "
            "apart; neighbours there run into each other (--light-density)"
        )
    coarse = [light.density for light in lights if light.density < _COARSE]
    if coarse:
        yield (
            f"the lightmaps of {count(len(coarse), 'cell')} are too small for --light-density: "
            f"they have {min(coarse):.0%} of it at least"
        )


def _notes_on_size(pieces: list[CellSurfaces]) -> Iterator[Warned]:
    """The note on a model with surfaces, but none that lightmaps have texels for."""
    from ptmtools.light.cells import expected_bytes

    if expected_bytes(pieces, 1.0):
        yield Warned(
            "there is no light: the surfaces of the model are too small or too large for "
            "lightmaps; check --unit, or use --light bake with --light-density"
        )


def lightmap_files(light: Light | None) -> dict[int, str]:
    """Cell → `.ptm` of its lightmap, relative to the served folder."""
    sides = [] if light is None else light.side.tolist()
    return {cell: ptm_file(lightmap_stem(cell)) for cell, side in enumerate(sides) if side}


def _light_of(
    run: Run,
    transaction: Transaction,
    baking: LightBaking,
    geometry: Geometry,
    pieces: Sequence[CellSurfaces],
    lights: Sequence[CellLight],
    unlit: NDArray[np.bool_],
) -> tuple[Light, int]:
    """The light of the building with its probes, and the bytes of these. ``unlit``: (T,) the faces
    without light."""
    import numpy as np

    from ptmtools.light.model import Light

    scene, building = run[SCENE], baking.building
    factor, exposure, probe_bytes = 1.0, np.ones((len(pieces), 3)), 0
    horizon, shine = np.zeros((2, 3)), np.zeros((len(scene.materials), 3))
    reflects, probes = np.zeros(len(geometry.object), np.bool_), np.zeros((len(pieces), 11))
    if building is not None:
        factor, exposure = _exposures(lights, run[CELLS])
        daylight = building.field.daylight
        horizon = factor * np.array([daylight.sky, daylight.ground])
        shine = factor * building.shine
        first = geometry.piece[geometry.triangle_start[:-1]]
        dark = unlit[run[CELLS].triangle_source[first]]
        reflects = reflective_shapes(scene, lights_of(run), geometry, dark)
        # They have a relief, or colours of their own.
        reflects &= ~np.isin(geometry.object, scene_origin(run).objects)
        of_cells = np.split(reflects, geometry.cell_start[1:-1])
        chosen = [cell for cell, shapes in enumerate(of_cells) if shapes.any()]
        surfaces = BakedBuilding(building, pieces, lights, _tint(scene), 1 / factor)
        probes, probe_bytes = bake_probes(run, transaction, surfaces, chosen)
        probes[:, :2] *= factor
    light = Light(
        np.array([0 if k.texels is None else len(k.texels) for k in lights], np.int32),
        factor * np.array([light.white for light in lights]),
        exposure,
        np.concatenate([light.lit for light in lights]),
        np.concatenate([light.mapped for light in lights]),
        np.concatenate([light.uv for light in lights]),
        np.concatenate([light.vertex for light in lights]),
        horizon,
        shine,
        reflects,
        probes,
        building is not None,
    )
    return light, probe_bytes


class LightStage(Stage["Light"]):
    """Bakes the light of all cells."""

    name = "light"
    about = "Bake the light of the surfaces into lightmaps."
    recipe = 17
    changed = "the light of walls has less grain in corners"
    options = LightOptions
    heeds = (TEXTURES,)
    artifact = Lazy("ptmtools.light.model:Light")
    optional = True
    opens_inputs = True

    def read_with(self, options: LightOptions) -> tuple[Stage[Any], ...]:
        return () if options.light == "none" else (SCENE, CELLS, TEXTURES)

    def inputs(self, artifacts: Artifacts, options: LightOptions) -> dict[str, str]:
        name = arrays_of(LIGHTS)
        digest = artifacts.outputs(SCENE).get(name)
        if options.light == "none":
            return {}
        lights = {} if digest is None else {name: digest}
        if options.light == "auto":
            lights[_IMAGES] = sha256(str(rounded_image_bytes(artifacts)).encode())
        before = artifacts.before(self)
        if before and _ABSENT in before.inputs and options.light == "auto" and _absence():
            lights[_ABSENT] = ""
        return lights | artifacts.files_of(self.sources(options)) | artifacts.choices(self)

    def check_options(self, options: LightOptions) -> None:
        """Raises MissingComponentError: PTM-M100 xatlas is not installed."""
        if options.light in ("bake", "model") and (fault := _absence()):
            raise fault

    def check_model(self, run: Run, options: LightOptions) -> None:
        """Raises InputError PTM-I701: the model has no lightmaps, which the options ask for."""
        if options.light != "model":
            return
        lights = lights_of(run)
        if lights is None or not lights.maps:
            raise InputError(
                "PTM-I701",
                "the model has no lightmaps",
                file=run.model or run.db.path,
                remedy="use --light bake, or a glTF with occlusion textures that do not repeat",
            )

    def make(
        self, run: Run, options: LightOptions, transaction: Transaction, work: StageRecord
    ) -> StageRecord:
        """Raises as `check_model`."""
        if options.light == "none":
            return complete(work, _NO_LIGHT, ())
        self.check_model(run, options)
        from ptmtools.light.cells import affordable_density
        from ptmtools.output.geometry import Geometry
        from ptmtools.output.pieces import pieces_of

        scene, cells = run[SCENE], run[CELLS]
        lights = lights_of(run)
        model_light = lights if lights and lights.maps and options.light != "bake" else None
        painted = model_light is not None
        works = true_works(scene, options.true_colours, painted=painted)
        unlit = unlit_faces(scene, lights, works, painted=painted)
        asked = options.light_density
        replaced = scene_origin(run).objects
        geometry = Geometry(scene, cells)
        pieces = pieces_of(geometry, cells, unlit, 1 / asked, replaced)
        if options.light == "auto" and not model_light:
            density = affordable_density(pieces, asked, rounded_image_bytes(run))
            if not density:
                return complete(work, _NO_LIGHT, _notes_on_size(pieces))
            options = replace(options, light_density=density)
        if options.light == "auto" and (fault := _absence()):
            left_out = f"lightmaps are left out: {fault.message}"
            remedy = f"{fault.remedy}, then build again" if fault.remedy else "build again"
            work = replace(work, inputs={**work.inputs, _ABSENT: ""})
            return complete(work, _NO_LIGHT, (Warned(f"{left_out}; {remedy}"),))
        baking = light_baking(run, options, model_light, lights, pieces)
        shared = LitCells(baking, run.recorded(TEXTURES))
        tasks = list(enumerate(pieces))
        baked, _ = bake_textures(run, transaction, bake_cell, shared, tasks, "light")
        cell_lights = [light for light, _ in baked]
        artifact, probe_bytes = _light_of(
            run, transaction, baking, geometry, pieces, cell_lights, unlit
        )
        run.keep(LIGHT, artifact)
        transaction.put_arrays(LIGHT.name, artifact.to_arrays())
        total = sum(served for _, served in baked) + probe_bytes
        counts = {**self.counts(artifact), "bytes": total, **_kind_of_light(shared.baking)}
        counts["works"] = len(set(scene.triangle_object[works].tolist()))
        if options.light_density < asked:
            counts["reduced_density"] = options.light_density
        return complete(work, counts, _notes(cell_lights))

    def counts(self, light: Light) -> Counts:
        return {
            "lightmaps": int((light.side > 0).sum()),
            "texels": int((light.side.astype("int64") ** 2).sum()),
            "probes": int((light.probe[:, 0] > 0).sum()),
        }

    def summary(self, n: Counts) -> str:
        if not n["lightmaps"]:
            return "no light"
        reduced = n.get("reduced_density", 0.0)
        parts = (
            ("of the model", n.get("light") == "model"),
            ("with lamps", n.get("lamps")),
            ("with the sky", n.get("sky")),
            ("with ceilings that glow", n.get("ceilings")),
            (count(n.get("probes", 0), "probe"), n.get("probes")),
            (f"pictures of {count(n.get('works', 0), 'object')} in true colours", n.get("works")),
            (f"reduced to {reduced:.1f} texels per metre, to save bytes", reduced),
        )
        total = n.get("bytes", n.get("ptm_bytes"))  # the latter of grey lightmaps
        return (
            f"{count(n['lightmaps'], 'lightmap')} of {count(n['texels'], 'texel')}, "
            f"{size(total)}" + "".join(f", {text}" for text, given in parts if given)
        )

    def misfit(self, light: Light, source: Stage[Any], contents: Any) -> str:
        foreign = source is CELLS and len(light.side) != contents.cell_count
        return "the light belongs to other cells" if foreign else ""


LIGHT = LightStage()
