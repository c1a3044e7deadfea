"""Reads IFC files, and measures what was read."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.scene.ifc import reader as ifc
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import MAX_VERTICES, Source

SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3")


def read(file: Path, most: int = MAX_VERTICES) -> tuple[Source, Findings]:
    findings = Findings(file)
    return ifc.read_ifc(file, findings, most), findings


def notes(findings: Findings) -> list[tuple[str, str, int]]:
    return [(note.code, note.message, note.count) for note in findings.notes]


def corners(source: Source, name: str) -> Floats:
    """(T, 3, 3) of all objects of a name."""
    chosen = [i for i, called in enumerate(source.objects) if called == name]
    return source.points[source.triangles[np.isin(source.triangle_object, chosen)]]


def volume(triangles: Floats) -> float:
    """Of a solid, m³, faces seen from outside."""
    middle = triangles - triangles.reshape(-1, 3).mean(axis=0)
    return float(np.linalg.det(middle).sum() / 6)


def size(triangles: Floats) -> list[float]:
    return np.ptp(triangles.reshape(-1, 3), axis=0).round(9).tolist()
