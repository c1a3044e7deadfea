"""Reads USD stages in this process, and compares sources."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.scene.messages import NamedImage
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import MAX_VERTICES
from ptmtools.scene.source import ModelSource


class Read:
    """What a stage becomes, made here and not in a process of its own."""

    def __init__(self, stage: Any, folder: Path, most: int = MAX_VERTICES) -> None:
        from ptmtools.scene.usd.source import make_source

        path = folder / f"{len(os.listdir(folder))}.usda"
        stage.GetRootLayer().Export(str(path))
        findings = IngestNotes(path)
        self.source, images, self.files = make_source(path, findings, most)
        self.images, self.glow_maps = images["texture"], images["glow_map"]
        self.notes = findings.entries
        self.codes = {note.code for note in self.notes}

    @property
    def corners(self) -> np.ndarray:
        return self.source.points[self.source.triangles]

    @property
    def normals(self) -> np.ndarray:
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

    @property
    def image(self) -> NamedImage:
        (image,) = self.images.values()
        return image

    def says(self, code: str) -> str:
        return "; ".join(note.message for note in self.notes if note.code == code)

    def count(self, code: str) -> int:
        return sum(note.count for note in self.notes if note.code == code)

    def uv_at(self, x: float, y: float) -> list[float]:
        corners, uv = self.corners.reshape(-1, 3), self.source.uv.reshape(-1, 2)
        (actual,) = np.unique(uv[(corners[:, :2] == (x, y)).all(axis=1)].round(6), axis=0)
        return list(actual.tolist())


def equal(a: ModelSource, b: ModelSource) -> bool:
    """Whether two sources have the same surfaces, in the same order."""
    return (
        np.array_equal(a.points, b.points)
        and np.array_equal(a.triangles, b.triangles)
        and np.array_equal(a.uv, b.uv)
        and np.array_equal(a.triangle_material, b.triangle_material)
        and [m.name for m in a.materials] == [m.name for m in b.materials]
    )
