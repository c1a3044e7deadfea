"""Describes a model file: format, objects, images, and the likely units and up axes."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ptmtools.progress import Progress, silent
from ptmtools.scene.formats import format_of
from ptmtools.scene.ingestion import ingest
from ptmtools.scene.model import Scene, SourceImage
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.orientation.up_axis import (
    Candidate,
    NamedFaces,
    Up,
    candidates,
    evidence,
)
from ptmtools.scene.source import FileFacts
from ptmtools.texture.images.opening import open_image
from ptmtools.texture.model import Limits


@dataclass(frozen=True)
class ImageFacts:
    """An image that some face uses: Pillow's name of its format, size in texels and bytes."""

    name: str
    format: str
    width: int
    height: int
    bytes: int


@dataclass(frozen=True)
class Guess:
    """A candidate for unit and up axis (`up_axis`): size, reasons, cost, and whether it costs at
    most `RUNNER_UP` times as much as the best one."""

    unit: str
    up: Up
    size: str
    reasons: tuple[str, ...]
    cost: float
    rival: bool


@dataclass(frozen=True)
class Inspection:
    """The content of a model file.

    Attributes
    ----------
    format, generator: of the file, and the program that wrote it, "" if unknown.
    extensions: by name, with their support.
    objects: triangles by name, summed over objects of the same name, the largest first.
    images: that faces use, in the order of the file.
    best: the most likely candidate for unit and up axis.
    others: the best candidate with the other axis, and the best one with another unit; the more
        likely first.
    scene: the result of ingest.
    """

    format: str
    generator: str
    bytes: int
    extensions: Mapping[str, str]
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
    """Reads a model and describes it. Raises the errors of `ingest`."""
    scene = ingest(path, options, progress, workers=workers, ask=False)
    row = format_of(path)
    facts = row.facts.load()(path) if row.facts else FileFacts()
    triangles = Counter[str]()
    for index, count in enumerate(np.bincount(scene.triangle_object).tolist()):
        triangles[scene.objects[index]] += count
    best, *others = _guesses(scene, row.usual_up)
    return Inspection(
        format=f"{row.about} {facts.version}".strip(),
        generator=facts.generator,
        bytes=path.stat().st_size,
        extensions=facts.extensions,
        objects=dict(triangles.most_common()),
        images=tuple(_facts(image, options) for image in scene.images),
        best=best,
        others=tuple(others),
        scene=scene,
    )


def _facts(image: SourceImage, options: IngestOptions) -> ImageFacts:
    data = image.load()
    picture = open_image(io.BytesIO(data), Limits(options.limit << 20))  # ingest has decoded it
    return ImageFacts(image.name, picture.format or "", *picture.size, len(data))


def _guesses(scene: Scene, usual: Up | None) -> list[Guess]:
    """The most likely candidate, in the unit and axes of the model, then the best ones with the
    other axis and with another unit."""
    space = scene.space
    points = scene.points / space.metres
    if space.up == "z":  # the inverse of `space.rotate`
        points = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
    named = NamedFaces.from_names(
        (scene.objects, scene.triangle_object),
        ([material.name for material in scene.materials], scene.triangle_material),
    )
    measured = evidence(points, scene.triangles, named)
    ranked = candidates(measured, usual=usual)
    if ranked[0].too_low:
        ranked = candidates(measured, usual=usual, numbers=True)
    best = ranked[0]
    axis = next(candidate for candidate in ranked if candidate.up != best.up)
    unit = next(candidate for candidate in ranked[1:] if candidate.up == best.up)
    others = [candidate for candidate in ranked if candidate in (axis, unit)]
    return [_guess(best, others[0]), *(_guess(rival, best) for rival in others)]


def _guess(candidate: Candidate, rival: Candidate) -> Guess:
    return Guess(
        unit=candidate.unit,
        up=candidate.up,
        size=candidate.size,
        reasons=tuple(candidate.reasons(rival)),
        cost=round(candidate.cost, 3),
        rival=candidate.rivals(rival),
    )
