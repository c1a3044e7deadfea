"""The report of a run over a database, and the downloads of a visitor of its served files."""

from __future__ import annotations

import sys
from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ptmtools.pipeline.records import StageReport
from ptmtools.quantities import size
from ptmtools.store.manifest import Manifest

#: Downloads of at least this many times the bytes of the model are marked as larger.
LARGER = 1.05


@dataclass(frozen=True)
class Visitor:
    """The downloads of a visitor, beside the size of the source model, from the counts that stages
    have recorded as ``model_bytes``, ``image_bytes`` and ``visit``.

    Attributes
    ----------
    model: bytes of the model's files without its images; None where they were not recorded.
    images: bytes of the files of its images, without those inside the model's; likewise.
    visit: the fields of `ptmtools.output.model.Visit`.
    """

    model: int | None
    images: int | None
    visit: Mapping[str, Any]

    @staticmethod
    def of(manifest: Manifest) -> Visitor | None:
        """None if nothing is served, or files of an earlier release."""
        counts = ChainMap(*(dict(record.counts) for record in manifest.stages.values()))
        visit = counts.get("visit")
        if not isinstance(visit, Mapping):
            return None
        return Visitor(counts.get("model_bytes"), counts.get("image_bytes"), visit)

    def lines(self) -> list[str]:
        """Lines of text; none if the manifest has invalid counts."""
        try:
            return self._lines()
        except (ArithmeticError, LookupError, TypeError, ValueError):
            return []

    def _lines(self) -> list[str]:
        visit, whole = self.visit, None
        lines = []
        if self.model is not None and self.images is not None:
            whole = self.model + self.images
            parts = f" (model files {size(self.model)}, image files {size(self.images)})"
            lines.append(
                f"source model, for comparison: {size(whole)}{parts if self.images else ''}"
            )

        def compare_size(count: int) -> str:
            larger = whole and count > LARGER * whole
            return size(count) + (", more than the source model" if larger else "")

        if visit["browser"] is not None:
            lines.append(f"a VRML browser downloads {compare_size(visit['browser'])}")
        lines.append(f"the first room is complete after {compare_size(visit['first_room'])}")
        if visit.get("simplified") is not None:
            lines.append(f"with simplified meshes it is drawn after {size(visit['simplified'])}")
        for key, when in (("mean", "on average"), ("most", "at most")):
            shares = f"{visit[f'{key}_volume']:.1%} of the volume"
            if visit[f"{key}_texels"] is not None:
                shares += f" and {visit[f'{key}_texels']:.1%} of the texels"
            lines.append(f"in memory {when}: {shares}, {compare_size(visit[f'{key}_at_hand'])}")
        if "everything" in visit:
            lines.append(
                f"in order of coverage: 90% of the average view after {size(visit['mean_90'])}, "
                f"99% after {size(visit['mean_99'])}"
            )
            if gain := _gain(visit):
                lines.append(f"what saves most: {gain}")
        return lines


#: A share of bytes that is a gain worth naming.
_GAIN = 0.4


def _gain(visit: Mapping[str, Any]) -> str:
    """Whether visible sets, their order, levels of detail or the resolution of textures saves a
    visitor most; empty if nothing does."""
    whole, at_hand = max(visit["everything"], 1), max(visit["mean_at_hand"], 1)
    by_cells, by_order = 1 - at_hand / whole, 1 - visit["mean_99"] / at_hand
    room, drawn = max(visit["first_room"], 1), visit.get("simplified")
    by_meshes = 0.0 if drawn is None else 1 - drawn / room
    if drawn is not None and by_meshes > max(_GAIN, by_cells, by_order):
        return f"levels of detail; the first room is drawn after {size(drawn)} of {size(room)}"
    if max(by_cells, by_order) < _GAIN:
        if visit["mean_texels"] is None:
            return ""
        return (
            f"resolution; visitors hold {at_hand / whole:.0%} of the model, and cells in order of "
            "coverage save little"
        )
    if by_cells >= by_order:
        return f"visible sets; visitors hold {at_hand / whole:.0%} of the model"
    return (
        f"the order of cells; 99% of the view takes {1 - by_order:.0%} of what visitors hold, "
        f"which is {at_hand / whole:.0%} of the model"
    )


@dataclass(frozen=True)
class BuildReport:
    """The report of a run over a database.

    Attributes
    ----------
    model: the model's file name.
    database: the folder.
    stages: in their order.
    seconds: wall-clock time of all stages together.
    peak_memory: largest number of bytes that this process has held; 0 where the system does not
        report it.
    peak_memory_of_workers: likewise, of a process that this one started and that has ended.
    visitor: the downloads of a visitor, if the served files were written.
    """

    model: str
    database: str
    stages: tuple[StageReport, ...]
    seconds: float
    peak_memory: int
    peak_memory_of_workers: int = 0
    visitor: Visitor | None = None

    def counts(self, stage: str) -> Mapping[str, Any]:
        """The counts of a stage; empty if it was not part of this run."""
        return next((s.counts for s in self.stages if s.stage == stage), {})

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes of all stages, in their order."""
        return tuple(note for stage in self.stages for note in stage.notes)


def peak_memory(*, of_workers: bool = False) -> int:
    """Largest number of bytes that this process, or one that it started and that has ended, has
    held; 0 where the system does not report it."""
    try:
        import resource
    except ImportError:
        return 0
    kind = resource.RUSAGE_CHILDREN if of_workers else resource.RUSAGE_SELF
    peak = resource.getrusage(kind).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
