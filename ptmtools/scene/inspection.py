"""Describes a model file: format, objects and images."""

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
class Inspection:
    """The content of a model file.

    Attributes
    ----------
    format, generator: of the file, and the program that wrote it, "" if unknown.
    extensions: by name, with their support.
    objects: triangles by name, summed over objects of the same name, the largest first.
    images: that faces use, in the order of the file.
    scene: the result of ingest.
    """

    format: str
    generator: str
    bytes: int
    extensions: Mapping[str, str]
    objects: dict[str, int]
    images: tuple[ImageFacts, ...]
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
    return Inspection(
        format=f"{row.about} {facts.version}".strip(),
        generator=facts.generator,
        bytes=path.stat().st_size,
        extensions=facts.extensions,
        objects=dict(triangles.most_common()),
        images=tuple(_facts(image, options) for image in scene.images),
        scene=scene,
    )


def _facts(image: SourceImage, options: IngestOptions) -> ImageFacts:
    data = image.load()
    picture = open_image(io.BytesIO(data), Limits(options.limit << 20))  # ingest has decoded it
    return ImageFacts(image.name, picture.format or "", *picture.size, len(data))
