"""The knobs of ingest."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class IngestOptions:
    """How a model is read.

    Attributes
    ----------
    unit: m, cm, mm, in, ft or the metres in one unit; if not given, it is guessed from the size.
    up: the model's up axis, "y" or "z"; if not given, it is guessed from floor area and
        size.
    strict: missing files, unknown materials, unreadable images and dropped faces are errors.
    allow_outside: the model may name files outside its own folder.
    limit: an image of the model whose texels would take more memory than this, MiB, is refused.
    max_triangles: a model of more triangles is refused.
    """

    unit: str | float | None = None
    up: Literal["y", "z"] | None = None
    strict: bool = False
    allow_outside: bool = False
    # Limits end a build or change nothing in it, so they are no part of what a stage was told.
    limit: int = field(default=1024, compare=False)
    max_triangles: int = field(default=20_000_000, compare=False)
