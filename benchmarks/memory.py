"""Measures the peak memory of a function beyond the memory of its process before the call."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from ptmtools.pipeline.report import peak_memory

T = TypeVar("T")


def with_peak(work: Callable[[], T]) -> tuple[T, int]:
    """Returns the result of ``work`` and its peak of resident bytes above those before the call.

    Where the system cannot reset the peak, the second value is the peak of the whole process.
    """
    before = _before()
    result = work()
    return result, max(peak_memory() if before is None else _status("VmHWM") - before, 0)


def _before() -> int | None:
    """Resets the peak and returns the resident bytes; None where the system cannot reset it."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
        return _status("VmRSS")
    except OSError:
        return None


def _status(name: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:"))
