"""What a run over a database did."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ptmtools.pipeline.build import Visitor


@dataclass(frozen=True)
class StageReport:
    """What became of a stage.

    Attributes
    ----------
    stage: its name.
    ran: False if it was current and nothing had to be done.
    seconds: that it took, checking included. Textures are encoded beside the other stages where
        there is more than one worker, so the sum may be more than the whole.
    counts: the figures recorded in the manifest.
    notes: what it has to say, one line each.
    warnings: the gravest of that, one line for each kind.
    reasons: why it ran, one line each.
    tasks: of a stage that consists of tasks: how many there are, how many had been done before and
        stayed, and how many were taken over from an interrupted run.
    """

    stage: str
    ran: bool
    seconds: float
    counts: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    tasks: tuple[int, int, int] | None = None
    warnings: tuple[str, ...] = ()

    @property
    def further(self) -> tuple[str, ...]:
        """The notes that no warning repeats."""
        return tuple(note for note in self.notes if note not in self.warnings)


@dataclass(frozen=True)
class BuildReport:
    """What a run over a database did.

    Attributes
    ----------
    model: the model's file name.
    database: the folder.
    stages: in their order.
    seconds: of all together.
    peak_memory: bytes, the most that this process ever held; 0 where the system does not tell.
    peak_memory_of_workers: bytes, the most that any process held that this one started and that
        has ended; 0 if there was none.
    visitor: what the served files mean for a visitor, if they were written.
    """

    model: str
    database: str
    stages: tuple[StageReport, ...]
    seconds: float
    peak_memory: int
    peak_memory_of_workers: int = 0
    visitor: Visitor | None = None

    def counts(self, stage: str) -> Mapping[str, Any]:
        """The figures of a stage; empty if it was no part of this run."""
        return next((s.counts for s in self.stages if s.stage == stage), {})

    @property
    def notes(self) -> tuple[str, ...]:
        """What the stages have to say, in their order."""
        return tuple(note for stage in self.stages for note in stage.notes)


def peak_memory(*, of_workers: bool = False) -> int:
    """Most bytes that this process has held at once, or one of those that it started and that have
    ended; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:
        return 0
    who = resource.RUSAGE_CHILDREN if of_workers else resource.RUSAGE_SELF
    peak = resource.getrusage(who).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
