"""What `ptm info` says of a campus."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ptmtools.campus.reading import read_campus
from ptmtools.campus.summary import kinds, summary


def describe_campus(folder: Path) -> tuple[tuple[str, ...], Mapping[str, Any]]:
    """Lines for people, and the same as JSON. Raises what `read_campus` raises."""
    campus = read_campus(folder)
    return tuple(summary(campus)), record(campus)


def record(campus: Any) -> dict[str, Any]:
    """Of a `Campus`, what `ptm campus --json` and `ptm info --json` print."""
    document = campus.to_document()
    return {
        "objects": len(campus.objects),
        "faces": [sum(o.meshes[lod].faces for o in campus.objects) for lod in range(campus.lods)],
        "textures": [asdict(kind) | {"average": kind.average} for kind in kinds(campus)],
        **{name: document[name] for name in ("unit", "origin", "lightmaps", "start", "presets")},
    }
