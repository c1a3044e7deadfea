"""The stages: their order, what each reads of the others, and the version of what each makes."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from typing import Any

#: Stage → the stages of which it reads the arrays, in the order in which they run.
READS: dict[str, tuple[str, ...]] = {
    "scene": (),
    "cells": ("scene",),
    "pvs": ("cells",),
    "ach": ("scene", "cells", "pvs"),
    "textures": (),
    "emit": ("scene", "cells", "pvs", "ach"),
}
STAGES = tuple(READS)
#: Stage → a number that is raised when the stage makes other bytes of the same inputs. It is part
#: of what decides whether a stage is current, so that a new release, which may change one stage,
#: does not build everything again.
RECIPES = {"scene": 3, "cells": 2, "pvs": 2, "ach": 2, "textures": 2, "emit": 4}

#: The scene's images: a list of them, and a copy of each under its digest.
IMAGES, IMAGE_LIST = "stages/images", "stages/images.json"
SERVED = "www"

_IMAGE_NAME = re.compile(r"[A-Za-z0-9_-]+\.[A-Za-z0-9]+")
_SHA256 = re.compile(r"[0-9a-f]{64}")


def arrays_of(stage: str) -> str:
    """The file of a stage's arrays."""
    return f"stages/{stage}.npz"


def parameters(options: Any) -> dict[str, Any]:
    """The options that can change an artifact, as JSON reads them back; those that cannot are not
    compared in their class (``field(compare=False)``)."""
    if not is_dataclass(options) or isinstance(options, type):
        raise TypeError(f"{options!r} is not an options dataclass")
    plain = asdict(options)
    for field in fields(options):
        if not field.compare:
            del plain[field.name]
    result: dict[str, Any] = json.loads(json.dumps(plain))
    return result


def image_rows(data: bytes) -> list[Mapping[str, Any]]:
    """The rows of the list of images: name, sha256, files and plain, as in `SourceImage`.

    Raises ValueError, KeyError, TypeError or RecursionError if it is no such list. Names and
    digests become names of files, and are those that ingest gives.
    """
    rows: list[Mapping[str, Any]] = json.loads(data)["images"]
    for row in rows:
        if not (_IMAGE_NAME.fullmatch(row["name"]) and _SHA256.fullmatch(row["sha256"])):
            raise ValueError("an image of an impossible name or digest")
        texts = isinstance(row["files"], list) and all(isinstance(f, str) for f in row["files"])
        if not texts or not isinstance(row["plain"], bool):
            raise TypeError("an image without a list of files")
    return rows


def image_list(rows: list[dict[str, Any]]) -> bytes:
    """Inverse of `image_rows`."""
    return (json.dumps({"images": rows}, indent=1, ensure_ascii=False) + "\n").encode()
