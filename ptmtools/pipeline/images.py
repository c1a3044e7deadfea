"""The images of a scene in its database: a list of them, and a copy of each under its SHA-256."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ptmtools.pipeline.run import Artifacts
from ptmtools.pipeline.stages import SCENE
from ptmtools.store.layout import IMAGE_LIST, IMAGES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.scene.model import Scene, SourceImage

_IMAGE_NAME = re.compile(r"[A-Za-z0-9_-]+\.[A-Za-z0-9]+")
_SHA256 = re.compile(r"[0-9a-f]{64}")


def image_rows(data: bytes) -> list[Mapping[str, Any]]:
    """The rows of the list of images: name, sha256, files and plain, as in `SourceImage`.

    Raises ValueError, KeyError, TypeError or RecursionError if it is no such list. Names and
    digests become names of files, and are those that ingest gives.
    """
    rows: list[Mapping[str, Any]] = json.loads(data)["images"]
    for row in rows:
        if not (_IMAGE_NAME.fullmatch(row["name"]) and _SHA256.fullmatch(row["sha256"])):
            raise ValueError("an image with an impossible name or digest")
        texts = isinstance(row["files"], list) and all(isinstance(f, str) for f in row["files"])
        if not texts or not isinstance(row["plain"], bool):
            raise TypeError("an image without a list of files")
    return rows


def image_rows_of(artifacts: Artifacts) -> list[Mapping[str, Any]]:
    """The list of the scene's images; raises PTM-D004 to PTM-D006."""
    data = artifacts.db.read_output
    return artifacts.held(IMAGE_LIST, lambda: image_rows(data(SCENE.name, IMAGE_LIST)))


def image_digests(artifacts: Artifacts) -> dict[str, str]:
    """Name → SHA-256 of the scene's images, in their order; raises as `image_rows_of`."""
    return {row["name"]: row["sha256"] for row in image_rows_of(artifacts)}


def images_of(artifacts: Artifacts) -> tuple[SourceImage, ...]:
    """The scene's images, each read when it is loaded; raises as `image_rows_of`."""
    from ptmtools.scene.model import SourceImage

    def loader(digest: str) -> Callable[[], bytes]:
        return lambda: artifacts.db.read(f"{IMAGES}/{digest}", digest)

    def images() -> tuple[SourceImage, ...]:
        return tuple(
            SourceImage(
                row["name"], row["sha256"], loader(row["sha256"]), tuple(row["files"]), row["plain"]
            )
            for row in image_rows_of(artifacts)
        )

    return artifacts.held(IMAGES, images)


def load_scene(artifacts: Artifacts, arrays: Mapping[str, NDArray[np.generic]]) -> Scene:
    """See `Stage.load`."""
    from ptmtools.scene.model import Scene

    return Scene.from_arrays(arrays, images_of(artifacts))


def keep_images(artifacts: Artifacts, images: Iterable[SourceImage]) -> bytes:
    """Keeps images that were just read; returns the text of their list, see `image_rows`."""
    kept = tuple(images)
    rows = [
        {"name": i.name, "sha256": i.sha256, "files": list(i.files), "plain": i.plain} for i in kept
    ]
    artifacts.hold(IMAGES, kept)
    artifacts.hold(IMAGE_LIST, rows)
    return (json.dumps({"images": rows}, indent=1, ensure_ascii=False) + "\n").encode()


def missing_images(artifacts: Artifacts, scene: Scene) -> Iterator[tuple[str, str, str]]:
    """The images of a scene that its database has no copy of, see `Stage.check`."""
    outputs = artifacts.record(SCENE).outputs
    for image in scene.images:
        if outputs.get(f"{IMAGES}/{image.sha256}") != image.sha256:
            yield IMAGE_LIST, image.name, "is not in the database"
