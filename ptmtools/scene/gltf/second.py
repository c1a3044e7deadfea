"""Reads a glTF a second time, with another texture of its materials in place of the colours.

The faces are cleaned as those of the scene, and are the same ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ptmtools.arrays import Ints
from ptmtools.scene.faces import keep_faces
from ptmtools.scene.gltf.document import document_json
from ptmtools.scene.gltf.material import TextureOf
from ptmtools.scene.gltf.reader import read_gltf
from ptmtools.scene.model import Note
from ptmtools.scene.notes import Findings
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.source import Source


@dataclass(frozen=True)
class SecondReading:
    """A glTF with other textures.

    Attributes
    ----------
    source: the file.
    faces: (T,) its faces that are in the scene.
    asked: for each of its materials, whether it names such a texture.
    missing: notes on missing textures, in the order of the materials.
    sought: the files that were looked for, as `Scene.files`.
    """

    source: Source
    faces: Ints
    asked: tuple[bool, ...]
    missing: tuple[Note, ...]
    sought: tuple[str, ...]


def read_again(model: Path, options: IngestOptions, texture_of: TextureOf) -> SecondReading | None:
    """A glTF with other textures; None if no material has such a texture. Raises as `read_gltf`."""
    named = (entry for entry in document_json(model).get("materials", []) if type(entry) is dict)
    if not any(map(texture_of, named)):
        return None
    asked: list[bool] = []

    def asking(entry: dict[str, Any]) -> dict[str, Any] | None:
        use = texture_of(entry)
        asked.append(use is not None)
        return use

    findings = Findings(model, options.allow_outside)
    source = read_gltf(model, findings, options.max_triangles, asking)
    missing = tuple(note for note in findings.notes if note.code in ("PTM-N204", "PTM-N205"))
    faces = keep_faces(source.points, source.triangles).source
    return SecondReading(source, faces, tuple(asked), missing, tuple(findings.folder.sought))
