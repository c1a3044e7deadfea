"""The counts that the manifest has of the served files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ptmtools.database.validation.findings import Findings
from ptmtools.database.validation.textures import ReadTexture
from ptmtools.database.vrml import Document, Node

MANIFEST = "manifest.json"


def check_counts(
    stages: Mapping[str, Mapping[str, Any]],
    sizes: Mapping[str, int],
    textures: Mapping[str, ReadTexture],
    documents: Mapping[str, Document],
    found: Findings,
) -> None:
    """Holds the counts of the stages `textures` and `emit` against their files; not of a stage of
    which a file is not as it was written, or could not be read.

    Parameters
    ----------
    stages: records, as the manifest has them.
    sizes: bytes of the files that are as they were written.
    textures, documents: what could be read.

    All files are named relative to the database.
    """
    for stage, count in (("textures", _of_textures), ("emit", _of_emit)):
        record = stages.get(stage, {"outputs": {}, "counts": {}})
        names, counts = record["outputs"].keys(), record["counts"]
        readable = {n for n in names if n.endswith((".ptm", ".wrl"))}
        if names - sizes.keys() or readable - textures.keys() - documents.keys():
            continue
        held = {name: sizes[name] for name in names}
        for name, true in count(held, textures, documents).items():
            if name in counts and counts[name] != true:
                told = f"is {counts[name]!r}, but the files have {true}"
                found.add("PTM-D659", MANIFEST, f"stages.{stage}.counts.{name}", told)


def _of_textures(
    sizes: Mapping[str, int],
    textures: Mapping[str, ReadTexture],
    documents: Mapping[str, Document],
) -> dict[str, int]:
    headers = {name: textures[name].header for name in sizes if name in textures}
    finest = [(header.levels[-1], header.texel_bytes) for header in headers.values()]
    return {
        "textures": len(headers),
        "ptm_bytes": sum(sizes[name] for name in headers),
        "raw_bytes": sum(level.width * level.height * texel for level, texel in finest),
    }


def _of_emit(
    sizes: Mapping[str, int],
    textures: Mapping[str, ReadTexture],
    documents: Mapping[str, Document],
) -> dict[str, int]:
    nodes = [node for name in sizes if name in documents for node in documents[name].nodes]
    triangles = [len(index) // 4 for index in map(_coord_index, nodes) if index is not None]
    return {
        "files": len(sizes),
        "bytes": sum(sizes.values()),
        "shapes": len(triangles),
        "triangles": sum(triangles),
        "viewpoints": sum(node.type == "Viewpoint" for node in nodes),
    }


def _coord_index(node: Node) -> Any:
    geometry = node.fields.get("geometry") if node.type == "Shape" else None
    return geometry.fields.get("coordIndex") if isinstance(geometry, Node) else None
