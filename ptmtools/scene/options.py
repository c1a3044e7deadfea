"""The knobs of ingest."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class IngestOptions:
    """How a model is read.

    Attributes
    ----------
    unit: the model's unit: m, cm, mm, in, ft, or how many metres it is; guessed from the size if
        not given.
    up: the model's up axis, "y" or "z"; guessed from floor area and size if not given.
    strict: missing files, unknown materials, unreadable images and dropped faces end the build.
    allow_outside: read files outside the model's folder if the model refers to them.
    limit: refuse an image of the model that takes more memory than this once decoded, MiB.
    max_triangles: refuse a model of more triangles than this.
    """

    unit: str | float | None = None
    up: Literal["y", "z"] | None = None
    strict: bool = False
    allow_outside: bool = False
    # Limits end a build or change nothing in it, so they do not decide whether a stage is current.
    limit: int = field(default=1024, compare=False)
    max_triangles: int = field(default=20_000_000, compare=False)
