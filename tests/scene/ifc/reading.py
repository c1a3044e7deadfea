"""Reads IFC files, and measures what was read."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import MAX_VERTICES
from ptmtools.scene.source import ModelSource
from tests.scene.conftest import read_source

SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3")


def read(file: Path, most: int = MAX_VERTICES) -> tuple[ModelSource, IngestNotes]:
    findings = IngestNotes(file)
    return read_source(file, findings, max_triangles=most), findings


def notes(findings: IngestNotes) -> list[tuple[str, str, int]]:
    return [(note.code, note.message, note.count) for note in findings.entries]


def corners(source: ModelSource, name: str) -> Floats:
    """(T, 3, 3) of all objects of a name."""
    chosen = [i for i, called in enumerate(source.objects) if called == name]
    return source.points[source.triangles[np.isin(source.triangle_object, chosen)]]


def volume(triangles: Floats) -> float:
    """Of a solid, m³, faces seen from outside."""
    middle = triangles - triangles.reshape(-1, 3).mean(axis=0)
    return float(np.linalg.det(middle).sum() / 6)


def size(triangles: Floats) -> list[float]:
    return np.ptp(triangles.reshape(-1, 3), axis=0).round(9).tolist()
