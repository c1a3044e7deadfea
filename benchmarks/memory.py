"""How much memory a piece of work takes, beyond what its process held before."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from ptmtools.pipeline.report import peak_memory

T = TypeVar("T")


def with_peak(work: Callable[[], T]) -> tuple[T, int]:
    """What ``work`` returns, and the most bytes resident meanwhile less those before; where the
    system cannot forget an earlier peak, the most that the process ever held."""
    before = _before()
    found = work()
    return found, max(peak_memory() if before is None else _status("VmHWM") - before, 0)


def _before() -> int | None:
    """Bytes resident; the peak so far is forgotten. None where the system cannot."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
        return _status("VmRSS")
    except OSError:
        return None


def _status(name: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:"))
