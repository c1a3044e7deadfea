"""What a model is, before anything is made of it."""

from __future__ import annotations

import io
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.progress import Progress, silent
from ptmtools.scene.gltf.document import document_json, outcome_of
from ptmtools.scene.ingestion import ingest
from ptmtools.scene.model import Scene, SourceImage
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.up_axis import USUAL_UP, Named, Reading, Up, looks, readings
from ptmtools.texture.images.opening import opened
from ptmtools.texture.model import Limits

#: The formats by the suffixes of their files.
_FORMATS = {
    ".3ds": "3D Studio",
    ".3mf": "3MF",
    ".ctm": "OpenCTM",
    ".dae": "COLLADA",
    ".glb": "glTF binary",
    ".gltf": "glTF",
    ".ifc": "IFC",
    ".ifczip": "IFC",
    ".obj": "Wavefront OBJ",
    ".off": "OFF",
    ".ply": "PLY",
    ".stl": "STL",
    ".usd": "USD",
    ".usda": "USD",
    ".usdc": "USD",
    ".usdz": "USDZ",
    ".wrl": "VRML",
    ".x3d": "X3D",
}


@dataclass(frozen=True)
class ImageFacts:
    """An image that some face uses: its format as Pillow calls it, size in texels and bytes."""

    name: str
    format: str
    width: int
    height: int
    bytes: int


@dataclass(frozen=True)
class Guess:
    """A reading of the model (`readings`): what it would be, why, how unusual that is, and whether
    it costs at most `RUNNER_UP` times as much as the best one."""

    unit: str
    up: Up
    size: str
    reasons: tuple[str, ...]
    cost: float
    rival: bool


@dataclass(frozen=True)
class Inspection:
    """What a model file holds.

    Attributes
    ----------
    format, generator: of the file, and what wrote it, "" if that is not known.
    extensions: of glTF, by name, with what becomes of each.
    objects: by name, with the triangles of all objects of that name, those with most first.
    images: that faces use, in the order of the file.
    best: the likeliest reading of its looks.
    others: the likeliest one with the other axis up, and the likeliest one with the same axis up
        and another unit; the likelier first.
    scene: all of it as it would be built.
    """

    format: str
    generator: str
    bytes: int
    extensions: dict[str, str]
    objects: dict[str, int]
    images: tuple[ImageFacts, ...]
    best: Guess
    others: tuple[Guess, ...]
    scene: Scene


def inspect(
    path: Path,
    options: IngestOptions = IngestOptions(),  # noqa: B008 - a frozen value
    progress: Progress = silent,
    *,
    workers: int = 1,
) -> Inspection:
    """Read a model and say what it is. Raises what `ingest` raises."""
    scene = ingest(path, options, progress, workers=workers)
    suffix = path.suffix.lower()
    tree = document_json(path) if suffix in (".glb", ".gltf") else {}
    version = str(tree.get("asset", {}).get("version", ""))
    count = Counter[str]()
    for index, triangles in enumerate(np.bincount(scene.triangle_object).tolist()):
        count[scene.objects[index]] += triangles
    best, *others = _guesses(scene, USUAL_UP.get(suffix))
    return Inspection(
        format=" ".join(part for part in (_FORMATS.get(suffix, suffix), version) if part),
        generator=str(tree.get("asset", {}).get("generator", "")),
        bytes=path.stat().st_size,
        extensions={name: outcome_of(name) for name in sorted(_listed(tree))},
        objects=dict(count.most_common()),
        images=tuple(_facts(image, options) for image in scene.images),
        best=best,
        others=tuple(others),
        scene=scene,
    )


def _listed(tree: dict[str, Any]) -> set[str]:
    return {
        *map(str, tree.get("extensionsUsed", [])),
        *map(str, tree.get("extensionsRequired", [])),
    }


def _facts(image: SourceImage, options: IngestOptions) -> ImageFacts:
    data = image.load()
    found = opened(io.BytesIO(data), Limits(options.limit << 20))  # it has been decoded before
    return ImageFacts(image.name, found.format or "", *found.size, len(data))


def _guesses(scene: Scene, usual: Up | None) -> list[Guess]:
    """The likeliest reading by the looks of the model, in its own unit and axes, then the likeliest
    ones of the other axis and of another unit."""
    space = scene.space
    points = scene.points / space.metres
    if space.up == "z":  # the way back from `space.turned`
        points = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
    named = Named.of(
        (scene.objects, scene.triangle_object),
        ([material.name for material in scene.materials], scene.triangle_material),
    )
    ranked = readings(looks(points, scene.triangles, named), usual=usual)
    best = ranked[0]
    axis = next(reading for reading in ranked if reading.up != best.up)
    unit = next(reading for reading in ranked[1:] if reading.up == best.up)
    others = [reading for reading in ranked if reading in (axis, unit)]
    return [_guess(best, others[0]), *(_guess(other, best) for other in others)]


def _guess(reading: Reading, other: Reading) -> Guess:
    return Guess(
        unit=reading.unit,
        up=reading.up,
        size=reading.size,
        reasons=tuple(reading.reasons(other)),
        cost=round(reading.cost, 3),
        rival=reading.rivals(other),
    )
