"""Bakes the relief of replaced objects: a normal map for each, encoded as a texture.

Without ``--relief normal-map`` this stage writes nothing. Normal maps are encoded with the options
of the textures, and clients fetch them like textures.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

from ptmtools.lazy import Lazy
from ptmtools.pipeline.artifacts import Artifacts, Run
from ptmtools.pipeline.encoding import TextureOptions, bake_textures, encode_texels, ptm_file
from ptmtools.pipeline.stage import Counts, Stage, complete
from ptmtools.pipeline.stages.scene import SCENE, scene_origin
from ptmtools.pipeline.stages.textures import TEXTURES
from ptmtools.quantities import count, size
from ptmtools_systems.stages.apo import APO, object_stems

if TYPE_CHECKING:
    from ptmtools.output.object_maps import ObjectMaps
    from ptmtools.output.representation import Represented
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction
    from ptmtools_systems.apo.normal_map import NormalMap
    from ptmtools_systems.apo.replacing import Replacing

#: A greater share of texels whose rays miss the original is reported.
_MISSED = 0.01


@dataclass(frozen=True)
class ReliefOptions:
    """Options of the relief stage: none of its own, see `ReplaceOptions`."""

    heading: ClassVar[str] = "Relief"


@dataclass(frozen=True)
class Mapped:
    """The shared input of all tasks."""

    replacing: Replacing
    options: TextureOptions


def bake_map(shared: Mapped, task: tuple[int, str]) -> tuple[NormalMap, list[tuple[str, bytes]]]:
    """The normal map of an object, and its files as `encode_image` returns them."""
    number, stem = task
    relief = shared.replacing.normal_map(number)
    return relief, encode_texels(shared.options, stem, relief.texels)


def _notes(name: str, relief: NormalMap) -> Iterator[str]:
    if relief.missed > _MISSED:
        yield (
            f"{name}: from {relief.missed:.1%} of the texels no ray met the original; "
            "there the map has the normals of the simplified mesh"
        )


def relief_stems(objects: list[str]) -> list[str]:
    """The stem of the files of each normal map; no image of a model has such a name."""
    return [f"relief~{stem}" for stem in object_stems(objects)]


def relief_files(artifacts: Artifacts, reliefs: ObjectMaps | None) -> dict[int, str]:
    """Replaced object → `.ptm` of its normal map, relative to the served folder."""
    numbers = [] if reliefs is None else reliefs.objects.tolist()
    names = [artifacts[APO].objects[number] for number in numbers]
    return dict(zip(numbers, map(ptm_file, relief_stems(names)), strict=True))


class ReliefStage(Stage["ObjectMaps"]):
    """Bakes the normal maps of all replaced objects."""

    name = "relief"
    about = "Bake the normals of replaced objects into normal maps."
    recipe = 1
    options = ReliefOptions
    reads = (SCENE,)
    heeds = (APO, TEXTURES)
    artifact = Lazy("ptmtools.output.object_maps:ObjectMaps")
    represents = True
    optional = True
    opens_inputs = True

    def inputs(self, artifacts: Artifacts, options: ReliefOptions) -> dict[str, str]:
        replacing = artifacts.chosen.get(APO) or artifacts.recorded(APO)
        if not replacing.apo or replacing.relief != "normal-map":
            return {}
        return artifacts.files_of(self.sources(options)) | artifacts.choices(self)

    def make(
        self, run: Run, options: ReliefOptions, transaction: Transaction, work: StageRecord
    ) -> StageRecord:
        """Raises MissingComponentError: PTM-M100 xatlas is not installed."""
        objects = scene_origin(run).objects
        if not len(objects) or run.recorded(APO).relief != "normal-map":
            return complete(work, {"maps": 0}, ())
        from ptmtools_systems.apo.replacing import Replacing, apo_options, object_maps

        # Workers need no images.
        scene, shown = replace(run.original(SCENE), images=()), replace(run[APO], images=())
        replacing = Replacing(scene, shown, apo_options(run.recorded(APO)))
        names = [shown.objects[number] for number in objects.tolist()]
        tasks = list(zip(objects.tolist(), relief_stems(names), strict=True))
        shared = Mapped(replacing, run.recorded(TEXTURES))
        maps, total = bake_textures(run, transaction, bake_map, shared, tasks, "normal maps")
        notes = [note for pair in zip(names, maps, strict=True) for note in _notes(*pair)]
        reliefs = object_maps(shown, objects, maps)
        run.keep(self, reliefs)
        transaction.put_arrays(self.name, reliefs.to_arrays())
        error = max(relief.error for relief in maps)
        return complete(work, {**self.counts(reliefs), "error": error, "ptm_bytes": total}, notes)

    def counts(self, reliefs: ObjectMaps) -> Counts:
        return {
            "maps": len(reliefs.objects),
            "texels": int((reliefs.side.astype("int64") ** 2).sum()),
        }

    def summary(self, n: Counts) -> str:
        if not n["maps"]:
            return "no object replaced by one with a normal map"
        return (
            f"{count(n['maps'], 'normal map')} of {count(n['texels'], 'texel')}, "
            f"{size(n['ptm_bytes'])}, normals off by {n['error']:.2g} at most"
        )

    def misfit(self, reliefs: ObjectMaps, source: Stage[Any], contents: Any) -> str:
        import numpy as np

        if source is not APO:
            return ""
        mapped = np.isin(contents.triangle_object, reliefs.objects).sum()
        return "" if mapped == len(reliefs.uv) else "the normal maps are those of other objects"

    def represented(self, artifacts: Artifacts) -> Represented | None:
        """The objects with normal maps; None without any."""
        from ptmtools.output.representation import Represented
        from ptmtools.pipeline.stages.emit import read_records

        reliefs = artifacts.stored(self)
        if reliefs is None:
            return None
        files = relief_files(artifacts, reliefs)
        owners = ((name, {"image": -1, "object": number}) for number, name in files.items())
        textures = read_records(artifacts, self, owners)
        return Represented(tuple(reliefs.objects.tolist()), maps=reliefs, textures=textures)


RELIEF = ReliefStage()
